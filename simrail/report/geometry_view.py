"""Rail geometry of a ride as the page shows it: sentences, figures, and indicators against limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from simrail.bands import BANDS, why_not
from simrail.columns import IRREGULARITY
from simrail.example import CellResult
from simrail.report.findings import Finding
from simrail.report.geometry_figures import bands_figure, rails_figure, stretch_of
from simrail.report.geometry_tables import (
    BAND,
    JUDGED,
    geometry_findings,
    indicator_table,
    is_zero,
)
from simrail.report.methods import MethodStyle
from simrail.report.pivot import Figures
from simrail.report.tables import Table
from simrail.track_quality import Limits

LONG_M, SHORT_M = 400.0, 120.0
"""Stretches that are drawn unfiltered, and in `BAND`."""


@dataclass(frozen=True)
class GeometryView:
    """Rail geometry of one ride as the template needs it."""

    findings: list[Finding]
    figures: list[tuple[str, Markup]]
    indicators: Table | None
    indicators_text: str


def geometry_view(
    example: CellResult,
    case: Figures | None,
    styles: Sequence[MethodStyle],
    others: Sequence[Figures],
    limits: Mapping[str, Limits],
    goals_mm: Mapping[str, float],
) -> GeometryView | None:
    """Make it; None if no method of the ride says what the rails look like."""
    drawn = with_rails(example, [style for style in styles if not is_zero(style)])
    if not drawn:
        return None
    first = drawn[0]
    figures = [
        (
            f"Rails over {LONG_M:.0f} m in the middle of the ride, unfiltered: as they lie (broad grey), "
            f"and as "
            f"{first.label} and others find them. The tinted band is the 95 % interval of {first.label}. "
            f"What "
            "is far longer than a train, an inertial method cannot tell from its own drift.",
            rails_figure(
                example,
                drawn[:2],
                band=None,
                limits=stretch_of(example, length_m=LONG_M),
                with_interval=True,
                what="Rails over distance, unfiltered",
            ),
        )
    ]
    if _holds_band(example, first):
        figures.append(
            (
                f"The same over {SHORT_M:.0f} m, filtered to {BAND}. A shift along the track is an error "
                f"of the "
                "odometry.",
                rails_figure(
                    example,
                    drawn[:2],
                    band=BANDS[BAND],
                    limits=stretch_of(example, length_m=SHORT_M),
                    with_interval=False,
                    what=f"Rails over distance in {BAND}",
                ),
            )
        )
    if case is not None:
        figures.append(
            (
                "Standard deviation of the error by band of wavelengths, on a logarithmic axis; hollow: no "
                "IMU "
                "at all, whose error is the rails themselves. Strokes: one standard deviation between draws.",
                bands_figure(case, styles),
            )
        )
    indicators, text = _indicators(example, first, limits)
    return GeometryView(
        geometry_findings(case, styles, others, goals_mm=goals_mm) if case else [],
        [(caption, Markup(svg)) for caption, svg in figures if svg],
        indicators,
        text,
    )


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


def _holds_band(example: CellResult, style: MethodStyle) -> bool:
    geometry = example.estimates[style.name].geometry
    assert geometry is not None
    step = float(geometry.index[1] - geometry.index[0])
    return not any(why_not(BANDS[BAND].edges_m(q), count=len(geometry), step_m=step) for q in JUDGED)


def _indicators(
    example: CellResult, style: MethodStyle, limits: Mapping[str, Limits]
) -> tuple[Table | None, str]:
    geometry = example.estimates[style.name].geometry
    if geometry is None or example.rails is None or not _holds_band(example, style):
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
        f"deviation "
        "over 200 m, largest distance from the mean. "
    )
    text += (
        f"Marked: beyond the scenario's limits ({told})."
        if told
        else "The scenario sets no limits, so none is marked."
    )
    return table, text
