"""The vertical accelerometer, for methods that live on it: there or not."""

import numpy as np

from simrail.core.columns import ACCEL
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording


def vertical_force(recording: Recording, *, tells: str) -> FloatArray:
    """Specific force along Z, m/s2 (n,).

    Parameters
    ----------
    recording : Recording
    tells : str
        What the method reads off it, for the message.

    Raises
    ------
    InputError
        If there is none.
    """
    column = ACCEL[2]
    vertical = recording.imu.get(column)
    if vertical is None or not np.isfinite(vertical).all() or not np.any(vertical):
        raise InputError(
            f"the recording has no vertical signal, which tells {tells}",
            field=column,
            value="none" if vertical is None else "NaN" if vertical.isna().any() else 0.0,
            limit="the specific force along Z, at rest +g",
            remedy="name the column of the vertical accelerometer",
        )
    force: FloatArray = vertical.to_numpy(dtype=np.float64)
    return force
