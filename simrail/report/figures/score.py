"""Figures of the scores: rms per method and window, and curve by curve (Fig. 12 of Briales et al. 2021)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.lines import Line2D

from simrail.report.figures import canvas
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case
from simrail.scoring.table import CURVE_PREFIX

_WINDOWS = (("straight", "o", "#8a8f98"), ("transition", "D", "#56B4E9"), ("curve", "s", "#D55E00"))
_QUANTITIES = (("roll", "roll"), ("pitch", "pitch"), ("yaw_debiased", "yaw, initial offset removed"))
_LEFT_IN = 2.0
_DASHES = (0, (3, 2))


def rms_figure(case: Case, styles: Sequence[MethodStyle]) -> str:
    """Rms error of every method in straights, transitions and curves, on a logarithmic axis."""
    with canvas.look():
        tall = 0.34 * len(styles) + 0.1
        figure, axes = canvas.panels_beside(3, tall_in=tall, left_in=_LEFT_IN, gap_in=0.25, right_in=0.2)
        for axis, (quantity, title) in zip(axes, _QUANTITIES, strict=True):
            reach = []
            for line, style in enumerate(styles):
                for window, marker, colour in _WINDOWS:
                    value, sd, _ = case.get(style.name, quantity, "rms", window=window)
                    if not value > 1e-5:
                        continue
                    reach.append(value)
                    if sd > 0.0:
                        ends = [max(value - sd, 0.3 * value), value + sd]
                        axis.plot(ends, [line, line], color=colour, lw=1.6)
                    axis.plot(value, line, marker, color=colour, ms=5.4, mec="white", mew=0.6, zorder=4)
                floor = case.get(style.name, quantity, "rms").value
                if not style.uses_imu and floor > 1e-5:
                    axis.axvline(floor, color=canvas.MUTED, lw=1.0, ls=_DASHES, zorder=1)
            if reach:
                axis.set_xlim(0.6 * min(reach), 1.6 * max(reach))
            canvas.log_scale(axis.xaxis)
            axis.set_ylim(len(styles) - 0.5, -0.5)
            axis.set_yticks(range(len(styles)), [_row_label(s) for s in styles] if axis is axes[0] else [])
            axis.tick_params(axis="y", length=0)
            for label, style in zip(axis.get_yticklabels(), styles, strict=False):
                label.set_color(canvas.MUTED if style.baseline else canvas.INK)
            axis.set_title(title, color=canvas.INK)
            axis.set_xlabel("rms error, \u00b0 (logarithmic)")
        handles = [Line2D([], [], marker=mark, color=colour, lw=0, ms=5.6) for _, mark, colour in _WINDOWS]
        handles.append(Line2D([], [], color=canvas.MUTED, lw=1.0, ls=_DASHES))
        labels = [*(window for window, *_ in _WINDOWS), "design angles only, whole ride"]
        canvas.figure_legend(figure, handles, labels, left_in=_LEFT_IN)
        words = "Root mean square errors of every method in straights, transitions and curves"
        return canvas.to_svg(figure, description=words)


_MOST_NAMES = 8
"""Names of curves that fit side by side."""


def curves_figure(case: Case, styles: Sequence[MethodStyle]) -> str:
    """Rms roll error of every method in each curve; "" if there are no curves, or no method tells roll."""
    windows = case.curves()
    scores_of = {
        style.name: [case.get(style.name, "roll", "rms", window=window) for window in windows]
        for style in styles
    }
    if not any(np.isfinite(score.value) for scores in scores_of.values() for score in scores):
        return ""
    with canvas.look():
        figure, (axis,) = canvas.panels([2.1])
        for order, style in enumerate(styles):
            scores = scores_of[style.name]
            slot, wide = (order, len(styles)), min(0.62, 0.045 * len(windows) * len(styles))
            canvas.draw_marks(
                axis, scores, style, slot=slot, wide=wide, marker="D" if style.baseline else "o"
            )
        names = [window.removeprefix(CURVE_PREFIX) for window in windows]
        if len(names) > _MOST_NAMES:
            # Their numbers, and the radii below them: whole names would run into each other.
            names = ["\n".join(name.split()[1:]) for name in names]
        canvas.categories(axis, names)
        canvas.log_scale(axis.yaxis)
        axis.set_ylabel("rms roll error, \u00b0")
        canvas.legend_above(axis)
        return canvas.to_svg(figure, description="Root mean square roll error of every method in each curve")


def _row_label(style: MethodStyle) -> str:
    # What the label says already is not said again.
    is_told = not style.baseline or style.baseline in style.label
    return style.label if is_told else f"{style.label}  (baseline)"
