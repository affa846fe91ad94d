"""``simrail spectra``: what it prints and writes, and how it refuses."""

from pathlib import Path

import pandas as pd
import pytest

from simrail.campaign.spectra import scenario_spectra
from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.ride.truth import Mount
from simrail.scenario.cells import Cell
from simrail.scenario.scenario import load_scenario
from simrail.scoring.vibration_levels import COLUMNS

SHAKING = """
title = "A coach that shakes"
seed = 1
track = "level_straight"
vehicle = "manchester_1"
engine = "kinematic"
truth_rate_hz = 500.0

[irregularity]
spectrum = "erri_b176_low"
wavelengths_m = [1.5, 100.0]
fade_m = 40.0

[vibration]

[[ride]]
name = "straight"
start_m = 60.0
end_m = 140.0
speed_kmh = 18.0
rest_s = 6.0

[[imu]]
name = "box"
grade = "ideal"
body = "axle_f1"
position_m = [0.0, 1.0, 0.46]

[[imu]]
name = "seat"
grade = "ideal"
body = "body"
position_m = [9.5, 0.0, 1.1]

[encoder]
wheel = "axle_f1.left"

[[estimator]]
name = "design_angles"
method = "DesignAngles"
"""

MINE = """
title = "Mine"
source = "made up"
kind = "operating"
vehicle = "a coach"
mount = "axle"
speed_mps = 5.0
octaves_hz = [31.5]
rms_mps2 = [1.0]
"""


@pytest.fixture
def scenario(here: Path) -> str:
    (here / "mine.toml").write_text(MINE, encoding="utf-8")
    (here / "shaking.toml").write_text(SHAKING, encoding="utf-8")
    return "./shaking.toml"


@pytest.mark.usefixtures("own_cache")
def test_compares_every_mount_with_the_spectra_that_are_named(
    scenario: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["spectra", scenario, "--against", "./mine.toml", "--out", "levels.csv"]) == DONE
    said = capsys.readouterr().out
    assert "frames: unverified: no operating spectrum" in said
    assert "wrote levels.csv" in said
    table = pd.read_csv("levels.csv")
    assert tuple(table.columns) == COLUMNS
    assert set(zip(table["mount"], table["kind"], strict=True)) == {("box", "axle"), ("seat", "floor")}
    assert set(table["speed_mps"].round(1)) == {0.0, 5.0}
    (beside,) = table[table["spectrum"] == "mine"].to_dict("records")
    assert (beside["mount"], beside["octave_hz"]) == ("box", 31.5)
    assert beside["ratio"] == pytest.approx(beside["simulated_mps2"], rel=1e-5)
    running = table[table["speed_mps"] > 0.0].groupby("mount")["simulated_mps2"].max()
    assert running["box"] > 10.0 * running["seat"] > 0.0


def test_of_every_ride_the_first_draw_counts(scenario: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three tracks, two devices on each and two draws of their sensors: one ride is simulated, for both."""
    simulated: list[tuple[int, int]] = []

    def note(cell: Cell, _parts: object, _watcher: object, count: int, total: int) -> Cell:
        simulated.append((count, total))
        return cell

    def levels(cell: Cell, mount: Mount) -> dict[float, tuple[int, int, str]]:
        return {float(cell.ride_index): (cell.sample, cell.track_draw, mount.name)}

    monkeypatch.setattr("simrail.campaign.spectra.simulated", note)
    monkeypatch.setattr("simrail.campaign.spectra.steady_levels", levels)
    monkeypatch.setattr("simrail.campaign.spectra.compare", lambda levels, _: levels)
    draws = ["monte_carlo.track_draws=3", "monte_carlo.sensor_draws=2"]
    found = scenario_spectra(load_scenario(scenario, overrides=draws), ())
    assert simulated == [(1, 1)]
    assert found == {("box", "axle", 0.0): (0, 0, "box"), ("seat", "floor", 0.0): (0, 0, "seat")}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "vibration.off=true"], ["vibration", "no ride that shakes", "add the table"]),
        (["--against", "nothing"], ["nothing", "etr103_floor_at_rest"]),
        (["--against", "./shaking.toml"], ["shaking.toml"]),
        (["--out", "."], ["--out", "is a folder", "name a file"]),
    ],
)
def test_bad_input_is_one_message(
    scenario: str, arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["spectra", scenario, *arguments]) == BAD_INPUT
    said = capsys.readouterr()
    assert said.out == ""
    # A scenario in the place of a spectrum has many faults, of which the first are told.
    assert said.err.count("\n") == (7 if "./shaking.toml" in arguments else 1)
    assert said.err.startswith("simrail: ")
    for word in words:
        assert word in said.err
