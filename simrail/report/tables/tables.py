"""Tables of the page: the subset of the score table that a person reads first."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import compress, groupby

from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case, Mean
from simrail.report.words.ablations import state_words
from simrail.report.words.verdicts import imu_words


@dataclass(frozen=True)
class Cell:
    """One table cell: its text, the spread behind it, and how it is marked."""

    text: str
    spread: str = ""
    mark: str = ""


@dataclass(frozen=True)
class Row:
    """One method."""

    label: str
    baseline: str
    colour: str
    cells: list[Cell]


@dataclass(frozen=True)
class Table:
    """A table with one or two header lines.

    Attributes
    ----------
    groups : list of (str, int)
        Upper header: text and number of columns; empty for none.
    columns : list of str
        Lower header.
    rows : list of Row
        The rows.
    """

    groups: list[tuple[str, int]]
    columns: list[str]
    rows: list[Row]


DECIMALS = 3
"""Of an error in the table, degrees."""

_ERRORS = (
    ("roll", "rms", "straight", "straight"),
    ("roll", "rms", "transition", "transition"),
    ("roll", "rms", "curve", "curve"),
    ("roll", "rms", "whole", "whole"),
    ("roll", "max", "whole", "max"),
    ("pitch", "rms", "curve", "curve"),
    ("pitch", "rms", "whole", "whole"),
    ("pitch", "max", "whole", "max"),
    ("yaw_debiased", "rms", "whole", "whole"),
    ("yaw_debiased", "final", "whole", "final"),
)
NONE = Cell("\u2013", mark="none")
"""Where there is no figure."""


def signed(text: str) -> str:
    """A number with the sign that is as wide as a plus."""
    return text.replace("-", "\u2212")


def number_cell(value: float, *, decimals: int = DECIMALS, spread: float = math.nan, mark: str = "") -> Cell:
    """A number, and the spread behind it where there is one; a dash if it is not finite."""
    if not math.isfinite(value):
        return NONE
    behind = f"{spread:.{decimals}f}" if math.isfinite(spread) else ""
    return Cell(signed(f"{round(value, decimals) + 0.0:.{decimals}f}"), behind, mark)  # no negative zero


def mean_cell(mean: Mean, *, decimals: int = DECIMALS, mark: str = "", scale: float = 1.0) -> Cell:
    """A mean over draws, and its standard deviation between them where it has one."""
    if mean.draws == 0:
        return NONE
    spread = scale * mean.sd if mean.sd > 0.0 else math.nan
    return number_cell(scale * mean.value, decimals=decimals, spread=spread, mark=mark)


def without_empty(table: Table) -> Table:
    """A table without columns in which no row has a figure: what a scenario does not score is not shown."""
    filled = [any(row.cells[i] != NONE for row in table.rows) for i in range(len(table.columns))]
    groups, start = [], 0
    for text, span in table.groups:
        left = sum(filled[start : start + span])
        groups += [(text, left)] * (left > 0)
        start += span
    rows = [replace(row, cells=list(compress(row.cells, filled))) for row in table.rows]
    return Table(groups, list(compress(table.columns, filled)), rows)


def method_row(style: MethodStyle, cells: list[Cell]) -> Row:
    """The row of a method."""
    return Row(style.label, style.baseline, style.colour, cells)


def error_table(case: Case, styles: Sequence[MethodStyle], *, reference: str) -> Table:
    """Errors of every method in degrees; the best method under test and losses to 'design angles' marked."""
    means = {
        column: [case.get(s.name, *column[:2], window=column[2], reference=reference) for s in styles]
        for column in _ERRORS
    }
    means = {column: figures for column, figures in means.items() if any(mean.draws for mean in figures)}
    cells: list[list[Cell]] = [[] for _ in styles]
    for figures in means.values():
        floor = next((abs(m.value) for s, m in zip(styles, figures, strict=True) if not s.uses_imu), math.nan)
        tested = [abs(m.value) for s, m in zip(styles, figures, strict=True) if s.uses_imu]
        # As they are shown: what reads the same is as good.
        least = min((round(value, DECIMALS) for value in tested if value >= 0.0), default=math.nan)
        for style, mean, row in zip(styles, figures, cells, strict=True):
            own = abs(mean.value) if style.uses_imu else math.nan
            marks = ["worse"] * (reference == "truth" and own > floor)
            marks += ["best"] * (own >= 0.0 and round(own, DECIMALS) == least)
            row.append(mean_cell(mean, mark=" ".join(marks)))
    rows = [method_row(style, row) for style, row in zip(styles, cells, strict=True)]
    return Table(_group_spans(list(means)), [word for *_, word in means], rows)


def consistency_table(case: Case, styles: Sequence[MethodStyle]) -> Table:
    """NEES, coverage, NIS and time per sample."""
    rows = []
    for style in styles:
        cells = [
            mean_cell(case.get(style.name, quantity, metric), decimals=decimals, scale=scale)
            for metric, decimals, scale in (("nees", 2, 1.0), ("coverage95", 1, 100.0))
            for quantity in ("roll", "pitch", "yaw")
        ]
        cells.append(mean_cell(case.metric_of_any(style.name, "nis"), decimals=2))
        cells.append(mean_cell(case.metric_of_any(style.name, "us_per_sample")))
        rows.append(method_row(style, cells))
    groups = [("NEES (1 is right)", 3), ("inside the 95 % interval, %", 3), ("NIS", 1), ("time", 1)]
    columns = [*("roll", "pitch", "yaw") * 2, "(1 is right)", "\u00b5s per sample"]
    return without_empty(Table(groups, columns, rows))


def odometry_table(all_cases: Sequence[Case]) -> Table:
    """Position and speed errors of the odometry, one row per case that differs."""
    rows, seen = [], set()
    for case in all_cases:
        for name in case.estimators():
            if not name.startswith("odometry:"):
                continue
            cells = [
                mean_cell(case.get(name, "position", "rms")),
                mean_cell(case.get(name, "position", "max")),
                mean_cell(case.get(name, "distance_relative", "final"), scale=100.0),
                mean_cell(case.get(name, "speed", "rms", window="moving"), decimals=4),
                mean_cell(case.get(name, "position", "coverage95"), decimals=1, scale=100.0),
            ]
            label = (
                f"{case.labels['ride']} \u00b7 {imu_words(case.labels)} \u00b7 "
                f"{name.removeprefix('odometry:')} \u00b7 {state_words(case.labels)}"
            )
            key = (label, *(cell.text for cell in cells))
            if key not in seen:
                seen.add(key)
                rows.append(Row(label, "", "", cells))
    groups = [("position error, m", 2), ("distance", 1), ("speed error, m/s", 1), ("inside, %", 1)]
    columns = ["rms", "max", "final, %", "rms, moving", "95 % interval"]
    return without_empty(Table(groups, columns, rows))


_WORDS = {
    "roll": "roll error, \u00b0",
    "pitch": "pitch error, \u00b0",
    "yaw_debiased": "yaw error\u00b9, \u00b0",
}


def _group_spans(columns: Sequence[tuple[str, str, str, str]]) -> list[tuple[str, int]]:
    """Title and width of columns of one quantity: rms, and others that are named below."""
    spans = []
    for quantity, group in groupby(columns, key=lambda column: column[0]):
        metrics = [metric for _, metric, *_ in group]
        others = [metric for metric in metrics if metric != "rms"]
        words = ": " + ", ".join(["rms", *others]) if others else " rms"
        spans.append((_WORDS[quantity] + words, len(metrics)))
    return spans
