"""The section itself: its tables, claims, notes and figures, gathered for the template.

Everything of ours is looked up in the scores, or computed from the first draw of each ride.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from simrail.campaign.cell import CellResult
from simrail.report.figures.attitude import attitude_figure
from simrail.report.figures.ride import direction_of
from simrail.report.papers.briales_2021.figures import (
    compensation_figure,
    repeatability_figure,
    rides_figure,
    spread_of,
)
from simrail.report.papers.briales_2021.method_claims import method_claims
from simrail.report.papers.briales_2021.printed import QUANTITIES, TABLE_3, TERMS_RIDE
from simrail.report.papers.briales_2021.ride_claims import ride_claims
from simrail.report.papers.briales_2021.rides import PARTS, Rides, is_fast, rides_of
from simrail.report.papers.briales_2021.terms import terms_table
from simrail.report.papers.claim import Claim
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Figures
from simrail.report.tables.tables import Cell, Row, Table
from simrail.report.words.sentences import degrees
from simrail.scenario.cells import Method

_REPEATED = ("gda_paper", "ekf_per_step", "ekf")
"""Methods whose roll is laid over itself, ride upon ride."""


@dataclass(frozen=True)
class PaperView:
    """The section as the template needs it."""

    design: Table
    truth: Table
    draws: int
    claims: list[Claim]
    notes: list[str]
    terms: Table
    terms_text: str
    figures: list[tuple[str, Markup]]
    heading: str = "Briales et al. 2021"
    template: str = "papers/briales_2021/section.html.j2"


def paper_view(
    all_cases: Sequence[Figures],
    methods: Sequence[Method],
    styles: Sequence[MethodStyle],
    examples: Sequence[CellResult],
) -> PaperView | None:
    """Make the section; None if no ride has a score.

    Parameters
    ----------
    all_cases : sequence of Figures
        The scores.
    methods, styles : sequence
        The scenario's methods and how they look.
    examples : sequence of CellResult
        First draw of each ride.
    """
    rides = rides_of(all_cases, methods)
    if not rides.cases:
        return None
    looks = {part: style for part, name in rides.names.items() for style in styles if style.name == name}
    drawn = _first_of_each_ride(examples)
    spread: dict[str, float] = {
        part: spread_of(drawn, rides.names[part])
        for part in ("gda_paper", "ekf_per_step", "ekf_intensity", "gda", "ekf")
        if part in rides.names and len(_with(drawn, rides.names[part])) == len(drawn) > 1
    }
    terms, terms_text = terms_table(drawn)
    return PaperView(
        design=_table(rides, looks, reference="design"),
        truth=_table(rides, looks, reference="truth"),
        draws=max(int(case.table["draws"].max()) for case in rides.cases),
        claims=[
            *method_claims(rides),
            *ride_claims(rides, spread=spread, wrong_sign_deg=_wrong_sign_deg(drawn)),
        ],
        notes=_notes(rides),
        terms=terms,
        terms_text=terms_text,
        figures=_figures(rides, looks, drawn),
    )


def _first_of_each_ride(examples: Sequence[CellResult]) -> list[CellResult]:
    first: dict[str, CellResult] = {}
    for example in examples:
        first.setdefault(example.recording.name, example)
    return list(first.values())


def _with(examples: Sequence[CellResult], name: str) -> list[CellResult]:
    return [example for example in examples if name in example.estimates]


def _table(rides: Rides, looks: dict[str, MethodStyle], *, reference: str) -> Table:
    """Table 3: mean and standard deviation over the rides; beside it, against the design, the paper's own."""
    windows = ("cropped", "whole")
    beside = reference == "design"
    rows = []
    for part in (part for part in PARTS if part in rides.names):
        label, printed_row = PARTS[part]
        cells = []
        if beside:
            printed = TABLE_3.get(printed_row, ())
            cells += [_number(p.mean, p.sd) for p in printed] or [Cell("\u2013", mark="none")] * 3
        for window in windows:
            cells += [
                _number(*rides.mean(part, quantity, window=window, reference=reference))
                for quantity in QUANTITIES
            ]
        style = looks.get(part)
        rows.append(Row(label, "", style.colour if style else "", cells))
    groups = [("printed in Table 3", 3)] if beside else []
    groups += [("ours, 2 s cropped at both ends", 3), ("ours, whole ride", 3)]
    return Table(groups, list(QUANTITIES) * len(groups), rows)


def _number(mean: float, sd: float) -> Cell:
    if not np.isfinite(mean):
        return Cell("\u2013", mark="none")
    decimals = 3 if mean < 5.0 else 2
    spread = f"{sd:.{decimals}f}" if np.isfinite(sd) else ""
    return Cell(f"{mean:.{decimals}f}", spread)


def _notes(rides: Rides) -> list[str]:
    """What the paper does not ask: the angles of the drawing, and what its misprints cost."""
    notes = []
    if rides.has("design"):
        floor = rides.mean("design", "roll")[0]
        lost: list[str] = []
        won: list[str] = []
        for part in rides.present([p for p in PARTS if p != "design"]):
            own = rides.mean(part, "roll")[0]
            (lost if own > floor else won).append(f"{PARTS[part][0]} ({degrees(own)})")
        notes.append(
            "The paper scores against the design angles, where 'design angles only', a method that uses "
            "no IMU at all, would err by nothing but its odometry. Against the truth it errs by "
            f"{degrees(floor)} rms in roll, mean over the rides. Worse than that: "
            f"{'; '.join(lost) or 'none'}. Better: {'; '.join(won) or 'none'}."
        )
    costs = [
        f"{own.upper()} from {degrees(rides.mean(own, 'roll')[0])} to "
        f"{degrees(rides.mean(printed, 'roll')[0])}"
        for own, printed in (("ekf", "ekf_printed"), ("gda", "gda_printed"))
        if rides.has(own, printed)
    ]
    if costs:
        notes.append(
            "The misprints of Eqs. 3 to 6 change the roll error, rms, mean over the rides: "
            f"{', '.join(costs)}."
        )
    return notes


def _wrong_sign_deg(examples: Sequence[CellResult]) -> float:
    """Roll that twice the largest lateral acceleration of the track would fake, on backward rides."""
    backward = [example for example in examples if direction_of(example) < 0]
    if not backward:
        return float("nan")

    def lateral(example: CellResult) -> float:
        motion = example.motion
        frame = example.recording.track.frame(motion["position_m"].to_numpy())
        return float(np.abs(motion["speed_mps"].to_numpy() ** 2 * frame.k[:, 2]).max())

    largest = max(backward, key=lateral)
    return float(np.degrees(np.arctan(2.0 * lateral(largest) / largest.recording.gravity_mps2)))


def _figures(
    rides: Rides, looks: dict[str, MethodStyle], examples: Sequence[CellResult]
) -> list[tuple[str, Markup]]:
    """Our versions of Figs. 11 to 22, each with its caption."""
    figures: list[tuple[str, str]] = []

    def drawn(parts: Sequence[str]) -> list[MethodStyle]:
        there = [looks[part] for part in parts if part in looks]
        return [style for style in there if all(style.name in e.estimates for e in examples)]

    shown = drawn([part for part in PARTS if not part.endswith("_printed")])
    if shown:
        text = (
            "As Fig. 12: rms difference to the design angles of each method on each ride, on a "
            "logarithmic axis; hollow: baselines and methods that do not know the track. Strokes: one "
            "standard deviation between draws of the sensors, where there are several."
        )
        figures.append((text, rides_figure(rides.cases, shown)))
    main = next((e for e in examples if e.recording.name == TERMS_RIDE), examples[0] if examples else None)
    first = drawn(("ekf_per_step", "gda_paper", "vqf_magnetometer"))
    if main and first:
        text = (
            f"As Fig. 11, ride {main.recording.name}: EKF and GDA with the paper's settings, and a "
            "general-purpose filter with magnetometer, which stands in for the commercial one."
        )
        figures.append((text, attitude_figure(main, first, what=text)))
    pairs = [
        (pair[0], pair[1])
        for names in (("gda", "gda_uncompensated"), ("ekf", "sabatini"))
        if len(pair := drawn(names)) == 2
    ]
    forward = [e for e in examples if direction_of(e) > 0]
    chosen = [e for e in (_first(forward, fast=False), _first(forward, fast=True)) if e]
    if pairs and chosen:
        text = (
            "As Figs. 13 and 14: roll with and without compensation, slow and fast. What the "
            "uncompensated filters miss is the lateral acceleration of the curves, which grows with the "
            "square of speed."
        )
        figures.append((text, compensation_figure(chosen, pairs)))
    repeated = drawn(_REPEATED)
    groups = {
        "As Figs. 15 and 16, slow forward rides.": [e for e in forward if not is_fast(e.cell)],
        "As Figs. 17 and 18, slow rides in both directions.": [e for e in examples if not is_fast(e.cell)],
        "As Figs. 19 and 20, forward rides, slow and fast.": forward,
        "As Figs. 21 and 22, all rides.": list(examples),
    }
    for text, group in groups.items():
        if len(group) > 1 and repeated:
            spreads = "; ".join(f"{s.label} {degrees(spread_of(group, s.name))}" for s in repeated)
            text += f" Estimated roll; dashed: design. Spread of the error between these rides: {spreads}."
            figures.append((text, repeatability_figure(group, repeated, what=text)))
    return [(text, Markup(svg)) for text, svg in figures]


def _first(examples: Sequence[CellResult], *, fast: bool) -> CellResult | None:
    return next((e for e in examples if is_fast(e.cell) == fast), None)
