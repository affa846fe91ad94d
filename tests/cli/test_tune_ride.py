"""``simrail tune my_ride.toml``: by the likelihood of recorded rides, into a file that estimate takes."""

from __future__ import annotations

import shlex
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer

from simrail.campaign.tune import tune_recordings
from simrail.cli.main import BAD_INPUT, DONE, app, call
from simrail.cli.templates import ride_template
from simrail.cli.tune import _command
from simrail.core.toml_files import read_toml


def command_of(*words: str) -> list[str]:
    """What a tuning of these words says that it was made by, as a shell takes it apart."""
    command = typer.main.get_command(app).commands["tune"]  # type: ignore[attr-defined]
    return shlex.split(_command(command.make_context("tune", list(words))))


def test_the_command_is_what_was_asked_without_its_file() -> None:
    """What is as it is anyway, and where it is written, do not stand there; the rest does, once each."""
    words = [
        "metro table.toml",
        "--estimator",
        "A",
        "--method",
        "kom",
        "--draws",
        "3",
        "--box",
        "0.01",
        "100.0",
    ]
    words += ["--parameter", "a b", "--parameter", "c", "--seed", "7", "--set", "ride.speed_kmh=[30, 40]"]
    told = command_of(*words, "--by-kind", "--out", "here.toml", "--evaluations", "480")
    assert sorted(told) == sorted(["simrail", "tune", *words, "--by-kind"])
    assert command_of(*told[2:]) == told


def test_what_is_asked_for_goes_before_what_is_usual(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[object] = []

    class Enough(Exception):
        """What is handed on is known."""

    def tunables_of(estimator: object, chosen: dict[str, object], *, method: str) -> None:
        asked.extend((estimator, chosen, method))
        raise Enough

    monkeypatch.setattr("simrail.campaign.tune.tunables_of", tunables_of)
    usual = {"box": (0.1, 10.0), "parameters": ("axle_yaw_sd",)}
    mine = SimpleNamespace(usual_search=lambda recordings: usual)
    with pytest.raises(Enough):
        tune_recordings([], tmp_path / "t.toml", estimator=mine, settings={"box": (0.5, 2.0)})  # type: ignore[arg-type]
    assert asked == [mine, {"box": (0.5, 2.0), "parameters": ("axle_yaw_sd",)}, "cml"]
    assert usual == {"box": (0.1, 10.0), "parameters": ("axle_yaw_sd",)}


OWN = '''
from dataclasses import dataclass

import pandas as pd

from simrail.estimation.estimate import Estimate
from simrail.estimation.tunable import Parameter, TunedValues


@dataclass(frozen=True)
class Bowl:
    """Least where the logarithms of a and b are those of 0.02 and 0.3."""

    rides: int
    unit = "negative log-likelihood"

    def value(self, values):
        from math import log

        return self.rides + log(values["a"] / 0.02) ** 2 + log(values["b"] / 0.3) ** 2


@dataclass(frozen=True)
class Mine:
    tuning: TunedValues = TunedValues({"a": 1.0, "b": 1.0})
    causal = True

    def estimate(self, recording):
        states = pd.DataFrame({"roll_rad": self.tuning.values["a"]}, index=recording.imu.index)
        return Estimate(states=states, mount=recording.mount)

    def parameters(self):
        return [Parameter(name, "1", 1e-4, 1e4, 1.0) for name in "ab"]

    def likelihood(self, recordings):
        return Bowl(len(recordings))
'''


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    text, data = ride_template("mine")
    lines = [line for line in text.splitlines() if not line.startswith(("track", "start_position_m"))]
    (tmp_path / "mine.toml").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "mine.csv").write_text(data, encoding="utf-8")
    (tmp_path / "own.py").write_text(OWN)
    return tmp_path


def test_what_is_found_is_taken_by_estimate(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["tune", "mine.toml", "--estimator", "own.py:Mine", "--evaluations", "64", "--ride", "mine.toml"]
    assert call(words) == DONE
    said = capsys.readouterr()
    # 64 of CMA-ES, and for two parameters twice ten steps of six and 17 along each axis.
    assert "search, all: some 252 evaluations of" in said.err and "s each: about 0:00:0" in said.err
    table = read_toml(here / "mine_cml.toml")
    assert table["hyperparameters"] == pytest.approx({"a": 0.02, "b": 0.3}, rel=1e-3)
    assert table["search"]["objective"][0] == pytest.approx(2.0, abs=1e-6), "both rides were fitted on"
    assert table["search"]["command"] == "simrail " + " ".join(words) and table["search"]["finished"]
    use = next(line for line in said.out.splitlines() if line.startswith("use it: "))
    assert call(shlex.split(use.removeprefix("use it: simrail "))) == DONE
    page = (here / "results" / "mine_Mine" / "estimate.html").read_text(encoding="utf-8")
    assert "0.02" in page.partition('id="options"')[2]
    # The search is over: nothing unfinished is left beside its file.
    assert sorted(path.name for path in here.glob("*.toml")) == ["mine.toml", "mine_cml.toml"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--method", "kom"], ["--method", "cml for a recorded ride", "needs no known rails"]),
        (["--draws", "2"], ["--draws", "only for scenarios"]),
        (["--imu", "axle"], ["--imu", "only for scenarios"]),
        (["--estimator", "Vqf"], ["--estimator", "nothing to tune"]),
        (["--estimator", "own.py:Mine", "--out", "mine.csv"], ["--out", ".toml"]),
        (["--estimator", "own.py:Mine", "--out", "mine.toml"], ["--out", "no tuning, and would be replaced"]),
    ],
)
def test_what_says_nothing_to_a_ride_is_refused(
    here: Path, capsys: pytest.CaptureFixture[str], more: list[str], words: list[str]
) -> None:
    assert call(["tune", "mine.toml", *more]) == BAD_INPUT
    said = capsys.readouterr().err
    assert all(word in said for word in words) and len(said.splitlines()) == 1, said
    assert not (here / "mine_cml.toml").exists()


def test_a_scenario_has_to_say_what_and_how(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["tune", "go20a"]) == BAD_INPUT
    assert "--estimator: is required for a scenario" in capsys.readouterr().err
    assert call(["tune", "go20a", "--estimator", "ekf_compensated"]) == BAD_INPUT
    assert "--method: is required for a scenario" in capsys.readouterr().err


@pytest.mark.long
def test_the_method_of_our_own_searches_how_its_mount_turns(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, _ = ride_template("mine")
    (here / "mine.toml").write_text(text, encoding="utf-8")
    assert call(["tune", "mine.toml", "--evaluations", "16", "--at-most", "24"]) == DONE
    table = read_toml(here / "mine_cml.toml")
    assert {name.partition("_")[2] for name in table["hyperparameters"]} >= {"roll_sd", "yaw_sd"}
    # A generation that has begun is ended.
    assert 24 <= table["search"]["evaluations"] < 24 + 16
    assert call(["estimate", "mine.toml", "--set", "tuning=mine_cml.toml"]) == DONE
    assert "rails by TrackRelativeSmoother" in capsys.readouterr().out
