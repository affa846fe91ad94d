"""A body that follows the track with prescribed motion relative to it: exact, and without Exudyn.

This is the oracle for sensors and estimators, and the matched model of consistency tests: every rate
and acceleration is a closed-form derivative (EQUATIONS 1.1 with the chain rule), nothing is
integrated. It has no suspension and no wheel-rail contact; use an engine of `simrail.vehicle` for a
vehicle that moves by itself.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PPoly

from simrail.core.jit import FloatArray
from simrail.core.rotation import euler_angles, rotation_matrix
from simrail.ride.truth import BodyMotion, Truth
from simrail.track.design import TrackDesign, TrackFrame
from simrail.track.laid_track import RAILS, LaidTrack
from simrail.vehicle.speed_profile import SpeedProfile

Channel = Callable[
    [FloatArray, FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]
]
"""Maps (t, s, V, dV/dt), each (n,), to value, first and second time derivative, each (n,)."""

CHANNELS = ("lateral", "vertical", "roll", "pitch", "yaw")


def along(function: Callable[[FloatArray, int], FloatArray]) -> Channel:
    """A channel that depends on the place: function(s, order) gives the order-th derivative by s."""

    def channel(
        _t: FloatArray, s: FloatArray, v: FloatArray, a: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        first, second = function(s, 1), function(s, 2)
        return function(s, 0), first * v, second * v**2 + first * a

    return channel


def rail_following(laid: LaidTrack, *, height_m: float = 0.0) -> dict[str, Channel]:
    """Channels of a body that keeps to the irregular rails: alignment, profile and cross-level.

    Parameters
    ----------
    laid : LaidTrack
        The rails.
    height_m : float
        Height of the body's point above them: it keeps over the rails' middle where that rolls, to first
        order of the roll (a cross-level of 10 mm leaves 0.1 um).
    """
    knots = laid.table_start_m + laid.table_step_m * np.arange(laid.table.shape[0] + 1)
    rails = PPoly(laid.table[:, RAILS].transpose(2, 0, 1), knots)
    half = 0.5
    base = laid.design.rail_base_m
    lean = height_m / base

    def mix(weights: tuple[float, float, float, float]) -> Channel:
        def function(s: FloatArray, order: int) -> FloatArray:
            mixed: FloatArray = rails(s, order) @ np.asarray(weights)
            return mixed

        return along(function)

    return {
        "lateral": mix((half, -lean, half, lean)),
        "vertical": mix((0.0, half, 0.0, half)),
        "roll": mix((0.0, 1.0 / base, 0.0, -1.0 / base)),
    }


def kinematic_truth(
    track: TrackDesign,
    profile: SpeedProfile,
    *,
    channels: dict[str, Channel] | None = None,
    offset_m: float = 0.0,
    height_m: float = 0.0,
    wheel_radius_m: float = 0.29,
    rate_hz: float = 1000.0,
    gravity_mps2: float = 9.81,
) -> Truth:
    """Move one body along the track.

    Parameters
    ----------
    track : TrackDesign
        The design track.
    profile : SpeedProfile
        s(t) of the body.
    channels : dict of str to Channel, optional
        Motion relative to the track frame by name (`CHANNELS`); those that are missing are zero.
        ``lateral`` and ``vertical`` in m, the angles in rad.
    offset_m, height_m : float
        Distance of the body's point ahead of the vehicle's reference point, and its height above the
        rail plane.
    wheel_radius_m : float
        Radius of its wheel ``"wheel"``, which rolls without slip along the track's centre.
    rate_hz, gravity_mps2 : float
        Output rate and gravity.

    Returns
    -------
    Truth
        With one body, ``"body"``, and one wheel, ``"wheel"``.
    """
    n = int(np.floor(profile.duration_s * rate_hz + 1e-9)) + 1
    t = np.arange(n) / rate_hz
    reference, v, a = profile.motion(t)
    s = reference + offset_m
    frame = track.frame(s)
    zero = np.zeros((3, n))
    value = {
        name: np.array(channels[name](t, s, v, a)) if channels and name in channels else zero
        for name in CHANNELS
    }
    return Truth(
        time_s=t,
        track=track,
        reference_position_m=reference,
        bodies={
            "body": _body_motion(frame, _carrier(frame, v, a), value, offset_m=offset_m, height_m=height_m)
        },
        wheel_angles={"wheel": (s - s[0]) / wheel_radius_m},
        wheel_states={},
        wheel_radius_m={"wheel": wheel_radius_m},
        gravity_mps2=gravity_mps2,
        manifest={"engine": "kinematic"},
    )


class _Carrier(NamedTuple):
    """How the track frame moves along with a body, its own components, (n, 3) each: EQUATIONS 1.1.

    Attributes
    ----------
    velocity, acceleration : ndarray
        Of its origin, m/s and m/s2.
    rate, rate_change : ndarray
        Angular rate, rad/s, and its derivative.
    """

    velocity: FloatArray
    acceleration: FloatArray
    rate: FloatArray
    rate_change: FloatArray


def _carrier(frame: TrackFrame, v: FloatArray, a: FloatArray) -> _Carrier:
    """The motion of the track frame at speeds and accelerations (n,) along the track."""
    k, dk = frame.k, frame.dk
    secant, tangent = 1.0 / np.cos(frame.pitch_rad), np.tan(frame.pitch_rad)
    acceleration = np.column_stack(
        [
            a * secant + v**2 * tangent * frame.rates[:, 1] * secant,
            v**2 * k[:, 2] * secant,
            -(v**2) * k[:, 1] * secant,
        ]
    )
    return _Carrier(
        velocity=np.column_stack([v * secant, 0.0 * v, 0.0 * v]),
        acceleration=acceleration,
        rate=v[:, None] * k,
        rate_change=a[:, None] * k + (v**2)[:, None] * dk,
    )


def _body_motion(
    frame: TrackFrame, carrier: _Carrier, value: dict[str, FloatArray], *, offset_m: float, height_m: float
) -> BodyMotion:
    """Motion of a body from that of the track frame and its own in it, ``value`` (3, n) of each channel."""
    design, flat = frame.rotation, np.zeros(len(frame.pitch_rad))
    rho, rho_rate, rho_rate2 = (
        np.column_stack([flat, value["lateral"][order], value["vertical"][order]]) for order in range(3)
    )
    rho[:, 2] += height_m
    turn = np.cross(carrier.rate, rho)
    velocity = carrier.velocity + rho_rate + turn
    acceleration = (
        carrier.acceleration
        + rho_rate2
        + 2.0 * np.cross(carrier.rate, rho_rate)
        + np.cross(carrier.rate_change, rho)
        + np.cross(carrier.rate, turn)
    )
    angles, rates, rates2 = (
        np.column_stack([value["roll"][order], value["pitch"][order], value["yaw"][order]])
        for order in range(3)
    )
    relative = rotation_matrix(angles)
    omega_r, alpha_r = _body_rates(angles, rates, rates2)
    omega_tb = np.einsum("nji,nj->ni", relative, carrier.rate)
    # d/dt of (C_rel^T omega_t), body components: the track's own rate seen from the turning body.
    alpha = np.einsum("nji,nj->ni", relative, carrier.rate_change) - np.cross(omega_r, omega_tb) + alpha_r
    return BodyMotion(
        offset_m=offset_m,
        height_m=height_m,
        position=frame.position + np.einsum("nij,nj->ni", design, rho),
        velocity=np.einsum("nij,nj->ni", design, velocity),
        acceleration=np.einsum("nij,nj->ni", design, acceleration),
        angles=euler_angles(design @ relative),
        rate=omega_tb + omega_r,
        angular_acceleration=alpha,
    )


def _body_rates(angles: FloatArray, rates: FloatArray, rates2: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Body rates and their derivative from ZYX angles and two derivatives (EQUATIONS 0), each (n, 3)."""
    sr, cr = np.sin(angles[:, 0]), np.cos(angles[:, 0])
    sp, cp = np.sin(angles[:, 1]), np.cos(angles[:, 1])
    r1, p1, y1 = rates.T
    r2, p2, y2 = rates2.T
    omega = np.column_stack([r1 - sp * y1, cr * p1 + sr * cp * y1, -sr * p1 + cr * cp * y1])
    alpha = np.column_stack(
        [
            r2 - sp * y2 - cp * p1 * y1,
            cr * p2 + sr * cp * y2 - sr * r1 * p1 + (cr * cp * r1 - sr * sp * p1) * y1,
            -sr * p2 + cr * cp * y2 - cr * r1 * p1 - (sr * cp * r1 + cr * sp * p1) * y1,
        ]
    )
    return omega, alpha
