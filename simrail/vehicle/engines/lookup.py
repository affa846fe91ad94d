"""Where the track is and where the driver wants to be: compiled look-ups for the force kernel.

Not here: forces. The same splines, without compilation, are `simrail.track.laid_track.LaidTrack`.
"""

import numpy as np

from simrail.core.jit import njit_inner
from simrail.vehicle.contact.cubic import slope, value
from simrail.vehicle.engines.records import Record, RecordArray, rotated_back

_NEWTON_STEPS = 8
"""Most steps of a search for s; from the last call's s two are enough."""
_SAME_PLACE = 1e-12
"""Of s: a step so small is rounding."""


@njit_inner
def track_at(track: RecordArray, options: Record, s: float, frame: Record) -> None:
    """Track frame and rails at s into ``frame``, from the C2 splines of the laid track."""
    i = int((s - options.grid_start_m) / options.grid_step_m)
    if i < 0:
        i = 0
    elif i >= track.shape[0]:
        i = track.shape[0] - 1
    t = s - options.grid_start_m - i * options.grid_step_m
    c = track[i]
    frame.x, frame.y, frame.z = value(c.x, t), value(c.y, t), value(c.z, t)
    frame.y_left, frame.dy_left = value(c.y_left, t), slope(c.y_left, t)
    frame.z_left, frame.dz_left = value(c.z_left, t), slope(c.z_left, t)
    frame.y_right, frame.dy_right = value(c.y_right, t), slope(c.y_right, t)
    frame.z_right, frame.dz_right = value(c.z_right, t), slope(c.z_right, t)
    frame.friction_left, frame.friction_right = value(c.friction_left, t), value(c.friction_right, t)
    # ZYX: rotation = Rz(yaw) Ry(pitch) Rx(roll).
    yaw, pitch, roll = value(c.yaw, t), value(c.pitch, t), value(c.roll, t)
    cy, sy = np.cos(yaw), np.sin(yaw)
    cp, sp = np.cos(pitch), np.sin(pitch)
    cr, sr = np.cos(roll), np.sin(roll)
    r = frame.rotation
    r[0, 0], r[0, 1], r[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    r[1, 0], r[1, 1], r[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    r[2, 0], r[2, 1], r[2, 2] = -sp, cp * sr, cp * cr
    # Curvatures: the frame's angular rate per metre, in its own axes.
    yaw1, pitch1, roll1 = slope(c.yaw, t), slope(c.pitch, t), slope(c.roll, t)
    frame.k1 = roll1 - sp * yaw1
    frame.k2 = cr * pitch1 + sr * cp * yaw1
    frame.k3 = -sr * pitch1 + cr * cp * yaw1
    frame.stretch = 1.0 / cp


@njit_inner
def place_in(frame: Record, body: Record) -> tuple[float, float, float, float]:
    """Place x, y, z of a body in the track frame, and the length there of a metre of s: -dx/ds."""
    x, y, z = rotated_back(frame.rotation, body.x - frame.x, body.y - frame.y, body.z - frame.z)
    return x, y, z, frame.stretch - frame.k3 * y + frame.k2 * z


@njit_inner
def find_on_track(
    track: RecordArray, options: Record, body: Record, s: float, frame: Record
) -> tuple[float, float, float, float]:
    """Where on the track a body is, by Newton's method from ``s`` on: s, y, z, and `place_in`'s metre.

    The frame at the place is left in ``frame``.
    """
    y = z = metre = 0.0
    for _ in range(_NEWTON_STEPS):
        track_at(track, options, s, frame)
        x, y, z, metre = place_in(frame, body)
        step = x / metre
        if abs(step) < _SAME_PLACE * (1.0 + abs(s)):
            break
        s += step
    return s, y, z, metre


@njit_inner
def driven(t: float, drive: RecordArray, memo: Record) -> tuple[float, float]:
    """Position and speed that the profile asks for at t; the memo remembers the piece."""
    i = memo.piece
    while i > 0 and t < drive[i].start_s:
        i -= 1
    while i < drive.shape[0] - 1 and t >= drive[i + 1].start_s:
        i += 1
    memo.piece = i
    # Before 0 the vehicle settles at rest; the first piece is a rest and its cubic is constant.
    u = t - drive[i].start_s
    if u < 0.0:
        return drive[0].cubic[3], 0.0
    return value(drive[i].cubic, u), slope(drive[i].cubic, u)
