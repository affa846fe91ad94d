"""Estimators that take many recordings at once: asked once per batch, and one bad recording fails alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from simrail.campaign.campaign import run_campaign
from simrail.campaign.cell import BatchTally, _outcomes
from simrail.campaign.time_limit import Outcome
from simrail.scenario.scenario import load_scenario

MANY = """
import os
from dataclasses import dataclass
from pathlib import Path

from simrail.estimators.baselines import DesignAngles


@dataclass(frozen=True)
class Noting:
    "Takes many recordings at once; refuses all of them if there is one that it does not like."
    sleep_s: float = 0.0
    dislikes: bool = False
    forgets: bool = False
    causal = True

    def estimate(self, recording):
        return self.estimate_many([recording])[0]

    def estimate_many(self, recordings):
        if len(recordings[0].imu) > 64:
            with Path(os.environ["SIMRAIL_TEST_NOTES"]).open("a") as notes:
                notes.write(f"{len(recordings)} recordings\\n")
        if self.dislikes and any(one.imu.iloc[0, 0] > 0.0 for one in recordings):
            raise ValueError("not this one")
        return [DesignAngles().estimate(one) for one in recordings[self.forgets :]]
"""

PLAIN = MANY.replace("estimate_many", "all_of")


@pytest.fixture
def run(noting_file: Path, notes: object) -> Callable[..., tuple[pd.DataFrame, list[str], set[int]]]:
    def run_with(source: str, *options: str) -> tuple[pd.DataFrame, list[str], set[int]]:
        (noting_file.parent / "noting.py").write_text(source)
        settings = ["ride.speed_kmh=50", *(f"estimator.noting.options.{option}" for option in options)]
        found = run_campaign(load_scenario(noting_file, overrides=settings), batch_cells=4)
        file = noting_file.parent / "notes.txt"
        asked = file.read_text().splitlines()
        file.unlink()
        return found.scores, asked, {failure.cell for failure in found.failures}

    return run_with


def test_a_batch_is_asked_for_at_once_and_the_bits_are_those_of_one_by_one(
    run: Callable[..., tuple[pd.DataFrame, list[str], set[int]]],
    assert_same: Callable[[pd.DataFrame, pd.DataFrame], None],
) -> None:
    many, asked, _ = run(MANY)
    assert asked[0] == "4 recordings"  # the example comes after
    one, asked, _ = run(PLAIN)
    assert asked[:4] == ["1 recordings"] * 4
    assert_same(one, many)
    # Together they take one time, which is that of each of their samples.
    times = many.query("estimator == 'noting' and metric == 'us_per_sample'")["value"]
    assert len(times) == 4 and len(set(times)) == 1


def test_a_recording_that_upsets_the_method_fails_alone(
    run: Callable[..., tuple[pd.DataFrame, list[str], set[int]]],
    assert_same: Callable[[pd.DataFrame, pd.DataFrame], None],
) -> None:
    many, _, failed = run(MANY, "dislikes=true")
    one, _, failed_one_by_one = run(PLAIN, "dislikes=true")
    assert failed == failed_one_by_one and 0 < len(failed) < 4
    assert_same(one, many)


def test_estimates_that_are_missing_are_a_failure(
    run: Callable[..., tuple[pd.DataFrame, list[str], set[int]]],
) -> None:
    scores, _, failed = run(MANY, "forgets=true")
    assert failed == {0, 1, 2, 3}
    assert scores["status"].astype(str).str.contains("gave 0 estimates of 1").any()


def test_the_time_of_a_batch_is_over_all_its_samples() -> None:
    """Three recordings of 100, 200 and 700 samples that take 2 s: 2 ms for each sample of each."""
    recordings = [SimpleNamespace(imu=range(n)) for n in (100, 200, 700)]
    method = SimpleNamespace(estimate_many=None)
    tally = BatchTally("toy", {}, {}, warm={"many"})

    def run(group: list[SimpleNamespace]) -> Outcome:
        return Outcome([object()] * len(group), 2.0, 2.0, "")  # type: ignore[list-item]

    found = list(_outcomes("many", method, recordings, run, tally, lambda: None))  # type: ignore[arg-type]
    assert [one[1] for one in found if isinstance(one, tuple)] == [pytest.approx(2000.0)] * 3
