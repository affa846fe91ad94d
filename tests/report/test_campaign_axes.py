"""Axes of a campaign as its report shows them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from simrail.report.campaign.axes import campaign_axes
from simrail.report.words.sentences import axis_words


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


def test_the_speeds_of_one_ride_are_told_once() -> None:
    """Beside the speed of every ride; what crosses the speeds of that ride is an axis too."""
    cells = pd.DataFrame(
        {
            "cell": range(6),
            "case": range(6),
            "ride": ["dip", "ramp", *4 * ["kick"]],
            "speed_kmh": [16.0, 241.0, 241.0, 241.0, 259.0, 259.0],
            "ride.speed_kmh": [np.nan, np.nan, 241.0, 241.0, 259.0, 259.0],
            "ride.rest_s": [np.nan, np.nan, 2.0, 4.0, 2.0, 4.0],
        }
    )
    assert [axis.column for axis in campaign_axes(cells)] == ["speed_kmh", "ride.rest_s", "ride"]


def test_words_of_an_axis() -> None:
    """Labels of a case are texts, those of a cell are numbers."""
    assert axis_words("ride.speed_kmh", "30.0") == axis_words("ride.speed_kmh", 30.0) == "speed 30 km/h"
    assert axis_words("irregularity.spectrum", "fra_4") == "spectrum fra_4"
    for value, words in ((True, "an exact map (ablation)"), ("False", "a map with errors")):
        assert axis_words("map.exact", value) == words
