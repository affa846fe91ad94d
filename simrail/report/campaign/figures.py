"""Figures over the axes of a campaign: heat maps, box plots, and the error against curvature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from simrail.example import CellResult
from simrail.jit import FloatArray
from simrail.report.attitude_figures import angle_error
from simrail.report.campaign.axes import CampaignAxis
from simrail.report.methods import MethodStyle
from simrail.report.style import INK, LEFT_IN, MUTED, WIDTH_IN, log_ticks, look, to_svg

HEAT = LinearSegmentedColormap.from_list(
    "heat", ["#f4f8fb", "#cfe1ee", "#93bfdb", "#4a92c3", "#1c639c", "#0a3560"], N=64
)
"""One hue, from light to dark: more error is darker, in print as well."""

CELL_IN = (0.46, 0.27)
"""Least width and height of a cell of a heat map: its number must be read."""


@dataclass(frozen=True)
class Side:
    """Columns or rows of a heat map: groups of draws, with their words."""

    title: str
    keys: list[tuple[object, ...]]
    words: list[str]
    columns: list[str]


def side_of(*axes: CampaignAxis) -> Side:
    """One axis, or two of which the second runs faster: speeds, each in both directions."""
    first, *rest = axes
    if not rest:
        return Side(first.title, [(value,) for value in first.values], list(first.words), [first.column])
    (second,) = rest
    arrows = {"forward": "\u2192", "backward": "\u2190", "standing": "\u2013"}
    pairs = [(i, j) for i in range(len(first.values)) for j in range(len(second.values))]
    name, comma, unit = first.title.partition(",")
    return Side(
        f"{name} and {second.title}{comma}{unit}",
        [(first.values[i], second.values[j]) for i, j in pairs],
        [f"{first.words[i]} {arrows.get(second.words[j], second.words[j])}" for i, j in pairs],
        [first.column, second.column],
    )


def heat_figure(
    draws: pd.DataFrame, styles: Sequence[MethodStyle], across: Side, down: Side, *, what: str
) -> str:
    """Mean figure of each method over two sides, on one logarithmic scale of colour; "" if there is none."""
    tables = [(style, _means(draws[draws["estimator"] == style.name], across, down)) for style in styles]
    tables = [(style, table) for style, table in tables if np.isfinite(table).any()]
    shown = np.array([table for _, table in tables])
    positive = shown[np.isfinite(shown) & (shown > 0.0)]
    if len(positive) == 0:
        return ""
    low, high = float(positive.min()), float(positive.max())
    norm = LogNorm(low, max(high, 1.05 * low))
    left = 0.35 + 0.075 * max(len(word) for word in down.words)
    wide = max(CELL_IN[0], 0.075 * max(len(word) for word in across.words)) * len(across.words)
    tall = CELL_IN[1] * len(down.words)
    gap, top, bottom, right = 0.22, 0.34, 0.52, 0.85
    room = WIDTH_IN - left - right
    per_row = max(1, min(len(tables), int((room + gap) / (wide + gap))))
    rows = -(-len(tables) // per_row)
    per_row = -(-len(tables) // rows)
    wide = min((room - gap * (per_row - 1)) / per_row, 1.8 * wide)
    height = rows * (tall + top) + bottom
    with look():
        figure = Figure(figsize=(WIDTH_IN, height))
        for number, (style, table) in enumerate(tables):
            row, column = divmod(number, per_row)
            box = (
                (left + column * (wide + gap)) / WIDTH_IN,
                (height - (row + 1) * (tall + top)) / height,
                wide / WIDTH_IN,
                tall / height,
            )
            axis = figure.add_axes(box)
            _draw_heat(axis, table, norm)
            axis.set_title(style.label, color=MUTED if style.baseline else INK, pad=4.0)
            axis.set_yticks(range(len(down.words)), down.words if column == 0 else [])
            last = row == rows - 1 or number + per_row >= len(tables)
            axis.set_xticks(range(len(across.words)), across.words if last else [])
            if last:
                axis.set_xlabel(across.title)
            if column == 0:
                axis.set_ylabel(down.title.partition(",")[0])
        _colour_bar(figure, norm, left + per_row * (wide + gap), bottom, height, min(tall, 1.6))
        return to_svg(figure, description=what)


def _means(draws: pd.DataFrame, across: Side, down: Side) -> FloatArray:
    """Mean over the draws of each cell of the map (rows, columns)."""
    means = draws.groupby([*down.columns, *across.columns], observed=True)["value"].mean()
    found = {key if isinstance(key, tuple) else (key,): value for key, value in means.items()}
    return np.array([[found.get((*y, *x), np.nan) for x in across.keys] for y in down.keys], dtype=np.float64)


def _draw_heat(axis: Axes, table: FloatArray, norm: LogNorm) -> None:
    rows, columns = table.shape
    edges = np.arange(columns + 1) - 0.5, np.arange(rows + 1) - 0.5
    axis.pcolormesh(
        *edges, np.ma.masked_invalid(table), cmap=HEAT, norm=norm, edgecolors="white", linewidth=1.2
    )
    axis.set_ylim(rows - 0.5, -0.5)
    axis.grid(visible=False)
    axis.tick_params(length=0)
    for spine in axis.spines.values():
        spine.set_visible(False)
    for (i, j), value in np.ndenumerate(table):
        if not np.isfinite(value):
            axis.text(j, i, "\u2013", ha="center", va="center", color=MUTED, fontsize=8.0)
            continue
        dark = float(norm(max(value, norm.vmin or value))) > 0.5
        axis.text(j, i, _short(value), ha="center", va="center", fontsize=8.0, color="white" if dark else INK)


def _short(value: float) -> str:
    """A number in two or three digits."""
    decimals = 3 if value < 0.0995 else 2 if value < 9.95 else 1
    return f"{value:.{decimals}f}"


def _colour_bar(
    figure: Figure, norm: LogNorm, left: float, bottom: float, height: float, tall: float
) -> None:
    box = (left / WIDTH_IN, (height - 0.34 - tall) / height, 0.11 / WIDTH_IN, tall / height)
    axis = figure.add_axes(box)
    bar = figure.colorbar(ScalarMappable(norm, HEAT), cax=axis)
    bar.outline.set_visible(False)
    log_ticks(axis.yaxis)
    axis.grid(visible=False)
    axis.minorticks_off()
    axis.set_title("\u00b0", fontsize=8.5, pad=5.0)


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
        ncols=6,
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
    axis.set_xticks(range(len(along.words)), along.words)
    axis.set_xlim(-0.5, len(along.values) - 0.5)
    axis.tick_params(axis="x", length=0)
    axis.grid(axis="x", visible=False)
    axis.grid(axis="y", which="minor", color="#f2f4f7", lw=0.5)
    for place in range(1, len(along.values)):
        axis.axvline(place - 0.5, color="#d0d5dd", lw=0.7)
    axis.set_xlabel(along.title)


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
