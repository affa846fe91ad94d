"""The section "Beside Briales et al. 2021": their Table 3, section 8, figures and claims beside ours.

Shown where the scenario says ``paper = "briales_2021"``. What the paper printed, and which of our methods stand
for which of theirs, is in `simrail.report.paper_000_data`; the verdicts are in `simrail.report.paper_000_claims`.
Everything of ours is looked up in the scores, or computed from the first draw of each ride.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from simrail.example import CellResult
from simrail.jit import FloatArray
from simrail.relative_motion import acceleration_terms, below
from simrail.report.attitude_figures import attitude_figure
from simrail.report.findings import degrees
from simrail.report.methods import MethodStyle
from simrail.report.paper_000_claims import Claim, claims
from simrail.report.paper_000_data import (
    PARTS,
    PRINTED_TERMS,
    QUANTITIES,
    TABLE_3,
    TERMS_RIDE,
    Rides,
    is_fast,
    rides_of,
)
from simrail.report.paper_000_figures import (
    compensation_figure,
    repeatability_figure,
    rides_figure,
    spread_of,
)
from simrail.report.pivot import Figures
from simrail.report.ride_figures import direction_of
from simrail.report.tables import Cell, Row, Table
from simrail.scenario.cells import Method

SLOW_PART_HZ = 0.5
"""What of the relative acceleration lies below it disturbs a filter that averages over a second or more."""

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
    looks = {
        part: style for part, name in rides.names.items() for style in styles if style.name == name
    }
    drawn = _first_of_each_ride(examples)
    spread = {
        part: spread_of(drawn, rides.names[part])
        for part in ("gda_paper", "ekf_per_step", "ekf_intensity", "gda", "ekf")
        if part in rides.names and len(_with(drawn, rides.names[part])) == len(drawn) > 1
    }
    terms, terms_text = _terms(drawn)
    return PaperView(
        design=_table(rides, looks, reference="design"),
        truth=_table(rides, looks, reference="truth"),
        draws=max(int(case.table["draws"].max()) for case in rides.cases),
        claims=claims(rides, spread=spread, wrong_sign_deg=_wrong_sign_deg(drawn)),
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
    for part in rides.present(list(PARTS)):
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
        lost, won = [], []
        for part in rides.present([p for p in PARTS if p != "design"]):
            own = rides.mean(part, "roll")[0]
            (lost if own > floor else won).append(f"{PARTS[part][0]} ({degrees(own)})")
        notes.append(
            "The paper scores against the design angles, where 'design angles only', a method that uses no IMU at all, "
            f"would err by nothing but its odometry. Against the truth it errs by {degrees(floor)} rms in roll, mean "
            f"over the rides. Worse than that: {'; '.join(lost) or 'none'}. Better: {'; '.join(won) or 'none'}."
        )
    for own, printed in (("ekf", "ekf_printed"), ("gda", "gda_printed")):
        if rides.has(own, printed):
            a, b = (rides.mean(part, "roll")[0] for part in (own, printed))
            notes.append(
                f"Misprints of Eqs. 2 to 6 in the compensation change the roll error of the {own.upper()} from "
                f"{degrees(a)} to {degrees(b)} rms, mean over the rides."
            )
    return notes


def _sd(signal: FloatArray) -> FloatArray:
    """Standard deviation of x, y, z, and of the vector as a whole: (n, 3) to (4,)."""
    variance = signal.var(axis=0)
    return np.sqrt(np.append(variance, variance.sum()))


def _terms(examples: Sequence[CellResult]) -> tuple[Table, str]:
    """The terms of section 8 on our rides; all four columns for the paper's ride, the vector's for the others."""
    rows_of = {
        "relative acceleration r\u2033": ("relative", "relative"),
        f"the same below {SLOW_PART_HZ:g} Hz": ("", "slow"),
        "Coriolis 2 \u03c9 \u00d7 r\u2032": ("coriolis", "coriolis"),
        "(\u03b1 + \u03c9\u03c9) r, r from the track to the IMU": ("", "angular"),
        "(\u03b1 + \u03c9\u03c9) r, r less the IMU's nominal place": ("angular", "deviation"),
        "track acceleration R\u2033": ("track", "track"),
    }
    found: dict[str, dict[str, FloatArray]] = {}
    for example in examples:
        recording = example.recording
        parts = acceleration_terms(
            example.motion,
            recording.track,
            nominal_m=recording.mount_position_m,
            gravity_mps2=recording.gravity_mps2,
        )
        slow = below(parts.relative, frequency_hz=SLOW_PART_HZ, rate_hz=recording.imu_sheet.rate_hz)
        found[recording.name] = {
            "relative": _sd(parts.relative),
            "slow": _sd(slow),
            "coriolis": _sd(parts.coriolis),
            "angular": _sd(parts.angular),
            "deviation": _sd(parts.angular_of_deviation),
            "track": _sd(parts.track),
        }
    names = list(found)
    main = TERMS_RIDE if TERMS_RIDE in found else (names[0] if names else "")
    others = [name for name in names if name != main]
    rows = []
    for label, (printed, key) in rows_of.items():
        cells = [_size(PRINTED_TERMS[printed]) if printed else Cell("\u2013", mark="none")]
        if main:
            cells += [_size(value) for value in found[main][key]]
        cells += [_size(found[name][key][3]) for name in others]
        rows.append(Row(label, "", "", cells))
    groups = [("printed", 1), (f"ours, {main}", 4), ("ours, whole vector", len(others))]
    table = Table(groups, [TERMS_RIDE, "x", "y", "z", "vector", *others], rows)
    return table, _terms_text(found.get(main, {}))


def _size(value: float) -> Cell:
    if value == 0.0:
        return Cell("0")
    exponent = int(np.floor(np.log10(value)))
    if exponent >= -3:
        return Cell(f"{value:.{2 - exponent if exponent < 2 else 0}f}")
    superscript = str(exponent).translate(str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"))
    return Cell(f"{value / 10.0**exponent:.2f}\u00b710{superscript}")


def _terms_text(sizes: dict[str, FloatArray]) -> str:
    if not sizes:
        return ""
    share = {key: sizes[key][3] / sizes["track"][3] for key in ("relative", "slow", "coriolis", "angular")}
    small = [key for key in ("coriolis", "angular") if share[key] < 0.01]
    text = (
        f"As a share of the track's acceleration on this ride: relative acceleration {100 * share['relative']:.0f} % "
        f"(the paper: {100 * PRINTED_TERMS['relative'] / PRINTED_TERMS['track']:.0f} %), its part below "
        f"{SLOW_PART_HZ:g} Hz {100 * share['slow']:.1f} %, Coriolis {100 * share['coriolis']:.2g} %, angular terms "
        f"{100 * share['angular']:.2g} %. "
    )
    text += (
        "The second and third hypotheses hold (each below 1 %). "
        if len(small) == 2
        else "Not below 1 %: " + ", ".join(k for k in ("coriolis", "angular") if k not in small) + ". "
    )
    relative = "does not hold" if share["relative"] > 0.1 else "holds"
    text += f"The first, that the body does not accelerate in the track frame, {relative} (limit 10 %), as in the paper"
    text += (
        "; but what of it is slow enough to pass a filter is "
        f"{share['relative'] / max(share['slow'], 1e-12):.0f} times smaller."
        if share["relative"] > 0.1
        else "."
    )
    ratio = sizes["angular"][3] / PRINTED_TERMS["angular"]
    return text + (
        f" The printed angular term is {ratio:.0f} times below ours with r = the IMU's place; with r as the small "
        f"displacement that the paper integrates, ours is {sizes['deviation'][3] / PRINTED_TERMS['angular']:.1f} times it."
    )


def _wrong_sign_deg(examples: Sequence[CellResult]) -> float:
    """Roll that twice the lateral acceleration of the sharpest curve would fake on the fastest backward ride."""
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
            "As Fig. 12: rms difference to the design angles of each method on each ride, on a logarithmic axis; hollow: "
            "baselines and methods that do not know the track. Strokes: one standard deviation between draws of the "
            "sensors, where there are several."
        )
        figures.append((text, rides_figure(rides.cases, shown)))
    main = next((e for e in examples if e.recording.name == TERMS_RIDE), examples[0] if examples else None)
    first = drawn(("ekf_per_step", "gda_paper", "vqf_magnetometer"))
    if main and first:
        text = (
            f"As Fig. 11, ride {main.recording.name}: EKF and GDA with the paper's settings, and a general-purpose filter "
            "with magnetometer, which stands in for the commercial one."
        )
        figures.append((text, attitude_figure(main, first, what=text)))
    pairs = [
        tuple(pair)
        for names in (("gda", "gda_uncompensated"), ("ekf", "sabatini"))
        if len(pair := drawn(names)) == 2
    ]
    forward = [e for e in examples if direction_of(e) > 0]
    chosen = [e for e in (_first(forward, fast=False), _first(forward, fast=True)) if e]
    if pairs and chosen:
        text = (
            "As Figs. 13 and 14: roll with and without compensation, slow and fast. What the uncompensated filters miss is "
            "the lateral acceleration of the curves, which grows with the square of speed."
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
            text += (
                f" Estimated roll, over each other; dashed: design. Spread of the error between these rides: {spreads}."
            )
            figures.append((text, repeatability_figure(group, repeated, what=text)))
    return [(text, Markup(svg)) for text, svg in figures]


def _first(examples: Sequence[CellResult], *, fast: bool) -> CellResult | None:
    return next((e for e in examples if is_fast(e.cell) == fast), None)
