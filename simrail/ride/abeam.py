"""Where points are along a design track: the frame abeam of each, its speed, and the place in it."""

import numpy as np

from simrail.core.jit import FloatArray
from simrail.track.design import TrackDesign, TrackFrame

_ENOUGH_M = 2e-11
"""Near to what rounding of a place at 15 km leaves; a derivative of 4 kHz samples still sees 1e-10 m."""


def abeam(
    track: TrackDesign, guess: FloatArray, position: FloatArray
) -> tuple[TrackFrame, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Track frame abeam of points: the one whose plane normal to its X axis holds the point.

    Parameters
    ----------
    track : TrackDesign
        The design.
    guess : ndarray (n,)
        Places s to begin from, within some metres.
    position : ndarray (n, 3)
        The points, global.

    Returns
    -------
    frame : TrackFrame
    rotation : ndarray (n, 3, 3)
        Of the frame.
    rho : ndarray (n, 3)
        The points in it; rho_x = 0, found by Newton's method.
    stretch : ndarray (n,)
        d(rho_x)/ds with the sign turned.
    s : ndarray (n,)
        The places.
    """
    s = np.clip(guess, track.start_m, track.end_m)
    frame, rotation, rho, stretch, step = _seen_from(track, s, position)
    for _ in range(3):
        # Each point goes on until it is found, whatever the others do: its bits are its own.
        (far,) = np.nonzero(np.abs(step) >= _ENOUGH_M)
        if not len(far):
            break
        s[far] = np.clip(s[far] + step[far], track.start_m, track.end_m)
        found, *others = _seen_from(track, s[far], position[far])
        for whole, part in zip((*frame, rotation, rho, stretch, step), (*found, *others), strict=True):
            whole[far] = part
    return frame, rotation, rho, stretch, s + step


def _seen_from(
    track: TrackDesign, s: FloatArray, position: FloatArray
) -> tuple[TrackFrame, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Frames at s (n,), their rotations, the points in them, stretches, and how far ahead each point is."""
    frame = track.frame(s)
    rotation = frame.rotation
    rho = np.einsum("nji,nj->ni", rotation, position - frame.position)
    stretch = 1.0 / np.cos(frame.pitch_rad) - frame.k[:, 2] * rho[:, 1] + frame.k[:, 1] * rho[:, 2]
    return frame, rotation, rho, stretch, rho[:, 0] / stretch


def along_track(
    track: TrackDesign,
    guess: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Track frame abeam of points: rotation (n, 3, 3), s, ds/dt, d2s/dt2, and the place (n, 2) in it.

    The rates follow by differentiating the condition of `abeam` (EQUATIONS 1.1).
    """
    frame, rotation, rho, stretch, _ = abeam(track, guess, position)
    v = np.einsum("nji,nj->ni", rotation, velocity)
    a = np.einsum("nji,nj->ni", rotation, acceleration)
    k, dk = frame.k, frame.dk
    y, z = rho[:, 1], rho[:, 2]
    speed = v[:, 0] / stretch
    y_rate = v[:, 1] + speed * k[:, 0] * z
    z_rate = v[:, 2] - speed * k[:, 0] * y
    secant = 1.0 / np.cos(frame.pitch_rad)
    stretch_rate = (
        speed * (np.tan(frame.pitch_rad) * secant * frame.rates[:, 1] - dk[:, 2] * y + dk[:, 1] * z)
        - k[:, 2] * y_rate
        + k[:, 1] * z_rate
    )
    turning = speed * (k[:, 2] * v[:, 1] - k[:, 1] * v[:, 2])
    speed_rate = (a[:, 0] + turning - speed * stretch_rate) / stretch
    return rotation, frame.s_m, speed, speed_rate, rho[:, 1:]
