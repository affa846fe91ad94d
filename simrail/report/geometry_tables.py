"""Tables and sentences of rail geometry: errors by band beside the baseline, and indicators against "
"limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from simrail.bands import Band
from simrail.report.findings import Finding, significant
from simrail.report.geometry_bands import BAND, JUDGED, QUANTITIES, band_words, bands_of_case
from simrail.report.methods import MethodStyle
from simrail.report.pivot import Figure, Figures
from simrail.report.tables import Cell, Row, Table
from simrail.score_table import FULL
from simrail.track_quality import Limits, section_indicators


def mappers(case: Figures, styles: Sequence[MethodStyle]) -> list[MethodStyle]:
    """Methods that say what the rails look like."""
    return [style for style in styles if case.get(style.name, "vertical_profile", "sd").draws]


def is_zero(style: MethodStyle) -> bool:
    """Whether a method is the baseline that answers 0."""
    return style.baseline == "no IMU"


def baseline_of(case: Figures, styles: Sequence[MethodStyle]) -> MethodStyle | None:
    """The baseline, if it was run."""
    return next((style for style in mappers(case, styles) if is_zero(style)), None)


def main_of(case: Figures, styles: Sequence[MethodStyle]) -> MethodStyle | None:
    """The scenario's first method under test, which sentences speak of; the tables hold all."""
    return next((style for style in mappers(case, styles) if not is_zero(style)), None)


def sd_of(case: Figures, style: MethodStyle, quantity: str, *, band: str = BAND) -> float:
    """Standard deviation of an error in a band, mm."""
    return case.get(style.name, quantity, "sd", band=band).value


def geometry_table(case: Figures, styles: Sequence[MethodStyle]) -> Table | None:
    """Errors by quantity, method and band; None if the case has no rail geometry."""
    bands, shown = bands_of_case(case), mappers(case, styles)
    if not bands or not shown:
        return None
    rows = []
    for quantity, words in QUANTITIES.items():
        if not any(case.get(s.name, quantity, "sd").draws for s in shown):
            if _is_unobservable(case, quantity):
                why = Cell("not observable", mark="none")
                rest = [Cell("\u2013", mark="none")] * (len(bands) + 2)
                rows.append(Row(f"{words}: no sensor sees the rails", "", "", [why, *rest]))
            continue
        for style in shown:
            cells = []
            for band in bands:
                found = case.get(style.name, quantity, "sd", band=band)
                mark = "" if is_zero(style) else _mark(case, shown, quantity, band, found.value)
                cells.append(_cell(found, mark=mark))
            cells.append(_cell(case.get(style.name, quantity, "mean"), decimals=2))
            cells.append(_cell(case.get(style.name, quantity, "max", band=BAND), decimals=2))
            cells.append(_cell(case.get(style.name, quantity, "coverage95"), decimals=0, scale=100.0))
            rows.append(
                Row(f"{words}: {style.label}", style.baseline if is_zero(style) else "", style.colour, cells)
            )
    groups = [("standard deviation of the error, mm", len(bands)), ("mean, mm", 1), ("max, mm", 1)]
    groups += [("inside 95 %", 1)]
    return Table(groups, [*map(band_words, bands), "unfiltered", BAND, "interval, %"], rows)


def _mark(case: Figures, shown: Sequence[MethodStyle], quantity: str, band: str, value: float) -> str:
    """How the error of a method under test is marked: the best of them, worse than without any IMU."""
    tested, floor = (
        [case.get(s.name, quantity, "sd", band=band).value for s in shown if is_zero(s) is baseline]
        for baseline in (False, True)
    )
    is_best = value == min((v for v in tested if np.isfinite(v)), default=np.nan)
    is_worse = any(value > v for v in floor)
    return " ".join(word for word, holds in (("best", is_best), ("worse", is_worse)) if holds)


def _is_unobservable(case: Figures, quantity: str) -> bool:
    """Whether the unfiltered quantity was left open, which is no failure."""
    rows = case.table[
        (case.table["quantity"].astype(str) == quantity) & (case.table["band"].astype(str) == FULL)
    ]
    return len(rows) > 0 and bool(((rows["draws"] == 0) & (rows["failed"] == 0)).all())


def overview_table(all_cases: Sequence[Figures], styles: Sequence[MethodStyle]) -> Table | None:
    """Error in `BAND` of the first method and of the baseline, one row per case; None without geometry."""
    rows = []
    for case in all_cases:
        cells = []
        floor, main = baseline_of(case, styles), main_of(case, styles)
        for quantity in JUDGED:
            found = case.get(main.name, quantity, "sd", band=BAND) if main else Figure(np.nan, np.nan, 0)
            zero = case.get(floor.name, quantity, "sd", band=BAND) if floor else Figure(np.nan, np.nan, 0)
            mark = "worse" if found.value > zero.value else ""
            cells += [_cell(found, mark=mark), _cell(zero, decimals=2)]
        if all(cell.mark == "none" for cell in cells):
            continue
        labels = case.labels
        note = ", an ablation" if labels["odometry"] == "truth" else ""
        label = (
            f"{labels['ride']} \u00b7 {labels['mount']} ({labels['imu']}) \u00b7 {labels['odometry']}{note}"
        )
        rows.append(Row(label, "", "", cells))
    if not rows:
        return None
    groups = [(f"{QUANTITIES[quantity]}, mm", 2) for quantity in JUDGED]
    return Table(groups, ["found", "no IMU"] * len(JUDGED), rows)


def indicator_table(
    truth: pd.DataFrame, found: pd.DataFrame, *, limits: Mapping[str, Limits], band: Band
) -> Table:
    """Indicators per section of true rails and of an estimate; what is beyond a limit is marked."""
    lines = {}
    for name, geometry in (("true", truth), ("found", found)):
        indicators = section_indicators(geometry, band=band, limits=limits)
        lines[name] = indicators.set_index(["start_m", "quantity"])
    both = lines["true"].index.intersection(lines["found"].index)
    quantities = [q for q in JUDGED if q in both.get_level_values("quantity")]
    rows = []
    for start in sorted(set(both.get_level_values("start_m"))):
        cells = []
        for quantity in quantities:
            at = (start, quantity)
            there = at in both
            for what in ("sd_m", "peak_m"):
                for name in ("true", "found"):
                    cells.append(_indicator(lines[name].loc[at] if there else None, what))
        rows.append(Row(f"{start:.0f} to {start + 200.0:.0f} m", "", "", cells))
    groups = [(QUANTITIES[q], 4) for q in quantities]
    columns = ["sd", "found", "peak", "found"] * len(quantities)
    return Table(groups, columns, rows)


def _indicator(line: pd.Series | None, what: str) -> Cell:
    if line is None:
        return Cell("\u2013", mark="none")
    beyond = bool(line["sd_exceeded"]) if what == "sd_m" else line["defects"] > 0
    return Cell(f"{1e3 * float(line[what]):.2f}".replace("-", "\u2212"), mark="worse" if beyond else "")


def geometry_findings(
    case: Figures,
    styles: Sequence[MethodStyle],
    others: Sequence[Figures],
    *,
    goals_mm: Mapping[str, float] | None = None,
) -> list[Finding]:
    """What the scores say of the rails: the first method in `BAND`, beside no IMU, and what its error is of.

    Parameters
    ----------
    case, styles : Figures, sequence of MethodStyle
        The case and the scenario's methods.
    others : sequence of Figures
        All cases: those with the true position and an ideal IMU say what the error is of.
    goals_mm : mapping of str to float, optional
        By quantity: what its error in `BAND` is asked to be at most, sd.
    """
    floor, main = baseline_of(case, styles), main_of(case, styles)
    if main is None:
        return []
    result = []
    for quantity in JUDGED:
        own, words = sd_of(case, main, quantity), QUANTITIES[quantity]
        if not own > 0.0:
            continue
        text = f"In {band_words(BAND)}, the {words} of {main.label} is off by {significant(own)} mm (sd)"
        tone = "note"
        if floor:
            zero = sd_of(case, floor, quantity)
            tone = "good" if own < zero else "bad"
            text += f"; that of no IMU at all by {significant(zero)} mm"
        goal = (goals_mm or {}).get(quantity)
        if goal is not None:
            tone = "bad" if own > goal else tone
            over = f"missed by {significant(own - goal)} mm" if own > goal else "kept"
            text += f". Asked were {goal:g} mm: {over}"
        parts = []
        for name, words_of in (("odometry", "with the true position"), ("imu", "with an ideal IMU")):
            twin = _twin(case, others, name)
            if twin:
                parts.append(f"{words_of} {significant(sd_of(twin, main, quantity))} mm")
        both = _twin(case, others, "both")
        if both:
            least = sd_of(both, main, quantity)
            parts.append(
                f"with both {significant(least)} mm, which is the vehicle between IMU and rails, and the "
                f"method"
            )
        text += f". It would be: {'; '.join(parts)}." if parts else "."
        result.append(Finding(tone, text))
        covered = case.get(main.name, quantity, "coverage95")
        if covered.draws:
            result += _coverage(main.label, words, covered.value)
    return result


def _coverage(label: str, words: str, value: float) -> list[Finding]:
    tone, verdict = "good", "about right"
    if value < 0.9:
        tone, verdict = "bad", "too small"
    elif value > 0.985:
        tone, verdict = "note", "larger than its errors"
    text = f"The 95 % interval of the {words} of {label} holds the truth in {100.0 * value:.0f} %: {verdict}."
    return [Finding(tone, text)]


def _twin(case: Figures, others: Sequence[Figures], what: str) -> Figures | None:
    """The case that differs in an ideal IMU, the true odometry, or both; None if there is none."""
    if case.labels["imu"] == "ideal" or case.labels["odometry"] == "truth":
        return None
    mount = case.labels["mount"]
    wanted = dict(case.labels)
    for other in others:
        labels = other.labels
        is_ideal = labels["imu"] == "ideal"
        same_mount = labels["mount"] in (mount, f"{mount}_ideal")
        if not same_mount or any(labels[k] != wanted[k] for k in ("ride", "vehicle")):
            continue
        odometry_true = labels["odometry"] == "truth"
        same_odometry = labels["odometry"] == wanted["odometry"]
        fits = {
            "odometry": odometry_true and labels["imu"] == wanted["imu"],
            "imu": is_ideal and same_odometry,
            "both": is_ideal and odometry_true,
        }
        if fits[what]:
            return other
    return None


def _cell(found: Figure, *, decimals: int = 3, mark: str = "", scale: float = 1.0) -> Cell:
    if found.draws == 0 or not np.isfinite(found.value):
        return Cell("\u2013", mark="none")
    spread = f"{scale * found.sd:.{decimals}f}" if found.sd > 0.0 else ""
    value = round(scale * found.value, decimals) + 0.0
    return Cell(f"{value:.{decimals}f}".replace("-", "\u2212"), spread, mark)
