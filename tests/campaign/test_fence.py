"""Estimators of strangers: none changes what the next one is given, or the process that runs it."""

from __future__ import annotations

import os
import random
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from shortest_ride import SHORTEST_RIDE

from simrail.campaign.campaign import run_campaign
from simrail.campaign.fence import EstimatorExit, digest, fenced, handed
from simrail.campaign.worker import _Worker
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.scenario.check import Plan, judge_scenario
from simrail.scenario.scenario import read_scenario

TEXT = (
    SHORTEST_RIDE
    + """
[[estimator]]
name = "stranger"
method = "DesignAngles"
[[estimator]]
name = "ekf"
method = "AttitudeEkf"
"""
)


@dataclass(frozen=True)
class Stranger:
    """Does something to what it is given, and estimates level angles."""

    deed: Callable[[Recording], object]

    needs = ()

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate."""
        n = len(recording.imu)
        if n > 64:
            self.deed(recording)
        states = pd.DataFrame({"roll_rad": np.zeros(n)}, index=recording.imu.index)
        return Estimate(states=states, mount=recording.mount)


def plan_with(deed: Callable[[Recording], object]) -> Plan:
    plan = judge_scenario(read_scenario(TEXT, name="fence"))
    plan.estimators["stranger"] = Stranger(deed)
    plan.parts.estimators(0)["stranger"] = Stranger(deed)
    return plan


def scores_of(deed: Callable[[Recording], object], monkeypatch: pytest.MonkeyPatch) -> pd.DataFrame:
    """Scores of a campaign in this process, whose parts are not sent anywhere."""
    plan = plan_with(deed)
    worker = _Worker(b"here", plan.parts)

    @contextmanager
    def at_work(_packed: bytes) -> Iterator[tuple[_Worker, Callable[[], None]]]:
        yield worker, lambda: None

    monkeypatch.setattr("simrail.campaign.campaign.pack", lambda parts: b"here")
    monkeypatch.setattr("simrail.campaign.worker._at_work_on", at_work)
    return run_campaign(plan, workers=1).scores


def zero_in_place(recording: Recording) -> None:
    recording.imu.iloc[:] = 0.0


def shift_values(recording: Recording) -> None:
    recording.imu["gyro_x_radps"].to_numpy()[...] -= 0.002


def force_values(recording: Recording) -> None:
    """Of a frame whose array owns its memory it can be forced; the digest finds it."""
    values = recording.imu.to_numpy()
    while values.base is not None and isinstance(values.base, np.ndarray):
        values = values.base
    values.flags.writeable = True
    values -= 0.002


def replace_frame(recording: Recording) -> None:
    object.__setattr__(recording, "imu", recording.imu * 0.0)


def write_odometry(recording: Recording) -> None:
    assert recording.odometry is not None
    recording.odometry["speed_mps"] = 0.0


@pytest.mark.parametrize("deed", [zero_in_place, shift_values, force_values, replace_frame, write_odometry])
def test_no_estimator_changes_what_the_next_one_is_given(
    deed: Callable[[Recording], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    honest = scores_of(lambda recording: None, monkeypatch)
    after = scores_of(deed, monkeypatch)
    pick = "estimator == 'ekf' and metric != 'us_per_sample'"
    pd.testing.assert_frame_equal(
        honest.query(pick).reset_index(drop=True).astype({"status": str}),
        after.query(pick).reset_index(drop=True).astype({"status": str}),
        check_exact=True,
    )
    if deed is force_values:
        of_stranger = after[after["estimator"] == "stranger"]
        assert of_stranger["status"].str.contains("changed the recording").all()


def quits(_recording: Recording) -> None:
    raise SystemExit(0)


def test_an_exit_is_a_failure_like_any_other(monkeypatch: pytest.MonkeyPatch) -> None:
    scores = scores_of(quits, monkeypatch)
    of_stranger = scores[scores["estimator"] == "stranger"]
    assert len(of_stranger) == 1 and "ended the process (exit code 0)" in str(of_stranger["status"].iloc[0])
    assert (scores[scores["estimator"] == "ekf"]["status"] == "ok").any()


def test_the_process_is_as_it_was(here: Path) -> None:
    random.seed(1)
    before = random.getstate(), np.geterr(), dict(os.environ), list(warnings.filters)
    with fenced() as printed:
        print("hello")
        random.seed(7)
        np.seterr(all="raise")
        os.environ["OWN"] = "1"
        warnings.simplefilter("error")
        (here / "other").mkdir()
        os.chdir(here / "other")
    assert printed.getvalue() == "hello\n"
    assert (random.getstate(), np.geterr(), dict(os.environ), list(warnings.filters)) == before
    assert Path.cwd() == here
    with pytest.raises(EstimatorExit, match="exit code 3"), fenced():
        raise SystemExit(3)


def test_what_is_handed_on_has_the_same_values_and_cannot_be_written() -> None:
    from simrail.campaign.cell import record_cell, simulated
    from simrail.campaign.progress import Watcher
    from simrail.scenario.build import Parts
    from simrail.scenario.cells import cells

    scenario = read_scenario(TEXT, name="fence")
    parts, cell = Parts(scenario), next(cells(scenario))
    recording = record_cell(cell, simulated(cell, parts, Watcher(), 1, 1), parts)
    given = handed(recording)
    assert digest(given) == digest(recording)
    for name in ("imu", "odometry", "encoder"):
        whole, own = getattr(recording, name), getattr(given, name)
        pd.testing.assert_frame_equal(whole, own, check_exact=True)
        with pytest.raises(ValueError, match="read-only"):
            own.iloc[:, 0].to_numpy()[0] = 1
