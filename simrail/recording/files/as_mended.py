"""What a ride file sets right in a signal: a factor on its values, and the offset and drift of its clock."""

import pandas as pd

from simrail.recording.files.signal_part import SignalPart


def as_mended(frame: pd.DataFrame, part: SignalPart) -> pd.DataFrame:
    """A signal with its scale and its clock set right; the frame itself where nothing is said of them.

    Parameters
    ----------
    frame : pandas.DataFrame
        In SI, indexed by ``time_s`` if it has times; of all quantities of the part, or of some.
    part : SignalPart
        What the ride file says of it.
    """
    for quantity in part.signal.quantities:
        factor = part.scale.get(quantity.key)
        if factor is not None:
            for column in [name for name in quantity.columns if name in frame]:
                frame[column] *= factor
    if part.signal.timed and (part.time_offset_s or part.time_drift_ppm):
        time = frame.index.to_numpy()
        slow = 1e-6 * part.time_drift_ppm * (time - time[0])
        frame.index = pd.Index(time + part.time_offset_s + slow, name="time_s")
    return frame
