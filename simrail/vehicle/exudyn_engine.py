"""The reference engine: rigid bodies in Exudyn, all forces from the one compiled kernel.

The bodies are ordinary Exudyn rigid bodies; wheel spins and creep states are the coordinates of one
generic node with a diagonal mass; one object without mass on all nodes calls `simrail.vehicle.forces`.
There are no joints and no constraints, so the explicit RK44 integrates it from standstill to
standstill. This is the only file that imports exudyn.

Two choices make it fast and exact. The nodes are `NodeRigidBodyRotVecLG`: their rates are body rates, so
the mass matrix is constant and factorised once (a third of the time per step of Rxyz nodes, whose
matrix is factorised at every evaluation). And the nodes' axes are the body's axes turned by half a turn
about X: for any heading the rotation vector then has a length near pi, where Exudyn's composition of
rotation vectors is exact to rounding; near zero it loses ten digits, which a stiff contact would turn
into noise.

Accelerations are the sixth-order central differences of the engine's own velocities at its steps. The
accelerations of the states themselves differ from the motion by the integrator's error, which the
stiff contact makes systematic (2e-4 m/s2 in a sharp curve at 0.5 ms: 0.4 m in a minute of dead
reckoning); the velocities are three orders better, and one evaluation in five is saved.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    NodeGenericODE2,
    NodeRigidBodyRotVecLG,
    ObjectGenericODE2,
    ObjectRigidBody,
    SensorUserFunction,
)
from scipy.spatial.transform import Rotation

from simrail.jit import FloatArray, njit
from simrail.profile import SpeedProfile
from simrail.track.laid import LaidTrack
from simrail.truth import euler_angles, rotation_matrix
from simrail.vehicle.force_data import pack, rest_drop_m, spread
from simrail.vehicle.forces import forces
from simrail.vehicle.model import VehicleModel

HALF_TURN = np.array([1.0, -1.0, -1.0])
"""Diagonal of the half turn about X between the axes of a body and those of its node."""


_DIFFERENCE = (45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0)
_REACH = len(_DIFFERENCE)
_NOTHING = [0.0]


class DerailedError(RuntimeError):
    """A wheel climbed beyond its flange tip: the ride ends there."""


@dataclass(frozen=True)
class Segment:
    """Output of one stretch of the simulation; n rows at the output rate.

    Attributes
    ----------
    time_s : ndarray (n,)
        Times, uniform.
    coordinates, rates, accelerations : ndarray (n, 6 b + p + 4 w)
        Per body the position and the rotation vector of its node (rates: velocity and node rates);
        then the spin angles; then the integrals of the creep states (whose rates are the creep states).
        Accelerations are the slopes of the rates (see the module).
    """

    time_s: FloatArray
    coordinates: FloatArray
    rates: FloatArray
    accelerations: FloatArray

    def body(self, index: int) -> FloatArray:
        """Motion (n, 18) of one body: the columns of `simrail.truth_files.BODY_ARRAYS`."""
        place, turn = slice(6 * index, 6 * index + 3), slice(6 * index + 3, 6 * index + 6)
        rotation = Rotation.from_rotvec(self.coordinates[:, turn]).as_matrix() * HALF_TURN
        return np.hstack(
            [
                self.coordinates[:, place],
                self.rates[:, place],
                self.accelerations[:, place],
                euler_angles(rotation),
                self.rates[:, turn] * HALF_TURN,
                self.accelerations[:, turn] * HALF_TURN,
            ]
        )


@njit
def generalized_forces(
    t: float,
    state: FloatArray,
    bodies: FloatArray,
    springs: FloatArray,
    wheels: FloatArray,
    spins: FloatArray,
    axles: FloatArray,
    guide: FloatArray,
    drive: FloatArray,
    grid: FloatArray,
    table: FloatArray,
    coef: FloatArray,
    const: FloatArray,
    pose: FloatArray,
    wrench: FloatArray,
    memo: FloatArray,
    work: FloatArray,
) -> None:
    """Forces in Exudyn's coordinates.

    ``state`` (3 n,) holds coordinates, rates and, as the output, generalised forces, each n = 6 b + p +
    4 w long. Rates and moments of a node are in its own axes: the body's, half a turn about X.
    """
    nb = bodies.shape[0]
    n = state.shape[0] // 3
    q, v, out = state[:n], state[n : 2 * n], state[2 * n :]
    for b in range(nb):
        p, j = pose[b], 6 * b
        for k in range(3):
            p[k], p[3 + k] = q[j + k], v[j + k]
        # Rodrigues: cos I + sin/angle [r]x + (1 - cos)/angle^2 r r^T, then the half turn.
        rx, ry, rz = q[j + 3], q[j + 4], q[j + 5]
        square = rx * rx + ry * ry + rz * rz
        angle = np.sqrt(square)
        c = np.cos(angle)
        s = np.sin(angle) / angle
        d = (1.0 - c) / square
        p[6], p[7], p[8] = c + d * rx * rx, s * rz - d * rx * ry, -s * ry - d * rx * rz
        p[9], p[10], p[11] = s * rz + d * rx * ry, -c - d * ry * ry, s * rx - d * ry * rz
        p[12], p[13], p[14] = d * rx * rz - s * ry, -s * rx - d * ry * rz, -c - d * rz * rz
        wx, wy, wz = v[j + 3], -v[j + 4], -v[j + 5]
        for k in range(3):
            p[15 + k] = p[6 + 3 * k] * wx + p[7 + 3 * k] * wy + p[8 + 3 * k] * wz
    first = 6 * nb
    creep = first + spins.shape[0]
    forces(
        t, pose, v[first:creep], v[creep:], bodies, springs, wheels, spins, axles, guide, drive, grid, table,
        coef, const, wrench, out[first:creep], out[creep:], memo, work,
    )  # fmt: skip
    for b in range(nb):
        w, p, j = wrench[b], pose[b], 6 * b
        out[j], out[j + 1], out[j + 2] = w[0], w[1], w[2]
        out[j + 3] = p[6] * w[3] + p[9] * w[4] + p[12] * w[5]
        out[j + 4] = -(p[7] * w[3] + p[10] * w[4] + p[13] * w[5])
        out[j + 5] = -(p[8] * w[3] + p[11] * w[4] + p[14] * w[5])


@njit
def part_of(arena: FloatArray, i: int) -> FloatArray:
    """The i-th part of an arena (see `simrail.vehicle.force_data.spread`), flat."""
    at = int(arena[5 * i])
    n = int(arena[5 * i + 1] * arena[5 * i + 2] * arena[5 * i + 3] * arena[5 * i + 4])
    return arena[at : at + n]


@njit
def generalized_forces_of(t: float, arena: FloatArray) -> None:
    """`generalized_forces` of an arena that holds its arguments after t, in their order."""
    table = part_of(arena, 9)
    coef = part_of(arena, 10)
    generalized_forces(
        t,
        part_of(arena, 0),
        part_of(arena, 1).reshape(-1, 1),
        part_of(arena, 2).reshape(-1, 17),
        part_of(arena, 3).reshape(-1, 4),
        part_of(arena, 4),
        part_of(arena, 5).reshape(-1, 2),
        part_of(arena, 6),
        part_of(arena, 7).reshape(-1, 5),
        part_of(arena, 8),
        table.reshape(-1, 10, 4),
        coef.reshape(2, int(arena[52]), int(arena[53]), 4),
        part_of(arena, 11),
        part_of(arena, 12).reshape(-1, 18),
        part_of(arena, 13).reshape(-1, 6),
        part_of(arena, 14),
        part_of(arena, 15),
    )


class ExudynEngine:
    """One vehicle on one laid track, ready to run.

    Parameters
    ----------
    model : VehicleModel
        The vehicle.
    track : LaidTrack
        The track.
    profile : SpeedProfile
        How it is driven.
    step_s : float
        Step of the integrator.
    rate_hz : float
        Output rate; its period must be a multiple of the step.
    gravity_mps2 : float
        Gravity.
    settle_s : float
        Time at rest before the ride, in which the springs come to rest; not part of the output.
    """

    def __init__(
        self,
        model: VehicleModel,
        track: LaidTrack,
        *,
        profile: SpeedProfile,
        step_s: float = 0.5e-3,
        rate_hz: float = 1000.0,
        gravity_mps2: float = 9.81,
        settle_s: float = 4.0,
    ) -> None:
        self.model, self.track, self.profile = model, track, profile
        self.step_s, self.rate_hz, self.settle_s = step_s, rate_hz, settle_s
        self.gravity_mps2 = gravity_mps2
        data = pack(model, track, profile, gravity_mps2=gravity_mps2)
        bodies, axles = len(model.bodies), len(data.axles)
        self.size = 6 * bodies + len(data.spins) + 4 * len(model.wheels)
        scratch = (np.zeros((bodies, 18)), np.zeros((bodies, 6)), np.zeros(1 + 5 * axles), np.zeros(42))
        self._arena, views = spread([np.zeros(3 * self.size), *data, *scratch])
        self._state, self.memo, self._spins = views[0], views[-2], data.spins
        # Compiled now, so that no clock of a ride counts it.
        generalized_forces_of.compile("void(float64, float64[::1])")  # type: ignore[attr-defined]
        self._build()

    def run(self, duration_s: float, *, segment_s: float = 10.0) -> Iterator[Segment]:
        """Simulate from rest; yields the output segment by segment (also the way to see progress).

        Raises
        ------
        DerailedError
            If a wheel leaves the rail beyond its flange tip.
        """
        every = round(1.0 / (self.rate_hz * self.step_s))
        total = round(duration_s / self.step_s)
        per_segment = max(every, round(segment_s / self.step_s) // every * every)
        # Steps at hand, from `first` on (step 0 is the start of the ride); differences reach 3 steps, so
        # rows lag behind the solution, and a few steps are solved beyond the end.
        steps = self._solve(-self.settle_s, 0.0)[-7:]
        first = 1 - len(steps)
        done = 0
        while done <= total:
            solved = first + len(steps) - 1
            until = min(solved + per_segment, total + every * _REACH)
            steps = np.concatenate([steps, self._solve(solved * self.step_s, until * self.step_s)[1:]])
            rows = np.arange(done, min(until - _REACH, total) + 1, every)
            here = rows - first
            rates = steps[:, 1]
            slope = np.zeros_like(rates[here])
            for k, weight in enumerate(_DIFFERENCE, start=1):
                slope += weight / self.step_s * (rates[here + k] - rates[here - k])
            yield Segment(np.multiply(rows, self.step_s), steps[here, 0], rates[here], slope)
            done = int(rows[-1]) + every
            keep = done - _REACH - first
            steps, first = steps[keep:], first + keep

    def wheel_loads_n(self) -> FloatArray:
        """Vertical contact force (track frame) of each wheel (w,) at the last evaluation, N."""
        loads = [self.memo[4 + 5 * a : 6 + 5 * a] for a in range(len(self.model.axle_names))]
        return np.concatenate(loads)

    def _build(self) -> None:
        model = self.model
        s0 = float(self.profile.start_m)
        exu.config.printToConsole = False  # its hints (lists allocated by callbacks) are no news here
        self._container = exu.SystemContainer()
        self.mbs = self._container.AddSystem()
        self._nodes = []
        drop = rest_drop_m(model, gravity_mps2=self.gravity_mps2)
        for body in model.bodies:
            frame = self.track.design.frame(np.array([s0 + body.position_m[0]]))
            rotation = rotation_matrix(np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad]))[0]
            position = frame.position[0] + rotation @ [0.0, body.position_m[1], body.position_m[2] + drop]
            turn = Rotation.from_matrix(rotation * HALF_TURN).as_rotvec()
            node = self.mbs.AddNode(
                NodeRigidBodyRotVecLG(initialCoordinates=[*position, *turn], initialVelocities=[0.0] * 6)
            )
            self.mbs.AddObject(
                ObjectRigidBody(
                    mass=body.mass_kg, inertia=[*body.inertia_kgm2, 0.0, 0.0, 0.0], nodeNumber=node
                )
            )
            self._nodes.append(node)
        for i, axle in enumerate(model.axle_names):
            self.memo[1 + 5 * i] = s0 + model.body(axle).position_m[0]
        aux = len(self._spins) + 4 * len(model.wheels)
        lumped = self.mbs.AddNode(
            NodeGenericODE2(
                referenceCoordinates=[0.0] * aux,
                initialCoordinates=[0.0] * aux,
                initialCoordinates_t=[0.0] * aux,
                numberOfODE2Coordinates=aux,
            )
        )
        mass = np.concatenate([self._spins, np.ones(4 * len(model.wheels))])
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
        self._settings.solution.sensors.writePeriod = self.step_s / 2.0

    def _callback(self) -> Any:
        """The force user function: everything bound in a closure, lists packed by struct.

        Exudyn hands over Python lists; packing them by struct and calling a compiled function with
        ready arrays is the cheapest plain-Python way found (2 us a call instead of 5).
        """
        n = self.size
        view = memoryview(self._state.data).cast("B")
        put = struct.Struct(f"{2 * n}d").pack_into
        get = self._state[2 * n :].tolist
        arena, settle = self._arena, self.settle_s

        def user_function(mbs: Any, t: float, item: int, q: list[float], v: list[float]) -> list[float]:
            put(view, 0, *q, *v)
            generalized_forces_of(t - settle, arena)
            forces_now: list[float] = get()
            return forces_now

        return user_function

    def _sensor(self) -> Any:
        """Copies coordinates and rates into the rows of the present solution, step by step."""
        system = self.mbs.systemData

        def user_function(mbs: Any, t: float, numbers: Any, factors: Any, configuration: Any) -> list[float]:
            row = self._rows[round((t - self._rows_start_s) / self.step_s)]
            row[0] = system.GetODE2Coordinates()
            row[1] = system.GetODE2Coordinates_t()
            return _NOTHING

        return user_function

    def _solve(self, start_s: float, end_s: float) -> FloatArray:
        """Integrate from the present state; coordinates and rates (steps + 1, 2, n) at every step."""
        integration = self._settings.timeIntegration
        # Exudyn knows no negative times: its clock starts with the settling.
        integration.startTime, integration.endTime = start_s + self.settle_s, end_s + self.settle_s
        steps = round((end_s - start_s) / self.step_s)
        integration.numberOfSteps = steps
        self._rows = np.full((steps + 1, 2, self.size), np.nan)
        self._rows_start_s = integration.startTime
        solved = self.mbs.SolveDynamic(
            self._settings, solverType=exu.DynamicSolverType.RK44, updateInitialValues=True, showHints=False
        )
        derailed = np.flatnonzero(self.memo[2::5])
        if derailed.size:
            place = self.memo[3 + 5 * derailed[0]]
            axle = self.model.axle_names[int(derailed[0])]
            raise DerailedError(f"derailed: axle {axle} left the rail at s = {place:.1f} m")
        if not solved or np.isnan(self._rows).any():
            raise RuntimeError(f"the integrator stopped between {start_s:g} and {end_s:g} s")
        return self._rows
