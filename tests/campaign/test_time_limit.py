"""An estimator that does not come to its end is ended: its row says so, and the campaign goes on."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from shortest_ride import DESIGN, SHORTEST_RIDE

from simrail.campaign import time_limit
from simrail.campaign.campaign import run_campaign
from simrail.campaign.time_limit import LimitedEstimator, OverTimeError
from simrail.cli.main import BAD_INPUT, call
from simrail.scenario.scenario import Scenario, load_scenario

pytestmark = pytest.mark.long

OWN = """
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

from simrail.estimators.baselines import DesignAngles


@numba.njit(nogil=True)
def spin(n):
    total = 0
    while n > 0:
        total += n & 3
        n += total & 1
        if n > 1 << 60:
            n = 1
    return total


@dataclass(frozen=True)
class Own:
    "Does something on the second recording of each ride."
    deed: str = "spin"
    causal = True

    def estimate(self, recording):
        Path("pids.txt").open("a").write(f"{os.getpid()}\\n")
        second = len(recording.imu) > 64 and self.is_second(recording)
        if second and self.deed == "spin":
            spin(1)
        if second and self.deed == "sleep":
            time.sleep(60.0)
        if second and self.deed == "die":
            os.kill(os.getpid(), signal.SIGSEGV)
        if second and self.deed == "eat":
            np.ones(500_000_000)
        if second and self.deed == "nibble":
            held = []
            while len(held) < 4000:
                held.append(bytearray(1_000_000))
        if second and self.deed == "raise":
            raise KeyError("no such thing")
        if self.deed == "print":
            print("hello")
        return DesignAngles().estimate(recording)

    def is_second(self, recording):
        return recording.imu["gyro_x_radps"].iloc[0] > 0.0
"""
TEXT = (
    SHORTEST_RIDE.replace("seed = 3", "seed = 3\nmonte_carlo = { sensor_draws = 4 }")
    + """
[[estimator]]
name = "own"
method = "own.py:Own"
"""
    + DESIGN
)


@pytest.fixture
def scenario(here: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SIMRAIL_RIDES", str(here / "rides"))
    monkeypatch.setattr(time_limit, "FIRST_CALL_S", 60.0)
    (here / "own.py").write_text(OWN)
    (here / "mine.toml").write_text(TEXT)
    return here / "mine.toml"


def read(file: Path, *settings: str) -> Scenario:
    return load_scenario(file, overrides=list(settings))


def values(scores: pd.DataFrame, estimator: str) -> pd.DataFrame:
    kept = scores[(scores["estimator"] == estimator) & (scores["metric"] != "us_per_sample")]
    return kept.reset_index(drop=True).astype({"status": str})


def pids() -> set[int]:
    return {int(line) for line in Path("pids.txt").read_text().split()}


def failed(scores: pd.DataFrame) -> dict[int, str]:
    rows = scores[(scores["estimator"] == "own") & ~scores["status"].isin(["ok", "no samples"])]
    return {int(row["cell"]): str(row["status"]) for row in rows.to_dict("records")}


@pytest.mark.parametrize(
    ("deed", "words"),
    [
        ("spin", "OverTimeError: took longer than time_limit_s = 1, and was ended"),
        ("die", "EstimatorDiedError: it ended the process that ran it (signal 11)"),
        pytest.param("raise", "KeyError: 'no such thing'", marks=pytest.mark.slow),
    ],
)
def test_it_is_ended_and_its_row_says_so(deed: str, words: str, scenario: Path) -> None:
    """In this process; a compiled loop that no signal ends, and a crash that would take the process along."""
    free = run_campaign(read(scenario, "estimator.own.options.deed='print'"), workers=1).scores
    limited = run_campaign(
        read(scenario, f"estimator.own.options.deed='{deed}'", "estimator.own.time_limit_s=1.0"), workers=1
    ).scores
    pd.testing.assert_frame_equal(values(limited, "design"), values(free, "design"), check_exact=True)
    reasons = failed(limited)
    assert 0 < len(reasons) < 4 and set(reasons.values()) == {words}
    good = [cell for cell in range(4) if cell not in reasons]
    pd.testing.assert_frame_equal(
        values(limited[limited["cell"].isin(good)], "own"),
        values(free[free["cell"].isin(good)], "own"),
        check_exact=True,
    )
    for pid in pids() - {os.getpid()}:
        assert not Path(f"/proc/{pid}/stat").exists(), "a process is left"


def test_without_a_limit_no_process_is_begun(scenario: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time_limit.multiprocessing, "get_context", lambda _: pytest.fail("a process"))
    run_campaign(read(scenario, "estimator.own.options.deed='print'"), workers=1)
    assert pids() == {os.getpid()}


def test_one_process_takes_all_recordings_of_a_batch(scenario: Path) -> None:
    settings = ["estimator.own.options.deed='print'", "time_limit_s=30.0"]
    result = run_campaign(read(scenario, *settings), workers=1, batch_cells=4)
    assert not failed(result.scores) and not result.failures
    assert os.getpid() not in pids() and len(pids()) == 2  # of the batch, and of the example on the page


@pytest.mark.slow
def test_workers_end_it_too(scenario: Path) -> None:
    settings = ["estimator.own.options.deed='spin'", "time_limit_s=1.0", "monte_carlo.sensor_draws=8"]
    one = run_campaign(read(scenario, *settings), workers=1).scores
    two = run_campaign(read(scenario, *settings), workers=2, batch_cells=2).scores
    assert failed(one) == failed(two) and failed(one)
    pd.testing.assert_frame_equal(values(one, "own"), values(two, "own"), check_exact=True)


ORPHAN = """
import os, sys, time
from simrail.campaign.time_limit import LimitedEstimator

class Endless:
    def estimate(self, recording):
        print(os.getpid(), file=sys.stderr, flush=True)
        while True:
            pass

class Nothing:
    imu = ()

from simrail.campaign import time_limit
time_limit.handed = lambda one: one
LimitedEstimator(Endless(), LIMITS).estimate([Nothing()], at_least_s=0.1)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")
@pytest.mark.parametrize("limits", ["1.0", "None, 500.0"])
def test_it_does_not_outlive_a_campaign_that_was_killed(limits: str) -> None:
    """Nor does one without a limit of time, which no timer ends."""
    program = ORPHAN.replace("LIMITS", limits)
    parent = subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True)
    assert parent.stderr is not None
    child = int(parent.stderr.readline())
    parent.kill()
    parent.wait()
    end = time.monotonic() + 60.0
    while Path(f"/proc/{child}").exists() and time.monotonic() < end:
        time.sleep(0.1)
    assert not Path(f"/proc/{child}").exists()


def test_ctrl_c_while_it_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    class Endless:
        def estimate(self, recording: object) -> None:
            time.sleep(60.0)

    monkeypatch.setattr(time_limit, "handed", lambda one: one)
    limited = LimitedEstimator(Endless(), 0.2)  # type: ignore[arg-type]
    with pytest.raises(OverTimeError):
        limited.estimate([None])  # type: ignore[list-item]
    limited._begin()
    process = limited._process

    def interrupted(_: float) -> bool:
        raise KeyboardInterrupt

    monkeypatch.setattr(limited._pipe, "poll", interrupted, raising=False)
    with pytest.raises(KeyboardInterrupt):
        limited.estimate([None])  # type: ignore[list-item]
    assert not process.is_alive()


EATEN = "OverMemoryError: took more memory than memory_limit_mb = 400"


@pytest.mark.skipif(sys.platform != "linux", reason="a limit of Linux")
@pytest.mark.parametrize("deed", ["eat", "nibble"])
def test_one_that_eats_memory_is_ended_and_the_others_go_on(deed: str, scenario: Path) -> None:
    """All at once by numpy, and by Python bit by bit; the next recording is whole again."""
    free = run_campaign(read(scenario, "estimator.own.options.deed='print'"), workers=1).scores
    settings = [f"estimator.own.options.deed='{deed}'", "estimator.own.memory_limit_mb=400.0"]
    limited = run_campaign(read(scenario, *settings), workers=1).scores
    pd.testing.assert_frame_equal(values(limited, "design"), values(free, "design"), check_exact=True)
    reasons = failed(limited)
    assert 0 < len(reasons) < 4 and set(reasons.values()) == {EATEN}
    good = [cell for cell in range(4) if cell not in reasons]
    pd.testing.assert_frame_equal(
        values(limited[limited["cell"].isin(good)], "own"),
        values(free[free["cell"].isin(good)], "own"),
        check_exact=True,
    )


@pytest.mark.parametrize("value", ["0.0", "63.0", "1e9", "'little'"])
def test_a_memory_limit_that_is_none(value: str, scenario: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for key in ("memory_limit_mb", "estimator.own.memory_limit_mb"):
        assert call(["check", "mine.toml", "--set", f"{key}={value}"]) == BAD_INPUT
        said = capsys.readouterr().err
        assert "memory_limit_mb" in said and "limit:" in said and "remedy:" in said


@pytest.mark.parametrize("value", ["0.0", "-1.0", "1e9", "'soon'"])
def test_a_limit_that_is_none(value: str, scenario: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for key in ("time_limit_s", "estimator.own.time_limit_s"):
        assert call(["check", "mine.toml", "--set", f"{key}={value}"]) == BAD_INPUT
        said = capsys.readouterr().err
        assert "time_limit_s" in said and "limit:" in said and "remedy:" in said


@pytest.mark.parametrize(("at_least_s", "allowed_s"), [(0.0, 6.0), (20.0, 20.0)])
def test_the_limit_is_of_each_recording(at_least_s: float, allowed_s: float) -> None:
    """What a batch may take is as many times that of a recording, or what a first call may take."""
    waited: list[float] = []

    class Pipe:
        def send(self, asked: tuple[list[object], float]) -> None:
            waited.append(asked[1])

        def poll(self, timeout: float) -> bool:
            waited.append(timeout)
            return True

        def recv(self) -> tuple[bool, str]:
            return True, "done"

    limited = LimitedEstimator(object(), 2.0)  # type: ignore[arg-type]
    limited._process, limited._pipe = object(), Pipe()
    assert limited.estimate([object()] * 3, at_least_s=at_least_s) == "done"  # type: ignore[list-item, comparison-overlap]
    assert waited == [allowed_s, allowed_s]
