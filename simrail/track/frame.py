"""The moving track frame: its angles, their derivatives and its Darboux vector.

Values and the one piece of algebra between them; where they come from is `simrail.track.design`.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray
from simrail.core.rotation import rotation_matrix


class TrackFrame(NamedTuple):
    """The design track frame at places s; every array has the shape of s, vectors a last axis of 3.

    Attributes
    ----------
    s_m : ndarray (...)
        Arc length of the horizontal projection.
    position : ndarray (..., 3)
        Centreline in the rail plane, global, m.
    roll_rad, pitch_rad, yaw_rad : ndarray (...)
        ZYX Euler angles of the track frame; yaw is unwrapped.
    rates, second : ndarray (..., 3)
        First and second derivative of (roll, pitch, yaw) with respect to s, rad/m and rad/m^2.
    k, dk : ndarray (..., 3)
        Darboux vector (twist, vertical, horizontal) in the track frame, rad/m, and its derivative with
        respect to s: the frame that moves at V = ds/dt turns at V k.

    At a joint, derivatives that step have the value of what begins there; the impulse in `dk` where a
    linear cant ramp or a bare parabola makes `k` step is left out.
    """

    s_m: FloatArray
    position: FloatArray
    roll_rad: FloatArray
    pitch_rad: FloatArray
    yaw_rad: FloatArray
    rates: FloatArray
    second: FloatArray
    k: FloatArray
    dk: FloatArray

    @property
    def rotation(self) -> FloatArray:
        """From the axes of the frame to the global ones, (n, 3, 3) at n places."""
        return rotation_matrix(np.column_stack([self.roll_rad, self.pitch_rad, self.yaw_rad]))


def stack(*parts: FloatArray) -> FloatArray:
    """Join arrays of the same or broadcastable shape along a new last axis."""
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def darboux(
    roll: FloatArray, pitch: FloatArray, rates: FloatArray, second: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Darboux vector of a ZYX frame and its derivative, both per metre and in the frame's components.

    k1 = roll' - sin(pitch) yaw'
    k2 = cos(roll) pitch' + sin(roll) cos(pitch) yaw'
    k3 = -sin(roll) pitch' + cos(roll) cos(pitch) yaw'

    (EQUATIONS section 1.1; the tests derive both from the rotation matrix.)
    """
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    r1, p1, y1 = np.moveaxis(rates, -1, 0)
    r2, p2, y2 = np.moveaxis(second, -1, 0)
    across, across1 = cp * y1, cp * y2 - sp * p1 * y1  # cos(pitch) yaw', and its derivative
    k = stack(r1 - sp * y1, cr * p1 + sr * across, cr * across - sr * p1)
    dk = stack(
        r2 - sp * y2 - cp * p1 * y1,
        cr * p2 + sr * across1 + r1 * k[..., 2],
        cr * across1 - sr * p2 - r1 * k[..., 1],
    )
    return k, dk
