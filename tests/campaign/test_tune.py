"""simrail tune: from a scenario to a file that a scenario can name; interrupted and resumed; bad input."""

from __future__ import annotations

from pathlib import Path

import pytest
from simrail.estimators.tuning.file import Tuning

from simrail.campaign.progress import Watcher
from simrail.campaign.tune import chosen_cells
from simrail.cli.main import BAD_INPUT, DONE, INTERRUPTED, call
from simrail.core.toml_files import shipped
from simrail.estimation.tunable import TunedValues
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import load_scenario

pytestmark = [pytest.mark.usefixtures("own_cache"), pytest.mark.long]

QUICK = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
SMOOTHER = """
[[estimator]]
name = "smoother"
method = "TrajectorySmoother"
[estimator.options]
tuning = "mine_cml.toml"
"""
SHORT = (
    QUICK.replace("rest_s = 10.0", "rest_s = 1.0")
    .replace("final_rest_s = 2.0", "final_rest_s = 0.5")
    .replace("start_m = 10.0", "start_m = 110.0")
    .replace("end_m = 590.0", "end_m = 165.0")
)
WORDS = ["tune", "mine.toml", "--estimator", "smoother", "--evaluations", "16", "--at-most", "60"]


@pytest.fixture
def place(here: Path) -> Path:
    (here / "mine.toml").write_text(SHORT + SMOOTHER, encoding="utf-8")
    return here


def test_makes_the_file_that_the_scenario_names(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Which need not be there before; twice the same bits; and its command is the one that made it."""
    assert call([*WORDS, "--method", "cml"]) == DONE
    said = capsys.readouterr().out
    assert "mine_cml.toml" in said and "identified" in said
    first = (place / "mine_cml.toml").read_bytes()
    tuning = Tuning.from_file(place / "mine_cml.toml")
    assert tuning.search is not None and tuning.search.finished
    assert tuning.search.command == "simrail " + " ".join([*WORDS[:4], "--method", "cml", *WORDS[4:]])
    assert "out, axle on front, lord_3dm_gx4_25" in tuning.search.fitted_on[0]
    # What it says of each parameter is what it has written.
    assert tuning.status is not None and tuning.curve_status is None
    told = {line.split()[0][:12]: line for line in said.splitlines() if "e-" in line or "0." in line}
    for name, status in tuning.status.items():
        assert status.split()[0] in told[name[:12]]
    made = judge_scenario(load_scenario("mine.toml")).estimators["smoother"]
    assert made.tuning == tuning  # type: ignore[attr-defined]
    assert call(tuning.search.command.split()[1:]) == DONE
    assert (place / "mine_cml.toml").read_bytes() == first
    assert sorted(entry.name for entry in place.iterdir()) == ["mine.toml", "mine_cml.toml"]


@pytest.mark.slow
def test_interrupted_it_goes_on(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [*WORDS, "--method", "cml", "--out", "other.toml", "--by-kind"]
    assert call(words) == DONE
    whole = (place / "other.toml").read_bytes()
    (place / "other.toml").unlink()

    def interrupt(self: Watcher, name: str, evaluations: int, value: float) -> None:
        if name == "curves" and evaluations > 40:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("simrail.campaign.progress.ProgressWatcher.search_goes", interrupt)
        capsys.readouterr()
        assert call(words) == INTERRUPTED
    assert "best so far is in other.unfinished.toml" in capsys.readouterr().out
    best = Tuning.from_file(place / "other.unfinished.toml")
    assert best.search is not None and not best.search.finished
    assert not (place / "other.toml").exists()
    assert call(words) == DONE
    assert "going on from other.unfinished.toml" in capsys.readouterr().out
    assert (place / "other.toml").read_bytes() == whole
    assert not list(place.glob("*unfinished*"))


@pytest.mark.slow
def test_known_output(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a smoother without options, between two places; without the descent, which takes long."""
    monkeypatch.setattr("simrail.estimators.tuning.search.ROUNDS", 0)
    words = ["tune", "mine.toml", "--estimator", "TrajectorySmoother", "--method", "kom"]
    words += ["--within", "120", "150", "--position", "3e-3", "--constrain", "none"]
    assert call([*words, "--evaluations", "16"]) == DONE
    tuning = Tuning.from_file(place / "mine_kom.toml")
    assert tuning.search is not None
    assert (tuning.search.method, tuning.search.unit) == ("kom", "sum of rms errors in mm")
    assert tuning.hyperparameters.lateral_position_m2 == 3e-3


STRANGER = """
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.estimation.estimate import Estimate
from simrail.estimation.tunable import Parameter, TunedValues


class Fit:
    def __init__(self, unit, values):
        self.unit, self.of = unit, values

    def value(self, values):
        return float(((self.of - values["offset_m"]) ** 2).mean() + (values["tau_s"] - 2.0) ** 2)


@dataclass(frozen=True)
class Mine:
    offset_m: float = 0.5
    tuning: TunedValues | None = None
    causal = True

    def estimate(self, recording):
        offset = self.offset_m if self.tuning is None else self.tuning.values["offset_m"]
        return Estimate(pd.DataFrame({"roll_rad": offset}, index=recording.imu.index), recording.mount)

    def parameters(self):
        return (
            Parameter("tau_s", "s", 0.1, 10.0, 1.0),
            Parameter("offset_m", "m", -9.0, 19.0, self.offset_m, scale="linear"),
        )

    def likelihood(self, recordings):
        return Fit("of the recordings", np.concatenate([one.imu["accel_z_mps2"] for one in recordings]))

    def reference_error(self, recordings, references):
        assert len(recordings) == len(references)
        return Fit("of the rails", np.concatenate([one["cross_level_m"] for one in references]))


@dataclass(frozen=True)
class Half(Mine):
    reference_error = None
"""


def test_a_strangers_tunable_is_tuned_by_both_methods(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From one file, in a scenario or by its path; what it finds is an option of the estimator."""
    (place / "mine.py").write_text(STRANGER, encoding="utf-8")
    entry = '[[estimator]]\nname = "own"\nmethod = "./mine.py:Mine"\n'
    (place / "mine.toml").write_text(f"{SHORT}\n{entry}", encoding="utf-8")
    words = ["tune", "mine.toml", "--evaluations", "160", "--method"]
    assert call([*words, "cml", "--estimator", "own"]) == DONE
    printed = capsys.readouterr().out
    assert "of the recordings" in printed and "tau_s" in printed and "offset_m" in printed
    values = TunedValues.from_file(place / "mine_cml.toml").values
    assert values == {"tau_s": pytest.approx(2.0, rel=1e-3), "offset_m": pytest.approx(9.81, abs=0.05)}
    assert call([*words, "kom", "--estimator", "mine.py:Mine"]) == DONE
    by_rails = TunedValues.from_file(place / "mine_kom.toml").values
    assert by_rails["offset_m"] == pytest.approx(0.0, abs=0.01) and by_rails["tau_s"] == pytest.approx(2.0)
    options = '[estimator.options]\ntuning = "mine_cml.toml"\n'
    (place / "mine.toml").write_text(f"{SHORT}\n{entry}{options}", encoding="utf-8")
    made = judge_scenario(load_scenario("mine.toml")).estimators["own"]
    assert made.tuning.values == values  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["--method", "map"], ["--method", "'map'", "cml or kom"]),
        (
            ["--by-kind"],
            ["--by-kind: Mine has no such setting of its search; limit: "],
        ),
        (["--constrain", "yz"], ["--constrain: Mine has no such setting"]),
        (["--box", "1", "2"], ["--box: Mine has no such setting"]),
        (
            ["--method", "kom", "--estimator", "./mine.py:Half"],
            ["--method: Half cannot be tuned by this method; found 'kom'; limit: cml"],
        ),
    ],
)
def test_what_a_strangers_tunable_does_not_offer_is_refused_in_one_line(
    words: list[str], parts: list[str], place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (place / "mine.py").write_text(STRANGER, encoding="utf-8")
    assert call([*WORDS, "--estimator", "./mine.py:Mine", "--method", "cml", *words]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    for part in parts:
        assert part in line
    assert {entry.name for entry in place.iterdir()} == {"mine.py", "mine.toml"}


@pytest.mark.slow
def test_fits_on_several_draws_of_new_tracks_first(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All of them count: the objective is that of the recordings together, and the file names each."""
    monkeypatch.setattr("simrail.estimators.tuning.search.ROUNDS", 0)
    words = [*WORDS, "--method", "cml", "--set", "monte_carlo.track_draws=2"]
    spec = load_scenario("mine.toml", overrides=["monte_carlo.track_draws=2"])
    drawn = [(c.track_draw, c.sensor_draw) for c in chosen_cells(spec, [], None, draws=3)]
    assert drawn == [(0, 0), (1, 0), (0, 1)]
    assert call([*words, "--draws", "2"]) == DONE
    both = Tuning.from_file(place / "mine_cml.toml").search
    assert both is not None and "--draws 2" in both.command
    assert len(both.fitted_on) == 2 and both.fitted_on[1].endswith(", draw 0 on track 1")
    assert call(words) == DONE
    one = Tuning.from_file(place / "mine_cml.toml").search
    assert one is not None and one.fitted_on == both.fitted_on[:1] and one.objective != both.objective


def test_sizes_of_the_track_relative_smoother_are_searched_by_name(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On an axle; the scenario that names the file estimates with them."""
    entry = '[[estimator]]\nname = "ours"\nmethod = "TrackRelativeSmoother"\n'
    options = '[estimator.options]\ntuning = "mine_cml.toml"\n'
    (place / "mine.toml").write_text(f"{SHORT}\n{entry}{options}", encoding="utf-8")
    words = ["tune", "mine.toml", "--estimator", "ours", "--method", "cml"]
    words += ["--evaluations", "0", "--at-most", "8"]
    assert call(words) == call([*words, "--parameter", "axle_yaw"]) == BAD_INPUT
    nothing, unknown = capsys.readouterr().err.splitlines()
    assert "--parameter: nothing is to be searched" in nothing and "axle_yaw_sd" in nothing
    assert "--parameter: there is no such size" in unknown and "found 'axle_yaw'" in unknown
    searched = ["--parameter", "axle_yaw_sd", "--parameter", "axle_gyro"]
    assert call([*words, *searched]) == DONE
    said = capsys.readouterr().out
    assert "negative log-likelihood per step" in said and "axle_yaw_sd" in said
    text = (place / "mine_cml.toml").read_text(encoding="utf-8")
    assert all(f"--parameter {name}" in text.splitlines()[0] for name in ("axle_yaw_sd", "axle_gyro"))
    values = TunedValues.from_file(place / "mine_cml.toml").values
    assert list(values) == ["axle_yaw_sd", "axle_gyro"]
    made = judge_scenario(load_scenario("mine.toml")).estimators["ours"]
    assert made.tuning.values == values  # type: ignore[attr-defined]
    (place / "mine_cml.toml").write_text(text.replace("axle_gyro = ", "axle_giro = "), encoding="utf-8")
    assert call(["check", "mine.toml"]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    for part in ("mine.toml: estimator", "tuning.axle_giro", "did you mean axle_gyro?"):
        assert part in line


def test_a_folder_that_cannot_be_written_is_refused_before_anything_runs(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("simrail.campaign.tune.can_be_made", lambda *_: False)
    assert call([*WORDS, "--method", "cml", "--out", "tuned.toml"]) == BAD_INPUT
    (said,) = capsys.readouterr().err.splitlines()
    assert "--out: the folder cannot be written; found 'tuned.toml'" in said


def test_what_a_search_left_and_what_it_was_not_allowed_is_told(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """No fall of the objective stands there as if it were a least; names are whole in 80 columns."""
    monkeypatch.setattr("simrail.estimators.tuning.search.ROUNDS", 0)
    assert call([*WORDS[:-4], "--method", "cml", "--evaluations", "0", "--at-most", "1"]) == DONE
    said = capsys.readouterr().out
    left = " ".join(said.partition("not at the least: ")[2].split()).partition(" would be better")[0]
    assert "lateral_m2ps5" in left or "vertical_m2ps5" in left, said
    assert "Costs: by how much" in said and "\u2026" not in said
    for name in ("lateral_position_m2", "vertical_position_m2"):
        assert name in said.partition("Costs: ")[0]


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["--method", "map"], ["--method", "'map'", "cml or kom"]),
        (["--estimator", "smother"], ["--estimator", "'smother'", "smoother"]),
        (["--estimator", "design_angles"], ["--estimator", "DesignAngles", "e.g. TrajectorySmoother"]),
        (["--ride", "home"], ["--ride", "'home'", "one of out"]),
        (["--draws", "0"], ["--draws: is out of range; found 0", ">= 1"]),
        (["--draws", "-1"], ["--draws: is out of range; found -1", ">= 1"]),
        (["--draws", "3"], ["--draws", "3", "1 to 2", "track_draws"]),
        (["--imu", "roof"], ["--imu", "'roof'", "one of axle"]),
        (["--out", "tuned.txt"], ["--out", "tuned.txt", ".toml"]),
        (["--out", "nowhere/tuned.toml"], ["--out", "no such folder"]),
        (["--out", "mine.toml"], ["--out", "mine.toml", "is no tuning"]),
        (["--box", "1", "1e-4"], ["--box", "least < greatest"]),
        (["--constrain", "x"], ["--constrain", "'x'", "yz"]),
        (["--position", "-1"], ["--position", "-1.0", "> 0"]),
        (["--position", "1e-4"], ["--position", "leaves nothing to search"]),
        (["--band", "D1"], ["--band", "--method kom"]),
        (["--within", "0", "9"], ["--within", "--method kom"]),
        (["--method", "kom", "--band", "D9"], ["--band", "'D9'", "D1"]),
        (["--method", "kom", "--band", "D3"], ["band", "D3"]),
        (["--method", "kom", "--within", "50", "20"], ["--within", "[50.0, 20.0]", "smaller first"]),
        (["--method", "kom", "--within", "500", "520"], ["reference", "none of the places"]),
        (["--method", "kom", "--band", "D1", "--step", "2"], ["--step", "2.0", "D1", "<= 1.2 m"]),
        (["--evaluations", "-1"], ["--evaluations", "-1", ">= 0"]),
        (["--set", "ride.out.speed_kmh=-3"], ["ride[0].speed_kmh"]),
        (["--set", "estimator.smoother.options.smothed=0"], ["estimator[3].options.smothed", "smoothed?"]),
    ],
)  # fmt: skip
def test_bad_input(
    words: list[str], parts: list[str], place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {entry.name: entry.read_bytes() for entry in place.iterdir()}
    assert call([*WORDS, "--method", "cml", *words]) == BAD_INPUT
    said = capsys.readouterr().err.splitlines()
    assert said[-1].startswith("simrail: ")
    for part in parts:
        assert part in said[-1], said
    assert {entry.name: entry.read_bytes() for entry in place.iterdir()} == before
