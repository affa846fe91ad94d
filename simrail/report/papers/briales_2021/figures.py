"""Our versions of the paper's Figs. 12 to 22: rms per ride, compensation, and repeatability of roll."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from simrail.campaign.cell import CellResult
from simrail.core.jit import FloatArray
from simrail.report.figures.attitude import angle_error
from simrail.report.figures.decimate import Bins
from simrail.report.figures.ride import direction_of, limits_of
from simrail.report.figures.style import (
    DESIGN,
    TRUTH,
    WIDTH_IN,
    legend_above,
    log_ticks,
    look,
    pad_limits,
    panels,
    shade_track,
    to_svg,
)
from simrail.report.papers.briales_2021.rides import is_fast
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Figures

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


def rides_figure(cases: Sequence[Figures], styles: Sequence[MethodStyle]) -> str:
    """Rms of every ride and method against the design angles, cropped as in Table 3 (Fig. 12)."""
    with look():
        height, gap, left, top, bottom = 4.6, 0.42, 0.62, 0.95, 0.5
        figure = Figure(figsize=(WIDTH_IN, height))
        wide = (WIDTH_IN - left - 0.15 - 2 * gap) / 3
        step = 0.8 / max(len(styles), 1)
        for i, quantity in enumerate(("roll", "pitch", "yaw")):
            box = (
                (left + i * (wide + gap)) / WIDTH_IN,
                bottom / height,
                wide / WIDTH_IN,
                1.0 - (top + bottom) / height,
            )
            axis = figure.add_axes(box)
            used: list[str] = []
            for order, style in enumerate(styles):
                marker = _MARKERS[used.count(style.colour) % len(_MARKERS)]
                used.append(style.colour)
                found = [
                    c.get(style.name, quantity, "rms", window="cropped", reference="design") for c in cases
                ]
                value = np.array([f.value for f in found])
                sd = np.nan_to_num([f.sd for f in found])
                x = np.arange(len(cases)) + (order + 0.5) * step - 0.4
                face = "white" if style.baseline else style.colour
                mark: dict[str, Any] = {"fmt": marker, "ms": 4.6, "mfc": face, "lw": 1.0}
                low = np.minimum(sd, 0.7 * value)
                axis.errorbar(x, value, [low, sd], color=style.colour, mew=1.1, label=style.label, **mark)
            for place in range(1, len(cases)):
                axis.axvline(place - 0.5, color="#d0d5dd", lw=0.7)
            axis.grid(axis="x", visible=False)
            axis.set_yscale("log")
            log_ticks(axis.yaxis)
            axis.set_xlim(-0.5, len(cases) - 0.5)
            axis.set_xticks(range(len(cases)), [c.labels["ride"] for c in cases], fontsize=8.0)
            axis.tick_params(axis="x", length=0)
            axis.set_title(quantity)
            if i == 0:
                axis.set_ylabel("rms difference to the design angles, \u00b0", loc="top")
                handles, labels = axis.get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="upper left", bbox_to_anchor=(0.045, 1.0), ncols=5, columnspacing=1.4
        )
        return to_svg(figure, description="Rms difference to the design angles of every method on every ride")


def compensation_figure(
    examples: Sequence[CellResult], pairs: Sequence[tuple[MethodStyle, MethodStyle]]
) -> str:
    """Roll with and without compensation, one panel per ride and method (Figs. 13 and 14)."""
    with look():
        rows = [(example, pair) for example in examples for pair in pairs]
        figure, axes = panels([1.35] * len(rows), top_in=0.6)
        labelled: dict[str, Any] = {}
        for axis, (example, pair) in zip(axes, rows, strict=True):
            bins = Bins(example.motion["position_m"].to_numpy())
            lines = _background(axis, example, bins)
            for order, style in enumerate(pair):
                x, y = bins.line(_roll(example, style))
                (line,) = axis.plot(x, y, color=style.colour, lw=1.1, zorder=12 - order, label=style.label)
                labelled.setdefault(style.label, line)
                lines.append(y)
            for line in axis.lines[:2]:
                labelled.setdefault(str(line.get_label()), line)
            pad_limits(axis, *_reach(lines), top=0.3 if axis is axes[0] else 0.1)
            axis.set_ylabel(f"roll, \u00b0\n{example.recording.name}", fontsize=8.4)
        shade_track(axes, examples[0].recording.track, limits=limits_of(examples[0]))
        axes[-1].set_xlabel("distance along the track, m")
        order_first = sorted(labelled, key=lambda word: {"truth": 0, "design": 1}.get(word, 2))
        axes[0].legend(
            [labelled[word] for word in order_first],
            order_first,
            loc="lower left",
            bbox_to_anchor=(-0.005, 1.0),
            ncols=6,
            borderaxespad=0.15,
        )
        return to_svg(figure, description="Roll with and without compensation over distance")


def repeatability_figure(examples: Sequence[CellResult], styles: Sequence[MethodStyle], *, what: str) -> str:
    """Estimated roll of several rides over distance, one panel per method (Figs. 15 to 22)."""
    with look():
        figure, axes = panels([1.55] * len(styles))
        for axis, style in zip(axes, styles, strict=True):
            seen: dict[tuple[bool, bool], int] = {}
            lines: list[FloatArray] = []
            for example in examples:
                bins = Bins(example.motion["position_m"].to_numpy())
                kind = (direction_of(example) > 0, is_fast(example.cell))
                colour = _RIDE_COLOURS[kind][seen.get(kind, 0) % 2]
                seen[kind] = seen.get(kind, 0) + 1
                x, y = bins.line(_roll(example, style))
                behind = 2 if kind[1] else 4  # the fast rides swing most and would hide the others
                axis.plot(x, y, color=colour, lw=0.9, label=example.recording.name, zorder=behind)
                lines.append(y)
            frame = examples[0].recording.track.frame(np.sort(bins.x))
            y = np.rad2deg(frame.roll_rad)
            axis.plot(np.sort(bins.x), y, color=DESIGN, lw=0.9, ls=(0, (4, 2)), label="design", zorder=20)
            pad_limits(axis, *_reach([*lines, y]), top=0.3 if axis is axes[0] else 0.1)
            axis.set_ylabel(f"roll, \u00b0\n{style.label}", fontsize=8.2)
        legend_above(axes[0])
        shade_track(axes, examples[0].recording.track, limits=limits_of(examples[0]))
        axes[-1].set_xlabel("distance along the track, m")
        return to_svg(figure, description=what)


def spread_of(examples: Sequence[CellResult], name: str) -> float:
    """Spread between rides of a method's roll error at the same place, rms along the line, degrees.

    The error, not the roll: on one irregular track the true roll differs from ride to ride as well. Errors
    are averaged over each metre that all rides passed.
    """
    per_ride = []
    low = max(float(e.motion["position_m"].min()) for e in examples)
    high = min(float(e.motion["position_m"].max()) for e in examples)
    edges = np.arange(np.ceil(low), np.floor(high), _GRID_STEP_M)
    for example in examples:
        position = example.motion["position_m"].to_numpy()
        error = np.rad2deg(angle_error(example, name, 0))
        cell = np.searchsorted(edges, position, side="right") - 1
        inside = (cell >= 0) & (cell < len(edges) - 1)
        total = np.bincount(cell[inside], weights=error[inside], minlength=len(edges) - 1)
        count = np.bincount(cell[inside], minlength=len(edges) - 1)
        per_ride.append(total / np.where(count > 0, count, np.nan))
    variance = np.var(np.array(per_ride), axis=0, ddof=1)
    return float(np.sqrt(np.nanmean(variance)))


def _background(axis: Any, example: CellResult, bins: Bins) -> list[FloatArray]:
    x, y = bins.line(np.rad2deg(example.motion["roll_rad"].to_numpy()))
    design = np.rad2deg(example.recording.track.frame(bins.x).roll_rad)
    axis.plot(x, y, color=TRUTH, lw=2.0, label="truth", zorder=2)
    axis.plot(bins.x, design, color=DESIGN, lw=0.9, ls=(0, (4, 2)), label="design", zorder=20)
    return [y, design]


def _roll(example: CellResult, style: MethodStyle) -> FloatArray:
    return np.rad2deg(example.motion["roll_rad"].to_numpy() + angle_error(example, style.name, 0))


def _reach(lines: Sequence[FloatArray]) -> tuple[float, float]:
    every = np.concatenate(lines)
    every = every[np.isfinite(every)]
    low, high = np.percentile(every, [0.05, 99.95])
    return float(low), float(high)
