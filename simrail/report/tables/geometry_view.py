"""Rail geometry of a ride as the page shows it: figures, and indicators against limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from simrail.campaign.cell import CellResult
from simrail.core.columns import IRREGULARITY
from simrail.report.figures.geometry import bands_figure, rails_figure, stretch_of, stretch_words
from simrail.report.tables.geometry_bands import BAND, JUDGED, judged_band, waves_words
from simrail.report.tables.geometry_tables import indicator_table, is_zero
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Figures
from simrail.report.tables.tables import Table
from simrail.report.words.sentences import listed
from simrail.track.bands import BANDS, Band, why_not
from simrail.track.quality import Limits

LONG_M = 400.0
"""Stretch that is drawn unfiltered."""

WAVES = 5.0
"""So many of the longest waves of a band are drawn of it: 125 m of D1."""

MOST_DRAWN = 3
"""Methods of one figure of rails; the tables hold all."""


@dataclass(frozen=True)
class GeometryView:
    """Rail geometry of one ride as the template needs it."""

    figures: list[tuple[str, Markup]]
    indicators: Table | None
    indicators_text: str


def geometry_view(
    example: CellResult,
    case: Figures | None,
    styles: Sequence[MethodStyle],
    *,
    limits: Mapping[str, Limits],
    known: Mapping[str, Band] = BANDS,
) -> GeometryView | None:
    """Make it; None if no method of the ride says what the rails look like.

    Parameters
    ----------
    example : CellResult
        The ride.
    case : Figures, optional
        Its scores; they say in which band it is judged.
    styles : sequence of MethodStyle
        The scenario's methods.
    limits : mapping of str to Limits
        Limits of the indicators.
    known : mapping of str to Band
        The scenario's bands by name.
    """
    drawn = with_rails(example, [style for style in styles if not is_zero(style)])[:MOST_DRAWN]
    if not drawn:
        return None
    first, finds = drawn[0], "finds" if len(drawn) == 1 else "find"
    stretch = stretch_of(example, first.name, band=None, length_m=LONG_M)
    text = (
        f"Rails over {stretch_words(example, stretch)}, unfiltered: as they lie (broad grey), and as "
        f"{listed([style.label for style in drawn])} {finds} them. The tinted band is the 95 % interval of "
        f"{first.label}. What is far longer than a train, an inertial method cannot tell from its own drift."
    )
    svg = rails_figure(
        example, drawn, band=None, limits=stretch, with_interval=True, what="Rails over distance, unfiltered"
    )
    figures = [(text, svg)]
    band = known.get(judged_band(case)) if case is not None else None
    if band is not None and _holds(example, first, band):
        length = WAVES * max(band.edges_m(quantity)[1] for quantity in JUDGED)
        stretch = stretch_of(example, first.name, band=band, length_m=length)
        words = waves_words(band.name, known)
        text = (
            f"The same over {stretch_words(example, stretch)} {words}, which the scores speak of. A shift "
            "along the track is an error of the odometry."
        )
        svg = rails_figure(
            example,
            drawn,
            band=band,
            limits=stretch,
            with_interval=False,
            what=f"Rails over distance {words}",
        )
        figures.append((text, svg))
    if case is not None:
        text = (
            "Standard deviation of the error by band of wavelengths, on a logarithmic axis; hollow: no IMU "
            "at all, whose error is the rails themselves. Strokes: one standard deviation between draws, if "
            "there are several."
        )
        figures.append((text, bands_figure(case, styles, known=known)))
    indicators, text = _indicators(example, first, limits)
    return GeometryView([(caption, Markup(svg)) for caption, svg in figures if svg], indicators, text)


def with_rails(example: CellResult, styles: Sequence[MethodStyle]) -> list[MethodStyle]:
    """Those of some methods that say what the rails of a ride look like, if its true rails are at hand."""
    if example.rails is None:
        return []
    found = []
    for style in styles:
        estimate = example.estimates.get(style.name)
        if estimate is not None and estimate.geometry is not None and len(estimate.geometry) > 1:
            found.append(style)
    return found


def _holds(example: CellResult, style: MethodStyle, band: Band) -> bool:
    """Whether a ride is long enough, and its places near enough to each other, for a band."""
    geometry = example.estimates[style.name].geometry
    assert geometry is not None
    step = float(geometry.index[1] - geometry.index[0])
    return not any(why_not(band.edges_m(q), count=len(geometry), step_m=step) for q in JUDGED)


def _indicators(
    example: CellResult, style: MethodStyle, limits: Mapping[str, Limits]
) -> tuple[Table | None, str]:
    geometry = example.estimates[style.name].geometry
    if geometry is None or example.rails is None or not _holds(example, style, BANDS[BAND]):
        return None, ""
    truth = example.rails.irregularities(geometry.index.to_numpy(dtype="float64"))[list(IRREGULARITY)]
    table = indicator_table(truth.set_index(geometry.index), geometry, limits=limits, band=BANDS[BAND])
    told = "; ".join(
        f"{name.replace('_', ' ')} "
        + ", ".join(
            f"{word} {1e3 * value:g} mm"
            for word, value in (("sd", limit.sd_m), ("peak", limit.defect_m))
            if value is not None
        )
        for name, limit in limits.items()
    )
    text = (
        f"Indicators in {BAND} of the true rails and of those that {style.label} finds, mm: standard "
        f"deviation over 200 m, largest distance from the mean. "
    )
    text += (
        f"Marked: beyond the scenario's limits ({told})."
        if told
        else "The scenario sets no limits, so none is marked."
    )
    return table, text
