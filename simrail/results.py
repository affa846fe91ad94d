"""Running a scenario and keeping what it found: the results folder, replaced as a whole or not at all.

Everything is written into a draft folder beside the final one, which takes its place when it is
complete; an interrupted run leaves the former results as they were, and what it had done beside them
(`simrail.campaign.checkpoint`). The manifest says what is needed
to make the results again, and nothing of the machine's folders or users.
"""

import json
import os
import platform
import shlex
import shutil
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from simrail.campaign.budget import budgets_of, ride_budget
from simrail.campaign.campaign import key_of, run_campaign
from simrail.campaign.cell import STAGES
from simrail.campaign.checkpoint import LOG, Checkpoint, Start, checkpoint_of
from simrail.campaign.progress import Watcher
from simrail.campaign.result import CampaignResult
from simrail.campaign.stored_results import StoredResults, read_results
from simrail.campaign.worker import BatchResult
from simrail.core.atomic_files import can_be_made, draft_of, restore
from simrail.core.csv_files import write_csv
from simrail.core.errors import InputError
from simrail.core.shown import Facts, Shown, names
from simrail.core.toml_files import label
from simrail.report.campaign.verdicts import groups_of
from simrail.report.pages.page import SETS_BESIDE, write_report
from simrail.report.tables.methods import method_styles
from simrail.report.words.verdicts import verdict_sentence
from simrail.scenario.cells import cells
from simrail.scenario.check import Plan, judge_scenario
from simrail.scenario.scenario import Scenario, load_scenario
from simrail.scoring.aggregate import aggregate

PACKAGES = (
    "simrail",
    "exudyn",
    "numpy",
    "scipy",
    "pandas",
    "numba",
    "pyarrow",
    "vqf",
    "imufusion",
)
MANIFEST = "manifest.json"


@dataclass(frozen=True, repr=False)
class Results(Shown):
    """What `run` returns: the campaign's tables, the manifest, and the folder that holds them.

    ``budgets`` say what errors are made of, where a requirement asks for it
    (`simrail.campaign.budget.budgets_of`).
    """

    folder: Path
    scenario: Scenario
    campaign: CampaignResult
    manifest: dict[str, Any]
    budgets: pd.DataFrame

    @property
    def scores(self) -> pd.DataFrame:
        """The score table, columns `simrail.scoring.table.SCORE_COLUMNS`."""
        return self.campaign.scores

    @property
    def report(self) -> Path:
        """The page."""
        return self.folder / "report.html"

    def _facts(self) -> Facts:
        facts = {
            "scenario": self.scenario.title,
            "cells": f"{len(self.campaign.cells):,}, {len(self.campaign.failures)} failed",
            "scores": f"{len(self.scores):,} rows",
            "methods": names(self.scores["estimator"].unique()),
            "report": self.report.as_posix(),
        }
        return self.scenario.name, facts


def run(
    scenario: str | Path | Scenario,
    *,
    out: str | Path | None = None,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    workers: int | None = None,
    cluster: str | None = None,
    start: Start = "auto",
    beside: str | Path | None = None,
    watcher: Watcher | None = None,
    many: bool = False,
    budget_draws: int = 0,
) -> Results:
    """Run a scenario: simulate, record, estimate, score, and write the results.

    Parameters
    ----------
    scenario : str, Path or Scenario
        Name of a shipped scenario, path of a file, or a scenario that has been read.
    out : str or Path, optional
        Folder of the results; ``results/<name>`` if not given. Former results there are replaced.
    seed : int, optional
        Replaces the scenario's seed.
    overrides : sequence of str, optional
        Settings ``key=value`` that replace what the file says.
    workers, cluster : int, str, optional
        Who runs it, see `simrail.campaign.executors.executor_of`.
    start : {"auto", "resume", "fresh", "retry-failed"}, optional
        Whether to go on with an unfinished run of the same plan: if there is one, in any case, or not; or
        to run the failed cells of finished results again.
    beside : str or Path, optional
        Folder of other results that the page sets beside these, of the same publication
        (`simrail.report.pages.page.SETS_BESIDE`).
    watcher : Watcher, optional
        Is told of the progress.
    many : bool
        Accept more cells than `simrail.scenario.check.MOST_CELLS`.
    budget_draws : int
        Over how many draws it is found out what the error of the first method is made of
        (`simrail.campaign.budget.ride_budget`); 0 for not at all.

    Returns
    -------
    Results
        Cells that failed are rows of ``campaign.scores`` whose status is the reason.

    Raises
    ------
    InputError
        If the scenario cannot be run, or the folder is not one of results; nothing has been written. Or if
        there is nothing to resume, or to retry, or nothing that could stand beside.
    OSError
        If a disk is full, or the cluster has gone; what is done is kept, and gone on with by the next run.
    """
    started, begun = datetime.now(UTC), time.perf_counter()
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario, overrides=overrides, seed=seed)
    elif overrides or seed is not None:
        raise TypeError("settings go to load_scenario when the scenario has been read already")
    folder = Path(out) if out is not None else Path("results") / scenario.name
    if restore(folder) and watcher is not None:
        watcher.told(f"former results were put back into {folder}: a run ended while it replaced them")
    _judge_folder(folder)
    other = _other_results(Path(beside), scenario, folder) if beside is not None else None
    plan = judge_scenario(scenario, many=many, progress=None if watcher is None else watcher.judging)
    key = key_of(plan)
    with checkpoint_of(folder, key, start=start) as checkpoint:
        if start == "retry-failed":
            keep_good(folder, plan, key, checkpoint)
        campaign = run_campaign(
            plan, workers=workers, cluster=cluster, checkpoint=checkpoint, watcher=watcher
        )
        _tell_verdicts(campaign, watcher)
        budgets = budgets_of(plan, campaign.verdicts, watcher=watcher)
        if budget_draws:
            budgets = pd.concat(
                [budgets, ride_budget(plan, budget_draws, watcher=watcher)], ignore_index=True
            )
        manifest = describe(scenario, campaign)
        manifest |= {"started_utc": started.isoformat(timespec="seconds"), "key": key}
        if budget_draws:
            manifest["command"] += f" --budget {budget_draws}"
        if other is not None:
            names = ("scenario", "scenario_hash", "seed", "started_utc", "git_revision")
            manifest["beside"] = {name: other.manifest.get(name) for name in names}
            manifest["command"] += f" --beside {shlex.quote(label(other.folder))}"
        with draft_of(folder) as draft:
            told = None if watcher is None else watcher.works
            _write(
                draft, scenario, campaign, manifest, begun=begun, beside=other, budgets=budgets, progress=told
            )
            shutil.copyfile(checkpoint.folder / LOG, draft / LOG)
        checkpoint.remove()
    return Results(folder, scenario, campaign, manifest, budgets)


def run_cell(
    scenario: str | Path,
    cell: int,
    *,
    out: str | Path | None = None,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    watcher: Watcher | None = None,
) -> CampaignResult:
    """Run one cell of a scenario alone: the same scores, to the bit, as in the table of them all.

    Parameters
    ----------
    scenario, seed, overrides, watcher
        As for `run`.
    cell : int
        Its number in the score table.
    out : str or Path, optional
        Folder of its results, as `run` writes them; nothing is written if not given.

    Raises
    ------
    InputError
        As for `run`, or if there is no such cell.
    """
    started, begun = datetime.now(UTC), time.perf_counter()
    read = load_scenario(scenario, overrides=overrides, seed=seed)
    if out is not None:
        restore(Path(out))
        _judge_folder(Path(out))
    plan = judge_scenario(read)
    if not 0 <= cell < plan.cells:
        raise InputError(
            "the scenario has no such cell", field="--cell", value=cell, limit=f"0 to {plan.cells - 1}"
        )
    campaign = run_campaign(plan, only=cell, watcher=watcher)
    if out is not None:
        manifest = describe(read, campaign)
        manifest["started_utc"] = started.isoformat(timespec="seconds")
        manifest["command"] += f" --cell {cell}"
        with draft_of(Path(out)) as draft:
            told = None if watcher is None else watcher.works
            _write(draft, read, campaign, manifest, begun=begun, progress=told)
    return campaign


def _other_results(folder: Path, scenario: Scenario, out: Path) -> StoredResults:
    """Results to stand beside those of a scenario; of the same publication, or the page has no place."""
    remedy = "run that scenario first, and name the folder of its results"
    if folder.resolve() == out.resolve():
        problem = "these results would be replaced by those that they are to stand beside"
        raise _refusal("--beside", folder, problem, f"{remedy}, or choose another folder with --out")
    results = read_results(folder, field="--beside", remedy=remedy)
    paper = scenario.spec.paper
    if paper not in SETS_BESIDE or results.scenario().spec.paper != paper:
        problem = f"the page of {scenario.name} has no place for results of {results.manifest['scenario']}"
        limit = f"two scenarios with the same paper, one of {', '.join(SETS_BESIDE)}"
        remedy = "run it without --beside; each page stands for itself"
        raise _refusal("--beside", folder, problem, remedy, limit=limit)
    return results


def _refusal(option: str, folder: Path, problem: str, remedy: str, *, limit: str | None = None) -> InputError:
    """What is wrong with a folder that an option names."""
    return InputError(problem, field=option, value=str(folder), limit=limit, remedy=remedy)


def _write(
    draft: Path,
    scenario: Scenario,
    campaign: CampaignResult,
    manifest: dict[str, Any],
    *,
    begun: float,
    beside: StoredResults | None = None,
    budgets: pd.DataFrame | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> None:
    """Write the results of a campaign into a folder."""
    campaign.scores.to_parquet(draft / "scores.parquet", index=False)
    campaign.cells.to_parquet(draft / "cells.parquet", index=False)
    write_csv(aggregate(campaign.scores, campaign.cells), draft / "scores.csv")
    verdicts = campaign.verdicts
    if len(verdicts):
        write_csv(verdicts, draft / "verdicts.csv")
    if budgets is not None and len(budgets):
        write_csv(budgets, draft / "budget.csv")
    drawing = time.perf_counter()
    write_report(
        draft / "report.html",
        scenario=scenario,
        scores=campaign.scores,
        cells=campaign.cells,
        examples=campaign.examples,
        manifest=manifest,
        beside=beside,
        budgets=budgets,
        progress=progress,
    )
    ended = time.perf_counter()
    manifest["wall_s"] |= {"report": ended - drawing, "total": ended - begun}
    (draft / MANIFEST).write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
    if campaign.failures:
        (draft / "failures.txt").write_text(_failures(campaign), encoding="utf-8")


def describe(scenario: Scenario, campaign: CampaignResult) -> dict[str, Any]:
    """Make the manifest: plain values that say what was run, with what, and how long it took."""
    factors = [ride["real_time_factor"] for ride in campaign.rides if "real_time_factor" in ride]
    spec = scenario.spec
    versions = {package: version(package) for package in PACKAGES}
    return {
        "scenario": scenario.name,
        "title": scenario.title,
        "scenario_hash": campaign.plan.content_hash,
        "seed": spec.seed,
        "settings": list(scenario.overrides),
        "command": scenario.command,
        "engine": sorted({str(ride["engine"]) for ride in campaign.rides}),
        "earth": "at rest" if spec.earth is None else spec.earth.model_dump(mode="json", warnings=False),
        "temperature": spec.temperature and spec.temperature.model_dump(mode="json", warnings=False),
        "real_time_factor": min(factors) if factors else None,
        "rides": campaign.rides,
        "cells": len(campaign.cells),
        "failed": len(campaign.failures),
        "failures": [
            {"cell": failure.cell, "estimator": failure.estimator, "reason": failure.reason}
            for failure in campaign.failures
        ],
        "stop": None if campaign.stopped is None else campaign.stopped.record,
        "warnings": campaign.warnings,
        "wall_s": dict(campaign.wall_s),
        "cpu_s": dict(campaign.cpu_s),
        "versions": {"python": platform.python_version(), **versions},
        "git_revision": git_revision(),
        "platform": {
            "system": platform.system(),
            "machine": platform.machine(),
            "cores": os.cpu_count(),
        },
        "scenario_text": scenario.text,
    }


def git_revision() -> str | None:
    """Revision of the source tree that simrail runs from, ``+`` if it was changed; None outside git."""
    source = Path(__file__).resolve().parents[1]
    if not (source / ".git").exists():
        return None
    # No tag, whatever its name, stands in the place of the hash.
    command = ["git", "-C", str(source), "describe", "--always", "--exclude=*", "--abbrev=12", "--dirty=+"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None


def _is_there(folder: Path) -> bool:
    try:
        return folder.exists()
    except (OSError, ValueError):  # by such a name there can be none
        return False


def _tell_verdicts(campaign: CampaignResult, watcher: Watcher | None) -> None:
    """Say what has been settled before the error is taken apart, which takes as long again and more."""
    scenario = campaign.plan.scenario
    if (
        watcher is None
        or campaign.verdicts.empty
        or not any(one.budget_draws for one in scenario.spec.require)
    ):
        return
    styles = list(method_styles(scenario).values())
    for _, _, _, rows in groups_of(campaign.verdicts):
        watcher.told(verdict_sentence(rows, styles))
    watcher.told("what the error is made of follows")


def _judge_folder(folder: Path) -> None:
    """Refuse a folder that cannot be written, or whose contents are not results."""
    remedy = "choose another folder with --out"
    if _is_there(folder):
        if not folder.is_dir():
            problem, limit = "the results need a folder, this is a file", "a new or empty folder"
            raise _refusal("--out", folder, problem, remedy, limit=limit)
        if any(folder.iterdir()) and not (folder / MANIFEST).is_file():
            problem = "the folder holds other things than results, and would be replaced"
            limit = f"a new or empty folder, or one that holds a {MANIFEST}"
            raise _refusal("--out", folder, problem, remedy, limit=limit)
    if not can_be_made(folder):
        limit = "a folder that may be written to, by a name of at most 255 bytes"
        raise _refusal("--out", folder, "the folder cannot be written", remedy, limit=limit)


def _failures(campaign: CampaignResult) -> str:
    """Tracebacks of what failed, each once, for the author of the part that failed."""
    cells_of: dict[str, list[str]] = {}
    for failure in campaign.failures:
        cells_of.setdefault(failure.trace, []).append(f"cell {failure.cell}, {failure.estimator}")
    home = str(Path.home())
    parts = [f"{'; '.join(names)}\n\n{trace}" for trace, names in cells_of.items()]
    return "\n".join(parts).replace(home, "~")


def keep_good(results: Path, plan: Plan, key: str, checkpoint: Checkpoint) -> None:
    """Keep the cells of finished results that did not fail.

    Parameters
    ----------
    results : Path
        Folder of the results.
    plan, key : Plan, str
        What is run, and its key.
    checkpoint : Checkpoint
        Where they are kept.

    Raises
    ------
    InputError
        If there are no results of this plan, or nothing in them failed.
    """
    option = "--retry-failed"
    former = read_results(results, field=option, remedy="run it without --retry-failed")
    manifest, scores = former.manifest, former.scores
    if manifest.get("key") != key:
        problem = "the results there are of another plan, or were made by other code"
        remedy = "run it without --retry-failed; rows of different code do not belong together"
        raise _refusal(option, results, problem, remedy)
    failed = {failure["cell"] for failure in manifest["failures"]}
    if not failed:
        raise _refusal(option, results, "nothing failed there", "there is nothing to do")
    good = set(scores["cell"]) - failed  # a run that its stop rule ended has not all cells
    rides = {ride["number"]: ride for ride in manifest["rides"]}
    good_of_ride: dict[int, list[int]] = {}
    for cell in cells(plan.scenario):
        if cell.number in good:
            good_of_ride.setdefault(cell.ride_number, []).append(cell.number)
    wall, cpu = ({stage: manifest[name][stage] for stage in STAGES} for name in ("wall_s", "cpu_s"))
    for ride_number, numbers in good_of_ride.items():
        rows = scores[scores["cell"].isin(numbers)].reset_index(drop=True)
        ride = rides.get(ride_number, {})
        checkpoint.add(BatchResult(tuple(numbers), ride_number, rows, (), ride, wall, cpu))
        wall = cpu = dict.fromkeys(STAGES, 0.0)
