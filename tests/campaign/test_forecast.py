"""What ``simrail run --plan`` says, held against the campaign that it speaks of."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from simrail.campaign import forecast as module
from simrail.campaign.campaign import CampaignResult, run_campaign
from simrail.campaign.forecast import Forecast, _time, forecast
from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.toml_files import shipped
from simrail.ride import cache as ride_cache
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, load_scenario, read_scenario

pytestmark = pytest.mark.usefixtures("own_cache")

SETTINGS = [
    "ride.reverse=[false, true]",
    "monte_carlo.track_draws=2",
    "monte_carlo.sensor_draws=3",
    "score.windows=['whole', 'curve', 'curve:*']",
    "ride.rest_s=2.0",
    "ride.end_m=420.0",
    "ride.acceleration_mps2=2.0",
]


@pytest.fixture
def message_of(capsys: pytest.CaptureFixture[str]) -> Callable[[list[str]], str]:
    """The one line of a command that must end with code 2."""

    def message(arguments: list[str]) -> str:
        assert call(arguments) == BAD_INPUT
        said = capsys.readouterr()
        assert said.out == "" and said.err.count("\n") == 1
        return said.err

    return message


def scenario(*settings: str) -> Scenario:
    return load_scenario("quick_kinematic", overrides=[*SETTINGS, *settings])


@pytest.fixture(scope="module")
def expected_and_done() -> tuple[Forecast, CampaignResult, float]:
    expected = forecast(scenario())
    begun = time.process_time()
    done = run_campaign(scenario(), workers=1)  # here, where its time is seen
    return expected, done, time.process_time() - begun


@pytest.mark.long
def test_counts_rows_and_disk_are_those_of_the_campaign(
    expected_and_done: tuple[Forecast, CampaignResult, float],
) -> None:
    expected, done, _ = expected_and_done
    assert (expected.plan.rides, expected.plan.cells) == (len(done.rides), len(done.cells)) == (4, 24)
    assert expected.rows == pytest.approx(len(done.scores), rel=0.01)
    assert expected.cached == 0 and not expected.failed
    size = sum(ride.size_bytes for ride in ride_cache.rides())
    assert expected.ride_bytes == pytest.approx(size, rel=0.05)


@pytest.mark.long
def test_the_ride_of_the_cell_that_is_timed_is_one_of_the_campaign(
    expected_and_done: tuple[Forecast, CampaignResult, float],
) -> None:
    _, done, _ = expected_and_done
    assert sorted(ride["from_cache"] for ride in done.rides) == [False, False, False, True]
    again = forecast(scenario())
    assert again.cached == 4 and again.stages_s["simulate"] == 0.0
    more = forecast(scenario("monte_carlo.track_draws=3", "monte_carlo.sensor_draws=1"))
    assert (more.plan.rides, more.cached) == (6, 4)


@pytest.mark.long
def test_disk_and_time_hold_short_waves_of_each_ride_and_its_engine_once() -> None:
    """Rides that shake beside the same in silence, and with wheels of two sizes: one ride of the engine."""
    settings = ["ride.reverse=false", "monte_carlo.track_draws=1", "monte_carlo.sensor_draws=1"]
    settings += ["vibration.off=[false, true]", "vibration.wheels.amplitude_um=[30.0, 60.0]", "seed=77"]
    before = {ride.key for ride in ride_cache.rides()}
    expected = forecast(scenario(*settings))
    done = run_campaign(scenario(*settings), workers=1)
    assert expected.plan.rides == len(done.rides) == 2 * 2 and not done.failures
    new = [ride for ride in ride_cache.rides() if ride.key not in before]
    assert len(new) == 1 + 2, "what the engine computed, and each size of the wheels"
    assert expected.ride_bytes == pytest.approx(sum(ride.size_bytes for ride in new), rel=0.05)
    assert expected.stages_s["simulate"] > 0.0
    again = forecast(scenario(*settings))
    assert again.cached == 4 and again.stages_s["simulate"] == 0.0


@pytest.mark.long
def test_time_is_of_the_right_size(expected_and_done: tuple[Forecast, CampaignResult, float]) -> None:
    """Processor time, not wall time. A machine that others use still swings by a factor of two."""
    expected, _, seconds = expected_and_done
    assert 0.33 < expected.total_s / seconds < 3.0


@pytest.mark.long
def test_time_grows_with_draws_of_the_sensors_only_where_they_are_used() -> None:
    few, many = forecast(scenario()), forecast(scenario("monte_carlo.sensor_draws=300"))
    assert many.stages_s["simulate"] == few.stages_s["simulate"] == 0.0
    assert many.rows == 100 * few.rows
    assert 30.0 < many.stages_s["measure"] / few.stages_s["measure"] < 300.0


@pytest.mark.long
def test_an_estimator_that_fails_is_named_and_not_counted(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from dataclasses import dataclass\n\n@dataclass(frozen=True)\nclass Mine:\n    causal = True\n\n"
        "    def estimate(self, recording):\n        raise ValueError('too short')\n"
    )
    text = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
    text += '[[estimator]]\nname = "mine"\nmethod = "./mine.py:Mine"\n'
    expected = forecast(read_scenario(text, name="mine", folder=tmp_path))
    assert expected.failed == {"mine": "ValueError: too short"} and expected.total_s > 0.0


@pytest.mark.long
def test_the_command_shows_it_and_runs_nothing(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = [word for setting in SETTINGS for word in ("--set", setting)]
    assert call(["run", "quick_kinematic", "--plan", *settings]) == DONE
    text = capsys.readouterr().out
    for words in (
        "rides to simulate",
        "of 4",
        "cells .* 24",
        "score rows .* about",
        "an estimate",
        "in the cache",
    ):
        assert re.search(words, text), text
    assert list(here.iterdir()) == []


@pytest.mark.long
def test_with_a_stop_rule_the_numbers_are_called_upper_limits(capsys: pytest.CaptureFixture[str]) -> None:
    rule = 'estimator="ekf_compensated", quantity="roll", metric="rms", width=0.1, least_draws=2'
    words = ["run", "quick_kinematic", "--plan", "--set", "monte_carlo.sensor_draws=4"]
    assert call(words) == DONE
    assert "upper limits" not in capsys.readouterr().out
    assert call([*words, "--set", f"stop={{{rule}}}"]) == DONE
    text = " ".join(capsys.readouterr().out.split())
    assert "upper limits: the stop rule may end it after 2 of 4 draws of the sensors" in text
    assert re.search("cells 8 recordings", text)


@pytest.mark.long
@pytest.mark.parametrize("command", ["run", "check", "plan"])
def test_more_than_a_million_cells_need_a_yes(
    command: str, here: Path, message_of: Callable[[list[str]], str]
) -> None:
    words = ["run", "quick_kinematic", "--plan"] if command == "plan" else [command, "quick_kinematic"]
    text = message_of([*words, "--set", "monte_carlo.sensor_draws=600000"])
    for part in ("too many cells", "1200000", "1000000", "--yes"):
        assert part in text
    assert list(here.iterdir()) == []


@pytest.mark.long
def test_a_yes_is_a_yes(capsys: pytest.CaptureFixture[str]) -> None:
    million = ["--set", "monte_carlo.sensor_draws=600000"]
    assert call(["run", "quick_kinematic", "--plan", "--yes", *million]) == DONE
    assert "1,200,000" in capsys.readouterr().out
    judge_scenario(scenario("monte_carlo.sensor_draws=600000"), many=True)


def test_a_plan_refuses_what_a_run_would_refuse(message_of: Callable[[list[str]], str]) -> None:
    text = message_of(["run", "quick_kinematic", "--plan", "--set", "ride.speed_kmh={ normal = [50, 5] }"])
    assert "without bounds" in text


@pytest.mark.parametrize(
    ("seconds", "words"), [(59.94, "59.9 s"), (150.0, "2 min"), (5400.0, "90 min"), (9000.0, "2.5 h")]
)
def test_a_time_is_told_in_its_unit(seconds: float, words: str) -> None:
    assert _time(seconds) == words


def planned(duration_s: float, key: str, *, shaken: bool = False, engine: bool = False) -> module._Planned:
    cell: Any = None
    return module._Planned(cell, duration_s, key, shaken, engine, engine)


def test_what_an_engine_computes_counts_once_and_what_shakes_each_time() -> None:
    rides = [
        planned(100.0, "a"),
        planned(100.0, "a", shaken=True),
        planned(40.0, "b", shaken=True, engine=True),
        planned(30.0, "c"),
    ]
    assert module._seconds(rides) == (170.0, 140.0)
    assert module._seconds(rides, new=True) == (130.0, 140.0)


@pytest.mark.parametrize(("factor", "seconds"), [(20.0, 8.0), (None, 7.0)])
def test_a_ride_costs_its_time_over_the_engines_pace_and_its_setup(
    factor: float | None, seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """100 s at twenty times the pace, and 3 s; an engine that tells no pace costs what it took."""
    ran: list[str] = []

    def run_batch(*_: object) -> SimpleNamespace:
        ran.append("batch")
        return SimpleNamespace(ride={"real_time_factor": factor, "setup_s": 3.0}, number=len(ran))

    ride = SimpleNamespace(
        profile=SimpleNamespace(duration_s=100.0), vibration="shaken", without_vibration="bare"
    )
    patches = {
        "pack": lambda parts: b"",
        "run_ride": lambda *_: SimpleNamespace(cpu_s={"simulate": 7.0}),
        "run_batch": run_batch,
        "forget": lambda: ran.append("forget"),
        "_vibration_s": lambda ride: 11.0,
        "_bytes_of": lambda ride: 2.0 if ride == "bare" else 5.0,
    }
    for name, value in patches.items():
        monkeypatch.setattr(module, name, value)
    cost = module._cost_of(None, SimpleNamespace(ride=lambda cell: ride))  # type: ignore[arg-type]
    assert (cost.duration_s, cost.engine_s, cost.vibration_s) == (100.0, seconds, 11.0)
    assert (cost.engine_bytes, cost.vibration_bytes) == (2.0, 5.0)
    # The second of two, since the first may compile; and nothing stays in this process.
    assert cost.result.number == 2 and ran == ["batch", "batch", "forget"]  # type: ignore[attr-defined]


def test_more_than_the_cache_keeps_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("simrail.ride.cache.limit_bytes", lambda: 20e9)
    assert module._cache_words(20e9) == "of rides; the cache keeps 20 GB"
    assert module._cache_words(20.1e9) == "of rides, more than the 20 GB that the cache keeps"
