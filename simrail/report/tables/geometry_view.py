"""Rail geometry of a ride as the page shows it: figures, and indicators against limits."""

from collections.abc import Mapping, Sequence
from typing import Any

from simrail.campaign.cell import CellResult
from simrail.core.columns import IRREGULARITY
from simrail.report.figures.geometry import bands_figure, rails_figure, stretch_of, stretch_words
from simrail.report.tables.geometry_bands import BAND, JUDGED, judged_band, waves_words
from simrail.report.tables.geometry_tables import indicator_table, is_zero
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case
from simrail.report.tables.tables import Table
from simrail.track.bands import BANDS, Band, why_not
from simrail.track.quality import Limits

LONG_M = 400.0
"""Stretch that is drawn unfiltered."""

WAVES = 5.0
"""So many of the longest waves of a band are drawn of it: 125 m of D1."""

MOST_DRAWN = 3
"""Methods of one figure of rails; the tables hold all."""


def geometry_view(
    example: CellResult,
    case: Case | None,
    styles: Sequence[MethodStyle],
    *,
    limits: Mapping[str, Limits],
    known: Mapping[str, Band] = BANDS,
) -> dict[str, Any] | None:
    """What the template of rails shows; None if no method of the ride says what the rails look like.

    Parameters
    ----------
    example : CellResult
        The ride.
    case : Case, optional
        Its scores; they say in which band it is judged.
    styles : sequence of MethodStyle
        The scenario's methods.
    limits : mapping of str to Limits
        Limits of the indicators.
    known : mapping of str to Band
        The scenario's bands by name.
    """
    drawn = [s for s in styles if not is_zero(s) and has_rails(example, s)][:MOST_DRAWN]
    if not drawn:
        return None
    first, band = drawn[0], known.get(judged_band(case)) if case is not None else None
    if band is not None and not _holds(example, first, band):
        band = None
    stretches: dict[Band | None, float] = {None: LONG_M}
    if band is not None:
        stretches[band] = WAVES * max(band.edges_m(quantity)[1] for quantity in JUDGED)
    rails = []
    for part, length_m in stretches.items():
        stretch = stretch_of(example, first.name, band=part, length_m=length_m)
        words = f" {waves_words(part.name, known)}" if part else ", unfiltered"
        what = f"Rails over distance{words}"
        svg = rails_figure(example, drawn, band=part, limits=stretch, with_interval=not part, what=what)
        rails.append((part is not None, f"{stretch_words(example, stretch)}{words}", svg))
    return {
        "methods": [style.label for style in drawn],
        "rails": rails,
        "bands": bands_figure(case, styles, known=known) if case is not None else "",
        "indicators": _indicators(example, first, limits),
        "limits": limits,
        "band": BAND,
    }


def has_rails(example: CellResult, style: MethodStyle) -> bool:
    """Whether a method says what the rails of a ride look like, and the true ones are at hand."""
    estimate = example.estimates.get(style.name)
    geometry = estimate.geometry if estimate else None
    return example.rails is not None and geometry is not None and len(geometry) > 1


def _holds(example: CellResult, style: MethodStyle, band: Band) -> bool:
    """Whether a ride is long enough, and its places near enough to each other, for a band."""
    geometry = example.estimates[style.name].geometry
    assert geometry is not None
    step = float(geometry.index[1] - geometry.index[0])
    return not any(why_not(band.edges_m(q), count=len(geometry), step_m=step) for q in JUDGED)


def _indicators(example: CellResult, style: MethodStyle, limits: Mapping[str, Limits]) -> Table | None:
    geometry = example.estimates[style.name].geometry
    if geometry is None or example.rails is None or not _holds(example, style, BANDS[BAND]):
        return None
    truth = example.rails.irregularities(geometry.index.to_numpy(dtype="float64"))[list(IRREGULARITY)]
    return indicator_table(truth.set_index(geometry.index), geometry, limits=limits, band=BANDS[BAND])
