"""The command line: what it prints, writes and returns; results are replaced as a whole or not at all."""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

import simrail
from simrail import results
from simrail.cli.main import CELL_FAILED, DONE, INTERRUPTED, call
from simrail.core.toml_files import shipped
from simrail.scoring.table import SCORE_COLUMNS

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
SETTINGS = [
    "ride.end_m=200.0",
    "ride.acceleration_mps2=2.0",
    "ride.rest_s=1.0",
    "imu.grade='lord_3dm_gx4_25'",
]
QUICK = [word for setting in SETTINGS for word in ("--set", setting)]
FILES = {"manifest.json", "scores.parquet", "scores.csv", "cells.parquet", "report.html", "run.log"}

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.fixture
def no_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Spare the figures of the report, where it does not matter what is drawn."""

    def write(path: Path, **keywords: object) -> None:
        known = {"scenario", "scores", "cells", "examples", "manifest", "beside", "budgets", "progress"}
        assert set(keywords) == known
        path.write_text("<html></html>")

    monkeypatch.setattr(results, "write_report", write)


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_version_and_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["--version"]) == DONE
    assert re.fullmatch(r"simrail \d+\.\d+\.\d+\S*\n", capsys.readouterr().out)
    assert call(["list"]) == DONE
    text = capsys.readouterr().out
    for word in ("go20a", "condequinto_olivar", "metro_irw_bogie", "lord_3dm_gx4_25", "AttitudeEkf", "ideal"):
        assert word in text
    assert "Extended Kalman filter" in text  # a title, read without importing the class
    assert "cannot be read" not in text and "not installed" not in text
    assert "\N{HORIZONTAL ELLIPSIS}" not in text and "attitude of its front axle" in text  # titles are whole
    assert call(["run", "--help"]) == DONE
    assert "results/<name>" in " ".join(capsys.readouterr().out.split())


def test_run_writes_everything_and_replaces_former_results(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    former = here / "results" / "quick_kinematic"
    former.mkdir(parents=True)
    (former / "manifest.json").write_text("{}")
    (former / "stale.csv").write_text("old")
    assert call(["run", "quick_kinematic", *QUICK, "--seed", "5"]) == DONE
    printed = capsys.readouterr().out
    assert "ekf_compensated" in printed and "design_angles *" in printed and "report.html" in printed
    assert names_in(here / "results") == {"quick_kinematic"}
    assert names_in(former) == FILES
    scores = pd.read_parquet(former / "scores.parquet")
    assert list(scores.columns) == list(SCORE_COLUMNS) and isinstance(
        scores["metric"].dtype, pd.CategoricalDtype
    )
    cells = pd.read_parquet(former / "cells.parquet")
    assert sorted(scores["cell"].unique()) == sorted(cells["cell"]) == [0, 1]
    table = pd.read_csv(former / "scores.csv")
    wanted = "estimator == 'ekf_compensated' and quantity == 'roll' and reference == 'truth'"
    wanted += " and window == 'whole' and metric == 'rms'"
    (row,) = table.query(wanted).itertuples()
    assert row.draws == 2 and row.value == pytest.approx(scores.query(wanted)["value"].mean(), rel=1e-8)
    assert "<html" in (former / "report.html").read_text(encoding="utf-8")[:200]

    manifest = json.loads((former / "manifest.json").read_text())
    assert manifest["seed"] == 5 and manifest["scenario_text"] == GOOD
    assert manifest["command"].startswith("simrail run quick_kinematic --set 'ride.end_m=200.0'")
    assert set(manifest["wall_s"]) == {"simulate", "measure", "estimate", "score", "report", "total"}
    assert all(seconds >= 0 for seconds in manifest["wall_s"].values())
    assert manifest["versions"]["exudyn"] and manifest["cells"] == 2 and manifest["failed"] == 0
    text = json.dumps(manifest)
    for path in (str(here), str(Path.home()), str(Path(simrail.__file__).parent)):
        assert path not in text or path == "/"


@pytest.mark.usefixtures("no_drawing")
def test_table_has_no_empty_columns_and_tells_of_the_odometry(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The ride ends before the curve begins: nothing is said of curves."""
    assert call(["run", "quick_kinematic", *QUICK, "--set", "ride.end_m=120.0"]) == DONE
    printed = " ".join(capsys.readouterr().out.split())
    assert "whole" in printed and "curve " not in printed and " - " not in printed
    assert re.search(r"the odometry's position error is [0-9.e-]+ m rms", printed)


@pytest.mark.usefixtures("no_drawing")
def test_run_into_a_folder_of_choice(here: Path) -> None:
    assert call(["run", "quick_kinematic", *QUICK, "--out", "a/b"]) == DONE
    assert names_in(here / "a" / "b") == FILES and names_in(here) == {"a"}


@pytest.mark.usefixtures("no_drawing")
def test_failed_cell_gives_code_1_and_its_reason(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "bad.py").write_text(
        "from dataclasses import dataclass\n\n\n@dataclass(frozen=True)\nclass Bad:\n    causal = True\n\n"
        "    def estimate(self, recording):\n        raise ZeroDivisionError('no gain')\n"
    )
    (here / "mine.toml").write_text(GOOD + '\n[[estimator]]\nname = "bad"\nmethod = "bad.py:Bad"\n')
    assert call(["run", "mine.toml", *QUICK]) == CELL_FAILED
    assert "ZeroDivisionError: no gain" in capsys.readouterr().out
    folder = here / "results" / "mine"
    assert names_in(folder) == FILES | {"failures.txt"}
    text = (folder / "failures.txt").read_text()
    assert "cell 0, bad; cell 1, bad" in text or text.count("no gain") == 2
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["failed"] == 2
    assert manifest["failures"][0] == {"cell": 0, "estimator": "bad", "reason": "ZeroDivisionError: no gain"}


@pytest.mark.parametrize(
    ("fault", "code"),
    [(KeyboardInterrupt(), INTERRUPTED), (OSError(28, "No space left on device"), CELL_FAILED)],
)
@pytest.mark.usefixtures("no_drawing")
def test_former_results_survive_a_fault_while_writing(
    fault: BaseException,
    code: int,
    here: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert call(["run", "quick_kinematic", *QUICK]) == DONE
    folder = here / "results" / "quick_kinematic"
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    capsys.readouterr()

    def fail(*arguments: object, **keywords: object) -> None:
        raise fault

    monkeypatch.setattr(results, "write_report", fail)
    assert call(["run", "quick_kinematic", *QUICK, "--seed", "3"]) == code
    message = capsys.readouterr().err.splitlines()[-1]
    assert "former results" in message and "Traceback" not in message
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    # What was done lies beside them, and a run of the same plan makes the results of it.
    (unfinished,) = names_in(here / "results") - {"quick_kinematic"}
    assert unfinished.startswith(".quick_kinematic.unfinished-")
    monkeypatch.undo()
    monkeypatch.chdir(here)
    monkeypatch.setattr(results, "write_report", lambda path, **keywords: path.write_text("<html></html>"))
    assert call(["run", "quick_kinematic", *QUICK, "--seed", "3", "--resume"]) == DONE
    assert "2 of 2 cells are done" in capsys.readouterr().err
    assert names_in(here / "results") == {"quick_kinematic"} and names_in(folder) == FILES


def test_draft_takes_the_place_in_one_step_and_former_comes_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "x"
    with results.draft_of(folder) as draft:
        (draft / "a").write_text("1")
        assert not folder.exists()
    assert names_in(folder) == {"a"} and names_in(tmp_path) == {"x"}
    real = Path.replace

    def refuse(self: Path, target: Path) -> Path:
        if self.name.endswith(".draft"):
            raise OSError("cannot rename")
        return real(self, target)

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(OSError, match="cannot rename"), results.draft_of(folder) as draft:
        (draft / "b").write_text("2")
    assert names_in(folder) == {"a"} and names_in(tmp_path) == {"x"}


def test_drafts_of_killed_runs_are_cleared(tmp_path: Path) -> None:
    old, young = tmp_path / ".x.1.draft", tmp_path / ".x.2.draft"
    for draft in (old, young):
        draft.mkdir()
    os.utime(old, (time.time() - 2 * 86400,) * 2)
    with results.draft_of(tmp_path / "x"):
        assert not old.exists() and young.exists()


def test_check_says_what_will_be_run(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["check", "quick_kinematic", "--set", "ride.end_m=100.0"]) == DONE
    captured = capsys.readouterr()
    assert (
        "quick_kinematic: fine" in captured.out
        and "1 ride of" in captured.out
        and "4 recordings" in captured.out
    )
    assert captured.err.startswith("warning: ride[0] (out): reaches")


@pytest.mark.parametrize("kind", ["estimator", "track", "vehicle", "imu", "scenario"])
@pytest.mark.usefixtures("no_drawing")
def test_templates_work_as_written(kind: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["new", kind, "my_part"]) == DONE
    said = capsys.readouterr().out
    suffix = "py" if kind == "estimator" else "toml"
    assert f"my_part.{suffix}" in said
    assert ("look at it: simrail" in said) == (kind in ("vehicle", "imu"))
    before = (here / f"my_part.{suffix}").read_bytes()
    assert call(["new", kind, "my_part"]) == 2  # never written over
    assert (here / f"my_part.{suffix}").read_bytes() == before
    settings = {
        "estimator": ["estimator[2].method=my_part.py:MyPart"],
        "track": ["track=./my_part.toml"],
        "vehicle": ["vehicle=./my_part.toml"],
        "imu": ["imu.grade=./my_part.toml"],
        "scenario": [],
    }[kind]
    (here / "mine.toml").write_text(GOOD)
    scenario = "my_part.toml" if kind == "scenario" else "mine.toml"
    options = [word for setting in settings for word in ("--set", setting)]
    assert call(["check", scenario, *options]) == DONE
    if kind == "estimator":
        assert call(["run", scenario, *QUICK, *options, "--set", "monte_carlo.sensor_draws=1"]) == DONE
        scores = pd.read_parquet(here / "results" / "mine" / "scores.parquet")
        rms = scores.query("estimator == 'design_angles' and metric == 'rms' and window == 'whole'")
        roll = rms.query("quantity == 'roll' and reference == 'truth'")["value"].item()
        assert 0.0 < roll < 5.0


def test_estimator_template_is_a_good_estimator(here: Path) -> None:
    from importlib.util import module_from_spec, spec_from_file_location

    from simrail.campaign.campaign import run_campaign
    from simrail.estimation.conformance import check_estimator
    from simrail.scenario.scenario import load_scenario

    assert call(["new", "estimator", "my_filter"]) == DONE
    options = ["--line-length=100", "--config", 'lint.isort.known-first-party=["simrail"]']
    subprocess.run([sys.executable, "-m", "ruff", "check", *options, "my_filter.py"], check=True)
    spec = spec_from_file_location("my_filter", here / "my_filter.py")
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules["my_filter"] = module
    spec.loader.exec_module(module)
    example = run_campaign(load_scenario("quick_kinematic", overrides=SETTINGS)).examples[0]
    check_estimator(module.MyFilter(), example.recording)


def test_the_cache_is_told_in_megabytes_of_each_ride_and_of_all(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    held = [
        SimpleNamespace(key=key * 16, name=f"ride {key}", size_bytes=size)
        for key, size in (("a", 12e6), ("b", 3e6))
    ]
    monkeypatch.setattr("simrail.ride.cache.rides", lambda: held)
    monkeypatch.setattr("simrail.ride.cache.limit_bytes", lambda: 20e9)
    assert call(["cache"]) == DONE
    one, other, total = capsys.readouterr().out.splitlines()
    assert one.split() == ["12", "MB", "a" * 12, "ride", "a"] and other.split()[:2] == ["3", "MB"]
    assert total.startswith("2 rides, 15 MB of at most 20 GB (SIMRAIL_CACHE_GB), in ")


@pytest.mark.usefixtures("no_drawing")
def test_cache_is_shown_and_cleared(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["run", "quick_kinematic", *QUICK, "--set", "ride.speed_kmh=33"]) == DONE
    capsys.readouterr()
    assert call(["cache"]) == DONE
    text = capsys.readouterr().out
    assert re.search(r"\d+ MB  [0-9a-f]{12}  out", text) and "SIMRAIL_CACHE_GB" in text
    assert call(["cache", "--clear"]) == DONE
    assert call(["cache"]) == DONE
    assert "0 rides, 0 MB" in capsys.readouterr().out


def test_public_names_are_there() -> None:
    for name in simrail.__all__:
        assert getattr(simrail, name) is not None
    assert callable(simrail.measure) and callable(simrail.score) and callable(simrail.run)
    assert sorted(simrail._HOME_OF) == list(simrail.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = simrail.nothing


def test_light_commands_import_nothing_heavy() -> None:
    code = (
        "import sys\nfrom simrail.cli.main import call\ncall(['--version'])\ncall(['list'])\n"
        "heavy = {'numba', 'pandas', 'scipy', 'exudyn', 'matplotlib'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def processor_s(*words: str) -> float:
    """Least time on the processor of three runs of Python, s; a wall's clock tells of other work as well."""
    seconds = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *words], check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    return min(seconds)


def test_light_commands_answer_at_once() -> None:
    """About as fast as pandas alone is imported (0.3 and 0.8 of it), whatever the machine."""
    peer = processor_s("-c", "import pandas")
    for command in ("--version", "list"):
        assert processor_s("-m", "simrail", command) < 1.5 * peer, command


@pytest.mark.slow
def test_interrupted_process_leaves_results_and_cache_sound(tmp_path: Path) -> None:
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    former = tmp_path / "results" / "go20a"
    former.mkdir(parents=True)
    (former / "manifest.json").write_text("{}")
    process = subprocess.Popen(
        [sys.executable, "-m", "simrail", "run", "go20a"],
        cwd=tmp_path,
        env=environment,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    drafts = tmp_path / "cache" / "simrail" / "rides"
    for _ in range(1200):
        if any(drafts.glob(".*/*")):
            break
        time.sleep(0.1)
    time.sleep(5.0)
    process.send_signal(signal.SIGINT)
    _, text = process.communicate(timeout=60)
    assert process.returncode == INTERRUPTED
    assert text.splitlines()[-1].startswith("simrail: interrupted")
    assert "Traceback" not in text
    assert names_in(former) == {"manifest.json"} and names_in(tmp_path / "results") == {"go20a"}
    assert not any(drafts.iterdir())


OWN = """
print("this ran")
from simrail.estimators.baselines import DesignAngles as Mine
"""


def test_check_says_that_it_runs_a_file_and_judges_without(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "mine.py").write_text(OWN)
    text = (
        simrail.load_scenario("quick_kinematic").text
        + '\n[[estimator]]\nname = "own"\nmethod = "mine.py:Mine"\n'
    )
    (here / "own.toml").write_text(text)
    assert call(["check", "own.toml", *QUICK, "--no-plugins"]) == DONE
    told = capsys.readouterr()
    assert (
        "this ran" not in told.out and "judged without mine.py" in told.err and "own" not in told.out.split()
    )
    assert call(["check", "own.toml", *QUICK]) == DONE
    told = capsys.readouterr()
    assert "loading mine.py, which runs its code" in told.err and "this ran" in told.out
