"""Where the track is and where the driver wants to be: compiled look-ups for the force kernel.

Not here: forces. The same splines, without compilation, are `simrail.track.laid_track.LaidTrack`.
"""

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed


@njit_borrowed
def track_at(table: FloatArray, grid: FloatArray, s: float, f: FloatArray) -> None:
    """Track frame and rails at s into f (26,), from the C2 splines of the laid track.

    f: position 0-2, rotation (rows) 3-11, k 12-14, stretch of the centreline 1/cos(pitch) 15,
    rails y_left, z_left, y_right, z_right 16-19, their derivatives by s 20-23, friction factors of the
    left and right rail 24-25.
    """
    at = (s - grid[0]) / grid[1]
    i = int(at)
    if i < 0:
        i = 0
    elif i >= table.shape[0]:
        i = table.shape[0] - 1
    t = s - grid[0] - i * grid[1]
    c = table[i]
    for j in range(3):
        f[j] = ((c[j, 0] * t + c[j, 1]) * t + c[j, 2]) * t + c[j, 3]
    yaw = ((c[3, 0] * t + c[3, 1]) * t + c[3, 2]) * t + c[3, 3]
    pitch = ((c[4, 0] * t + c[4, 1]) * t + c[4, 2]) * t + c[4, 3]
    roll = ((c[5, 0] * t + c[5, 1]) * t + c[5, 2]) * t + c[5, 3]
    yaw1 = (3.0 * c[3, 0] * t + 2.0 * c[3, 1]) * t + c[3, 2]
    pitch1 = (3.0 * c[4, 0] * t + 2.0 * c[4, 1]) * t + c[4, 2]
    roll1 = (3.0 * c[5, 0] * t + 2.0 * c[5, 1]) * t + c[5, 2]
    for j in range(4):
        f[16 + j] = ((c[6 + j, 0] * t + c[6 + j, 1]) * t + c[6 + j, 2]) * t + c[6 + j, 3]
        f[20 + j] = (3.0 * c[6 + j, 0] * t + 2.0 * c[6 + j, 1]) * t + c[6 + j, 2]
    for j in range(2):
        f[24 + j] = ((c[10 + j, 0] * t + c[10 + j, 1]) * t + c[10 + j, 2]) * t + c[10 + j, 3]
    cy, sy = np.cos(yaw), np.sin(yaw)
    cp, sp = np.cos(pitch), np.sin(pitch)
    cr, sr = np.cos(roll), np.sin(roll)
    f[3], f[4], f[5] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    f[6], f[7], f[8] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    f[9], f[10], f[11] = -sp, cp * sr, cp * cr
    f[12] = roll1 - sp * yaw1
    f[13] = cr * pitch1 + sr * cp * yaw1
    f[14] = -sr * pitch1 + cr * cp * yaw1
    f[15] = 1.0 / cp


@njit_borrowed
def find_on_track(
    table: FloatArray, grid: FloatArray, b: FloatArray, s: float, f: FloatArray
) -> tuple[float, float, float]:
    """Where on the track a body is: s, and its lateral and vertical place in the track frame there.

    ``b`` is the pose of the body, ``s`` where to begin; the frame at the place found is left in ``f``.
    """
    y = z = 0.0
    for _ in range(8):
        track_at(table, grid, s, f)
        dx, dy, dz = b[0] - f[0], b[1] - f[1], b[2] - f[2]
        x = f[3] * dx + f[6] * dy + f[9] * dz
        y = f[4] * dx + f[7] * dy + f[10] * dz
        z = f[5] * dx + f[8] * dy + f[11] * dz
        stretch = f[15] - f[14] * y + f[13] * z
        step = x / stretch
        if abs(step) < 1e-12 * (1.0 + abs(s)):
            break
        s += step
    return s, y, z


@njit_borrowed
def driven(t: float, drive: FloatArray, memo: FloatArray) -> tuple[float, float]:
    """Position and speed that the profile asks for at t; memo[0] remembers the piece."""
    n = drive.shape[0]
    i = int(memo[0])
    while i > 0 and t < drive[i, 0]:
        i -= 1
    while i < n - 1 and t >= drive[i + 1, 0]:
        i += 1
    memo[0] = i
    # Before 0 the vehicle settles at rest; the first piece is a rest and its cubic is constant.
    u = t - drive[i, 0]
    if u < 0.0:
        return drive[0, 4], 0.0
    position = ((drive[i, 1] * u + drive[i, 2]) * u + drive[i, 3]) * u + drive[i, 4]
    return position, (3.0 * drive[i, 1] * u + 2.0 * drive[i, 2]) * u + drive[i, 3]
