"""Motion of a point of a rigid body, and what an IMU there feels, compiled.

One row at a time, so that a row is the same bits in whatever company it is worked out.
"""

import numpy as np

from simrail.core.jit import FloatArray, njit

TURN = 2.0 * np.pi


@njit
def carry(
    body: FloatArray,
    lever: FloatArray,
    tilt: FloatArray,
    tilt_yaw: float,
    gravity: float,
    motion: FloatArray,
    acceleration: FloatArray,
    rotation: FloatArray,
) -> None:
    """Carry the motion of a body's centre of gravity to a point of it (EQUATIONS 0 and 1.1).

        p = c + C l;   v = c' + C (w x l);   a = c'' + C (alpha x l + w x (w x l))
        gyro = T^T w;   accel = T^T C^T (a + g e_z)

    with C = Rz(yaw) Ry(pitch) Rx(roll) of the body and T the turn of the sensor in it.

    Parameters
    ----------
    body : ndarray (n, 18)
        Position, velocity and acceleration of the centre of gravity (global, m), roll, pitch and yaw (rad),
        angular rate and its derivative (body).
    lever : ndarray (3,)
        From the centre of gravity to the point, body, m.
    tilt : ndarray (3, 3)
        T, from the sensor's axes to the body's.
    tilt_yaw : float
        Yaw of T: the sensor's yaw is that within half a turn of the body's and this.
    gravity : float
        m/s2.
    motion : ndarray (n, m), m >= 15
        Written: position, velocity (global), roll, pitch and yaw of the sensor, gyro, accel.
    acceleration : ndarray (n, 3)
        Written: of the point, global, m/s2.
    rotation : ndarray (n, 3, 3)
        Written: C T.
    """
    x, y, z = lever[0], lever[1], lever[2]
    turned = False
    for i in range(3):
        for j in range(3):
            turned = turned or tilt[i, j] != (1.0 if i == j else 0.0)
    c, felt, gyro = np.empty((3, 3)), np.empty(3), np.empty(3)
    for k in range(body.shape[0]):
        roll, pitch, yaw = body[k, 9], body[k, 10], body[k, 11]
        sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
        sy, cy = np.sin(yaw), np.cos(yaw)
        c[0, 0], c[0, 1], c[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
        c[1, 0], c[1, 1], c[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
        c[2, 0], c[2, 1], c[2, 2] = -sp, cp * sr, cp * cr
        wx, wy, wz = body[k, 12], body[k, 13], body[k, 14]
        ax, ay, az = body[k, 15], body[k, 16], body[k, 17]
        # w x l, and alpha x l + w x (w x l).
        vx, vy, vz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
        bx = ay * z - az * y + wy * vz - wz * vy
        by = az * x - ax * z + wz * vx - wx * vz
        bz = ax * y - ay * x + wx * vy - wy * vx
        for i in range(3):
            motion[k, i] = body[k, i] + c[i, 0] * x + c[i, 1] * y + c[i, 2] * z
            motion[k, 3 + i] = body[k, 3 + i] + c[i, 0] * vx + c[i, 1] * vy + c[i, 2] * vz
            acceleration[k, i] = body[k, 6 + i] + c[i, 0] * bx + c[i, 1] * by + c[i, 2] * bz
        up = acceleration[k, 2] + gravity
        for i in range(3):
            gyro[i] = body[k, 12 + i]
            felt[i] = c[0, i] * acceleration[k, 0] + c[1, i] * acceleration[k, 1] + c[2, i] * up
        if not turned:
            for i in range(3):
                motion[k, 6 + i], motion[k, 9 + i], motion[k, 12 + i] = body[k, 9 + i], gyro[i], felt[i]
                for j in range(3):
                    rotation[k, i, j] = c[i, j]
            continue
        for i in range(3):
            motion[k, 9 + i] = tilt[0, i] * gyro[0] + tilt[1, i] * gyro[1] + tilt[2, i] * gyro[2]
            motion[k, 12 + i] = tilt[0, i] * felt[0] + tilt[1, i] * felt[1] + tilt[2, i] * felt[2]
            for j in range(3):
                rotation[k, i, j] = c[i, 0] * tilt[0, j] + c[i, 1] * tilt[1, j] + c[i, 2] * tilt[2, j]
        motion[k, 6] = np.arctan2(rotation[k, 2, 1], rotation[k, 2, 2])
        motion[k, 7] = -np.arcsin(min(max(rotation[k, 2, 0], -1.0), 1.0))
        heading = np.arctan2(rotation[k, 1, 0], rotation[k, 0, 0])
        motion[k, 8] = heading + TURN * np.rint((yaw + tilt_yaw - heading) / TURN)
