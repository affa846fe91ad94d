"""The reference engine: rigid bodies in Exudyn, all forces from the one compiled kernel.

The bodies are ordinary Exudyn rigid bodies on `NodeRigidBodyRxyz`; wheel spins and creep states are
the coordinates of one generic node with a diagonal mass; one object without mass on all nodes calls
`simrail.vehicle.forces`. There are no joints and no constraints, so the explicit RK44 integrates it
from standstill to standstill. This is the only file that imports exudyn.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    NodeGenericODE2,
    NodeRigidBodyRxyz,
    ObjectGenericODE2,
    ObjectRigidBody,
    SensorNode,
)

from simrail.jit import FloatArray, njit
from simrail.profile import SpeedProfile
from simrail.track.design import TrackFrame
from simrail.track.laid import LaidTrack
from simrail.truth import rotation_matrix
from simrail.vehicle.forces import ForceData, forces, pack, rest_drop_m
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.tait_bryan import angles_of

_OUTPUTS = (
    exu.OutputVariableType.Coordinates,
    exu.OutputVariableType.Coordinates_t,
    exu.OutputVariableType.Coordinates_tt,
)


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
        Per body x, y, z and the three Tait-Bryan angles of Rx Ry Rz; then the spin angles; then the
        integrals of the creep states (whose rates are the creep states).
    """

    time_s: FloatArray
    coordinates: FloatArray
    rates: FloatArray
    accelerations: FloatArray


@njit
def generalized_forces(
    t, state, bodies, springs, wheels, spins, axles, guide, drive, grid, table, coef, const, pose, wrench, memo, work
):
    """Forces in Exudyn's coordinates.

    ``state`` (3 n,) holds coordinates, rates and, as the output, generalised forces, each n = 6 b + p +
    4 w long. A moment works on Tait-Bryan angles through the axes of A = Rx Ry Rz.
    """
    nb = bodies.shape[0]
    n = state.shape[0] // 3
    q, v, out = state[:n], state[n : 2 * n], state[2 * n :]
    for b in range(nb):
        p, j = pose[b], 6 * b
        ca, sa = np.cos(q[j + 3]), np.sin(q[j + 3])
        cb, sb = np.cos(q[j + 4]), np.sin(q[j + 4])
        cc, sc = np.cos(q[j + 5]), np.sin(q[j + 5])
        for k in range(3):
            p[k], p[3 + k] = q[j + k], v[j + k]
        p[6], p[7], p[8] = cb * cc, -cb * sc, sb
        p[9], p[10], p[11] = sa * sb * cc + ca * sc, ca * cc - sa * sb * sc, -sa * cb
        p[12], p[13], p[14] = sa * sc - ca * sb * cc, ca * sb * sc + sa * cc, ca * cb
        p[15] = v[j + 3] + sb * v[j + 5]
        p[16] = ca * v[j + 4] - sa * cb * v[j + 5]
        p[17] = sa * v[j + 4] + ca * cb * v[j + 5]
    first = 6 * nb
    creep = first + spins.shape[0]
    forces(
        t, pose, v[first:creep], v[creep:], bodies, springs, wheels, spins, axles, guide, drive, grid, table,
        coef, const, wrench, out[first:creep], out[creep:], memo, work,
    )  # fmt: skip
    for b in range(nb):
        w, j = wrench[b], 6 * b
        ca, sa = np.cos(q[j + 3]), np.sin(q[j + 3])
        cb, sb = np.cos(q[j + 4]), np.sin(q[j + 4])
        out[j], out[j + 1], out[j + 2] = w[0], w[1], w[2]
        out[j + 3] = w[3]
        out[j + 4] = ca * w[4] + sa * w[5]
        out[j + 5] = sb * w[3] - sa * cb * w[4] + ca * cb * w[5]


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
        self.data: ForceData = pack(model, track, profile, gravity_mps2=gravity_mps2)
        self.size = 6 * len(model.bodies) + len(self.data.spins) + 4 * len(model.wheels)
        self.memo = np.zeros(1 + 5 * len(self.data.axles))
        self._build()

    def run(self, duration_s: float, *, segment_s: float = 10.0) -> Iterator[Segment]:
        """Simulate from rest; yields the output segment by segment (also the way to see progress).

        Raises
        ------
        DerailedError
            If a wheel leaves the rail beyond its flange tip.
        """
        self._solve(-self.settle_s, 0.0)
        total = round(duration_s * self.rate_hz)
        per_segment = max(1, round(segment_s * self.rate_hz))
        done = 0
        while done < total:
            rows = min(per_segment, total - done)
            segment = self._solve(done / self.rate_hz, (done + rows) / self.rate_hz)
            # The row at the start belongs to the last segment; at 0 it is the settled state, at rest.
            yield segment if done == 0 else Segment(*(column[1:] for column in vars(segment).values()))
            done += rows
            derailed = np.flatnonzero(self.memo[2::5])
            if derailed.size:
                place = self.memo[3 + 5 * derailed[0]]
                axle = self.model.axle_names[int(derailed[0])]
                raise DerailedError(f"derailed: axle {axle} left the rail at s = {place:.1f} m")

    def wheel_loads_n(self) -> FloatArray:
        """Normal contact force of each wheel (w,) at the last evaluation, N."""
        loads = [self.memo[4 + 5 * a : 6 + 5 * a] for a in range(len(self.data.axles))]
        return np.concatenate(loads)

    def _build(self) -> None:
        model = self.model
        s0 = float(self.profile.start_m)
        self._container = exu.SystemContainer()
        self.mbs = self._container.AddSystem()
        self._nodes = []
        drop = rest_drop_m(model, gravity_mps2=self.gravity_mps2)
        for body in model.bodies:
            frame = self.track.design.frame(np.array([s0 + body.position_m[0]]))
            position, angles = _standing(frame, [0.0, body.position_m[1], body.position_m[2] + drop])
            node = self.mbs.AddNode(
                NodeRigidBodyRxyz(initialCoordinates=[*position, *angles], initialVelocities=[0.0] * 6)
            )
            self.mbs.AddObject(
                ObjectRigidBody(
                    mass=body.mass_kg, inertia=[*body.inertia_kgm2, 0.0, 0.0, 0.0], nodeNumber=node
                )
            )
            self._nodes.append(node)
        for i, axle in enumerate(model.axle_names):
            self.memo[1 + 5 * i] = s0 + model.body(axle).position_m[0]
        aux = len(self.data.spins) + 4 * len(model.wheels)
        lumped = self.mbs.AddNode(
            NodeGenericODE2(
                referenceCoordinates=[0.0] * aux,
                initialCoordinates=[0.0] * aux,
                initialCoordinates_t=[0.0] * aux,
                numberOfODE2Coordinates=aux,
            )
        )
        mass = np.concatenate([self.data.spins, np.ones(4 * len(model.wheels))])
        self.mbs.AddObject(ObjectGenericODE2(nodeNumbers=[lumped], massMatrix=np.diag(mass)))
        self._nodes.append(lumped)
        self.mbs.AddObject(
            ObjectGenericODE2(nodeNumbers=self._nodes, forceUserFunction=self._callback())
        )
        period = 1.0 / self.rate_hz
        self._sensors = [
            [
                self.mbs.AddSensor(
                    SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=output)
                )
                for node in self._nodes
            ]
            for output in _OUTPUTS
        ]
        self.mbs.Assemble()
        self._settings = exu.SimulationSettings()
        integration = self._settings.timeIntegration
        integration.automaticStepSize = False
        integration.verboseMode = 0
        # Without this the accelerations in the output belong to the last stage, not to the state.
        integration.explicit.computeEndOfStepAccelerations = True
        self._settings.linearSolverType = exu.LinearSolverType.EXUdense
        self._settings.solution.file.write = False
        self._settings.solution.sensors.writePeriod = period

    def _callback(self) -> Callable[..., list[float]]:
        """The force user function: everything bound in a closure, lists packed by struct.

        Exudyn hands over Python lists; packing them by struct and calling a compiled function with
        ready arrays is the cheapest plain-Python way found (2 us a call instead of 5).
        """
        n = self.size
        state = np.zeros(3 * n)
        view = memoryview(state).cast("B")
        put = struct.Struct(f"{2 * n}d").pack_into
        out = state[2 * n :]
        get = out.tolist
        pose = np.zeros((len(self.model.bodies), 18))
        wrench = np.zeros((len(self.model.bodies), 6))
        work = np.zeros(42)
        memo, data = self.memo, tuple(self.data)

        def user_function(mbs: Any, t: float, item: int, q: list[float], v: list[float]) -> list[float]:
            put(view, 0, *q, *v)
            generalized_forces(t, state, *data, pose, wrench, memo, work)
            forces_now: list[float] = get()
            return forces_now

        return user_function

    def _solve(self, start_s: float, end_s: float) -> Segment:
        integration = self._settings.timeIntegration
        integration.startTime, integration.endTime = start_s, end_s
        integration.numberOfSteps = round((end_s - start_s) / self.step_s)
        solved = self.mbs.SolveDynamic(
            self._settings, solverType=exu.DynamicSolverType.RK44, updateInitialValues=True, showHints=False
        )
        if not solved:
            raise RuntimeError(f"the integrator stopped between {start_s:g} and {end_s:g} s")
        stored = [[self.mbs.GetSensorStoredData(sensor) for sensor in group] for group in self._sensors]
        times = stored[0][0][:, 0]
        columns = [np.hstack([data[:, 1:] for data in group]) for group in stored]
        return Segment(times, *columns)


def _standing(frame: TrackFrame, place: list[float]) -> tuple[FloatArray, FloatArray]:
    """Global position and Rx Ry Rz angles of a body that stands at a place in one track frame."""
    rotation = rotation_matrix(np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad]))
    return frame.position[0] + rotation[0] @ np.array(place), angles_of(rotation)[0]
