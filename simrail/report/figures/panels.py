"""Panels of a ride on paper: what the page's explorer draws, of the same numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from simrail.core.jit import FloatArray
from simrail.report.figures import canvas
from simrail.report.figures.views import Look, Panel, Series, View

MOST_BEYOND = 1.3
"""What leaves a panel by more than this share of its reach is told."""

MOST_IN_LINE = 14
"""Letters of a title that stand in one line with the unit."""

LEAST_SPAN = 1e-3
"""Of a panel, in its unit: what is flat looks flat."""

PANEL_IN = (1.75, 1.15, 0.82)
"""Height of panels: of up to three, of up to five, of more."""


def panels_figure(
    view: View, group: str, looks: Mapping[str, Look], *, what: str, keys: Sequence[str] = ()
) -> str:
    """Panels of a group above each other; "" if the view has none.

    They are scaled to methods under test and the truth: of a baseline that leaves a panel, a note says how
    far it goes.

    Parameters
    ----------
    view : View
        The ride.
    group : str
        Which panels.
    looks : mapping of str to Look
        Of all series.
    what : str
        Description for those who cannot see it.
    keys : sequence of str, optional
        Series to draw, the first on top; all if not given.
    """
    drawn = [panel for panel in view.panels if panel.group == group]
    if not drawn:
        return ""
    tall = PANEL_IN[0 if len(drawn) < 4 else 1 if len(drawn) < 6 else 2]
    with canvas.look():
        figure, axes = canvas.panels([tall] * len(drawn))
        for axis, panel in zip(axes, drawn, strict=True):
            _draw(axis, view, panel, looks, keys)
            parted = ",\n" if len(panel.title) > MOST_IN_LINE else ", "
            axis.tick_params(axis="y", labelsize=8.2)
            canvas.label_upright(axis, f"{panel.title}{parted}{panel.unit}", fontsize=8.4)
        canvas.legend_above(*axes)
        x = np.concatenate([view.axes[panel.axis][0] for panel in drawn])
        low, high = float(np.nanmin(x)), float(np.nanmax(x))
        room = 0.01 * max(high - low, 1e-3)
        canvas.shade_places(axes, view.places, limits=(low - room, high + room))
        canvas.distance_axis(axes[-1], direction=view.travel, words=view.along)
        return canvas.to_svg(figure, description=what)


def _draw(axis: Axes, view: View, panel: Panel, looks: Mapping[str, Look], keys: Sequence[str]) -> None:
    shown = [one for one in panel.series if not keys or one.key in keys or looks[one.key].kind == "truth"]
    x, ends = view.axes[panel.axis]
    leading = [one for one in shown if looks[one.key].kind != "baseline"] or shown
    for one in shown:
        look = looks[one.key]
        colour = {"": canvas.INK, "muted": canvas.MUTED}.get(look.colour, look.colour)
        # The truth is a thin line above all others, and what no method made lies below them.
        depth = {"truth": 9.0, "test": 5.0, "baseline": 3.0}.get(look.kind, 4.0) - 0.01 * _place(one, keys)
        dash: Any = (0, tuple(d / 1.5 for d in look.dash)) if look.dash else "-"
        drawn_as: dict[str, Any] = {"color": colour, "ls": dash, "label": look.label, "zorder": depth}
        if one.low is not None and one.high is not None:
            is_behind = look.kind == "baseline"
            tint: dict[str, Any] = {"color": colour, "alpha": 0.4 if is_behind else 0.22, "lw": 0}
            label = f"{look.label}, range" if is_behind else None
            axis.fill_between(x, one.low, one.high, zorder=depth - 0.005, label=label, **tint)
        if one.mean is not None and look.kind != "baseline":
            axis.plot(x, one.mean, lw=1.1, **drawn_as)
        if one.y is not None:
            axis.plot(ends, one.y, lw=0.8 if look.kind == "truth" else 1.1, **drawn_as)
    low, high = _reach(leading)
    canvas.pad_limits(axis, low, high, top=0.16)
    if low < 0.0 < high:
        axis.axhline(0.0, color="#98a1af", lw=0.7, zorder=-1)
    beyond = [
        (most, looks[one.key].label)
        for one in shown
        if (most := max(abs(v) for v in _reach([one]))) > MOST_BEYOND * max(abs(low), abs(high))
    ]
    if beyond and not canvas.is_narrow():
        _note(axis, beyond, panel.unit)


def _place(series: Series, keys: Sequence[str]) -> int:
    return list(keys).index(series.key) if series.key in keys else 0


def _reach(series: Sequence[Series]) -> tuple[float, float]:
    """Least and greatest of some series, single spikes left out."""
    parts: list[FloatArray] = [
        values for one in series for values in (one.y, one.low, one.high) if values is not None
    ]
    values = np.concatenate(parts)
    values = values[np.isfinite(values)]
    if not len(values):
        return -1.0, 1.0
    low, high = (float(value) for value in np.percentile(values, [0.05, 99.95]))
    flat = max(LEAST_SPAN - (high - low), 0.0)
    return low - 0.5 * flat, high + 0.5 * flat


def _note(axis: Axes, beyond: list[tuple[float, str]], unit: str) -> None:
    listed = ", ".join(f"{label} {most:.2g} {unit}" for most, label in sorted(beyond, reverse=True))
    box: dict[str, Any] = {"facecolor": "white", "alpha": 0.85, "lw": 0, "pad": 1.5}
    style: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 7.8, "color": canvas.MUTED}
    words = f"beyond the panel, at most: {listed}"
    axis.text(0.995, 0.03, words, transform=axis.transAxes, bbox=box, zorder=30, **style)
