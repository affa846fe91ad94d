"""The linear short-wave part of a truth, kept apart from what the engine computed, and the sum of both.

The motion of each body in heave, roll, pitch and sway, relative to the ride, with first and second
derivatives. The sum is exact: heave and sway along the axes of the track frame, roll and pitch as increments
of the Euler angles, rates and accelerations by their kinematics, so that they are the derivatives of the
pose.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from simrail.core.jit import FloatArray
from simrail.vehicle.vibration.linear_model import Bending

if TYPE_CHECKING:
    from simrail.ride.truth import BodyMotion
    from simrail.track.design import TrackFrame

COLUMNS = (
    *("heave_m", "heave_mps", "heave_mps2"),
    *("roll_rad", "roll_radps", "roll_radps2"),
    *("pitch_rad", "pitch_radps", "pitch_radps2"),
    *("sway_m", "sway_mps", "sway_mps2"),
)
"""Columns of a body's short-wave motion."""


@dataclass(frozen=True)
class ShortWaves:
    """Motion and loads by short waves, at the times of a truth.

    Attributes
    ----------
    sources : dict of str to str
        Names of what shakes, and where the figures come from.
    longest_wave_m : float
        The engine's own ride holds longer waves of the rails, this part shorter ones.
    motions : dict of str to ndarray (n, 12)
        Of each body, columns `COLUMNS`, at its centre of gravity; float32 on disk.
    bendings : dict of str to (Bending, ndarray (n, 3))
        Shape of each body that bends, and its modal coordinate (m) with two derivatives.
    loads : dict of str to ndarray (k,)
        Vertical load of each wheel beyond that of the ride, N, at the times of `Truth.contact`.
    least_share_of_load : dict of str to float
        Least load of each wheel over its static one with this part alone; below 0 the linear contact would
        pull.
    """

    sources: dict[str, str]
    longest_wave_m: float
    motions: dict[str, FloatArray]
    bendings: dict[str, tuple[Bending, FloatArray]] = field(default_factory=dict)
    loads: dict[str, FloatArray] = field(default_factory=dict)
    least_share_of_load: dict[str, float] = field(default_factory=dict)

    def warnings(self) -> list[str]:
        """What is beyond the linear contact, one line each."""
        pulled = {wheel: share for wheel, share in self.least_share_of_load.items() if share < 0.0}
        if not pulled:
            return []
        wheel = min(pulled, key=pulled.__getitem__)
        return [
            f"short waves take off {1.0 - pulled[wheel]:.2f} times the load of {wheel}: it would leave the "
            "rail, which the linear contact of the vibration does not know"
        ]

    def arrays(self, body: str) -> list[FloatArray]:
        """Where the motion of a body is kept, and that of its bending."""
        bent = [self.bendings[body][1]] if body in self.bendings else []
        return [self.motions[body], *bent]

    def of(self, body: str, ahead_m: float, rows: slice = slice(None)) -> FloatArray:
        """Motion (n, 12) of a body at some samples as it is felt ahead of its centre of gravity."""
        motion = np.array(self.motions[body][rows], dtype=np.float64)
        if body in self.bendings:
            bent, coordinate = self.bendings[body][0], self.bendings[body][1][rows]
            rise, slope = bent.shape(ahead_m)
            motion[:, 0:3] += rise * coordinate
            motion[:, 6:9] -= slope * coordinate
            # The centre of gravity is where the arm of a mount begins: its own rise comes with the pitch.
            motion[:, 0:3] -= ahead_m * slope * coordinate
        return motion


def superposed(
    body: BodyMotion, short: FloatArray, frame: TrackFrame, speed: FloatArray, speed_rate: FloatArray
) -> BodyMotion:
    """A body's motion with its short-wave part.

    Parameters
    ----------
    body : BodyMotion
        As the engine computed it; n samples.
    short : ndarray (n, 12)
        Its short-wave motion, `COLUMNS`.
    frame : TrackFrame
        Track frame at the body.
    speed, speed_rate : ndarray (n,)
        V = ds/dt of that frame and dV/dt.

    Notes
    -----
    Sway and heave are a way d = (0, y, h) in the axes of the frame, which turns at ``w = V k``, with
    ``a = V' k + V^2 dk``: it adds ``d``, ``d' + w x d`` and ``d'' + 2 w x d' + a x d + w x (w x d)``.
    """
    w = speed[:, None] * frame.k
    slope_of_w = speed_rate[:, None] * frame.k + speed[:, None] ** 2 * frame.dk
    zero = np.zeros(len(speed))
    d, d1, d2 = (np.column_stack([zero, short[:, 9 + k], short[:, k]]) for k in range(3))
    turned = np.cross(w, d)
    pulled = 2.0 * np.cross(w, d1) + np.cross(slope_of_w, d) + np.cross(w, turned)
    rotation = frame.rotation

    def in_space(vectors: FloatArray) -> FloatArray:
        rotated: FloatArray = np.einsum("nij,nj->ni", rotation, vectors)
        return rotated

    angles, rate, slope = _turned(body, short)
    return replace(
        body,
        position=body.position + in_space(d),
        velocity=body.velocity + in_space(d1 + turned),
        acceleration=body.acceleration + in_space(d2 + pulled),
        angles=angles,
        rate=rate,
        angular_acceleration=slope,
    )


def _turned(body: BodyMotion, short: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angles, rates and angular accelerations with increments of roll and pitch, by Euler kinematics.

    With roll f, pitch t, yaw y: ``p = f' - y' sin t``, ``q = t' cos f + y' cos t sin f``,
    ``r = -t' sin f + y' cos t cos f``, and their derivatives.
    """
    f, t = body.angles[:, 0], body.angles[:, 1]
    p, q, r = np.asarray(body.rate).T
    p1, q1, r1 = np.asarray(body.angular_acceleration).T
    sf, cf, st, ct = np.sin(f), np.cos(f), np.sin(t), np.cos(t)
    y1, t1 = (q * sf + r * cf) / ct, q * cf - r * sf
    f1 = p + y1 * st
    # What of q' and r' the second derivatives of the angles make.
    of_q = q1 + t1 * f1 * sf - y1 * (f1 * ct * cf - t1 * st * sf)
    of_r = r1 + t1 * f1 * cf + y1 * (f1 * ct * sf + t1 * st * cf)
    y2, t2 = (of_q * sf + of_r * cf) / ct, of_q * cf - of_r * sf
    f2 = p1 + y2 * st + y1 * t1 * ct
    f, f1, f2 = f + short[:, 3], f1 + short[:, 4], f2 + short[:, 5]
    t, t1, t2 = t + short[:, 6], t1 + short[:, 7], t2 + short[:, 8]
    sf, cf, st, ct = np.sin(f), np.cos(f), np.sin(t), np.cos(t)
    rate = [f1 - y1 * st, t1 * cf + y1 * ct * sf, -t1 * sf + y1 * ct * cf]
    slope = [
        f2 - y2 * st - y1 * t1 * ct,
        t2 * cf - t1 * f1 * sf + y2 * ct * sf + y1 * (f1 * ct * cf - t1 * st * sf),
        -t2 * sf - t1 * f1 * cf + y2 * ct * cf - y1 * (f1 * ct * sf + t1 * st * cf),
    ]
    angles = np.column_stack([f, t, body.angles[:, 2]])
    return angles, np.column_stack(rate), np.column_stack(slope)
