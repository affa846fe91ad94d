"""Figures over the axes of a campaign: box plots, and the error against curvature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from simrail.campaign.cell import CellResult
from simrail.core.jit import FloatArray
from simrail.report.campaign.axes import CampaignAxis
from simrail.report.figures.attitude import angle_error
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

LONG_WORD = 16
"""Longer names of values are told in two lines, so that neighbours do not touch."""


def box_figure(
    draws: pd.DataFrame, styles: Sequence[MethodStyle], axes: Sequence[CampaignAxis], *, what: str
) -> str:
    """How the figure spreads over all cells with a value of an axis, for each axis a panel."""
    styles = [style for style in styles if (draws["estimator"] == style.name).any()]
    positive = draws.loc[draws["value"] > 0.0, "value"]
    if not styles or not axes or positive.empty:
        return ""
    across = 2 if len(axes) > 1 else 1
    rows = -(-len(axes) // across)
    tall, gap, top, bottom = 2.2, 0.75, 0.62, 0.5
    height = top + rows * tall + (rows - 1) * gap + bottom
    wide = (WIDTH_IN - LEFT_IN - 0.2 - 0.7 * (across - 1)) / across
    found = {style.name: draws[draws["estimator"] == style.name] for style in styles}
    with look():
        figure = Figure(figsize=(WIDTH_IN, height))
        for number, axis_of in enumerate(axes):
            row, column = divmod(number, across)
            box = (
                (LEFT_IN + column * (wide + 0.7)) / WIDTH_IN,
                (height - top - tall - row * (tall + gap)) / height,
                wide / WIDTH_IN,
                tall / height,
            )
            axis = figure.add_axes(box)
            _draw_boxes(axis, found, styles, axis_of)
            axis.set_yscale("log")
            axis.set_ylim(0.8 * float(positive.quantile(0.001)), 1.25 * float(positive.quantile(0.999)))
            log_ticks(axis.yaxis)
            if column == 0:
                axis.set_ylabel("rms roll error, \u00b0")
        _legend(figure, styles)
        return to_svg(figure, description=what)


def _legend(figure: Figure, styles: Sequence[MethodStyle]) -> None:
    figure.legend(
        handles=[Patch(color=style.colour, label=style.label) for style in styles],
        loc="upper left",
        bbox_to_anchor=(LEFT_IN / WIDTH_IN - 0.01, 1.0),
        ncols=fitting_columns([style.label for style in styles], WIDTH_IN - LEFT_IN),
        borderaxespad=0.1,
    )


def _draw_boxes(
    axis: Axes, found: dict[str, pd.DataFrame], styles: Sequence[MethodStyle], along: CampaignAxis
) -> None:
    slot = 0.8 / len(styles)
    for i, value in enumerate(along.values):
        for k, style in enumerate(styles):
            rows = found[style.name]
            values = rows.loc[rows[along.column] == value, "value"].to_numpy()
            values = values[values > 0.0]
            if len(values) == 0:
                continue
            x = i - 0.4 + (k + 0.5) * slot
            low, first, middle, third, high = np.percentile(values, [5.0, 25.0, 50.0, 75.0, 95.0])
            axis.plot([x, x], [low, high], color=style.colour, lw=1.0, solid_capstyle="butt", zorder=2)
            axis.bar(x, third - first, 0.78 * slot, first, color=style.colour, lw=0, zorder=3)
            ends = [x - 0.39 * slot, x + 0.39 * slot]
            # A box without height is seen as a bar.
            axis.plot(ends, [middle, middle], color=style.colour, lw=3.6, solid_capstyle="butt", zorder=2)
            axis.plot(ends, [middle, middle], color="white", lw=1.3, solid_capstyle="butt", zorder=4)
    axis.set_xticks(range(len(along.words)), [_in_two(word) for word in along.words])
    axis.set_xlim(-0.5, len(along.values) - 0.5)
    axis.tick_params(axis="x", length=0)
    axis.grid(axis="x", visible=False)
    axis.grid(axis="y", which="minor", color="#f2f4f7", lw=0.5)
    for place in range(1, len(along.values)):
        axis.axvline(place - 0.5, color="#d0d5dd", lw=0.7)
    axis.set_xlabel(along.title)


def _in_two(word: str) -> str:
    """A long name in two lines, parted at the underscore that is nearest to its middle."""
    places = [i for i, letter in enumerate(word) if letter == "_"]
    if len(word) <= LONG_WORD or not places:
        return word
    at = min(places, key=lambda i: abs(i - len(word) // 2)) + 1
    return f"{word[:at]}\n{word[at:]}"


def curvature_figure(
    examples: Sequence[CellResult], styles: Sequence[MethodStyle], *, words: Sequence[str], what: str
) -> str:
    """Mean roll error against the curvature of the design track, from single rides; "" without curves."""
    kept = [
        (example, word, *_curvature_bins(example))
        for example, word in zip(examples, words, strict=True)
        if example.estimates
    ]
    kept = [item for item in kept if len(item[2]) > 1][:4]
    if not kept:
        return ""
    gap, top, bottom, tall = 0.3, 0.66, 0.5, 2.5
    wide = (WIDTH_IN - LEFT_IN - 0.2 - gap * (len(kept) - 1)) / len(kept)
    height = top + tall + bottom
    with look():
        figure = Figure(figsize=(WIDTH_IN, height))
        first: Axes | None = None
        for number, (example, word, middles, number_of) in enumerate(kept):
            box = (
                (LEFT_IN + number * (wide + gap)) / WIDTH_IN,
                bottom / height,
                wide / WIDTH_IN,
                tall / height,
            )
            axis = figure.add_axes(box, sharey=first)
            first = first or axis
            for style in styles:
                if style.name not in example.estimates:
                    continue
                error = np.rad2deg(angle_error(example, style.name, 0))
                means = [float(np.mean(error[number_of == k])) for k in range(len(middles))]
                axis.plot(
                    middles,
                    means,
                    "o-",
                    color=style.colour,
                    mfc="white" if style.baseline else style.colour,
                    ms=4.4,
                    mew=1.1,
                    lw=1.0,
                    label=style.label,
                )
            axis.axhline(0.0, color=MUTED, lw=0.7, zorder=1)
            axis.set_title(word, color=INK)
            axis.set_xlabel("curvature, 1/km (positive to the left)")
            if number:
                axis.tick_params(labelleft=False)
            else:
                axis.set_ylabel("mean roll error, \u00b0")
        drawn = [style for style in styles if any(style.name in item[0].estimates for item in kept)]
        _legend(figure, drawn)
        return to_svg(figure, description=what)


def _curvature_bins(example: CellResult) -> tuple[FloatArray, np.ndarray]:
    """Mean curvature (b,) 1/km of the bins ridden through for half a second, and the bin (n,) or -1."""
    motion, rate = example.motion, example.recording.imu_sheet.rate_hz
    curvature = 1e3 * example.recording.track.frame(motion["position_m"].to_numpy()).k[:, 2]
    moving = np.abs(motion["speed_mps"].to_numpy()) > 0.5
    width = max(float(np.ptp(curvature)) / 10.0, 1e-6)
    bins = np.rint(curvature / width).astype(np.intp)
    kept = [k for k in np.unique(bins) if np.count_nonzero(moving & (bins == k)) >= 0.5 * rate]
    number = np.full(len(bins), -1)
    for place, k in enumerate(kept):
        number[moving & (bins == k)] = place
    return np.array([curvature[number == place].mean() for place in range(len(kept))]), number
