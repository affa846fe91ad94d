"""The way that a wheel encoder counts, as a logger reads it off: with no model of the train.

`simrail.estimators.odometry.encoder` is the filter that the estimators use.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from simrail.recording.recording import EncoderSheet


def pulse_way_m(sheet: EncoderSheet) -> float:
    """Way of one count, 2 pi r / N, in m."""
    return 2.0 * np.pi * sheet.wheel_radius_m / sheet.pulses_per_revolution


def counted_way_m(encoder: pd.DataFrame, sheet: EncoderSheet) -> pd.Series[float]:
    """Way since the first reading, m, signed: whole counts times `pulse_way_m`."""
    counts = encoder["pulse_count"] - encoder["pulse_count"].iloc[0]
    way: pd.Series[float] = (counts * pulse_way_m(sheet)).rename("way_m")
    return way
