"""The section beside Gonzalez-Carbajal et al. 2023: tables, claims and figures of ours for its template.

Everything of ours is looked up in the scores, or computed from the first draw of the ride that is drawn.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.report.figures.geometry import has_rails, lines_of
from simrail.report.pages.section import PageData, Section
from simrail.report.papers.claim import judged, title_of, with_ablation
from simrail.report.papers.gonzalez_2023 import judges, parts, tunings
from simrail.report.papers.gonzalez_2023.figures import noise_figure, tuning_figures
from simrail.report.papers.gonzalez_2023.parts import COLUMNS, FILTERED, PAPER, OtherSize, Rows, column_words
from simrail.report.tables.geometry import QUANTITIES
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case, of_cell
from simrail.report.tables.tables import Cell, Row, Table, mean_cell, number_cell
from simrail.report.words.ablations import WORDS
from simrail.scoring.ablations import ABLATIONS, Ablation
from simrail.track.bands import Band

SCALED = Band("paper", 0.3, 7.0)
FULL_SIZE = Band("paper", 3.0, 70.0)
"""The paper's filter on its 1:10 track, and what it is at full size; scenarios call the band ``paper``."""

MODEL_M = 200.0
"""Length below which a track is taken for the 1:10 one."""

START_M = 2.0
"""First metres of a ride on a 1:10 track, where the peak of Fig. A1 stands; ten times that at full size."""

COVERED = ("cml", "cml_held", "kom", "hand", "printed")
"""Parts whose intervals are counted."""


def section(data: PageData) -> list[Section]:
    """Make the section; none if no case has rail geometry."""
    rows = parts.rows_of(data.cases, data.methods, band=SCALED.name)
    if rows is None:
        return []
    example = _example_of(data, rows.case)
    example = example or next((e for e in data.examples if e.rails is not None), None)
    noisy = _example_of(data, rows.noisy)
    looks = {
        part: replace(style, colour=PAPER.parts[part].colour, stroke="-")
        for part, name in rows.names.items()
        for style in data.styles
        if style.name == name
    }
    band = _band_of(data, example)
    seen = {part: style for part, style in looks.items() if example and has_rails(example, style)}
    covered, by_draws = (
        {part: coverage_of(example, seen[part], band, by_draws=own) for part in COVERED if part in seen}
        if example
        else {}
        for own in (False, True)
    )
    size = parts.size_of(band.longest_m)
    other = parts.other_size(data.beside, band=SCALED.name) if data.beside else None
    if other is not None and other.size == size:  # of one size: then the name tells rows apart
        other = replace(other, size=f"{size}, {other.name}")
    tuned = tunings.by_part(rows.names, tunings.tunings_of(data.methods, data.scenario.folder))
    own = {
        part: [_sd_of(example, seen[part], quantity, band) for quantity in FILTERED]
        for part, tuning in tuned.items()
        if example and part in seen and tunings.searched_on(tuning, data.scenario, example.cell)
    }
    peak = peak_of(example, seen[rows.main], band) if example and rows.main in seen else None
    evidence = judges.Evidence(rows, covered.get(rows.main, []), peak, tuned.get("cml"))
    claims = judged(PAPER, evidence, judges, has=rows.has)
    twins = {one: parts.ablated_rows(rows, data.cases, one) for one in ABLATIONS}
    for one, twin in twins.items():
        if twin is not None:
            # Intervals and peak are of the ride that is drawn, which is of no ablation.
            beside = judged(PAPER, judges.Evidence(twin, tuning=evidence.tuning), judges, has=twin.has)
            claims = with_ablation(claims, beside, one)
    missing = [PAPER.label(part) for part in PAPER.printed if not rows.has(part)]
    notes = [*tunings.notes(tuned), tunings.silence_note(tuned), tunings.own_ride_note(rows, own)]
    notes.append(judges.errata_note(rows))
    notes += [f"Not run in this scenario: {', '.join(missing)}."] * bool(missing)
    drawings = tuning_figures(seen, example, band) if example else []
    if example and noisy:
        drawings += noise_figure(rows, looks, example, noisy, band)
    shown: dict[str, Any] = {
        "where": rows.where,
        "size": size,
        "is_model": size == parts.MODEL,
        "other": other,
        "tables": _table(rows, looks, size, other),
        "coverage": _coverage_table(covered, by_draws, looks),
        "tunings": tunings.status_table(tuned),
        "commands": tunings.commands(tuned),
        "all_claims": claims,
        "ablations": [
            (WORDS[one].cost, cost_paragraph(rows, twin, one), _cost_table(rows, twin, looks, one))
            for one, twin in twins.items()
        ],
        "notes": [note for note in notes if note],
        "drawings": drawings,
    }
    title = title_of(PAPER, shown["all_claims"])
    return [Section("paper", title, "papers/gonzalez_2023/section.html.j2", shown)]


def _example_of(data: PageData, case: Case | None) -> CellResult | None:
    """The ride of a case that is drawn."""
    return next((e for e in data.examples if case and of_cell(data.cases, e.cell) is case), None)


def _sd_of(example: CellResult, style: MethodStyle, quantity: str, band: Band) -> float:
    """Sd of a method's filtered error on a ride, mm; NaN without any."""
    _, true, own, _ = lines_of(example, style.name, quantity, band)
    error = (own - true)[np.isfinite(own)]
    return float(error.std()) if len(error) else float("nan")


def _band_of(data: PageData, example: CellResult | None) -> Band:
    """Band that the scores are of; where the scenario has none, the paper's for the track's length."""
    own = data.scenario.spec.geometry.own_bands.get(SCALED.name)
    if own is not None:
        return Band(SCALED.name, *own)
    is_model = example is not None and example.line.length_m < MODEL_M
    return SCALED if is_model else FULL_SIZE


def _table(rows: Rows, looks: Mapping[str, MethodStyle], size: str, other: OtherSize | None) -> Table:
    """Tables 1 and 2: what is printed, ours below it, and ours of the other size below that."""
    ours = f"ours, {size}" if other is not None else "ours"
    lines = []
    for part, role in PAPER.parts.items():
        style = looks.get(rows.played_by(part))
        colour = style.colour if style else ""
        printed = PAPER.printed.get(part, ())
        if printed:
            lines.append(
                Row(f"{role.label}: printed", "", "", [number_cell(v) for one in printed for v in one])
            )
        if rows.has(part):
            label = f"{role.label}: {ours}" if printed or other is not None else role.label
            lines.append(Row(label, "", colour, _numbers(rows, part)))
        if other is not None and other.rows.has(part):
            label = f"{role.label}: ours, {other.size}"
            lines.append(Row(label, "", colour or role.colour, _numbers(other.rows, part)))
    groups = [(words, 3) for words in column_words()]
    return Table(groups, ["\u03bc", "\u03c3", "max"] * len(COLUMNS), lines)


def cost_paragraph(rows: Rows, twin: Rows | None, ablation: Ablation) -> str:
    """What the smoother loses by what a train has and an ablation has not, beside what the paper says."""
    played = [part for part in PAPER.parts if twin is not None and rows.has(part) and twin.has(part)]
    costs = {
        QUANTITIES[quantity]: {
            part: [one.get(part, quantity, "sd", filtered=True).value for one in (rows, twin)]
            for part in played
            if twin is not None
        }
        for quantity in FILTERED
    }
    by_quantity = {}
    for words, own in costs.items():
        tested = [part for part in own if part != "zero"]
        if tested:
            worst = max(tested, key=lambda part: own[part][0] / max(own[part][1], 1e-12))
            by_quantity[words] = worst, *own[worst]
    is_ablated = rows.case.labels[ablation.column] == ablation.ablated
    known = twin is not None
    return PAPER.written(PAPER.words[ablation.column], costs=by_quantity, known=known, is_ablated=is_ablated)


def _cost_table(
    rows: Rows, twin: Rows | None, looks: Mapping[str, MethodStyle], ablation: Ablation
) -> Table | None:
    """Filtered errors of the rails and errors of the attitude, as a train has it and with the ablation."""
    if twin is None:
        return None
    angles = ("roll", "pitch", "yaw_debiased")
    lines = []
    for part, role in PAPER.parts.items():
        if rows.has(part) and twin.has(part):
            both = [one.get(part, q, "sd", filtered=True) for q in FILTERED for one in (rows, twin)]
            both += [one.attitude(part, angle) for angle in angles for one in (rows, twin)]
            style = looks.get(rows.played_by(part))
            cells = [mean_cell(mean._replace(sd=float("nan"))) for mean in both]
            lines.append(Row(role.label, "", style.colour if style else "", cells))
    groups = [(f"{QUANTITIES[quantity]}, sd, mm", 2) for quantity in FILTERED]
    groups += [(f"{angle}, \u00b0 rms", 2) for angle in ("roll", "pitch", "yaw\u00b9")]
    return Table(groups, list(WORDS[ablation].heads) * len(groups), lines)


def _numbers(rows: Rows, part: str) -> list[Cell]:
    means = [
        rows.get(part, quantity, metric, filtered=filtered)
        for quantity, filtered in COLUMNS
        for metric in ("mean", "sd", "max")
    ]
    return [mean_cell(mean._replace(sd=float("nan"))) for mean in means]


def coverage_of(
    example: CellResult, style: MethodStyle, band: Band, *, by_draws: bool = False
) -> list[float]:
    """Share of the track inside a method's 95 % interval, %, in the order of `COLUMNS`; [] without sds.

    As in the paper, the interval about filtered rails is that of the unfiltered ones; by draws, their own.
    """
    shares = []
    for quantity, filtered in COLUMNS:
        cut = band if filtered else None
        _, true, own, sd = lines_of(example, style.name, quantity, cut, by_draws=by_draws)
        there = np.isfinite(own) & np.isfinite(sd)
        if not there.any():
            return []
        shares.append(100.0 * float(np.mean(np.abs(own - true)[there] <= 1.96 * sd[there])))
    return shares


def _coverage_table(
    covered: Mapping[str, list[float]], by_draws: Mapping[str, list[float]], looks: Mapping[str, MethodStyle]
) -> Table:
    rows = [Row("CML: printed", "", "", [Cell(f"{value:g}") for value in PAPER.figures["coverage"]])]
    for part in covered:
        for words, shares in (("", covered), (": interval of the filtered rails, by draws", by_draws)):
            cells = [number_cell(share, decimals=0) for share in shares[part]]
            if cells:
                rows.append(Row(f"{PAPER.label(part)}{words}", "", looks[part].colour, cells))
    return Table([("inside the 95 % interval, %", len(COLUMNS))], column_words(), rows)


def peak_of(example: CellResult, style: MethodStyle, band: Band) -> judges.Peak:
    """How the start of a ride errs beside its rest; its first metres are as long as its size asks for."""
    place, true, own, _ = lines_of(example, style.name, "alignment", None)
    error = own - true
    away = np.abs(place - float(example.motion["position_m"].iloc[0]))
    first_m = START_M * band.longest_m / SCALED.longest_m
    first = away < first_m
    if not first.any() or first.all():
        return judges.Peak(first_m, float("nan"), float("nan"))
    return judges.Peak(first_m, float(np.abs(error[first]).max()), float(error[~first].std()))
