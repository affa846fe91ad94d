"""The figure of forces over distance: the axle that runs ahead, either way."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import CONTACT
from simrail.report.figures.contact import leading_axle, wheel_forces
from simrail.track.design import Straight, TrackDesign


def example_of(direction):
    place = np.linspace(100.0, 100.0 + direction * 60.0, 500)
    contacts = {}
    for axle, ahead in (("front", 0.9), ("rear", -0.9)):
        for side, load_n in (("left", 41e3), ("right", 39e3)):
            rows = np.zeros((500, len(CONTACT)))
            rows[:, CONTACT.index("position_m")] = place + ahead
            rows[:, CONTACT.index("wheel_load_n")] = load_n + 1e3 * ahead
            rows[:, CONTACT.index("guiding_force_n")] = 2e3
            contacts[f"{axle}.{side}"] = rows
    motion = pd.DataFrame({"position_m": place})
    track = TrackDesign("line", 0.0, (Straight(200.0),))
    return SimpleNamespace(contacts=contacts, motion=motion, line=track)


@pytest.mark.parametrize(("direction", "axle"), [(1, "front"), (-1, "rear")])
def test_the_axle_that_runs_ahead_is_drawn(direction, axle):
    example = example_of(direction)
    drawn = leading_axle(example)
    assert list(drawn) == ["left", "right"]
    for side, rows in drawn.items():
        np.testing.assert_array_equal(rows, example.contacts[f"{axle}.{side}"])


def test_forces_are_in_kilonewtons_and_press_outward_on_either_side():
    drawn = {side: wheel_forces(side, rows) for side, rows in leading_axle(example_of(1)).items()}
    assert drawn["left"]["Q"][0] == pytest.approx(41.9) and drawn["left"]["Y"][0] == pytest.approx(2.0)
    # A force to the left presses the right rail outward, and not the left one.
    assert drawn["left"]["Y/Q"][0] == pytest.approx(-2.0 / 41.9)
    assert drawn["right"]["Y/Q"][0] == pytest.approx(2.0 / 39.9)
