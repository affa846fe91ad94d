"""Bands of wavelengths as page and terminal speak of them: which a case has, in which one it is judged."""

from collections.abc import Mapping, Sequence

from simrail.report.tables.pivot import Case
from simrail.scoring.table import FULL
from simrail.track.bands import BANDS, Band

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
    found = [judged_band(case) for case in all_cases if bands_of_case(case)]
    return max(dict.fromkeys(found), key=found.count, default=FULL)


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
