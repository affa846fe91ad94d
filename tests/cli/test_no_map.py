"""A recorded ride that names no track: what needs no map runs as with one, all else says so in a line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrail.cli.estimate_ride import estimator_named
from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.cli.templates import ride_template
from simrail.core.errors import InputError
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.files.ride_writer import write_ride


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("rides")
    text, data = ride_template("mine")
    (place / "mine.csv").write_text(data, encoding="utf-8")
    (place / "mine.toml").write_text(text, encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("track", "start_position_m"))]
    (place / "bare.toml").write_text("\n".join(lines), encoding="utf-8")
    return place


def test_the_command_shows_no_design(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ride, out = folder / "bare.toml", folder / "out"
    assert call(["estimate", str(ride), "--estimator", "ComplementaryFilter", "--out", str(out)]) == DONE
    told = capsys.readouterr().out
    assert "a line without a map" in told and "less design" not in told
    assert "less design" not in (out / "estimate.html").read_text(encoding="utf-8")


def test_what_needs_no_map_is_the_same_with_one(folder: Path) -> None:
    method = estimator_named("ComplementaryFilter", [])
    bare, mapped = (
        method.estimate(read_ride(folder / f"{name}.toml")).states[["roll_rad", "pitch_rad"]].to_numpy()
        for name in ("bare", "mine")
    )
    np.testing.assert_allclose(bare, mapped, atol=1e-12)


@pytest.mark.parametrize("method", ["DesignAngles", "AttitudeEkf", "CurveMatchedOdometry"])
def test_what_needs_a_map_says_so(folder: Path, method: str) -> None:
    recording = read_ride(folder / "bare.toml")
    with pytest.raises(InputError, match=r'^track: the method needs a map.*track = "./my_line.toml"'):
        estimator_named(method, []).estimate(recording)


def test_it_says_so_in_one_line_and_writes_nothing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ride, out = folder / "bare.toml", folder / "none"
    assert call(["estimate", str(ride), "--estimator", "DesignAngles", "--out", str(out)]) == BAD_INPUT
    assert "the ride names none" in capsys.readouterr().err.strip().splitlines()[-1]
    assert not out.exists()


def test_it_is_written_and_read_back_without_one(folder: Path) -> None:
    write_ride(read_ride(folder / "bare.toml"), folder / "again")
    assert not (folder / "again" / "track.toml").exists()
    again = read_ride(folder / "again")
    assert not again.track.is_map and again.start_position_m == 0.0


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ('track = "smooth_curve"', "start_position_m: is required"),
        ("map = { cant_sd_mm = 3.0 }", "map: belongs to a track"),
    ],
)
def test_halves_are_refused(folder: Path, more: str, says: str) -> None:
    text = (folder / "bare.toml").read_text(encoding="utf-8")
    (folder / "half.toml").write_text(f"{more}\n{text}", encoding="utf-8")
    with pytest.raises(InputError, match=says):
        read_ride(folder / "half.toml")
