"""The section beside Veillard et al. 2016: tables, claims and figures of ours, gathered for its template."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from simrail.report.figures import canvas
from simrail.report.pages.section import PageData, Section
from simrail.report.papers.claim import judged, title_of
from simrail.report.papers.veillard_2016 import judges
from simrail.report.papers.veillard_2016.figures import (
    curve_figure,
    distributions_figure,
    mounts_of,
    spectrum_figure,
)
from simrail.report.papers.veillard_2016.lines import PAPER, Draws, Lines, lines_of
from simrail.report.papers.veillard_2016.ride import distances_of, spectrum_over_speed
from simrail.report.tables.tables import NONE, Cell, Row, Table, number_cell, signed

COLUMNS = (
    ("along", "along, mg", 1),
    ("across", "across, mg", 1),
    ("roll", "roll, \u00b0", 2),
    ("pitch", "pitch, \u00b0", 2),
    ("speed", "speed, m/s", 2),
    ("speed_mean", "mean, m/s", 2),
)
"""Figure, words and decimals of the columns of each mount; the distance follows them."""


def section(data: PageData) -> list[Section]:
    """Make the section; none if no part has a score."""
    lines = lines_of(data.scores, data.methods)
    if not lines.mounts:
        return []
    drawn = mounts_of(data.examples, lines.mounts)
    paper = lines.names.get("paper", "")
    spectra = {mount: spectrum_over_speed(example) for mount, example in drawn.items()}
    led = {mount: distances_of(example, paper) for mount, example in drawn.items()}
    distances = {mount: one for mount, one in led.items() if one is not None}
    evidence = judges.Evidence(lines, spectra, distances)
    first = lines.draws(next(iter(lines.names)), "speed", lines.mounts[0])
    shown: dict[str, Any] = {
        "paper": PAPER,
        "lines": max(first.line_count, 1),
        "recordings": max(lines.recordings(mount) for mount in lines.mounts),
        "mounts": lines.mounts,
        "tables": [(mount, table_of(lines, mount)) for mount in lines.mounts],
        "all_claims": judged(PAPER, evidence, judges, has=lines.has),
        "notes": judges.beside_ours(evidence),
        "errata": judges.errata(evidence),
        "distributions": canvas.drawn("paper-distributions", partial(distributions_figure, lines)),
        "spectrum": canvas.drawn("paper-spectrum", partial(spectrum_figure, spectra)),
        "curves": [
            (mount, canvas.drawn(f"paper-curve-{mount}", partial(curve_figure, example, lines.names)))
            for mount, example in drawn.items()
        ],
    }
    title = title_of(PAPER, shown["all_claims"])
    return [Section("paper", title, "papers/veillard_2016/section.html.j2", shown)]


def table_of(lines: Lines, mount: str) -> Table:
    """Mean over lines and devices of every part at a mount, beside what is printed."""
    names = ("acceleration", "acceleration", "attitude", "attitude", "speed")
    printed = [Cell(f"{PAPER.printed[name][0][0]:g}") for name in names]
    cells = [*printed, NONE, Cell(f"{PAPER.printed['distance'][0][0]:g}")]
    rows = [Row("printed, of one ride", "", "", cells)]
    for part, role in PAPER.parts.items():
        if lines.has(part):
            rows.append(Row(role.label, "", role.colour, _cells(lines, part, mount)))
    columns = [*(words for _, words, _ in COLUMNS), "distance, %"]
    return Table([("acceleration", 2), ("attitude", 2), ("speed", 2), ("at the end", 1)], columns, rows)


def _cells(lines: Lines, part: str, mount: str) -> list[Cell]:
    cells = [_mean_cell(lines.draws(part, name, mount), decimals) for name, _, decimals in COLUMNS]
    return [*cells, _range_cell(lines.draws(part, "distance", mount))]


def _mean_cell(draws: Draws, decimals: int) -> Cell:
    """Mean over lines and devices, and the ends of its interval."""
    if not len(draws.values):
        return NONE
    mean, low, high = draws.mean()
    if not np.isfinite([low, high]).all():
        return number_cell(mean, decimals=decimals)
    ends = " to ".join(number_cell(end, decimals=decimals).text for end in (low, high))
    return replace(number_cell(mean, decimals=decimals), spread=ends)


def _range_cell(draws: Draws) -> Cell:
    """Least and greatest of all lines and devices, with sign."""
    if not len(draws.values):
        return NONE
    low, high = float(np.min(draws.values)), float(np.max(draws.values))
    decimals = 1 if max(-low, high) >= 1.0 else 3  # of what keeps its way to metres no tenth would be left
    return Cell(signed(f"{low:+.{decimals}f} to {high:+.{decimals}f}"))
