"""Which elements can be joined to a line."""

from __future__ import annotations

import pytest

from simrail.core.errors import InputError
from simrail.track.design import Curve, Element, Straight, TrackDesign, Transition


@pytest.mark.parametrize(
    ("elements", "field"),
    [
        ((), "segment"),
        ((Straight(0.0),), "segment[0].length_m"),
        ((Straight(float("nan")),), "segment[0].length_m"),
        ((Straight(10.0), Transition(10.0)), "segment[1].end_radius_m"),
        ((Transition(10.0), Straight(10.0)), "segment[0].start_radius_m"),
        ((Straight(10.0), Transition(10.0), Transition(10.0), Straight(10.0)), "segment[1].end_radius_m"),
        ((Straight(10.0), Curve(10.0, 300.0)), "segment[1]"),
        ((Curve(10.0, 300.0, 0.02), Curve(10.0, 300.0, 0.03)), "segment[1]"),
        ((Curve(10.0, 0.0),), "segment[0].radius_m"),
        ((Curve(10.0, 300.0, 80.0),), "segment[0].cant_m"),
    ],
)
def test_elements_that_cannot_be_joined(elements: tuple[Element, ...], field: str) -> None:
    with pytest.raises(InputError) as caught:
        TrackDesign("bad", 0.0, elements).check()
    assert caught.value.field == field
