"""Alignments that exist: joints of real designs, as their files have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.track.file import track_by_name

CASES = Path(__file__).parent / "cases" / "30-real-alignments"


@pytest.mark.parametrize("name", ["spiral_spiral", "begins_in_transition", "cant_on_straight"])
def test_sound_geometry_is_taken(name: str) -> None:
    design = track_by_name(str(CASES / f"{name}.toml"))
    frame = design.frame(np.linspace(design.start_m, design.end_m, 501))
    assert np.isfinite(frame.position).all()


def test_spirals_of_two_lengths_meet_straight_and_level() -> None:
    design = track_by_name(str(CASES / "spiral_spiral.toml"))
    assert design.curvature(340.0) == pytest.approx(0.0, abs=1e-18)
    assert design.frame(340.0).roll_rad == pytest.approx(0.0, abs=1e-15)
    assert design.curvature(320.0) == pytest.approx(-0.25 / 1500.0)
    assert design.curvature(370.0) == pytest.approx(0.5 / 1000.0)


@pytest.mark.parametrize("name", ["kink", "tram_no_transition"])
def test_steps_need_a_stated_length(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"segment\[1\].*step_smoothing_m of the track.*e\.g\. 5\.0"):
        track_by_name(str(CASES / f"{name}.toml"))
    text = (CASES / f"{name}.toml").read_text(encoding="utf-8")
    (tmp_path / "mended.toml").write_text("step_smoothing_m = 5.0\n" + text, encoding="utf-8")
    design = track_by_name(str(tmp_path / "mended.toml"))
    bend = design.curvature(np.linspace(design.start_m, design.end_m, 20001))
    turn = sum(e.length_m * e.curvature_1pm for e in design.elements if e.word == "curve")
    assert design.frame(design.end_m).yaw_rad == pytest.approx(turn, rel=1e-9)
    assert np.abs(np.diff(bend)).max() < 1e-3
