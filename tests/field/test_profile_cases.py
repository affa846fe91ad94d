"""Profiles that exist: what a MiniProf writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.profile_files import rail_profile, wheel_profile
from simrail.vehicle.contact.profiles import rail_60e1

CASES = Path(__file__).parent / "cases" / "35-miniprof"
WHEELS = {
    "wheel.whl": None,
    "wheel_renamed.txt": None,
    "wheel_no_header.txt": 0.07,
    "wheel_three_columns.txt": None,
}


@pytest.mark.parametrize("name", WHEELS)
def test_wheels_are_read_from_the_flanges_tip_on(name: str) -> None:
    read = wheel_profile(CASES / name, tape_circle_m=WHEELS[name])
    assert read.lateral_m[[0, -1]] == pytest.approx([-0.055, 0.065], abs=1e-12)
    # The files' tread is a cone of 1:20.
    tread = (read.lateral_m > -0.03) & (read.lateral_m < 0.06)
    assert np.abs(read.depth_m + 0.05 * read.lateral_m)[tread].max() < 1e-9
    assert any(note.startswith("30 points behind the flange's tip, 15.0 mm") for note in read.notes)


def test_without_a_header_the_place_of_the_tape_circle_is_asked_for() -> None:
    with pytest.raises(InputError, match=r"flange tip at 15\.0 mm.*tape_circle_mm = 70\.0"):
        wheel_profile(CASES / "wheel_no_header.txt")


def test_what_lies_under_a_head_is_left_out_and_a_percent_comments() -> None:
    undercut, plain = (
        rail_profile(CASES / "rail_undercut.txt"),
        rail_profile(CASES / "rail_percent_comment.prr"),
    )
    assert any("1 points under the head on the gauge side" in note for note in undercut.notes)
    assert plain.notes == ()
    at = np.linspace(-0.034, 0.034, 200)
    depths = [np.interp(at, rail.lateral_m, rail.depth_m) for rail in (undercut, plain)]
    np.testing.assert_allclose(depths[0], depths[1], atol=1e-12)


def test_a_pair_of_them_meets() -> None:
    wheel, rail = wheel_profile(CASES / "wheel.whl"), rail_profile(CASES / "rail_undercut.txt")
    table = build_contact(wheel, rail, static_load_n=53e3)
    plain = build_contact(wheel, rail_60e1(), static_load_n=53e3)
    assert table.split_m == pytest.approx(plain.split_m, abs=3e-3)
