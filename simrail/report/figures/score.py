"""Figures of the scores: rms per method and window, and curve by curve (Fig. 12 of Briales et al. 2021)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from simrail.report.figures.style import (
    INK,
    LEFT_IN,
    MUTED,
    WIDTH_IN,
    fitting_columns,
    log_ticks,
    look,
    to_svg,
)
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Figures

_WINDOWS = (("straight", "o", "#8a8f98"), ("transition", "D", "#56B4E9"), ("curve", "s", "#D55E00"))
_QUANTITIES = (("roll", "roll"), ("pitch", "pitch"), ("yaw_debiased", "yaw, initial offset removed"))


def rms_figure(figures: Figures, styles: Sequence[MethodStyle], *, reference: str = "truth") -> str:
    """Rms error of every method in straights, transitions and curves, on a logarithmic axis."""
    with look():
        row = 0.34
        left, gap, top, bottom = 2.0, 0.25, 0.62, 0.5
        tall = row * len(styles) + 0.1
        figure = Figure(figsize=(WIDTH_IN, tall + top + bottom))
        height = tall + top + bottom
        wide = (WIDTH_IN - left - 0.2 - 2 * gap) / 3
        for i, (quantity, title) in enumerate(_QUANTITIES):
            box = ((left + i * (wide + gap)) / WIDTH_IN, bottom / height, wide / WIDTH_IN, tall / height)
            axis = figure.add_axes(box)
            reach = []
            for line, style in enumerate(styles):
                for window, marker, colour in _WINDOWS:
                    value, sd, _ = figures.get(
                        style.name, quantity, "rms", window=window, reference=reference
                    )
                    if not value > 1e-5:
                        continue
                    reach.append(value)
                    if sd > 0.0:
                        axis.plot(
                            [max(value - sd, 0.3 * value), value + sd], [line, line], color=colour, lw=1.6
                        )
                    axis.plot(value, line, marker, color=colour, ms=5.4, mec="white", mew=0.6, zorder=4)
            for style in styles:
                if not style.uses_imu:
                    floor, _, _ = figures.get(style.name, quantity, "rms", reference=reference)
                    if floor > 1e-5:
                        axis.axvline(floor, color=MUTED, lw=1.0, ls=(0, (3, 2)), zorder=1)
            axis.set_xscale("log")
            if reach:
                axis.set_xlim(0.6 * min(reach), 1.6 * max(reach))
            log_ticks(axis.xaxis)
            axis.set_ylim(len(styles) - 0.5, -0.5)
            axis.set_yticks(range(len(styles)), [_row_label(s) for s in styles] if i == 0 else [])
            axis.tick_params(axis="y", length=0)
            axis.grid(axis="x", which="minor", color="#f2f4f7", lw=0.5)
            for label, style in zip(axis.get_yticklabels(), styles, strict=False):
                label.set_color(MUTED if style.baseline else INK)
            axis.set_title(title, color=INK)
            axis.set_xlabel("rms error, \u00b0 (logarithmic)")
        _window_legend(figure, height)
        return to_svg(
            figure, description="Root mean square errors of every method in straights, transitions and curves"
        )


def curves_figure(figures: Figures, styles: Sequence[MethodStyle]) -> str:
    """Rms roll error of every method in each curve; "" if there are no curves."""
    windows = figures.curves()
    if not windows:
        return ""
    with look():
        figure = Figure(figsize=(WIDTH_IN, 3.1))
        axis = figure.add_axes((LEFT_IN / WIDTH_IN, 0.55 / 3.1, 1.0 - (LEFT_IN + 0.2) / WIDTH_IN, 2.1 / 3.1))
        spread = min(0.62 / max(len(styles), 1), 0.045 * len(windows))
        for i, style in enumerate(styles):
            x, y, e = [], [], []
            for place, window in enumerate(windows):
                value, sd, _ = figures.get(style.name, "roll", "rms", window=window)
                if value > 1e-5:
                    x.append(place + (i - 0.5 * (len(styles) - 1)) * spread)
                    y.append(value)
                    e.append(sd if sd > 0.0 else 0.0)
            marker = "o" if not style.baseline else "D"
            face = style.colour if not style.baseline else "white"
            low = np.minimum(e, 0.7 * np.asarray(y))
            axis.errorbar(
                x,
                y,
                np.array([low, e]),
                fmt=marker,
                ms=5.2,
                color=style.colour,
                mfc=face,
                mew=1.3,
                lw=1.1,
                label=style.label,
            )
        for place in range(1, len(windows)):
            axis.axvline(place - 0.5, color="#d0d5dd", lw=0.7)
        axis.grid(axis="x", visible=False)
        axis.set_yscale("log")
        log_ticks(axis.yaxis)
        axis.grid(axis="y", which="minor", color="#f2f4f7", lw=0.5)
        axis.set_xlim(-0.5, len(windows) - 0.5)
        axis.set_xticks(range(len(windows)), [window.removeprefix("curve:") for window in windows])
        axis.tick_params(axis="x", length=0)
        axis.set_ylabel("rms roll error, \u00b0")
        columns = fitting_columns([style.label for style in styles], WIDTH_IN - LEFT_IN)
        axis.legend(
            loc="lower left",
            bbox_to_anchor=(-0.005, 1.0),
            ncols=columns,
            borderaxespad=0.15,
            columnspacing=1.2,
        )
        return to_svg(figure, description="Root mean square roll error of every method in each curve")


def _row_label(style: MethodStyle) -> str:
    # What the label says already is not said again.
    told = not style.baseline or style.baseline in style.label
    return style.label if told else f"{style.label}  (baseline)"


def _window_legend(figure: Figure, height: float) -> None:
    handles = [
        Line2D([], [], marker=marker, color=colour, lw=0, ms=5.6, label=window)
        for window, marker, colour in _WINDOWS
    ]
    handles.append(
        Line2D([], [], color=MUTED, lw=1.0, ls=(0, (3, 2)), label="design angles only, whole ride")
    )
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(2.0 / WIDTH_IN - 0.012, 1.0),
        ncols=4,
        borderaxespad=0.1,
    )
