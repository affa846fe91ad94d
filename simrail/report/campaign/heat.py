"""Heat maps over the axes of a campaign; of rails, what methods err by in the band that counts."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure

from simrail.core.jit import FloatArray
from simrail.report.campaign.axes import CampaignAxis, draws_of, finest, held
from simrail.report.figures.canvas import (
    INK,
    MUTED,
    Drawing,
    add_panel,
    drawn,
    is_narrow,
    look,
    panels_beside,
    to_svg,
    width_in,
)
from simrail.report.tables.geometry import JUDGED, QUANTITIES, waves_words
from simrail.report.tables.methods import MethodStyle
from simrail.track.bands import Band

HEAT = LinearSegmentedColormap.from_list(
    "heat", ["#f4f8fb", "#cfe1ee", "#93bfdb", "#4a92c3", "#1c639c", "#0a3560"], N=64
)
"""One hue, from light to dark: more error is darker, in print as well."""

MOST_CELLS = 800
"""Of all maps of a figure: of more, nobody reads the numbers, and files hold them."""

CELL_IN = (0.46, 0.27)
"""Least width and height of a cell of a heat map: its number must be read."""

LETTER_IN = 0.075
"""Width of a letter of nine points."""

NUMBER_IN = 0.16
"""Height of a number beside the bar of colours, with what parts it from the next."""

LEAST_FREE = 0.8
"""Share of their room to which words beside each other are made small: 7.2 points."""

MOST_DIGITS = 5
"""Letters of the longest `short_number` of usual sizes: 0.013."""


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


def heat_maps(
    draws: Mapping[str, pd.DataFrame],
    across: Side,
    down: Side,
    *,
    unit: str,
    what: str,
    muted: Collection[str] = (),
) -> str:
    """Mean figure over two sides, a map per title, on one logarithmic scale of colour; "" if there is none.

    Parameters
    ----------
    draws : mapping of str to pandas.DataFrame
        By title of a map, what it is the mean of.
    across, down : Side
        Its columns and rows.
    unit : str
        Unit of the figures.
    what : str
        Description for those who cannot see it.
    muted : collection of str
        Titles that stand back: those of baselines.
    """
    tables = [(title, _means(part, across, down)) for title, part in draws.items()]
    tables = [(title, table) for title, table in tables if np.isfinite(table).any()]
    shown = np.array([table for _, table in tables])
    positive = shown[np.isfinite(shown) & (shown > 0.0)]
    if len(positive) == 0 or shown.size > MOST_CELLS:
        return ""
    low, high = float(positive.min()), float(positive.max())
    norm = LogNorm(low, max(high, 1.05 * low))
    longest = max(len(word) for word in across.words)
    # On a phone there is no room for a bar: the cells have numbers.
    left, right = 0.35 + LETTER_IN * max(len(word) for word in down.words), 0.15 if is_narrow() else 0.85
    gap, title_in = 0.22, 0.34
    wide = max(CELL_IN[0], LETTER_IN * longest) * len(across.words)
    tall = CELL_IN[1] * len(down.words)
    room = width_in() - left - right
    per_row = max(1, min(len(tables), int((room + gap) / (wide + gap))))
    rows = -(-len(tables) // per_row)
    per_row = -(-len(tables) // rows)
    wide = min((room - gap * (per_row - 1)) / per_row, 1.8 * wide)
    end = left + per_row * (wide + gap)
    # Words of neighbours must not touch: they are small, or upright, where there is less than they need.
    cell_in = wide / len(across.words)
    free = min(cell_in / (LETTER_IN * (1 + longest)), 1.0)
    upright = free < LEAST_FREE
    with look():
        figure, axes = panels_beside(
            len(tables),
            tall_in=tall,
            across=per_row,
            left_in=left,
            right_in=width_in() - end + gap,
            top_in=title_in,
            gap_in=gap,
            row_gap_in=title_in,
            bottom_in=0.35 + LETTER_IN * longest if upright else 0.5,
        )
        for number, (axis, (title, table)) in enumerate(zip(axes, tables, strict=True)):
            _draw_heat(axis, table, norm, size=min(8.0, 72.0 * cell_in / (0.6 * MOST_DIGITS)))
            axis.set_title(title, color=MUTED if title in muted else INK, pad=4.0)
            is_first, is_last = number % per_row == 0, number + per_row >= len(tables)
            axis.set_yticks(range(len(down.words)), down.words if is_first else [])
            size = 9.0 * (1.0 if upright else free)
            axis.set_xticks(range(len(across.words)), across.words if is_last else [], fontsize=size)
            if upright:
                axis.tick_params(axis="x", labelrotation=90.0)
            if is_last:
                axis.set_xlabel(across.title)
            if is_first:
                axis.set_ylabel(down.title.partition(",")[0])
        if is_narrow():
            figure.text(1.0, 1.0, unit, fontsize=8.5, ha="right", va="top")
        else:
            _colour_bar(figure, norm, unit, end, title_in, min(rows * (tall + title_in) - title_in, 1.6))
        return to_svg(figure, description=what)


def rails_figures(
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    axes: Sequence[CampaignAxis],
    styles: Sequence[MethodStyle],
    *,
    band: str,
    known: Mapping[str, Band],
) -> list[tuple[str, Drawing]]:
    """Caption and heat maps for each axis, methods by its values; [] if no method says what rails look like.

    Parameters
    ----------
    scores, cells : pandas.DataFrame
        Score table and table of cells.
    axes : sequence of CampaignAxis
        What the cells differ in; an axis that follows from another has no figure of its own.
    styles : sequence of MethodStyle
        Methods, in their order.
    band : str
        Band that is shown.
    known : mapping of str to Band
        Bands whose wavelengths are told.
    """
    draws = {
        QUANTITIES[quantity]: draws_of(scores, cells, axes, quantity=quantity, metric="sd", band=band)
        for quantity in JUDGED
    }
    named = {name for rows in draws.values() for name in rows["estimator"].unique()}
    shown = [style for style in styles if style.name in named]
    if not shown:
        return []
    down = Side("method", [(s.name,) for s in shown], [s.label for s in shown], ["estimator"])
    fine = finest(axes, cells)
    by_column = {axis.column: axis for axis in fine}
    sides: dict[str, tuple[CampaignAxis, ...]] = {}
    if "speed_kmh" in by_column and "direction" in by_column:
        both = by_column.pop("speed_kmh"), by_column.pop("direction")
        sides["speed and direction of travel"] = both
    sides |= {axis.name: (axis,) for axis in by_column.values()}
    figures = []
    for title, across in sides.items():
        kept = held(fine, *across)
        own = {quantity: kept.of(rows) for quantity, rows in draws.items()}
        averaged = "draws and ways to ride" if len(fine) > len(across) + len(kept.values) else "draws"
        caption = (
            f"Rails: standard deviation of the error {waves_words(band, known)}, by method and {title}; "
        )
        caption += f"mean over {averaged}{f'; {kept.words}' if kept.words else ''}."
        make = partial(heat_maps, own, side_of(*across), down, unit="mm", what=caption)
        figures.append((caption, drawn(f"rails-by-{title.replace(' ', '-')}", make)))
    return figures


def _means(draws: pd.DataFrame, across: Side, down: Side) -> FloatArray:
    """Mean over the draws of each cell of the map (rows, columns)."""
    means = draws.groupby([*down.columns, *across.columns], observed=True)["value"].mean()
    by_key = {key if isinstance(key, tuple) else (key,): value for key, value in means.items()}
    table = [[by_key.get((*y, *x), np.nan) for x in across.keys] for y in down.keys]
    return np.array(table, dtype=np.float64)


def _draw_heat(axis: Axes, table: FloatArray, norm: LogNorm, *, size: float) -> None:
    rows, columns = table.shape
    edges = np.arange(columns + 1) - 0.5, np.arange(rows + 1) - 0.5
    shown = np.ma.masked_invalid(table)
    axis.pcolormesh(*edges, shown, cmap=HEAT, norm=norm, edgecolors="white", linewidth=1.2)
    axis.set_ylim(rows - 0.5, -0.5)
    axis.grid(visible=False)
    axis.tick_params(length=0)
    axis.spines[:].set_visible(False)
    for (i, j), value in np.ndenumerate(table):
        text, colour = "\u2013", MUTED
        if np.isfinite(value):
            is_dark = float(norm(max(value, norm.vmin or value))) > 0.5
            # Colours of the cell, not of the page: they are the same in dark mode.
            text, colour = short_number(value), "#fefefe" if is_dark else "#1b2431"
        axis.text(j, i, text, ha="center", va="center", fontsize=size, color=colour)


def short_number(value: float) -> str:
    """A number in two or three digits."""
    decimals = 3 if value < 0.0995 else 2 if value < 9.95 else 1
    return f"{value:.{decimals}f}"


def _colour_bar(figure: Figure, norm: LogNorm, unit: str, left: float, top: float, tall: float) -> None:
    _, height = figure.get_size_inches()
    axis = add_panel(figure, left, height - top - tall, 0.11, tall)
    bar = figure.colorbar(ScalarMappable(norm, HEAT), cax=axis)
    bar.outline.set_visible(False)
    # Its ends are told, and what decades lie well between them: clear of each other by a number's height.
    low, high = float(norm.vmin or 1.0), float(norm.vmax or 1.0)
    decades = 10.0 ** np.arange(np.ceil(np.log10(low)), np.floor(np.log10(high)) + 1.0)
    apart = max(1.8, (high / low) ** (NUMBER_IN / tall))
    marks = [low]
    marks += [mark for mark in decades[:: math.ceil(math.log10(apart))] if apart * low < mark < high / apart]
    marks.append(high)
    bar.set_ticks(marks, labels=[short_number(mark) for mark in marks])
    axis.grid(visible=False)
    axis.minorticks_off()
    axis.set_title(unit, fontsize=8.5, pad=8.0)  # clear of the topmost number
