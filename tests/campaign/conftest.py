"""Small campaigns for tests, one of them with an estimator that notes down what it is asked."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd
import pytest

from simrail.campaign.campaign import run_campaign
from simrail.core.toml_files import shipped
from simrail.scenario.scenario import Scenario, load_scenario

SHORT = [
    "ride.end_m=70.0",
    "ride.acceleration_mps2=2.0",
    "ride.jerk_mps3=4.0",
    "ride.rest_s=1.0",
    "ride.final_rest_s=1.0",
    "imu.grade='lord_3dm_gx4_25'",
    "score.windows=['whole', 'moving']",
]

NOTING = """
import os
import time
import zlib
from dataclasses import dataclass
from pathlib import Path

from simrail.estimators.baselines import DesignAngles


@dataclass(frozen=True)
class Noting:
    "Notes each recording that it gets, and takes its time."
    sleep_s: float = 0.05
    causal = True

    def estimate(self, recording):
        if len(recording.imu) > 64:  # else it is asked to warm up
            with Path(os.environ["SIMRAIL_TEST_NOTES"]).open("a") as notes:
                notes.write(f"{os.getpid()} {zlib.crc32(recording.imu.to_numpy().tobytes())}\\n")
            time.sleep(self.sleep_s)
        return DesignAngles().estimate(recording)
"""


class Notes:
    """What the estimator `Noting` has noted: (process, recording), in order."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def __iter__(self) -> Iterator[tuple[int, str]]:
        lines = self.file.read_text().splitlines() if self.file.exists() else []
        yield from ((int(pid), recording) for pid, recording in map(str.split, lines))

    def repeated(self, *, main: int) -> int:
        """How often a recording was estimated from again, the main process's examples aside."""
        count = Counter(recording for pid, recording in self if pid != main)
        return sum(count.values()) - len(count)


@pytest.fixture
def rides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of rides of its own, for this process and all that it starts."""
    monkeypatch.setenv("SIMRAIL_RIDES", str(tmp_path / "rides"))
    return tmp_path / "rides"


@pytest.fixture
def notes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Notes:
    """What `Noting` notes, in any process."""
    monkeypatch.setenv("SIMRAIL_TEST_NOTES", str(tmp_path / "notes.txt"))
    return Notes(tmp_path / "notes.txt")


@pytest.fixture(scope="session")
def short() -> Callable[..., Scenario]:
    """A short scenario, with settings."""
    return lambda *settings: load_scenario("quick_kinematic", overrides=[*SHORT, *settings])


@pytest.fixture(scope="module")
def module_rides(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A cache of rides that the tests of a module share."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMRAIL_RIDES", str(tmp_path_factory.mktemp("rides")))
        yield


@pytest.fixture
def noting_file(tmp_path: Path, rides: Path, notes: Notes) -> Path:
    """A scenario file whose estimators are `Noting` and a filter: 2 rides of 4 cells."""
    return write_noting(tmp_path)


def write_noting(folder: Path) -> Path:
    """Write the scenario of `noting_file`, and its estimator."""
    (folder / "noting.py").write_text(NOTING)
    text = shipped("scenario")["quick_kinematic"].read_text()
    head = text[: text.index("[[estimator]]")]
    for old, new in (
        ("end_m = 590.0", "end_m = 70.0\nacceleration_mps2 = 2.0\njerk_mps3 = 4.0"),
        ("rest_s = 10.0", "rest_s = 1.0"),
        ("speed_kmh = 50.0", "speed_kmh = [30.0, 50.0]"),
        ("sensor_draws = 2", "sensor_draws = 4"),
        ('["lord_3dm_gx4_25", "ideal"]', '"lord_3dm_gx4_25"'),
    ):
        assert old in head
        head = head.replace(old, new, 1)
    head += '[[estimator]]\nname = "ekf"\nmethod = "AttitudeEkf"\n'
    head += '[[estimator]]\nname = "noting"\nmethod = "noting.py:Noting"\n'
    (folder / "mine.toml").write_text(head)
    return folder / "mine.toml"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, module_rides: None) -> pd.DataFrame:
    """Scores of an undisturbed run of `noting_file`."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("whole")
        patch.setenv("SIMRAIL_TEST_NOTES", str(folder / "notes.txt"))
        file = write_noting(folder)
        return run_campaign(load_scenario(file, overrides=["estimator.noting.options.sleep_s=0.0"])).scores


def _without_time(scores: pd.DataFrame) -> pd.DataFrame:
    return scores[scores["metric"] != "us_per_sample"].reset_index(drop=True)


@pytest.fixture(scope="session")
def assert_same() -> Callable[[pd.DataFrame, pd.DataFrame], None]:
    """Assert that two score tables are the same to the bit, order and categories included."""

    def judge(ours: pd.DataFrame, theirs: pd.DataFrame) -> None:
        assert len(ours) > 100
        pd.testing.assert_frame_equal(_without_time(ours), _without_time(theirs), check_exact=True)

    return judge


def is_alive(pid: int) -> bool:
    """Whether there is such a process."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
