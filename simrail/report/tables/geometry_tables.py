"""Tables of rail geometry: errors by band beside the baseline, and indicators against limits."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from simrail.report.tables.geometry_bands import JUDGED, QUANTITIES, band_words, bands_of_case, judged_band
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import NOTHING, Case
from simrail.report.tables.tables import DECIMALS, NONE, Cell, Row, Table, mean_cell, number_cell
from simrail.scoring.table import FULL
from simrail.track.bands import BANDS, Band
from simrail.track.quality import Limits, section_indicators


def mappers(case: Case, styles: Sequence[MethodStyle]) -> list[MethodStyle]:
    """Methods that say what the rails look like."""
    return [style for style in styles if case.get(style.name, "vertical_profile", "sd").draws]


def is_zero(style: MethodStyle) -> bool:
    """Whether a method is the baseline that answers 0."""
    return style.baseline == "no IMU"


def baseline_of(case: Case, styles: Sequence[MethodStyle]) -> MethodStyle | None:
    """The baseline, if it was run."""
    return next((style for style in mappers(case, styles) if is_zero(style)), None)


def main_of(case: Case, styles: Sequence[MethodStyle]) -> MethodStyle | None:
    """The scenario's first method under test, which sentences speak of; the tables hold all."""
    return next((style for style in mappers(case, styles) if not is_zero(style)), None)


def sd_of(case: Case, style: MethodStyle, quantity: str, *, band: str) -> float:
    """Standard deviation of an error in a band, mm."""
    return case.get(style.name, quantity, "sd", band=band).value


def behind_baseline(
    case: Case, styles: Sequence[MethodStyle], quantity: str, *, band: str
) -> list[MethodStyle]:
    """Methods that err more than the baseline, which uses no IMU; none if that was not run."""
    floor = baseline_of(case, styles)
    if floor is None:
        return []
    least = sd_of(case, floor, quantity, band=band)
    tested = [style for style in mappers(case, styles) if not is_zero(style)]
    return [style for style in tested if sd_of(case, style, quantity, band=band) > least]


def geometry_table(
    case: Case, styles: Sequence[MethodStyle], *, known: Mapping[str, Band] = BANDS
) -> Table | None:
    """Errors by quantity, method and band; None if the case has no rail geometry.

    Parameters
    ----------
    case, styles : Case, sequence of MethodStyle
        The case and the scenario's methods.
    known : mapping of str to Band
        Bands whose wavelengths are told.
    """
    bands, shown = bands_of_case(case), mappers(case, styles)
    judged = judged_band(case)
    if not bands or not shown:
        return None
    rows = []
    for quantity, words in QUANTITIES.items():
        if not any(case.get(s.name, quantity, "sd").draws for s in shown):
            if _is_unobservable(case, quantity):
                is_base = _is_base(case, quantity, shown)
                why = (
                    "its base is no multiple of the geometry's step"
                    if is_base
                    else "no sensor sees the rails"
                )
                rows.append(Row(f"{words}: {why}", "", "", _open(len(bands) + 3, is_base=is_base)))
            continue
        for style in shown:
            if not case.get(style.name, quantity, "sd").draws:
                # What a method under test leaves open is told; of rails as designed it goes without saying.
                if not is_zero(style) and _is_unobservable(case, quantity, style.name):
                    left = _open(len(bands) + 3, is_base=_is_base(case, quantity, [style]))
                    rows.append(Row(f"{words}: {style.label}", "", style.colour, left))
                continue
            cells = []
            for band in bands:
                mean = case.get(style.name, quantity, "sd", band=band)
                mark = "" if is_zero(style) else _mark(case, shown, quantity, band, mean.value)
                cells.append(mean_cell(mean, mark=mark))
            cells.append(mean_cell(case.get(style.name, quantity, "mean"), decimals=2))
            cells.append(mean_cell(case.get(style.name, quantity, "max", band=judged), decimals=2))
            cells.append(mean_cell(case.get(style.name, quantity, "coverage95"), decimals=0, scale=100.0))
            rows.append(
                Row(f"{words}: {style.label}", style.baseline if is_zero(style) else "", style.colour, cells)
            )
    groups = [("standard deviation of the error, mm", len(bands)), ("mean, mm", 1), ("max, mm", 1)]
    groups += [("inside 95 %", 1)]
    words_of = {band: band_words(band, known) for band in bands}
    columns = [*words_of.values(), "unfiltered", words_of[judged].partition(" (")[0], "interval, %"]
    return Table(groups, columns, rows)


def _mark(case: Case, shown: Sequence[MethodStyle], quantity: str, band: str, value: float) -> str:
    """How the error of a method under test is marked: the best of them, worse than without any IMU."""
    tested, floor = (
        [case.get(s.name, quantity, "sd", band=band).value for s in shown if is_zero(s) is baseline]
        for baseline in (False, True)
    )
    # As they are shown: what reads the same is as good.
    is_best = round(value, DECIMALS) == round(
        min((v for v in tested if np.isfinite(v)), default=np.nan), DECIMALS
    )
    is_worse = any(value > v for v in floor)
    return " ".join(word for word, holds in (("best", is_best), ("worse", is_worse)) if holds)


def _is_base(case: Case, quantity: str, styles: Sequence[MethodStyle]) -> bool:
    """Whether twist is left open for its base: it follows from the cross-level, and that is known."""
    return quantity == "twist" and any(case.get(s.name, "cross_level", "sd").draws for s in styles)


def _open(columns: int, *, is_base: bool) -> list[Cell]:
    """Cells of a quantity that is left open."""
    return [
        Cell("not computed" if is_base else "not observable", mark="none"),
        *[NONE] * (columns - 1),
    ]


def _is_unobservable(case: Case, quantity: str, name: str = "") -> bool:
    """Whether the unfiltered quantity was left open, which is no failure: by a method, or by all."""
    table = case.table
    rows = table[(table["quantity"].astype(str) == quantity) & (table["band"].astype(str) == FULL)]
    if name:
        rows = rows[rows["estimator"].astype(str) == name]
    return len(rows) > 0 and bool(((rows["draws"] == 0) & (rows["failed"] == 0)).all())


def overview_table(
    all_cases: Sequence[Case], styles: Sequence[MethodStyle], *, known: Mapping[str, Band] = BANDS
) -> Table | None:
    """Error of the first method and of the baseline in the band that a case is judged in, a row per case.

    None without geometry.
    """
    rows = []
    for case in all_cases:
        cells, band = [], judged_band(case)
        floor, main = baseline_of(case, styles), main_of(case, styles)
        for quantity in JUDGED:
            own, zero = (
                case.get(style.name, quantity, "sd", band=band) if style else NOTHING
                for style in (main, floor)
            )
            mark = "worse" if own.value > zero.value else ""
            cells += [mean_cell(own, mark=mark), mean_cell(zero, decimals=2)]
        if all(cell.mark == "none" for cell in cells):
            continue
        labels = case.labels
        note = ", an ablation" if labels["odometry"] == "truth" else ""
        label = (
            f"{labels['ride']} \u00b7 {labels['mount']} ({labels['imu']}) \u00b7 {labels['odometry']}{note} "
            f"\u00b7 {band_words(band, known)}"
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
    true, own = (
        section_indicators(rails, band=band, limits=limits).set_index(["start_m", "quantity"])
        for rails in (truth, found)
    )
    both = true.index.intersection(own.index)
    quantities = [q for q in JUDGED if q in both.get_level_values("quantity")]
    rows = []
    for start in sorted(set(both.get_level_values("start_m"))):
        cells = []
        for place in ((start, quantity) for quantity in quantities):
            for what in ("sd_m", "peak_m"):
                cells += [
                    _indicator(part.loc[place], what) if place in both else NONE for part in (true, own)
                ]
        rows.append(Row(f"{start:.0f} to {start + 200.0:.0f} m", "", "", cells))
    groups = [(QUANTITIES[q], 4) for q in quantities]
    return Table(groups, ["sd", "found", "peak", "found"] * len(quantities), rows)


def _indicator(line: pd.Series, what: str) -> Cell:
    beyond = bool(line["sd_exceeded"]) if what == "sd_m" else line["defects"] > 0
    return number_cell(1e3 * float(line[what]), decimals=2, mark="worse" if beyond else "")
