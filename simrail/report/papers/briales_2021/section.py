"""The section beside Briales et al. 2021: tables, claims and figures of ours, gathered for its template.

Everything of ours is looked up in the scores, or computed from the first draw of each ride.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.report.figures import canvas
from simrail.report.figures.attitude import attitude_figure
from simrail.report.figures.ride import direction_of
from simrail.report.pages.section import PageData, Section
from simrail.report.papers.briales_2021 import judges
from simrail.report.papers.briales_2021.figures import (
    compensation_figure,
    repeatability_figure,
    rides_figure,
    spread_of,
)
from simrail.report.papers.briales_2021.rides import (
    PAPER,
    QUANTITIES,
    Rides,
    ablated_rides,
    is_fast,
    rides_of,
)
from simrail.report.papers.briales_2021.terms import SLOW_PART_HZ, TERMS_RIDE, terms_table
from simrail.report.papers.claim import judged, title_of, with_ablation
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.tables import NONE, Cell, Row, Table, number_cell
from simrail.report.words.ablations import WORDS
from simrail.scoring.ablations import ABLATIONS, Ablation

_REPEATED = ("gda_paper", "ekf_per_step", "ekf")
"""Methods whose roll is laid over itself, ride upon ride."""


def section(data: PageData) -> list[Section]:
    """Make the section; none if no ride has a score."""
    rides = rides_of(data.cases, data.methods)
    if not rides.cases:
        return []
    looks = {part: style for part, name in rides.names.items() for style in data.styles if style.name == name}
    examples: dict[str, CellResult] = {}
    for example in data.examples:
        examples.setdefault(example.recording.name, example)
    drawn = list(examples.values())
    spread = {
        part: spread_of(drawn, name)
        for part in ("gda_paper", "ekf_per_step", "ekf_intensity", "gda", "ekf")
        if (name := rides.names.get(part)) and len(drawn) > 1 and all(name in e.estimates for e in drawn)
    }
    evidence = judges.Evidence(rides, spread, _wrong_sign_deg(drawn))
    claims = judged(PAPER, evidence, judges, has=rides.has)
    twins = {one: ablated_rides(rides, data.cases, one) for one in ABLATIONS}
    for one, twin in twins.items():
        if twin is not None:
            # How roll repeats is of the rides that are drawn, none of which is of an ablation.
            beside = judges.Evidence(twin, {}, evidence.wrong_sign_deg)
            claims = with_ablation(claims, judged(PAPER, beside, judges, has=twin.has), one)
    shown: dict[str, Any] = {
        "paper": PAPER,
        "design": _table(rides, looks, reference="design"),
        "truth": _table(rides, looks, reference="truth"),
        "draws": max(int(case.table["draws"].max()) for case in rides.cases),
        "all_claims": claims,
        "ablations": [
            (WORDS[one].cost, cost_paragraph(rides, twin, one), _cost_table(rides, twin, looks, one))
            for one, twin in twins.items()
        ],
        "notes": _notes(rides),
        **_terms(drawn),
        **_drawings(rides, looks, drawn),
    }
    title = title_of(PAPER, shown["all_claims"])
    return [Section("paper", title, "papers/briales_2021/section.html.j2", shown)]


def _table(rides: Rides, looks: Mapping[str, MethodStyle], *, reference: str) -> Table:
    """Table 3: mean and standard deviation over the rides; beside it, against the design, the paper's own."""
    beside = reference == "design"
    rows = []
    for part, role in PAPER.parts.items():
        if part not in rides.names:
            continue
        printed = PAPER.printed.get(role.row, ()) if beside else ()
        cells = [_number(*figure) for figure in printed] or [NONE] * 3 * beside
        for window in ("cropped", "whole"):
            cells += [_number(*rides.mean(part, q, window=window, reference=reference)) for q in QUANTITIES]
        rows.append(Row(role.label, "", looks[part].colour if part in looks else "", cells))
    groups = [("printed in Table 3", 3)] * beside
    groups += [("ours, 2 s cropped at both ends", 3), ("ours, whole ride", 3)]
    return Table(groups, list(QUANTITIES) * len(groups), rows)


def cost_paragraph(rides: Rides, twin: Rides | None, ablation: Ablation) -> str:
    """What the methods lose by what a train has and an ablation has not, beside what the paper says of it."""
    parts = [part for part in PAPER.parts if rides.has(part) and (twin is None or twin.has(part))]
    costs = {
        quantity: {
            part: (rides.mean(part, quantity)[0], twin.mean(part, quantity)[0]) for part in parts if twin
        }
        for quantity in QUANTITIES
    }
    is_ablated = all(case.labels[ablation.column] == ablation.ablated for case in rides.cases)
    design = costs["roll"].pop("design", None)
    for quantity in ("pitch", "yaw"):
        costs[quantity].pop("design", None)
    worst = {
        quantity: max(own, key=lambda part: own[part][0] / max(own[part][1], 1e-12))
        for quantity, own in costs.items()
        if own
    }
    return PAPER.written(
        PAPER.words[ablation.column],
        costs=costs,
        worst=worst,
        design=design,
        known=twin is not None,
        is_ablated=is_ablated,
    )


def _cost_table(
    rides: Rides, twin: Rides | None, looks: Mapping[str, MethodStyle], ablation: Ablation
) -> Table | None:
    """Errors against the truth, mean over the rides, as a train has it and with the ablation."""
    if twin is None:
        return None
    rows = []
    for part, role in PAPER.parts.items():
        if rides.has(part) and twin.has(part):
            both = [one.mean(part, q)[0] for q in QUANTITIES for one in (rides, twin)]
            colour = looks[part].colour if part in looks else ""
            rows.append(Row(role.label, "", colour, [number_cell(value) for value in both]))
    groups = [(f"{quantity}, \u00b0 rms", 2) for quantity in QUANTITIES]
    return Table(groups, list(WORDS[ablation].heads) * len(groups), rows)


def _number(mean: float, sd: float) -> Cell:
    return number_cell(mean, decimals=3 if mean < 5.0 else 2, spread=sd)


def _notes(rides: Rides) -> list[str]:
    """Who loses to the design angles against the truth and who wins, and what the misprints cost."""
    notes = []
    if rides.has("design"):
        errors = {part: rides.mean(part, "roll")[0] for part in rides.present(list(PAPER.parts))}
        floor = errors.pop("design")
        notes.append(PAPER.written(PAPER.words["beside_design"], floor=floor, errors=errors))
    changes = {
        own.upper(): [rides.mean(part, "roll")[0] for part in (own, printed)]
        for own, printed in (("ekf", "ekf_printed"), ("gda", "gda_printed"))
        if rides.has(own, printed)
    }
    return notes + ([PAPER.written(PAPER.words["misprints"], changes=changes)] if changes else [])


def _terms(examples: Sequence[CellResult]) -> dict[str, Any]:
    """Table of the neglected terms, and their shares of the track's acceleration."""
    table, sizes = terms_table(examples)
    share = {term: size / sizes["track"] for term, size in sizes.items()}
    limit = PAPER.limits["other_hypotheses"]
    return {
        "terms": table,
        "sizes": sizes,
        "share": share,
        "share_printed": PAPER.figures["relative"][0] / PAPER.figures["track"][0],
        "large_terms": [term for term in ("coriolis", "angular") if sizes and share[term] >= limit],
        "slow_part_hz": SLOW_PART_HZ,
    }


def _wrong_sign_deg(examples: Sequence[CellResult]) -> float:
    """Roll that twice the largest lateral acceleration of the track would fake, on backward rides."""
    largest = float("nan")
    for example in examples:
        if direction_of(example) < 0:
            motion, recording = example.motion, example.recording
            curvature = example.line.frame(motion["position_m"].to_numpy()).k[:, 2]
            lateral = float(np.abs(motion["speed_mps"].to_numpy() ** 2 * curvature).max())
            fake = float(np.degrees(np.arctan(2.0 * lateral / recording.gravity_mps2)))
            largest = max(fake, largest) if largest == largest else fake
    return largest


def _drawings(
    rides: Rides, looks: Mapping[str, MethodStyle], examples: Sequence[CellResult]
) -> dict[str, Any]:
    """Our versions of Figs. 11 to 22; "" or empty where rides or methods are missing."""

    def drawn(*parts: str) -> list[MethodStyle]:
        styles = [looks[part] for part in parts if part in looks]
        return [style for style in styles if all(style.name in e.estimates for e in examples)]

    shown = drawn(*(part for part in PAPER.parts if not part.endswith("_printed")))
    main = next((e for e in examples if e.recording.name == TERMS_RIDE), next(iter(examples), None))
    first, repeated = drawn("ekf_per_step", "gda_paper", "vqf_magnetometer"), drawn(*_REPEATED)
    pairs = [drawn(*parts) for parts in (("gda", "gda_uncompensated"), ("ekf", "sabatini"))]
    pairs = [pair for pair in pairs if len(pair) == 2]
    forward = [e for e in examples if direction_of(e) > 0]
    by_speed = {is_fast(e.cell): e for e in reversed(forward)}
    slow_and_fast = [by_speed[fast] for fast in (False, True) if fast in by_speed]
    groups = {
        "As Figs. 15 and 16, slow forward rides": [e for e in forward if not is_fast(e.cell)],
        "As Figs. 17 and 18, slow rides in both directions": [e for e in examples if not is_fast(e.cell)],
        "As Figs. 19 and 20, forward rides, slow and fast": forward,
        "As Figs. 21 and 22, all rides": list(examples),
    }
    return {
        "main_ride": main.recording.name if main else "",
        "each_ride": canvas.drawn("paper-rides", partial(rides_figure, rides.cases, shown)) if shown else "",
        "attitude": canvas.drawn(
            "paper-attitude", partial(attitude_figure, main, first, what="Attitude, as Fig. 11")
        )
        if main and first
        else "",
        "compensation": canvas.drawn("paper-compensation", partial(compensation_figure, slow_and_fast, pairs))
        if pairs and slow_and_fast
        else "",
        "repeats": [
            (
                words,
                {style.label: spread_of(group, style.name) for style in repeated},
                canvas.drawn(
                    f"paper-repeats-{number}",
                    partial(repeatability_figure, group, repeated, what=f"Estimated roll. {words}"),
                ),
            )
            for number, (words, group) in enumerate(groups.items(), 1)
            if len(group) > 1 and repeated
        ],
    }
