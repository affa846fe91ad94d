"""The section beside Hidalgo et al.: a table, claims and figures of ours for its template."""

import math
from dataclasses import replace
from functools import partial
from typing import Any

from simrail.campaign.cell import CellResult
from simrail.report.figures import canvas
from simrail.report.figures.geometry import has_rails, rails_figure, stretch_of, stretch_words
from simrail.report.pages.section import PageData, Section
from simrail.report.papers.claim import judged, title_of
from simrail.report.papers.hidalgo import judges
from simrail.report.papers.hidalgo.places import BAND, PAPER, Places, places_of
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.tables import NONE, Cell, Row, Table, number_cell, signed
from simrail.report.words.sentences import listed
from simrail.scoring.bootstrap import Interval
from simrail.track.bands import BANDS

DRAWN_M = 150.0
"""Stretch that is drawn."""


def section(data: PageData) -> list[Section]:
    """Make the section; none if no ride has a vertical profile."""
    names = PAPER.names(data.methods)
    places = places_of(data.scores, data.cells, names)
    if places is None:
        return []
    looks = {
        part: replace(style, colour=PAPER.parts[part].colour, stroke="-")
        for part, name in names.items()
        for style in data.styles
        if style.name == name
    }
    shown: dict[str, Any] = {
        "paper": PAPER,
        "table": _table(places),
        "draws": places.table.index.get_level_values("draw").nunique(),
        "band": BAND,
        "all_claims": judged(PAPER, places, judges, has=places.has),
        "notes": judges.notes(places),
        "drawings": [drawing for example in data.examples for drawing in _drawings(example, looks)],
    }
    title = title_of(PAPER, shown["all_claims"])
    return [Section("paper", title, "papers/hidalgo/section.html.j2", shown)]


def _table(places: Places) -> Table:
    """Errors by part and place, with the interval of their mean; coverage of the filter's own interval."""
    rows = []
    for part, role in PAPER.parts.items():
        if part in places.table:
            cells = [
                cell
                for place in places.names
                for cell in (
                    _with_interval(places.mean(part, place)),
                    _with_interval(places.mean(part, place, "D2")),
                    number_cell(100.0 * places.mean(part, place, "coverage95").value, decimals=0),
                )
            ]
            rows.append(Row(role.label, "", role.colour, cells))
    columns = [f"{BAND}, mm", "D2, mm", "inside 95 %"] * len(places.names)
    return Table([(place, 3) for place in places.names], columns, rows)


def _with_interval(one: Interval) -> Cell:
    if not math.isfinite(one.value):
        return NONE
    behind = signed(f"{one.low:.2f} to {one.high:.2f}") if math.isfinite(one.low) else ""
    return Cell(f"{one.value:.3f}", behind)


def _drawings(example: CellResult, looks: dict[str, MethodStyle]) -> list[tuple[str, canvas.Drawing]]:
    """The profile with and without the gyro, of the rides that are drawn."""
    drawn = [looks[part] for part in ("gyro", "no_gyro", "own") if part in looks]
    drawn = [style for style in drawn if has_rails(example, style)]
    if not drawn:
        return []
    limits = stretch_of(example, drawn[0].name, band=BANDS[BAND], length_m=DRAWN_M)
    text = (
        f"Rails over {stretch_words(example, limits)} {example.recording.name} ({example.recording.mount}), "
        f"filtered to {BAND}, as {listed([style.label for style in drawn])} "
        f"find{'s' * (len(drawn) == 1)} them."
    )
    make = partial(
        rails_figure, example, drawn, band=BANDS[BAND], limits=limits, with_interval=False, what=text
    )
    return [(text, canvas.drawn("paper-rails", make))]
