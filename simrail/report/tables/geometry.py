"""Rail geometry: bands of wavelengths as page and terminal speak of them, errors by band beside the baseline.

Which bands a case has, in which one it is judged, and indicators against limits.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import NOTHING, Case
from simrail.report.tables.tables import DECIMALS, NONE, Cell, Row, Table, mean_cell, number_cell
from simrail.report.words.ablations import state_words
from simrail.report.words.verdicts import imu_words
from simrail.scoring.table import FULL
from simrail.track.bands import BANDS, Band
from simrail.track.quality import Limits, section_indicators

QUANTITIES = {
    "vertical_profile": "vertical profile",
    "cross_level": "cross-level",
    "alignment": "alignment",
    "twist": "twist",
    "gauge": "gauge",
}
"""Quantities of rail geometry in the order of the page."""

JUDGED = ("vertical_profile", "cross_level", "alignment")
"""Those that every method under test is judged by."""

BAND = "D1"
"""Band that a case is judged in where its ride is long enough, and that a scenario's limits are of."""


def bands_of_case(case: Case) -> list[str]:
    """Bands in which a case has rail geometry, ``full`` first; empty without any."""
    table = case.table
    rows = table[table["quantity"].astype(str).isin(QUANTITIES) & (table["draws"] > 0)]
    return [str(name) for name in dict.fromkeys(rows["band"])]


def judged_band(case: Case) -> str:
    """Band that a case is judged in: `BAND` where the ride is long enough, else the scenario's own.

    Where there is no own band either, the first that has figures, at last ``full``.
    """
    there = [name for name in bands_of_case(case) if name != FULL]
    own = [name for name in there if name not in BANDS]
    return BAND if BAND in there else next(iter([*own, *there]), FULL)


def band_of_all(all_cases: Sequence[Case]) -> str:
    """Band that most cases are judged in: of those with rail geometry."""
    judged = [judged_band(case) for case in all_cases if bands_of_case(case)]
    return max(dict.fromkeys(judged), key=judged.count, default=FULL)


def band_words(name: str, bands: Mapping[str, Band] = BANDS) -> str:
    """A band with its wavelengths: ``D1 (3-25 m)``; one that `bands` does not hold by its name alone."""
    if name not in bands:
        return "unfiltered" if name == FULL else name
    band = bands[name]
    return f"{name} ({band.shortest_m:g}\u2013{band.longest_m:g} m)"


def waves_words(name: str, bands: Mapping[str, Band] = BANDS) -> str:
    """The same for a sentence: ``in wavelengths of 3-25 m (D1)``."""
    if name not in bands:
        return "unfiltered" if name == FULL else f"in the band {name}"
    band = bands[name]
    return f"in wavelengths of {band.shortest_m:g}\u2013{band.longest_m:g} m ({name})"


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
    bands, shown, judged = bands_of_case(case), mappers(case, styles), judged_band(case)
    if not bands or not shown:
        return None
    rows = []
    for quantity, words in QUANTITIES.items():
        there = [style for style in shown if case.get(style.name, quantity, "sd").draws]
        if not there and _is_unobservable(case, quantity):
            why, cells = _left_open(case, quantity, shown, len(bands) + 3)
            rows.append(Row(f"{words}: {why}", "", "", cells))
        for style in shown if there else ():
            label, baseline = f"{words}: {style.label}", style.baseline if is_zero(style) else ""
            if style in there:
                cells = [
                    mean_cell(
                        case.get(style.name, quantity, "sd", band=band),
                        mark="" if baseline else _mark(case, shown, style, quantity, band),
                    )
                    for band in bands
                ]
                cells.append(mean_cell(case.get(style.name, quantity, "mean"), decimals=2))
                cells.append(mean_cell(case.get(style.name, quantity, "max", band=judged), decimals=2))
                cells.append(mean_cell(case.get(style.name, quantity, "coverage95"), decimals=0, scale=100.0))
                rows.append(Row(label, baseline, style.colour, cells))
            elif not baseline and _is_unobservable(case, quantity, style.name):
                # What a method under test leaves open is told; of rails as designed it goes without saying.
                _, cells = _left_open(case, quantity, [style], len(bands) + 3)
                rows.append(Row(label, "", style.colour, cells))
    groups = [("standard deviation of the error, mm", len(bands)), ("mean, mm", 1), ("max, mm", 1)]
    groups += [("inside 95 %", 1)]
    words_of = {band: band_words(band, known) for band in bands}
    columns = [*words_of.values(), "unfiltered", words_of[judged].partition(" (")[0], "interval, %"]
    return Table(groups, columns, rows)


def _mark(case: Case, shown: Sequence[MethodStyle], style: MethodStyle, quantity: str, band: str) -> str:
    """How the error of a method under test is marked: the best of them, worse than without any IMU."""
    own = sd_of(case, style, quantity, band=band)
    sds = [sd_of(case, one, quantity, band=band) for one in shown if not is_zero(one)]
    # As they are shown: what reads the same is as good.
    is_best = round(own, DECIMALS) == round(float(np.nanmin(sds)), DECIMALS) if np.isfinite(own) else False
    is_worse = style in behind_baseline(case, shown, quantity, band=band)
    return " ".join(["best"] * is_best + ["worse"] * is_worse)


def _left_open(
    case: Case, quantity: str, styles: Sequence[MethodStyle], columns: int
) -> tuple[str, list[Cell]]:
    """Why a quantity is left open, and its cells: twist follows from the cross-level, if that is known."""
    if quantity == "twist" and any(case.get(s.name, "cross_level", "sd").draws for s in styles):
        why, word = "its base is no multiple of the geometry's step", "not computed"
    else:
        why, word = "no sensor sees the rails", "not observable"
    return why, [Cell(word, mark="none"), *[NONE] * (columns - 1)]


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
        band, labels = judged_band(case), case.labels
        main, floor = main_of(case, styles), baseline_of(case, styles)
        cells = []
        for quantity in JUDGED:
            own, zero = (
                case.get(style.name, quantity, "sd", band=band) if style else NOTHING
                for style in (main, floor)
            )
            mark = "worse" if own.value > zero.value else ""
            cells += [mean_cell(own, mark=mark), mean_cell(zero, decimals=2)]
        note = ", an ablation" if labels["odometry"] == "truth" else ""
        label = (
            f"{labels['ride']} \u00b7 {imu_words(labels)} \u00b7 {labels['odometry']}{note} "
            f"\u00b7 {state_words(labels)} \u00b7 {band_words(band, known)}"
        )
        if not all(cell.mark == "none" for cell in cells):
            rows.append(Row(label, "", "", cells))
    if not rows:
        return None
    groups = [(f"{QUANTITIES[quantity]}, mm", 2) for quantity in JUDGED]
    return Table(groups, ["found", "no IMU"] * len(JUDGED), rows)


def indicator_table(
    truth: pd.DataFrame | None, found: pd.DataFrame, *, limits: Mapping[str, Limits], band: Band
) -> Table:
    """Indicators per section of rails as found, beside the true ones if these are known.

    What is beyond a limit is marked.
    """
    parts = [
        section_indicators(rails, band=band, limits=limits).set_index(["start_m", "quantity"])
        for rails in (truth, found)
        if rails is not None
    ]
    both = parts[0].index.intersection(parts[-1].index)
    quantities = [q for q in JUDGED if q in both.get_level_values("quantity")]
    rows = []
    for start in sorted(set(both.get_level_values("start_m"))):
        cells = []
        for place in ((start, quantity) for quantity in quantities):
            for what in ("sd_m", "peak_m"):
                cells += [_indicator(part.loc[place], what) if place in both else NONE for part in parts]
        rows.append(Row(f"{start:.0f} to {start + 200.0:.0f} m", "", "", cells))
    heads = ["sd", "peak"] if truth is None else ["sd", "found", "peak", "found"]
    groups = [(QUANTITIES[q], len(heads)) for q in quantities]
    return Table(groups, heads * len(quantities), rows)


def _indicator(line: pd.Series, what: str) -> Cell:
    beyond = bool(line["sd_exceeded"]) if what == "sd_m" else line["defects"] > 0
    return number_cell(1e3 * float(line[what]), decimals=2, mark="worse" if beyond else "")
