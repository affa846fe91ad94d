"""Compiled loops of the trajectory smoother's model: signals and track terms as its filter takes them.

What they mean is said in `simrail.estimators.trajectory.model`.
"""

from simrail.core.jit import FloatArray, njit, njit_borrowed
from simrail.core.sine import sine_cosine


@njit_borrowed
def less_bias(signals: tuple[FloatArray, ...], bias: FloatArray, found: FloatArray) -> None:
    """Rates and forces, six of (n,), side by side (n, 6), out; rates less their bias (n, 3)."""
    gx, gy, gz, fx, fy, fz = signals
    for k in range(found.shape[0]):
        found[k, 0], found[k, 1], found[k, 2] = gx[k] - bias[k, 0], gy[k] - bias[k, 1], gz[k] - bias[k, 2]
        found[k, 3], found[k, 4], found[k, 5] = fx[k], fy[k], fz[k]


@njit
def beyond(
    roll: FloatArray,
    pitch: FloatArray,
    pitch_rate: FloatArray,
    yaw_rate: FloatArray,
    gravity: float,
    found: FloatArray,
) -> None:
    """`simrail.estimators.trajectory.model.beyond_first_order` of angles and rates (n,), (n, 6), out."""
    for k in range(found.shape[0]):
        sr, cr = sine_cosine(roll[k])
        sp, cp = sine_cosine(pitch[k])
        found[k, 0] = (pitch[k] - sp) * yaw_rate[k]
        found[k, 1] = (cr - 1.0) * pitch_rate[k] + (sr * cp - roll[k]) * yaw_rate[k]
        found[k, 2] = (roll[k] - sr) * pitch_rate[k] + (cr * cp - 1.0) * yaw_rate[k]
        found[k, 3] = gravity * (pitch[k] - sp)
        found[k, 4] = gravity * (sr * cp - roll[k])
        found[k, 5] = gravity * (cr * cp - 1.0)


@njit
def terms(
    roll: FloatArray,
    pitch: FloatArray,
    yaw: FloatArray,
    motion: FloatArray,
    printed: bool,
    found: FloatArray,
) -> None:
    """`simrail.estimators.trajectory.kernel.TERMS` (n, 15), out, of the track's angles and motion (12, n).

    Printed, the rotation about the vertical takes the place of that about Y where the body's height enters
    (paper 001, appendix 1, g4C, g5C, g6C).
    """
    for k in range(found.shape[0]):
        found[k, 0], found[k, 1], found[k, 2] = roll[k], pitch[k], yaw[k]
        for row in range(9):
            found[k, 3 + row] = motion[row, k]
        if printed:
            found[k, 11] = motion[4, k]
        for row in range(9, 12):
            found[k, 3 + row] = 2.0 * motion[row, k]
