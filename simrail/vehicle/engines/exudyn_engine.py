"""The reference engine: rigid bodies in Exudyn, all forces from the one compiled kernel.

The bodies are ordinary Exudyn rigid bodies; wheel spins and creep states are the coordinates of one
generic node with a diagonal mass; one object without mass on all nodes calls the force kernel
(`simrail.vehicle.engines.exudyn_forces`). There are no joints and no constraints, so the explicit RK44
integrates it from standstill to standstill. This is the only file that imports exudyn.

Two choices make it fast and exact. The nodes are `NodeRigidBodyRotVecLG`: their rates are body rates, so
the mass matrix is constant and factorised once (a third of the time per step of Rxyz nodes, whose
matrix is factorised at every evaluation). And the nodes' axes are the body's axes turned by half a turn
about X: for any heading the rotation vector then has a length near pi, where Exudyn's composition of
rotation vectors is exact to rounding; near zero it loses ten digits, which a stiff contact would turn
into noise.
"""

import struct
from collections.abc import Iterator
from typing import Any

import exudyn as exu
import numba
import numpy as np
from exudyn.itemInterface import (
    NodeGenericODE2,
    NodeRigidBodyRotVecLG,
    ObjectGenericODE2,
    ObjectRigidBody,
    SensorUserFunction,
)
from scipy.spatial.transform import Rotation

from simrail.core.jit import FloatArray
from simrail.vehicle.contact.contact import CONTACT
from simrail.vehicle.engines.derailment import refuse_derailed
from simrail.vehicle.engines.engine import (
    Segment,
    Setup,
    start_memory,
    start_poses,
    stretches,
)
from simrail.vehicle.engines.exudyn_forces import HALF_TURN, Arguments, generalized_forces, tell_contacts
from simrail.vehicle.engines.force_data import states_of
from simrail.vehicle.engines.records import RecordArray

_NOTHING = [0.0]


class ExudynEngine:
    """One vehicle on one laid track, ready to run.

    Parameters
    ----------
    setup : Setup
        What runs, where and how.
    """

    def __init__(self, setup: Setup) -> None:
        self.setup, model = setup, setup.model
        data = setup.pack()
        self._states = states_of(data)
        self._spins = data.spins["inertia"]
        self.size = 6 * len(model.bodies) + len(data.spins) + self._states
        self.memory = start_memory(setup)
        self._arguments = Arguments(self.size, data, self.memory)
        # What is told of the contact is evaluated apart, so that it leaves no trace in the ride.
        self._telling = Arguments(self.size, data, start_memory(setup))
        # Compiled now, so that no clock of a ride counts it.
        compiled = generalized_forces.compile  # type: ignore[attr-defined]
        compiled((numba.float64, numba.typeof(self._arguments.places)))
        # Coordinates and rates at every step of the present stretch, and of the one before it.
        self._rows = self._earlier = np.zeros((0, 2, self.size))
        self._build()

    def run(self, duration_s: float, *, segment_s: float = 10.0) -> Iterator[Segment]:
        """Simulate from rest; yields the output segment by segment (also the way to see progress).

        Raises
        ------
        DerailedError
            If a wheel leaves its rail.
        """
        bodies, spins = len(self.setup.model.bodies), len(self._spins)
        for time_s, rows, slopes in stretches(
            self.setup,
            self._solve,
            self._halt,
            lambda steps: steps[:, 1, : 6 * bodies].reshape(-1, bodies, 6),
            duration_s=duration_s,
            segment_s=segment_s,
        ):
            places = rows[:, 0, : 6 * bodies].reshape(-1, bodies, 6)
            rates = rows[:, 1, : 6 * bodies].reshape(-1, bodies, 6)
            turn = Rotation.from_rotvec(places[:, :, 3:].reshape(-1, 3)).as_matrix()
            yield Segment(
                time_s=time_s,
                position=places[:, :, :3],
                velocity=rates[:, :, :3],
                acceleration=slopes[:, :, :3],
                rotation=turn.reshape(-1, bodies, 3, 3) * HALF_TURN,
                rate=rates[:, :, 3:] * HALF_TURN,
                angular_acceleration=slopes[:, :, 3:] * HALF_TURN,
                spin_rad=rows[:, 0, 6 * bodies : 6 * bodies + spins],
                states=rows[:, 1, 6 * bodies + spins :],
                contacts=self._contacts(time_s, rows),
            )

    def _contacts(self, time_s: FloatArray, rows: FloatArray) -> RecordArray:
        """What the force kernel tells of the contact (n, w) at output rows."""
        at = self._telling
        told = np.zeros((len(rows), len(at.contacts)), CONTACT)
        tell_contacts(time_s, np.ascontiguousarray(rows), at.state, at.contacts, at.places, told)
        return told

    def _until(self, time_s: float, first: int) -> RecordArray:
        """What the force kernel tells of the contact (n, w) at output rows until a time.

        ``first`` is the first step of the present stretch; the one before it is told, too.
        """
        step_s, every = self.setup.step_s, self.setup.every
        rows = np.concatenate([self._earlier[:-1], self._rows])
        first -= max(len(self._earlier) - 1, 0)
        steps = np.arange(-(-max(first, 0) // every) * every, int(time_s / step_s) + 1, every)
        return self._contacts(np.multiply(steps, step_s), rows[steps - first])

    def _build(self) -> None:
        model = self.setup.model
        exu.config.printToConsole = False  # its hints (lists allocated by callbacks) are no news here
        self._container = exu.SystemContainer()
        self.mbs = self._container.AddSystem()
        self._nodes = []
        poses = start_poses(self.setup)
        for body, (position, rotation) in zip(model.bodies, poses, strict=True):
            turn = Rotation.from_matrix(rotation * HALF_TURN).as_rotvec()
            node = self.mbs.AddNode(
                NodeRigidBodyRotVecLG(initialCoordinates=[*position, *turn], initialVelocities=[0.0] * 6)
            )
            inertia = [*body.inertia_kgm2, 0.0, 0.0, 0.0]
            self.mbs.AddObject(ObjectRigidBody(mass=body.mass_kg, inertia=inertia, nodeNumber=node))
            self._nodes.append(node)
        aux = len(self._spins) + self._states
        lumped = self.mbs.AddNode(
            NodeGenericODE2(
                referenceCoordinates=[0.0] * aux,
                initialCoordinates=[0.0] * aux,
                initialCoordinates_t=[0.0] * aux,
                numberOfODE2Coordinates=aux,
            )
        )
        mass = np.concatenate([self._spins, np.ones(self._states)])
        self.mbs.AddObject(ObjectGenericODE2(nodeNumbers=[lumped], massMatrix=np.diag(mass)))
        self._nodes.append(lumped)
        self.mbs.AddObject(ObjectGenericODE2(nodeNumbers=self._nodes, forceUserFunction=self._callback()))
        self.mbs.AddSensor(
            SensorUserFunction(
                sensorNumbers=[], factors=[], writeToFile=False, sensorUserFunction=self._sensor()
            )
        )
        self.mbs.Assemble()
        self._settings = exu.SimulationSettings()
        integration = self._settings.timeIntegration
        integration.automaticStepSize = False
        integration.verboseMode = 0
        integration.reuseConstantMassMatrix = True
        self._settings.linearSolver.solverType = exu.LinearSolverType.EigenDense
        self._settings.solution.file.write = False
        # At every step: half a step, lest rounding lets one slip.
        self._settings.solution.sensors.writePeriod = self.setup.step_s / 2.0

    def _callback(self) -> Any:
        """The force user function: everything bound in a closure, lists packed by struct.

        Exudyn hands over Python lists; packing them by struct and calling a compiled function with
        ready arrays is the cheapest plain-Python way found (2 us a call instead of 5).
        """
        n = self.size
        state = self._arguments.state
        view = memoryview(state.data).cast("B")
        put = struct.Struct(f"{2 * n}d").pack_into
        get = state[2 * n :].tolist
        places, settle = self._arguments.places, self.setup.settle_s

        def user_function(_mbs: Any, t: float, _item: int, q: list[float], v: list[float]) -> list[float]:
            put(view, 0, *q, *v)
            generalized_forces(t - settle, places)
            forces_now: list[float] = get()
            return forces_now

        return user_function

    def _sensor(self) -> Any:
        """Copies coordinates and rates into the rows of the present solution, step by step."""
        system, step = self.mbs.systemData, self.setup.step_s

        def user_function(_mbs: Any, t: float, *_others: Any) -> list[float]:
            row = self._rows[round((t - self._rows_start_s) / step)]
            row[0] = system.GetODE2Coordinates()
            row[1] = system.GetODE2Coordinates_t()
            return _NOTHING

        return user_function

    def _halt(self) -> None:
        """Stop all bodies and spins; what else is a rate here is a first-order state."""
        rates = np.array(self.mbs.systemData.GetODE2Coordinates_t())
        rates[: self.size - self._states] = 0.0
        for kind in (exu.ConfigurationType.Initial, exu.ConfigurationType.Current):
            self.mbs.systemData.SetODE2Coordinates_t(rates.tolist(), configuration=kind)

    def _solve(self, first: int, last: int) -> FloatArray:
        """Integrate from the present state; coordinates and rates (steps + 1, 2, n) at every step."""
        integration = self._settings.timeIntegration
        # Exudyn knows no negative times: its clock starts with the settling.
        integration.startTime = first * self.setup.step_s + self.setup.settle_s
        integration.endTime = last * self.setup.step_s + self.setup.settle_s
        integration.numberOfSteps = last - first
        self._earlier, self._rows = self._rows, np.full((last - first + 1, 2, self.size), np.nan)
        self._rows_start_s = integration.startTime
        solved = self.mbs.SolveDynamic(
            self._settings, solverType=exu.DynamicSolverType.RK44, updateInitialValues=True, showHints=False
        )
        refuse_derailed(self.memory, self.setup, lambda time_s: self._until(time_s, first))
        if not solved or np.isnan(self._rows).any():
            begin, end = first * self.setup.step_s, last * self.setup.step_s
            raise RuntimeError(f"the integrator stopped between {begin:g} and {end:g} s")
        return self._rows
