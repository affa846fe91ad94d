"""Forces between wheels and rails over a ride: what the engine told of them, as columns and as extremes."""

import numpy as np

from simrail.core.jit import FloatArray
from simrail.vehicle.engines.records import RecordArray

FLANGE_SLOPE = 1.0
"""A contact steeper than this (45 degrees) is the flange's, too: a pair that never jumps has one patch."""


def contact_columns(told: RecordArray) -> FloatArray:
    """What an engine told of one wheel's contact (n,), as columns `simrail.core.columns.CONTACT` (n, 12).

    ``told`` are records `simrail.vehicle.contact.contact.CONTACT`.
    """
    flange = (told["flag"] >= 2) | (np.tan(told["angle_rad"]) > FLANGE_SLOPE)
    return np.column_stack(
        [
            told["position_m"],
            *(told[name] for name in ("load_n", "guiding_n", "normal_n", "creep_x_n", "creep_y_n")),
            *(told[name] for name in ("creepage_x", "creepage_y", "spin_1pm", "rail_m", "angle_rad")),
            flange,
        ]
    )
