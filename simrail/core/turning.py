"""Where a way turns back: the runs of a ride, from its places alone."""

import numpy as np

from simrail.core.jit import FloatArray

TURN_M = 1.0
"""A way back that is longer is a run of its own: a vehicle that rocks as it comes to rest does not turn."""


def turning_rows(place: FloatArray, *, step: int = 1) -> list[int]:
    """Samples where a way begins, where it turns back, and where it ends.

    Parameters
    ----------
    place : ndarray (n,)
        Position along the track, m.
    step : int
        Every so many samples are looked at.
    """
    rows, way, far = [0], 0.0, 0
    seen = np.asarray(place[::step], dtype=np.float64)
    for row, at in enumerate(seen.tolist()):
        moved = at - seen[far]
        if way == 0.0 and abs(moved) > TURN_M:
            way, far = np.sign(moved), row
        elif way * moved > 0.0:
            far = row
        elif way * moved < -TURN_M:
            rows.append(far * step)
            way, far = -way, row
    return [*rows, len(place) - 1]
