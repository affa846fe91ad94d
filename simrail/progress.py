"""What the command line shows of a run: progress bars while it goes, a score table at its end."""

from __future__ import annotations

import time
from datetime import timedelta
from types import TracebackType
from typing import Self

import pandas as pd
from rich import box
from rich.console import Console, Group
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from simrail.campaign_result import CampaignResult
from simrail.report.methods import MethodStyle, method_styles
from simrail.results import Results
from simrail.scenario.cells import methods
from simrail.score_table import OK
from simrail.watcher import Watcher

COLUMNS = (
    ("roll", "truth", "whole"),
    ("roll", "truth", "curve"),
    ("roll", "design", "curve"),
    ("pitch", "truth", "whole"),
    ("pitch", "truth", "curve"),
    ("pitch", "design", "curve"),
)
MOST_GROUPS = 12
_EVERY_S = 10.0
"""On a plain stream, how often the progress is told."""


class ProgressWatcher(Watcher):
    """Shows simulated time, speed and time left; on a plain stream, a line per stage."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            TextColumn("{task.fields[note]}"),
            TimeElapsedColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._ride: TaskID | None = None
        self._cells: TaskID | None = None
        self._begun = self._cells_begun = self._said = 0.0
        self._before = self._done = 0
        self._by_worker: dict[str, int] = {}
        self._searches: dict[str, TaskID] = {}

    def __enter__(self) -> Self:
        self._progress.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.__exit__(kind, error, trace)

    def ride_begins(self, number: int, count: int, name: str) -> None:
        """See `Watcher`."""
        if self._ride is not None:
            self._progress.remove_task(self._ride)
        which = f" {number}/{count}" if count > 1 else ""
        self._ride = self._progress.add_task(f"ride {name}{which}", total=None, note="")
        self._begun = time.perf_counter()
        if not self._console.is_terminal:
            self._console.print(f"ride {name}{which}", highlight=False)

    def ride_goes(self, done_s: float, total_s: float, speed_mps: float) -> None:
        """See `Watcher`."""
        if self._ride is None:
            return
        wall = max(time.perf_counter() - self._begun, 1e-6)
        left = (total_s - done_s) * wall / max(done_s, 1e-6)
        note = (
            f"{done_s:.0f} of {total_s:.0f} s, {done_s / wall:.1f} x real time, "
            f"{3.6 * abs(speed_mps):3.0f} km/h, {left:.0f} s left"
        )
        self._progress.update(self._ride, total=total_s, completed=done_s, note=note)

    def ride_ends(self) -> None:
        """See `Watcher`."""
        if self._ride is not None:
            self._progress.update(self._ride, total=1.0, completed=1.0, note="running its cells")

    def cells_begin(self, done: int, count: int) -> None:
        """See `Watcher`."""
        self._before = self._done = done
        self._cells_begun = self._said = time.perf_counter()
        if self._cells is not None:
            self._progress.remove_task(self._cells)
        self._cells = self._progress.add_task("cells", total=count, completed=done, note="")

    def cells_done(self, done: int, count: int, failed: int, worker: str) -> None:
        """See `Watcher`."""
        now = time.perf_counter()
        self._by_worker[worker] = self._by_worker.get(worker, 0) + done - self._done
        self._done = done
        seconds = max(now - self._cells_begun, 1e-6)
        left = (count - done) * seconds / max(done - self._before, 1)
        each = "+".join(map(str, self._by_worker.values()))
        by = f", by {len(self._by_worker)} workers: {each}" if len(self._by_worker) > 1 else ""
        note = (
            f"{done} of {count}, {failed} failed, {(done - self._before) / seconds:.3g} per second, "
            f"{timedelta(seconds=round(left))} left{by}"
        )
        if self._cells is not None:
            self._progress.update(self._cells, completed=done, note=note)
        if not self._console.is_terminal and (now > self._said + _EVERY_S or done == count):
            self._said = now
            self._console.print(f"cells: {note}", highlight=False, soft_wrap=True)

    def told(self, line: str) -> None:
        """See `Watcher`."""
        self._console.print(line, highlight=False, soft_wrap=True)

    def recording_written(self, number: int, count: int, name: str) -> None:
        """See `Watcher`."""
        if self._ride is not None:
            self._progress.update(self._ride, note=f"{number} of {count} recordings written, {name}")
        if not self._console.is_terminal:
            self._console.print(f"wrote {name} ({number} of {count})", highlight=False)

    def search_goes(self, name: str, evaluations: int, value: float) -> None:
        """See `Watcher`."""
        if self._searches.get(name) is None:
            self._searches[name] = self._progress.add_task(f"search, {name}", total=None, note="")
            if not self._console.is_terminal:
                self._console.print(f"search, {name}", highlight=False)
        note = f"{evaluations} evaluations, {value:.6f}"
        self._progress.update(self._searches[name], note=note)


def print_scores(console: Console, results: Results) -> None:
    """Print the score table: one block per ride and IMU, one row per estimator, RMS over all draws."""
    campaign = results.campaign
    scores, cells = campaign.scores, campaign.cells
    styles = method_styles(methods(results.scenario))
    for number, (_, members) in enumerate(cells.groupby("case", sort=True)):
        if number == MOST_GROUPS:
            console.print(f"... and {cells['case'].nunique() - number} more cases: see scores.csv")
            break
        console.print(_block(scores[scores["cell"].isin(members["cell"])], members, styles))
    if campaign.stopped is not None:
        # What was not reached is to be seen; what was, is no less than what was asked for.
        colour = "green" if campaign.stopped.reached else "yellow"
        console.print(Text(campaign.stopped.words, style=colour), soft_wrap=True)
    for warning in campaign.plan.warnings:
        console.print(f"[yellow]warning:[/yellow] {warning}", highlight=False)
    reasons = list(dict.fromkeys((failure.estimator, failure.reason) for failure in campaign.failures))
    for estimator, reason in reasons[:10]:
        console.print(f"[red]failed:[/red] {estimator}: {reason}", highlight=False)
    wall = results.manifest["wall_s"]
    factor = results.manifest["real_time_factor"]
    speed = f", engine at {factor:.1f} x real time" if factor else ""
    console.print(
        f"{wall['total']:.1f} s{speed}. Report: {results.folder / 'report.html'}",
        highlight=False,
        soft_wrap=True,
    )


def print_cell(console: Console, campaign: CampaignResult) -> None:
    """Print every score of one cell."""
    first = campaign.cells.iloc[0]
    console.print(
        f"[bold]cell {first['cell']}[/bold]: ride {first['ride']}, {first['imu']} on {first['mount']}"
    )
    columns = ["estimator", "quantity", "band", "reference", "window", "metric", "value", "unit", "status"]
    print(campaign.scores[columns].to_string(index=False, float_format=lambda value: f"{value:.9g}"))


def _block(rows: pd.DataFrame, members: pd.DataFrame, styles: dict[str, MethodStyle]) -> Group:
    """Table of one case: RMS errors in degrees, the mean over its draws."""
    first = members.iloc[0]
    draws = f", mean of {len(members)} draws" if len(members) > 1 else ""
    # Title and notes stand outside of the table, which may be narrow.
    title = Text(
        f"{first['ride']}: {first['speed_kmh']:g} km/h {first['direction']}, "
        f"{first['imu']} on {first['mount']}, odometry: {first['odometry']}{draws}",
        style="bold",
    )
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    good = rows[rows["status"] == OK]
    keys = ["estimator", "quantity", "reference", "window", "metric"]
    mean = good.groupby(keys, observed=True)["value"].mean()
    # A ride without curves has no columns of them.
    columns = [column for column in COLUMNS if any((name, *column, "rms") in mean for name in styles)]
    table.add_column("RMS error, deg")
    for quantity, reference, window in columns:
        against = "" if reference == "truth" else "\nvs design"
        table.add_column(f"{quantity}\n{window}{against}", justify="right")
    table.add_column("us per\nsample", justify="right")
    marked = False
    for name, style in styles.items():
        values = [mean.get((name, *column, "rms")) for column in columns]
        time_us = mean.get((name, "roll", "truth", "whole", "us_per_sample"))
        numbers = ["-" if value is None else f"{value:.3f}" for value in values]
        marked = marked or bool(style.baseline)
        table.add_row(
            f"{name}{' *' if style.baseline else ''}",
            *numbers,
            "-" if time_us is None else f"{time_us:.2f}",
            style="dim" if style.baseline else None,
        )
    notes = ["* baseline"] if marked else []
    astray = mean.get((f"odometry:{first['odometry']}", "position", "truth", "whole", "rms"))
    if astray is not None and first["odometry"] != "truth":
        notes.append(f"the odometry's position error is {astray:.3g} m rms")
    in_curves = {name: mean.get((name, *COLUMNS[1], "rms")) for name in styles}
    for name, style in styles.items():
        beaten = [
            other
            for other, value in in_curves.items()
            if styles[other].uses_imu and value is not None and value > (in_curves[name] or float("inf"))
        ]
        if not style.uses_imu and beaten:
            notes.append(
                f"{name}, which uses no IMU, has the smaller roll error in curves than {', '.join(beaten)}"
            )
    return Group(title, table, Text("; ".join(notes), style="dim"))
