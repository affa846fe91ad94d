"""Section of several passes: errors of fused rails over their number, beside its root, and coverage."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from simrail.report.figures import canvas
from simrail.report.pages.section import PageData, Section
from simrail.report.tables.geometry import JUDGED, QUANTITIES, bands_of_case, mappers
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case
from simrail.report.tables.tables import NONE, Cell, Row, Table
from simrail.report.words.ablations import state_words
from simrail.report.words.verdicts import imu_words
from simrail.scoring.table import FULL

PASSES = "passes"
"""Axis of the scenario, and column of the table of cells."""

_OF_PASSES = (PASSES, "case", "speed_kmh", "direction")
"""Labels by which cases of one group differ."""

_COLOURS = ("#0b7285", "#d9480f", "#5f3dc4", "#2b8a3e", "#868e96")
_MARKS = "osv^D"


def passes_section(data: PageData) -> list[Section]:
    """What becomes of the error of the rails with the number of passes; nothing where there is one number."""
    shown: list[tuple[str, canvas.Drawing, Table]] = []
    for group in groups_of(data.cases):
        for style in mappers(group[0], data.styles):
            labels = group[0].labels
            title = f"{style.label}: IMU {imu_words(labels)}, {state_words(labels)}"
            name = f"passes-{len(shown) + 1}"
            drawing = canvas.drawn(name, partial(passes_figure, group, style, what=title))
            shown.append((title, drawing, passes_table(group, style)))
    if not shown:
        return []
    return [Section("passes", "Several passes", "campaign/passes.html.j2", {"shown": shown})]


def groups_of(cases: Sequence[Case]) -> Iterator[list[Case]]:
    """Cases that differ in the number of passes only, fewest first; groups of one are left out."""
    groups: dict[tuple[tuple[str, str], ...], list[Case]] = {}
    for case in cases:
        if case.labels.get(PASSES, "nan") != "nan":
            key = tuple((name, value) for name, value in case.labels.items() if name not in _OF_PASSES)
            groups.setdefault(key, []).append(case)
    for group in groups.values():
        if len(group) > 1:
            yield sorted(group, key=passes_of)


def passes_of(case: Case) -> int:
    """Number of passes of a case."""
    return int(case.labels[PASSES])


def passes_figure(group: Sequence[Case], style: MethodStyle, *, what: str) -> str:
    """Root mean square of the error by band over the number of passes, on logarithmic axes.

    Dashed beside each: its value at the fewest passes, falling by the root of their number.
    """
    n = np.array([passes_of(case) for case in group], dtype=np.float64)
    bands = [band for band in bands_of_case(group[0]) if band != FULL]
    with canvas.look():
        figure, axes = canvas.panels_beside(len(JUDGED), tall_in=2.2, left_in=0.62)
        for axis, quantity in zip(axes, JUDGED, strict=True):
            for band, colour, mark in zip(bands, _COLOURS, _MARKS, strict=False):
                value = np.array([case.get(style.name, quantity, "rms", band=band).value for case in group])
                axis.plot(n, value, color=colour, marker=mark, ms=4.5, label=band)
                axis.plot(n, value[0] * np.sqrt(n[0] / n), color=colour, ls=(0, (3, 2)), lw=0.8)
            canvas.log_scale(axis.yaxis)
            axis.set_xscale("log", base=2)
            axis.set_xticks(n, [f"{number:g}" for number in n])
            axis.minorticks_off()
            axis.set_xlabel("passes")
            axis.set_title(QUANTITIES[quantity], color=canvas.INK)
        axes[0].set_ylabel("rms of the error, mm")
        canvas.figure_legend(figure, *axes[0].get_legend_handles_labels(), left_in=0.62)
        return canvas.to_svg(
            figure, description=f"Error of the fused rails by band over the number of passes, {what}"
        )


def passes_table(group: Sequence[Case], style: MethodStyle) -> Table:
    """Error in mm, what the root of the number of passes would leave of the first, and coverage."""
    numbers = [passes_of(case) for case in group]
    columns = [f"{n}" for n in numbers]
    rows = []
    for quantity in JUDGED:
        for band in bands_of_case(group[0]):
            errors = [case.get(style.name, quantity, "rms", band=band) for case in group]
            inside = [case.get(style.name, quantity, "coverage95", band=band) for case in group]
            root = errors[0].value * float(np.sqrt(numbers[0] / numbers[-1]))
            cells = [_cell(one.value, one.draws, 3) for one in errors]
            cells += [_cell(root, errors[0].draws, 3)]
            cells += [_cell(one.value, one.draws, 2) for one in inside]
            name = "unfiltered" if band == FULL else band
            rows.append(Row(f"{QUANTITIES[quantity]}, {name}", "", "", cells))
    groups = [("error, mm, by passes", len(columns)), ("by the root", 1), ("coverage of 95 %", len(columns))]
    return Table(groups, [*columns, f"{numbers[-1]}", *columns], rows)


def _cell(value: float, draws: int, decimals: int) -> Cell:
    return Cell(f"{value:.{decimals}f}") if draws else NONE
