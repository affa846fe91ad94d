"""Figures of rail geometry: true and estimated rails with their 95 % band, and error by band."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.columns import IRREGULARITY
from simrail.core.jit import FloatArray
from simrail.report.figures import canvas
from simrail.report.figures.ride import over_distance
from simrail.report.tables.geometry import JUDGED, QUANTITIES, band_words, bands_of_case, is_zero, mappers
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case
from simrail.scoring.table import FULL
from simrail.track.bands import BANDS, Band, band_pass, sd_of_draws, why_not

_MARKS = "osv^PX<>*"

ROOMY = 4
"""So many bands leave room for their wavelengths below the axis."""


def has_rails(example: CellResult, style: MethodStyle) -> bool:
    """Whether a method says what the rails of a ride look like, and the true ones are at hand."""
    estimate = example.estimates.get(style.name)
    geometry = estimate.geometry if estimate else None
    return example.rails is not None and geometry is not None and len(geometry) > 1


def stretch_of(example: CellResult, name: str, *, band: Band | None, length_m: float) -> tuple[float, float]:
    """First and last place of a stretch of some length: in the middle of what there is to draw.

    That is where the ride went and a method says what the rails look like, in a band or unfiltered; the
    stretch is shorter where there is no more of it.
    """
    position = example.motion["position_m"]
    low, high = float(position.min()), float(position.max())
    there = []
    for quantity in JUDGED:
        place, _, found, _ = lines_of(example, name, quantity, band)
        there.append(place[np.isfinite(found) & (place >= low) & (place <= high)])
    places = np.concatenate(there)
    if len(places):
        low, high = float(places.min()), float(places.max())
    middle = 0.5 * (low + high)
    return max(low, middle - 0.5 * length_m), min(high, middle + 0.5 * length_m)


def stretch_words(example: CellResult, stretch: tuple[float, float]) -> str:
    """A stretch as captions say it: ``120 m in the middle of the ride``."""
    length = stretch[1] - stretch[0]
    is_all = length > 0.98 * float(np.ptp(example.motion["position_m"].to_numpy()))
    return f"all {length:.0f} m of the ride" if is_all else f"{length:.0f} m in the middle of the ride"


def lines_of(
    example: CellResult, name: str, quantity: str, band: Band | None, *, by_draws: bool = False
) -> tuple[FloatArray, ...]:
    """Places, true rails, estimated rails and their sd (NaN if unknown), mm; in a band or unfiltered.

    The sd in a band is that of the unfiltered rails, as paper 001 has it, or by draws that of the filtered
    ones.
    """
    geometry = example.estimates[name].geometry
    assert geometry is not None and example.rails is not None
    place = geometry.index.to_numpy(dtype=np.float64)
    column = f"{quantity}_m"
    true = 1e3 * example.rails.irregularities(place)[column].to_numpy()
    found = 1e3 * geometry[column].to_numpy(dtype=np.float64)
    sd_name = f"{quantity}_sd_m"
    sd = 1e3 * geometry[sd_name].to_numpy() if sd_name in geometry else np.full(len(place), np.nan)
    if band is not None:
        edges = band.edges_m(quantity)
        step = float(place[1] - place[0]) if len(place) > 1 else 0.0
        if why_not(edges, count=len(place), step_m=step):
            nothing = np.full(len(place), np.nan)
            return place, nothing, nothing, nothing
        draws = example.estimates[name].geometry_draws
        if by_draws:
            sd = np.full(len(place), np.nan)
            if draws is not None:
                drawn = 1e3 * draws[:, :, IRREGULARITY.index(column)]
                sd = sd_of_draws(band_pass(drawn, edges, step_m=step))
        true, found = (band_pass(line, edges, step_m=step) for line in (true, found))
    return place, true, found, sd


def rails_figure(
    example: CellResult,
    styles: Sequence[MethodStyle],
    *,
    band: Band | None,
    limits: tuple[float, float],
    with_interval: bool,
    what: str,
) -> str:
    """Vertical profile, cross-level and alignment over a stretch: truth, and some methods.

    Parameters
    ----------
    example : CellResult
        The ride, with its rails.
    styles : sequence of MethodStyle
        Methods to draw, the first on top and the one whose 95 % interval is drawn.
    band : Band, optional
        Wavelengths to show.
    limits : tuple of float
        First and last place, m.
    with_interval : bool
        Whether to draw the interval: by draws where the method has them.
    what : str
        Description for those who cannot see it.
    """
    with canvas.look():
        figure, axes = canvas.panels([1.55] * len(JUDGED))
        for axis, quantity in zip(axes, JUDGED, strict=True):
            reach = [0.0]
            for order, style in enumerate(styles):
                drawn = example.estimates[style.name].geometry_draws is not None
                place, true, found, sd = lines_of(example, style.name, quantity, band, by_draws=drawn)
                at = (place >= limits[0]) & (place <= limits[1]) & np.isfinite(found)
                if order == 0:
                    axis.plot(place[at], true[at], color=canvas.TRUTH, lw=2.6, label="truth", zorder=2)
                    reach += [*true[at]]
                    if with_interval and np.isfinite(sd).any():
                        low, high = found[at] - 1.96 * sd[at], found[at] + 1.96 * sd[at]
                        tint: dict[str, Any] = {"color": style.colour, "alpha": 0.16, "lw": 0}
                        axis.fill_between(place[at], low, high, label="its 95 % interval", zorder=1, **tint)
                        reach += [*low, *high]
                look_of: dict[str, Any] = {"color": style.colour, "ls": style.stroke, "lw": 1.1}
                axis.plot(place[at], found[at], label=style.label, zorder=9 - 0.1 * order, **look_of)
                reach += [*found[at]]
            canvas.pad_limits(axis, min(reach), max(reach), top=0.16 if quantity == JUDGED[0] else 0.08)
            canvas.label_upright(axis, f"{QUANTITIES[quantity]},\nmm")
        canvas.legend_above(axes[0])
        over_distance(axes, example, limits=limits)
        return canvas.to_svg(figure, description=what)


def bands_figure(case: Case, styles: Sequence[MethodStyle], *, known: Mapping[str, Band] = BANDS) -> str:
    """Standard deviation of the error by band, a panel per quantity, on a logarithmic axis; "" without any.

    Parameters
    ----------
    case, styles : Case, sequence of MethodStyle
        The case and the scenario's methods.
    known : mapping of str to Band
        Bands whose wavelengths are told, if there is room.
    """
    bands = bands_of_case(case)
    shown = mappers(case, styles)
    if not bands or not shown:
        return ""
    with canvas.look():
        figure, axes = canvas.panels_beside(len(JUDGED), tall_in=2.0, left_in=0.62)
        words = [_tick(band, known if len(bands) <= ROOMY else {}) for band in bands]
        for axis, quantity in zip(axes, JUDGED, strict=True):
            for order, style in enumerate(shown):
                scores = [case.get(style.name, quantity, "sd", band=band) for band in bands]
                marker = "D" if is_zero(style) else _MARKS[order % len(_MARKS)]
                canvas.draw_marks(axis, scores, style, slot=(order, len(shown)), wide=0.7, marker=marker)
            canvas.categories(axis, words)
            canvas.log_scale(axis.yaxis)
            axis.set_title(QUANTITIES[quantity], color=canvas.INK)
        axes[0].set_ylabel("sd of the error, mm")
        canvas.figure_legend(figure, *axes[0].get_legend_handles_labels(), left_in=0.62)
        return canvas.to_svg(
            figure, description="Standard deviation of the error of the rail geometry by band"
        )


def _tick(band: str, known: Mapping[str, Band]) -> str:
    """Name of a band below an axis, and its wavelengths below that."""
    if band == FULL:
        return "all"
    return band_words(band, known).replace(" (", "\n").removesuffix(")")
