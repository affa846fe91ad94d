"""The section itself: its tables, and claims, notes and figures gathered for the template.

Everything of ours is looked up in the scores, or computed from the first draw of the ride that is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from markupsafe import Markup

from simrail.campaign.cell import CellResult
from simrail.campaign.stored_results import StoredResults
from simrail.estimators.tuning.file import Tuning
from simrail.report.figures.geometry import lines_of
from simrail.report.papers.claim import Claim
from simrail.report.papers.gonzalez_2023.beside import MODEL, OtherSize, other_size, size_of, where
from simrail.report.papers.gonzalez_2023.claims import Peak, claims, errata_note
from simrail.report.papers.gonzalez_2023.figures import noise_figure, tuning_figures
from simrail.report.papers.gonzalez_2023.own_ride import FILTERED, own_ride_note, searched_on
from simrail.report.papers.gonzalez_2023.parts import COLOURS, PARTS, Rows, rows_of
from simrail.report.papers.gonzalez_2023.printed import COLUMNS, COVERAGE, TABLES
from simrail.report.papers.gonzalez_2023.tunings import by_part, commands, notes, status_table
from simrail.report.tables.geometry_bands import QUANTITIES
from simrail.report.tables.geometry_view import with_rails
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Figures, of_cell
from simrail.report.tables.tables import Cell, Row, Table
from simrail.scenario.cells import Method
from simrail.scenario.scenario import Scenario
from simrail.track.bands import Band

SCALED = Band("paper", 0.3, 7.0)
FULL_SIZE = Band("paper", 3.0, 70.0)
"""The paper's filter on its 1:10 track, and what it is at full size; scenarios call the band ``paper``."""

MODEL_M = 200.0
"""Length below which a track is taken for the 1:10 one."""

START_M = 2.0
"""First metres of a ride on a 1:10 track, where the peak of Fig. A1 stands; ten times that at full size."""


@dataclass(frozen=True)
class PaperView:
    """The section as the template needs it."""

    where: str
    size: str
    is_model: bool
    other: OtherSize | None
    table: Table
    coverage: Table
    tunings: Table | None
    commands: list[tuple[str, str]]
    claims: list[Claim]
    notes: list[str]
    figures: list[tuple[str, Markup]]
    heading: str = "Gonzalez-Carbajal et al. 2023"
    template: str = "papers/gonzalez_2023/section.html.j2"


def paper_view(
    all_cases: Sequence[Figures],
    methods: Sequence[Method],
    styles: Sequence[MethodStyle],
    examples: Sequence[CellResult],
    *,
    tunings: Mapping[str, Tuning] | None = None,
    scenario: Scenario | None = None,
    former: StoredResults | None = None,
) -> PaperView | None:
    """Make the section; None if no case has rail geometry.

    Parameters
    ----------
    all_cases : sequence of Figures
        The scores.
    methods, styles : sequence
        The scenario's methods and how they look.
    examples : sequence of CellResult
        First draw of each ride, and of an IMU with noise added.
    tunings : mapping of str to Tuning, optional
        Tunings by the method that names them.
    scenario : Scenario, optional
        What was run: tells which tunings were searched on the ride that is drawn.
    former : StoredResults, optional
        Results of the other size, whose rows stand beside ours.
    """
    rows = rows_of(all_cases, methods, band=SCALED.name)
    if rows is None:
        return None
    example = next((e for e in examples if of_cell(list(all_cases), e.cell) is rows.case), None)
    example = example or next((e for e in examples if e.rails is not None), None)
    noisy = next((e for e in examples if rows.noisy and of_cell(list(all_cases), e.cell) is rows.noisy), None)
    looks = {
        part: replace(style, colour=COLOURS.get(part, ""), stroke="-")
        for part, name in rows.names.items()
        for style in styles
        if style.name == name
    }
    band = _band_of(scenario, example)
    main = looks.get(rows.main)
    drawn = main if example and main and with_rails(example, [main]) else None
    covered: dict[str, list[float]] = {
        part: coverage_of(example, looks[part], band)
        for part in ("cml", "cml_held", "kom", "hand", "printed")
        if example and part in looks and with_rails(example, [looks[part]])
    }
    by_draws = {part: coverage_of(example, looks[part], band, by_draws=True) for part in covered if example}
    size = size_of(band.longest_m)
    other = other_size(former, band=SCALED.name) if former is not None else None
    if other is not None and other.size == size:  # of one size: then the name tells rows apart
        other = replace(other, size=f"{size}, {other.name}")
    tuned = by_part(rows.names, tunings or {})
    own = {
        part: _filtered_sds(example, looks[part], band)
        for part, tuning in tuned.items()
        if example and scenario and part in looks and searched_on(tuning, scenario, example.cell)
    }
    return PaperView(
        where=where(rows),
        size=size,
        is_model=size == MODEL,
        other=other,
        table=_table(rows, looks, size, other),
        coverage=_coverage_table(covered, by_draws, looks),
        tunings=status_table(tuned),
        commands=commands(tuned),
        claims=claims(
            rows,
            coverage=covered.get(rows.main, []),
            peak=_peak(example, drawn, band) if example and drawn else Peak(np.nan, np.nan, np.nan),
            tuning=tuned.get("cml"),
        ),
        notes=[
            note
            for note in (*notes(tuned), own_ride_note(rows, own), errata_note(rows), *_not_run(rows))
            if note
        ],
        figures=[
            *(tuning_figures(looks, example, band) if example else []),
            *(noise_figure(rows, looks, example, noisy, band) if example and noisy else []),
        ],
    )


def _filtered_sds(example: CellResult, style: MethodStyle, band: Band) -> list[float]:
    """Sd of the filtered error on one ride, mm, in the order of `FILTERED`; NaN where there is none."""
    sds = []
    for quantity in FILTERED:
        if not with_rails(example, [style]):
            return [float("nan")] * len(FILTERED)
        _, true, found, _ = lines_of(example, style.name, quantity, band)
        error = (found - true)[np.isfinite(found)]
        sds.append(float(error.std()) if len(error) else float("nan"))
    return sds


def _band_of(scenario: Scenario | None, example: CellResult | None) -> Band:
    """Band that the scores are of; where the scenario is not known, the paper's for the track's length."""
    own = scenario.spec.geometry.own_bands.get(SCALED.name) if scenario is not None else None
    if own is not None:
        return Band(SCALED.name, *own)
    if example is None:
        return FULL_SIZE
    length = example.recording.track.length_m
    return SCALED if length < MODEL_M else FULL_SIZE


def _table(rows: Rows, looks: dict[str, MethodStyle], size: str, other: OtherSize | None) -> Table:
    """Tables 1 and 2: what is printed, ours below it, and ours of the other size below that."""
    ours = f"ours, {size}" if other is not None else "ours"
    result = []
    for part, label in PARTS.items():
        style = looks.get(rows.played_by(part))
        colour = style.colour if style else ""
        if part in TABLES:
            cells = [
                Cell(f"{value:.3f}".replace("-", "\u2212")) for printed in TABLES[part] for value in printed
            ]
            result.append(Row(f"{label}: printed", "", "", cells))
        if rows.has(part):
            named = part in TABLES or other is not None
            result.append(Row(f"{label}: {ours}" if named else label, "", colour, _numbers(rows, part)))
        if other is not None and other.rows.has(part):
            colour = colour or COLOURS.get(part, "")
            result.append(Row(f"{label}: ours, {other.size}", "", colour, _numbers(other.rows, part)))
    groups = [
        (f"{QUANTITIES[quantity]}, {'filtered' if filtered else 'unfiltered'}", 3)
        for quantity, filtered in COLUMNS
    ]
    return Table(groups, ["\u03bc", "\u03c3", "max"] * len(COLUMNS), result)


def _numbers(rows: Rows, part: str) -> list[Cell]:
    return [
        _number(rows, part, quantity, metric, filtered=filtered)
        for quantity, filtered in COLUMNS
        for metric in ("mean", "sd", "max")
    ]


def _number(rows: Rows, part: str, quantity: str, metric: str, *, filtered: bool) -> Cell:
    found = rows.get(part, quantity, metric, filtered=filtered)
    if not found.draws or not np.isfinite(found.value):
        return Cell("\u2013", mark="none")
    return Cell(f"{round(found.value, 3) + 0.0:.3f}".replace("-", "\u2212"))  # no -0.000


def coverage_of(
    example: CellResult, style: MethodStyle, band: Band, *, by_draws: bool = False
) -> list[float]:
    """Share of the track inside a method's 95 % interval, %, in the order of `COLUMNS`; [] without sds.

    As in the paper, the interval about filtered rails is that of the unfiltered ones; by draws, their own.
    """
    shares = []
    for quantity, filtered in COLUMNS:
        cut = band if filtered else None
        _, true, found, sd = lines_of(example, style.name, quantity, cut, by_draws=by_draws)
        known = np.isfinite(found) & np.isfinite(sd)
        if not known.any():
            return []
        shares.append(100.0 * float(np.mean(np.abs(found - true)[known] <= 1.96 * sd[known])))
    return shares


def _coverage_table(
    covered: dict[str, list[float]], by_draws: dict[str, list[float]], looks: dict[str, MethodStyle]
) -> Table:
    rows = [Row("CML: printed", "", "", [Cell(f"{value:g}") for value in COVERAGE])]
    for part, values in covered.items():
        if values:
            cells = [Cell(f"{value:.0f}") for value in values]
            rows.append(Row(PARTS[part], "", looks[part].colour, cells))
        if by_draws.get(part):
            cells = [Cell(f"{value:.0f}") for value in by_draws[part]]
            label = f"{PARTS[part]}: interval of the filtered rails, by draws"
            rows.append(Row(label, "", looks[part].colour, cells))
    columns = [f"{QUANTITIES[q]}, {'filtered' if f else 'unfiltered'}" for q, f in COLUMNS]
    return Table([("inside the 95 % interval, %", len(columns))], columns, rows)


def _peak(example: CellResult, style: MethodStyle, band: Band) -> Peak:
    """How the start of a ride errs beside its rest; its first metres are as long as its size asks for."""
    place, true, found, _ = lines_of(example, style.name, "alignment", None)
    error = found - true
    away = np.abs(place - float(example.motion["position_m"].iloc[0]))
    first_m = START_M * band.longest_m / SCALED.longest_m
    first = away < first_m
    if not first.any() or first.all():
        return Peak(first_m, float("nan"), float("nan"))
    return Peak(first_m, float(np.abs(error[first]).max()), float(error[~first].std()))


def _not_run(rows: Rows) -> list[str]:
    missing = [PARTS[part] for part in TABLES if not rows.has(part)]
    return [f"Not run in this scenario: {', '.join(missing)}."] if missing else []
