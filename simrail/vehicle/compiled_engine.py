"""The fast engine: the equations of the reference engine, every step of them compiled.

Forces, contact, track and output rows are those of `simrail.vehicle.exudyn_engine`; only who integrates
differs (`simrail.vehicle.stepper`). At the same step both agree far below a millionth of m/s2, so each
is the test of the other. It needs no Exudyn.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from simrail.jit import FloatArray
from simrail.profile import SpeedProfile
from simrail.track.laid import LaidTrack
from simrail.vehicle.engine import (
    Segment,
    refuse_derailed,
    start_memo,
    start_poses,
    stretches,
    wheel_loads_n,
)
from simrail.vehicle.force_data import pack, states_of
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.stepper import BODY, march


class CompiledEngine:
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
    drive : {"guide", "wheels"}
        Whether the guide pulls the vehicle along or its wheels drive and brake it.
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
        drive: Literal["guide", "wheels"] = "guide",
    ) -> None:
        self.model = model
        self.step_s, self.rate_hz, self.settle_s = step_s, rate_hz, settle_s
        self.data = pack(model, track, profile, gravity_mps2=gravity_mps2, drive=drive)
        self.memo = start_memo(model, profile)
        self._inertia = np.array([[body.mass_kg, *body.inertia_kgm2] for body in model.bodies])
        self._spin_inertia = self.data.spins[:, 0].copy()
        self._turned = BODY * len(model.bodies)
        self._first_state = self._turned + 2 * len(self.data.spins)
        self.state = np.zeros(self._first_state + states_of(self.data))
        bodies = len(model.bodies)
        self._scratch = (
            np.zeros((3, len(self.state))), np.zeros((bodies, 18)), np.zeros((bodies, 6)), np.zeros(34)
        )  # fmt: skip
        poses = start_poses(model, track, profile, gravity_mps2=gravity_mps2)
        for body, (position, rotation) in zip(self._bodies(self.state), poses, strict=True):
            body[:3] = position
            body[3:7] = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
        # Compiled now, so that no clock of a ride counts it.
        self._march(0, np.zeros((0, len(self.state))))

    def run(self, duration_s: float, *, segment_s: float = 5.0) -> Iterator[Segment]:
        """Simulate from rest; yields the output segment by segment (also the way to see progress).

        Raises
        ------
        DerailedError
            If a wheel leaves the rail beyond its flange tip.
        """
        for time_s, rows, slopes in stretches(
            self._solve,
            lambda steps: self._bodies(steps)[:, :, 7:],
            duration_s=duration_s,
            settle_s=self.settle_s,
            step_s=self.step_s,
            rate_hz=self.rate_hz,
            segment_s=segment_s,
        ):
            bodies = self._bodies(rows)
            turn = Rotation.from_quat(bodies[:, :, 3:7].reshape(-1, 4), scalar_first=True).as_matrix()
            yield Segment(
                time_s=time_s,
                position=bodies[:, :, :3],
                velocity=bodies[:, :, 7:10],
                acceleration=slopes[:, :, :3],
                rotation=turn.reshape(*bodies.shape[:2], 3, 3),
                rate=bodies[:, :, 10:],
                angular_acceleration=slopes[:, :, 3:],
                spin_rad=rows[:, self._turned : self._turned + len(self.data.spins)],
                states=rows[:, self._first_state :],
            )

    def wheel_loads_n(self) -> FloatArray:
        """Vertical contact force (track frame) of each wheel (w,) at the last evaluation, N."""
        return wheel_loads_n(self.memo)

    def _bodies(self, states: FloatArray) -> FloatArray:
        """The bodies' part of states (..., n), as (..., b, 13)."""
        return states[..., : self._turned].reshape(*states.shape[:-1], -1, BODY)

    def _march(self, first: int, rows: FloatArray) -> int:
        return march(
            first, self.step_s, self.state, rows, self._inertia, self._spin_inertia, self.memo,
            *self._scratch, tuple(self.data),
        )  # fmt: skip

    def _solve(self, first: int, last: int) -> FloatArray:
        """Integrate from the present state; the state (steps + 1, n) at every step."""
        rows = np.empty((last - first + 1, len(self.state)))
        rows[0] = self.state
        made = self._march(first, rows[1:])
        refuse_derailed(self.memo, self.model)
        if made < last - first or not np.isfinite(self.state).all():
            begin, end = first * self.step_s, last * self.step_s
            raise RuntimeError(f"the integrator stopped between {begin:g} and {end:g} s")
        return rows
