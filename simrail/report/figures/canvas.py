"""How figures look, and how they become inline SVG.

Figures are `matplotlib.figure.Figure` objects made under `look()`; pyplot and its global state are
not used. Text stays text, so it is set in the page's own fonts and can be searched.
"""

import re
from collections.abc import Sequence
from contextlib import AbstractContextManager
from html import escape
from io import StringIO
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from simrail.core.jit import FloatArray
from simrail.report.figures.decimate import Bins, Envelope
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Mean
from simrail.track.design import CURVE, TRANSITION, Curve, TrackDesign

WIDTH_IN = 11.25
"""Width of a figure: 1080 CSS pixels."""

LEFT_IN = 0.84
"""Margin left of the axes: tick labels such as -0.25, then two lines of label."""

INK, MUTED, GRID = "#1b2430", "#667085", "#e4e7ec"
TRUTH, DESIGN = "#c2c8d1", "#111111"
CURVE_TINT, TRANSITION_TINT = "#eef1e6", "#f6f8f2"

_CURVE_NAME: dict[str, Any] = {
    "textcoords": "offset points",
    "ha": "center",
    "va": "top",
    "fontsize": 7.2,
    "color": "#66714a",
    "zorder": 40,
    "bbox": {"facecolor": CURVE_TINT, "alpha": 0.85, "lw": 0, "pad": 1.0},
}
"""How the names of curves look in a plot over distance."""

_RC: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "simrail",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.edgecolor": "#b8bec8",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": "#98a1af",
    "ytick.color": "#98a1af",
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "lines.linewidth": 1.1,
    "lines.solid_joinstyle": "round",
    "path.simplify_threshold": 0.75,
    "legend.frameon": False,
    "legend.fontsize": 8.8,
    "legend.handlelength": 1.8,
}


def look() -> AbstractContextManager[None]:
    """Context in which figures are made and written."""
    return mpl.rc_context(_RC)


def add_panel(
    figure: Figure, left_in: float, low_in: float, wide_in: float, tall_in: float, **options: Any
) -> Axes:
    """Add a panel to a figure, at a place in inches."""
    wide, tall = figure.get_size_inches()
    return figure.add_axes((left_in / wide, low_in / tall, wide_in / wide, tall_in / tall), **options)


def panels(heights_in: Sequence[float], *, top_in: float = 0.42) -> tuple[Figure, list[Axes]]:
    """Make a figure of panels above each other over one x axis.

    Margins are in inches, so that the axes of all figures of the page stand at the same place.
    """
    gap, bottom, right = 0.14, 0.5, 0.2
    height = top_in + bottom + sum(heights_in) + gap * (len(heights_in) - 1)
    figure = Figure(figsize=(WIDTH_IN, height))
    axes: list[Axes] = []
    edge = height - top_in
    wide = WIDTH_IN - LEFT_IN - right
    for tall in heights_in:
        axis = add_panel(figure, LEFT_IN, edge - tall, wide, tall, sharex=axes[0] if axes else None)
        # A fixed place, so that no label depends on the width of its tick labels.
        axis.yaxis.set_label_coords(-0.56 / wide, 0.5)
        axes.append(axis)
        edge -= tall + gap
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    return figure, axes


def panels_beside(
    count: int,
    *,
    tall_in: float,
    across: int = 3,
    left_in: float = LEFT_IN,
    right_in: float = 0.15,
    top_in: float = 0.62,
    gap_in: float = 0.42,
    row_gap_in: float = 0.75,
    share_y: bool = False,
) -> tuple[Figure, list[Axes]]:
    """Make a figure of panels beside each other, in rows; lengths in inches."""
    bottom = 0.5
    rows = -(-count // across)
    height = top_in + rows * tall_in + (rows - 1) * row_gap_in + bottom
    wide = (WIDTH_IN - left_in - right_in - gap_in * (across - 1)) / across
    figure = Figure(figsize=(WIDTH_IN, height))
    axes: list[Axes] = []
    for number in range(count):
        row, column = divmod(number, across)
        low = height - top_in - tall_in - row * (tall_in + row_gap_in)
        left = left_in + column * (wide + gap_in)
        axes.append(add_panel(figure, left, low, wide, tall_in, sharey=axes[0] if share_y and axes else None))
    return figure, axes


def categories(axis: Axes, words: Sequence[str], *, size: float | None = None) -> None:
    """Give each word a slot of the x axis, parted by lines."""
    for place in range(1, len(words)):
        axis.axvline(place - 0.5, color="#d0d5dd", lw=0.7)
    axis.set_xticks(range(len(words)), words, fontsize=size)
    axis.set_xlim(-0.5, len(words) - 0.5)
    axis.tick_params(axis="x", length=0)
    axis.grid(axis="x", visible=False)


def draw_marks(
    axis: Axes,
    scores: Sequence[Mean],
    style: MethodStyle,
    *,
    slot: tuple[int, int],
    marker: str,
    wide: float = 0.8,
) -> None:
    """Draw a method's scores by category, with a stroke of one standard deviation between draws.

    Parameters
    ----------
    axis : Axes
        Panel with `categories`.
    scores : sequence of Mean
        One per category; what is not positive is left out.
    style : MethodStyle
        The method; hollow for a baseline.
    slot : tuple of int
        Number of the method and how many there are, which share the width `wide` of a category.
    marker : str
        Its mark.
    """
    order, count = slot
    value = np.array([score.value for score in scores])
    value = np.where(value > 1e-5, value, np.nan)
    sd = np.nan_to_num([score.sd for score in scores])
    axis.errorbar(
        np.arange(len(scores)) + (order + 0.5) * wide / count - 0.5 * wide,
        value,
        [np.minimum(sd, 0.7 * value), sd],
        fmt=marker,
        ms=5.0,
        color=style.colour,
        mfc="white" if style.baseline else style.colour,
        mew=1.2,
        lw=1.0,
        label=style.label,
    )


def draw_envelope(axis: Axes, bins: Bins, signal: FloatArray, *, colour: str) -> Envelope:
    """Draw the range and the mean of a signal (n,) by bins; returns them."""
    envelope = bins.envelope(signal)
    axis.fill_between(bins.x, envelope.low, envelope.high, color=colour, alpha=0.28, lw=0)
    axis.plot(bins.x, envelope.mean, color=colour, lw=1.1)
    return envelope


def draw_truth(axis: Axes, bins: Bins, angle_rad: FloatArray) -> FloatArray:
    """Draw a true angle (n,) over distance; returns what was drawn, in degrees."""
    x, y = bins.line(np.rad2deg(angle_rad))
    axis.plot(x, y, color=TRUTH, lw=2.2, label="truth", zorder=2)
    return y


def draw_design(axis: Axes, x: FloatArray, angle_rad: FloatArray) -> FloatArray:
    """Draw an angle of the design track at places (n,); returns it in degrees."""
    y: FloatArray = np.rad2deg(angle_rad)
    axis.plot(x, y, color=DESIGN, lw=0.9, ls=(0, (4, 2)), label="design", zorder=20)
    return y


def fit_limits(axis: Axes, lines: Sequence[FloatArray], *, top: float = 0.08) -> None:
    """Set y limits to what lines reach, single spikes left out, with room at the top for names of curves."""
    finite = np.concatenate(lines)
    finite = finite[np.isfinite(finite)]
    low, high = np.percentile(finite, [0.05, 99.95])
    pad_limits(axis, low, high, top=top)


def log_ticks(axis: Axis) -> None:
    """Label a logarithmic axis without exponents: at 1, 2 and 5 of each decade, or at 1 of many.

    Where fewer than two of these are in sight, at two to four even steps.
    """
    low, high = sorted(axis.get_view_interval())
    subs = (1.0, 2.0, 5.0) if high < 60.0 * low else (1.0,)
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    marks = np.outer(decades, subs)
    few = np.count_nonzero((low <= marks) & (marks <= high)) < 2
    axis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]) if few else LogLocator(subs=subs))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def log_scale(axis: Axis) -> None:
    """Make an axis logarithmic, after its limits were set."""
    panel = axis.axes
    (panel.set_xscale if axis is panel.xaxis else panel.set_yscale)("log")
    log_ticks(axis)
    axis.grid(visible=True, which="minor", color="#f2f4f7", lw=0.5)


def fitting_columns(labels: Sequence[str], width_in: float) -> int:
    """Columns of a legend that fit into a width; a letter is taken for 0.6 of the font's size.

    Matplotlib fills a legend column by column, and a column is as wide as its longest label.
    """
    size_in = _RC["legend.fontsize"] / 72.0
    for columns in range(len(labels), 1, -1):
        rows, longer = divmod(len(labels), columns)
        starts = np.cumsum([0] + [rows + (i < longer) for i in range(columns)])
        longest = [max(map(len, labels[a:b])) for a, b in pairwise(starts)]
        if size_in * (0.6 * sum(longest) + 4.2 * columns) <= width_in:
            return columns
    return 1


def legend_above(*axes: Axes) -> None:
    """Put the legend of some panels above the first, outside of the data; truth and design first."""
    by_label = {
        str(label): handle
        for axis in reversed(axes)
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    labels = sorted(by_label, key=lambda label: {"truth": 0, "design": 1}.get(label, 2))
    axes[0].legend(
        [by_label[label] for label in labels],
        labels,
        loc="lower left",
        bbox_to_anchor=(-0.005, 1.0),
        ncols=fitting_columns(labels, WIDTH_IN - LEFT_IN),
        borderaxespad=0.15,
        columnspacing=1.4,
    )


def figure_legend(
    figure: Figure, handles: Sequence[Artist], labels: Sequence[str], *, left_in: float = LEFT_IN
) -> None:
    """Put a legend at the top of a figure."""
    figure.legend(
        handles,
        labels,
        loc="upper left",
        bbox_to_anchor=(left_in / WIDTH_IN - 0.01, 1.0),
        ncols=fitting_columns(labels, WIDTH_IN - left_in),
        borderaxespad=0.1,
    )


def shade_track(axes: Sequence[Axes], track: TrackDesign, *, limits: tuple[float, float]) -> None:
    """Tint curves and transitions of a plot over distance, and name the curves in the first panel."""
    low, high = limits
    start, last_label = track.start_m, -np.inf
    for element in track.elements:
        end = start + element.length_m
        if end > low and start < high and element.kind in (CURVE, TRANSITION):
            tint = CURVE_TINT if element.kind == CURVE else TRANSITION_TINT
            for axis in axes:
                axis.axvspan(max(start, low), min(end, high), color=tint, lw=0, zorder=-5)
            middle = 0.5 * (start + end)
            has_room = middle - last_label > 0.05 * (high - low) and low < middle < high
            if isinstance(element, Curve) and has_room:
                text = f"{abs(element.radius_m):.0f} m {'left' if element.radius_m > 0 else 'right'}"
                at_top = axes[0].get_xaxis_transform()
                axes[0].annotate(text, (middle, 1.0), (0, -3), xycoords=at_top, **_CURVE_NAME)
                last_label = middle
        start = end
    axes[0].set_xlim(low, high)


def distance_axis(axis: Axes, *, direction: int | None = None) -> None:
    """Label the x axis of a plot over distance, with the direction of travel where there is one."""
    axis.set_xlabel("distance along the track, m")
    if direction is None:
        return
    arrow, side, x = ("travel \u2192", "right", 1.0) if direction >= 0 else ("\u2190 travel", "left", 0.0)
    look_of: dict[str, Any] = {"textcoords": "offset points", "ha": side, "color": INK, "weight": "bold"}
    axis.annotate(arrow, (x, 0.0), (0, -29), xycoords="axes fraction", **look_of)


def pad_limits(axis: Axes, low: float, high: float, *, top: float = 0.14) -> None:
    """Set y limits with room at the top for the names of the curves."""
    span = max(high - low, 1e-9)
    axis.set_ylim(low - 0.08 * span, high + top * span)


def to_svg(figure: Figure, *, description: str) -> Markup:
    """Write a figure as an inline SVG element that fills the width of its container.

    Parameters
    ----------
    figure : Figure
        The figure.
    description : str
        What it shows, for those who cannot see it.
    """
    out = StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text, flags=re.DOTALL)
    # A tenth of a point is 0.13 pixels. Only within tags: a label of 0.0001 is no place.
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\.\d)\d{3,}", r"\1", tag.group()), text)
    # Several figures share the page: an id that nothing refers to would only stand there twice.
    used = set(re.findall(r"#([\w-]+)", text))
    text = re.sub(r' id="([\w.-]+)"', lambda m: m.group(0) if m.group(1) in used else "", text)
    # The page chooses the fonts; matplotlib's versions write them in two ways.
    text = re.sub(r'font-family: [^;"]*;? ?', "", text)
    text = re.sub(r'font: ([\d.]+px) [^;"]*', r"font-size: \1", text)
    view = re.search(r'viewBox="[^"]*"', text)
    assert view is not None
    link = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    head = f'<svg {view.group()} {link} role="img" aria-label="{escape(description, quote=True)}">'
    text = re.sub(r"\s*\n\s*", "\n", head + text[text.index(">") + 1 :])
    return Markup(re.sub(r"\n([MLz\"])", r"\1", text).strip())  # a path in one line
