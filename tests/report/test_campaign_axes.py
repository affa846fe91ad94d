"""Axes of a campaign as its report shows them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from simrail.report.campaign.axes import campaign_axes


def test_an_axis_of_one_ride_leaves_the_others_without_a_value() -> None:
    cells = pd.DataFrame(
        {
            "cell": [0, 1, 2],
            "case": [0, 1, 2],
            "ride": ["dip", "kick", "kick"],
            "ride.speed_kmh": [np.nan, 247.0, 259.0],
        }
    )
    (axis,) = [axis for axis in campaign_axes(cells) if axis.column == "ride.speed_kmh"]
    assert [axis.word_of(value) for value in cells["ride.speed_kmh"]] == ["-", "247", "259"]
