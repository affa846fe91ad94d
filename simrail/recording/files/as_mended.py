"""What a ride file sets right in a signal: factors of its columns, and the offset and drift of its clock."""

import pandas as pd

from simrail.core.jit import FloatArray
from simrail.recording.files.signal_part import SignalPart


def scaled(values: list[FloatArray], key: str, part: SignalPart) -> list[FloatArray]:
    """Columns of a quantity, on the device's own axes, with the factors that the ride file gives them.

    Parameters
    ----------
    values : list of ndarray (n,)
        The columns; changed in place.
    key : str
        The quantity.
    part : SignalPart
        What the ride file says of it.
    """
    factors = part.scale.get(key)
    if factors is not None:
        each = factors if isinstance(factors, tuple) else (factors,) * len(values)
        for column, factor in zip(values, each, strict=True):
            column *= factor
    return values


def as_mended(frame: pd.DataFrame, part: SignalPart) -> pd.DataFrame:
    """A signal with its clock set right; the frame itself where nothing is said of it.

    Parameters
    ----------
    frame : pandas.DataFrame
        Indexed by ``time_s`` if it has times; of all quantities of the part, or of some.
    part : SignalPart
        What the ride file says of it.
    """
    if part.signal.timed and (part.time_offset_s or part.time_drift_ppm):
        time = frame.index.to_numpy()
        slow = 1e-6 * part.time_drift_ppm * (time - time[0])
        frame.index = pd.Index(time + part.time_offset_s + slow, name="time_s")
    return frame
