"""Our versions of the paper's Figs. 12 to 22: rms per ride, compensation, and repeatability of roll."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
import pandas as pd

from simrail.campaign.cell import CellResult
from simrail.core.jit import FloatArray
from simrail.report.figures import canvas
from simrail.report.figures.attitude import angle_error
from simrail.report.figures.decimate import Bins
from simrail.report.figures.ride import direction_of, over_distance
from simrail.report.papers.briales_2021.rides import QUANTITIES, is_fast
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case

_RIDE_COLOURS = {
    (True, False): ("#0072B2", "#56B4E9"),
    (False, False): ("#D55E00", "#E69F00"),
    (True, True): ("#009E73", "#66c2a5"),
    (False, True): ("#AA4499", "#CC79A7"),
}
"""By (forward, fast): colours of the rides of a class."""

_MARKERS = "os^vD"
"""Methods of one colour differ in their marks."""

_GRID_STEP_M = 1.0


def rides_figure(cases: Sequence[Case], styles: Sequence[MethodStyle]) -> str:
    """Rms of every ride and method against the design angles, cropped as in Table 3 (Fig. 12)."""
    with canvas.look():
        figure, axes = canvas.panels_beside(3, tall_in=3.15, left_in=0.62, top_in=0.95)
        colours = [style.colour for style in styles]
        for axis, quantity in zip(axes, QUANTITIES, strict=True):
            for order, style in enumerate(styles):
                scores = [
                    c.get(style.name, quantity, "rms", window="cropped", reference="design") for c in cases
                ]
                marker = _MARKERS[colours[:order].count(style.colour) % len(_MARKERS)]
                canvas.draw_marks(axis, scores, style, slot=(order, len(styles)), marker=marker)
            canvas.categories(
                axis, [c.labels["ride"] for c in cases], size=6.6 if canvas.is_narrow() else 8.0
            )
            canvas.log_scale(axis.yaxis)
            axis.set_title(quantity)
        axes[0].set_ylabel("rms difference to the design angles, \u00b0", loc="top")
        canvas.figure_legend(figure, *axes[0].get_legend_handles_labels(), left_in=0.62)
        return canvas.to_svg(
            figure, description="Rms difference to the design angles of every method on every ride"
        )


def compensation_figure(examples: Sequence[CellResult], pairs: Sequence[Sequence[MethodStyle]]) -> str:
    """Roll with and without compensation, one panel per ride and method (Figs. 13 and 14)."""
    with canvas.look():
        rows = [(example, pair) for example in examples for pair in pairs]
        figure, axes = canvas.panels([1.35] * len(rows), top_in=0.6)
        for axis, (example, pair) in zip(axes, rows, strict=True):
            bins = Bins(example.motion["position_m"].to_numpy())
            track = example.line
            lines = [
                canvas.draw_truth(axis, bins, example.motion["roll_rad"].to_numpy()),
                canvas.draw_design(axis, bins.x, track.frame(bins.x).roll_rad),
            ]
            for order, style in enumerate(pair):
                x, y = bins.line(_roll(example, style))
                axis.plot(x, y, color=style.colour, lw=1.1, zorder=12 - order, label=style.label)
                lines.append(y)
            canvas.fit_limits(axis, lines, top=0.3 if axis is axes[0] else 0.1)
            canvas.label_upright(axis, f"roll, \u00b0\n{example.recording.name}", fontsize=8.4)
        over_distance(axes, examples[0], arrow=False)
        canvas.legend_above(*axes)
        return canvas.to_svg(figure, description="Roll with and without compensation over distance")


def repeatability_figure(examples: Sequence[CellResult], styles: Sequence[MethodStyle], *, what: str) -> str:
    """Estimated roll of several rides over distance, one panel per method (Figs. 15 to 22)."""
    with canvas.look():
        figure, axes = canvas.panels([1.55] * len(styles))
        for axis, style in zip(axes, styles, strict=True):
            colours = {kind: cycle(pair) for kind, pair in _RIDE_COLOURS.items()}
            lines: list[FloatArray] = []
            for example in examples:
                bins, fast = Bins(example.motion["position_m"].to_numpy()), is_fast(example.cell)
                colour = next(colours[direction_of(example) > 0, fast])
                x, y = bins.line(_roll(example, style))
                behind = 2 if fast else 4  # the fast rides swing most and would hide the others
                axis.plot(x, y, color=colour, lw=0.9, label=example.recording.name, zorder=behind)
                lines.append(y)
            places = np.sort(bins.x)
            lines.append(canvas.draw_design(axis, places, examples[0].line.frame(places).roll_rad))
            canvas.fit_limits(axis, lines, top=0.3 if axis is axes[0] else 0.1)
            canvas.label_upright(axis, f"roll, \u00b0\n{style.label}", fontsize=8.2)
        canvas.legend_above(axes[0])
        over_distance(axes, examples[0], arrow=False)
        return canvas.to_svg(figure, description=what)


def spread_of(examples: Sequence[CellResult], name: str) -> float:
    """Spread between rides of a method's roll error at the same place, rms along the line, degrees.

    The error, not the roll: on one irregular track the true roll differs from ride to ride as well. Errors
    are averaged over each metre that all rides passed.
    """
    positions = [example.motion["position_m"].to_numpy() for example in examples]
    low, high = max(position.min() for position in positions), min(position.max() for position in positions)
    edges = np.arange(np.ceil(low), np.floor(high), _GRID_STEP_M)
    per_ride = []
    for example, position in zip(examples, positions, strict=True):
        # Metre 1 begins at the first edge: what lies before it (0), or from the last edge on, is left out.
        metre = np.searchsorted(edges, position, side="right")
        errors = pd.Series(np.rad2deg(angle_error(example, name, 0))).groupby(metre).mean()
        per_ride.append(errors.reindex(range(1, len(edges))))
    variance = pd.concat(per_ride, axis=1).dropna().var(axis=1)
    return float(np.sqrt(variance.mean()))


def _roll(example: CellResult, style: MethodStyle) -> FloatArray:
    return np.rad2deg(example.motion["roll_rad"].to_numpy() + angle_error(example, style.name, 0))
