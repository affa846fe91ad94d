"""``simrail estimate --fuse``: rails of exported rides, in files and words; and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.columns import IRREGULARITY, IRREGULARITY_SD

TEXT = """
title = "passes"
seed = 3
track = "condequinto_olivar"
vehicle = "metro_irw_bogie"
engine = "kinematic"
truth_rate_hz = 250.0
[irregularity]
spectrum = "erri_b176_low"
wavelengths_m = [1.5, 100.0]
[[ride]]
name = "pass"
start_m = 40.0
end_m = 230.0
speed_kmh = 50.0
reverse = [false, true]
acceleration_mps2 = 2.0
jerk_mps3 = 2.0
rest_s = 2.0
final_rest_s = 1.0
[encoder]
wheel = "trailing.left"
pulses_per_revolution = 1024
rate_hz = 250.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 0.6]
[[estimator]]
name = "smoother"
method = "TrackRelativeSmoother"
"""


@pytest.fixture(scope="module")
def rides(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("passes")
    (folder / "passes.toml").write_text(TEXT)
    assert call(["export", str(folder / "passes.toml"), "--out", str(folder / "rides")]) == DONE
    return sorted(str(path.parent) for path in (folder / "rides").glob("*/ride.toml"))


@pytest.mark.long
def test_rails_of_both_ways_are_fused(
    rides: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "fused"
    assert call(["estimate", *rides, "--fuse", "--out", str(out)]) == DONE
    text = capsys.readouterr().out
    assert "2 passes over" in text and text.count("moved by") == 2 and "cross level: sd" in text
    geometry = pd.read_csv(out / "geometry.csv", comment="#")
    assert list(geometry) == ["position_m", *IRREGULARITY, *IRREGULARITY_SD]
    assert len(geometry) > 600 and geometry["cross_level_sd_m"].gt(0.0).all()
    passes = pd.read_csv(out / "passes.csv")
    assert len(passes) == 2 and passes["cross_level_weight"].sum() == pytest.approx(1.0)
    assert passes["shift_m"].abs().max() < 0.5
    # What is there is not replaced.
    assert call(["estimate", *rides, "--fuse", "--out", str(out)]) == BAD_INPUT


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ([], ["RIDE.toml", "found 2", "limit: 1", "--fuse"]),
        (["--fuse", "--estimator", "DesignAngles"], ["estimates[0].geometry", "nothing of the rails"]),
        (["--fuse", "--set", "geometry_step_m=0.0"], ["estimates[0].geometry", "geometry_step_m > 0"]),
    ],
)
def test_what_cannot_be_fused_is_refused(
    rides: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], words: list[str]
) -> None:
    assert call(["estimate", *rides, *more, "--out", str(tmp_path / "out")]) == BAD_INPUT
    message = capsys.readouterr().err
    assert all(word in message for word in words), message
    assert not (tmp_path / "out").exists()
