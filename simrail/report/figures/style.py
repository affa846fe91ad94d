"""How figures look, and how they become inline SVG.

Figures are `matplotlib.figure.Figure` objects made under `look()`; pyplot and its global state are
not used. Text stays text, so it is set in the page's own fonts and can be searched.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import AbstractContextManager
from html import escape
from io import StringIO
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from simrail.track.design import CURVE, TRANSITION, Curve, TrackDesign

WIDTH_IN = 11.25
"""Width of a figure: 1080 CSS pixels."""

LEFT_IN = 0.84
"""Margin left of the axes: tick labels such as -0.25, then two lines of label."""

INK, MUTED, GRID = "#1b2430", "#667085", "#e4e7ec"
TRUTH, DESIGN = "#c2c8d1", "#111111"
CURVE_TINT, TRANSITION_TINT = "#eef1e6", "#f6f8f2"

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
    "path.simplify_threshold": 0.25,
    "legend.frameon": False,
    "legend.fontsize": 8.8,
    "legend.handlelength": 1.8,
}


def look() -> AbstractContextManager[None]:
    """Context in which figures are made and written."""
    return mpl.rc_context(_RC)


def panels(
    heights_in: Sequence[float], *, left_in: float = LEFT_IN, right_in: float = 0.2, top_in: float = 0.42
) -> tuple[Figure, list[Axes]]:
    """Make a figure of panels above each other over one x axis.

    Margins are in inches, so that the axes of all figures of the page stand at the same place.
    """
    gap, bottom = 0.14, 0.5
    height = top_in + bottom + sum(heights_in) + gap * (len(heights_in) - 1)
    figure = Figure(figsize=(WIDTH_IN, height))
    axes: list[Axes] = []
    edge = height - top_in
    for tall in heights_in:
        box = (
            left_in / WIDTH_IN,
            (edge - tall) / height,
            1.0 - (left_in + right_in) / WIDTH_IN,
            tall / height,
        )
        axis = figure.add_axes(box, sharex=axes[0] if axes else None)
        # A fixed place, so that no label depends on the width of its tick labels.
        axis.yaxis.set_label_coords(-0.56 / (WIDTH_IN - left_in - right_in), 0.5)
        axes.append(axis)
        edge -= tall + gap
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    return figure, axes


def log_ticks(axis: Axis) -> None:
    """Label a logarithmic axis without exponents: at 1, 2 and 5 of each decade, or at 1 of many."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 60.0 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


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


def legend_above(axis: Axes) -> None:
    """Put the legend of an axis above it, outside of the data; truth and design first."""
    handles, labels = axis.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda i: {"truth": 0, "design": 1}.get(labels[i], 2))
    axis.legend(
        [handles[i] for i in order],
        [labels[i] for i in order],
        loc="lower left",
        bbox_to_anchor=(-0.005, 1.0),
        ncols=fitting_columns([labels[i] for i in order], WIDTH_IN - LEFT_IN),
        borderaxespad=0.15,
        columnspacing=1.4,
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
            if (
                isinstance(element, Curve)
                and middle - last_label > 0.05 * (high - low)
                and low < middle < high
            ):
                side = "left" if element.radius_m > 0 else "right"
                text = f"{abs(element.radius_m):.0f} m {side}"
                axes[0].annotate(
                    text,
                    (middle, 1.0),
                    xycoords=axes[0].get_xaxis_transform(),
                    xytext=(0, -3),
                    textcoords="offset points",
                    ha="center",
                    va="top",
                    fontsize=7.2,
                    color="#66714a",
                    zorder=40,
                    bbox={"facecolor": CURVE_TINT, "alpha": 0.85, "lw": 0, "pad": 1.0},
                )
                last_label = middle
        start = end
    axes[0].set_xlim(low, high)


def distance_axis(axis: Axes, *, direction: int) -> None:
    """Label the x axis of a plot over distance, with the direction of travel."""
    arrow = "travel \u2192" if direction >= 0 else "\u2190 travel"
    axis.set_xlabel("distance along the track, m")
    place = {"ha": "right", "x": 1.0} if direction >= 0 else {"ha": "left", "x": 0.0}
    axis.annotate(
        arrow,
        (place["x"], 0.0),
        xycoords=("axes fraction", "axes fraction"),
        xytext=(0, -29),
        textcoords="offset points",
        ha=place["ha"],
        color=INK,
        weight="bold",
    )


def pad_limits(axis: Axes, low: float, high: float, *, top: float = 0.14, bottom: float = 0.08) -> None:
    """Set y limits with room at the top for the names of the curves."""
    span = max(high - low, 1e-9)
    axis.set_ylim(low - bottom * span, high + top * span)


def to_svg(figure: Figure, *, description: str) -> str:
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
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r' d="([^"]*)"', _shorter, text, flags=re.DOTALL)
    # Several figures share the page: an id that nothing refers to would only stand there twice.
    used = set(re.findall(r"#([\w-]+)", text))
    text = re.sub(r' id="([\w-]+)"', lambda m: m.group(0) if m.group(1) in used else "", text)
    # The page chooses the fonts; matplotlib's versions write them in two ways.
    text = re.sub(r'font-family: [^;"]*;? ?', "", text)
    text = re.sub(r'font: ([\d.]+px) [^;"]*', r"font-size: \1", text)
    text = re.sub(r' transform="rotate\(-?0 [^"]*"', "", text)
    text = re.sub(r'^<svg[^>]*?(viewBox="[^"]*")[^>]*>', r"<svg \1 ROLE>", text)
    link = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    text = text.replace("ROLE", f'{link} role="img" aria-label="{escape(description, quote=True)}"', 1)
    return re.sub(r"\n\s*", "\n", text).strip()


def _shorter(match: re.Match[str]) -> str:
    """A path in tenths of a point (0.13 pixel); long lines as steps from point to point."""
    path = match.group(1)
    words = path.split()
    if len(words) < 30 or set(words[::3]) != {"M", "L"} or words[3::3].count("M"):
        return f' d="{" ".join(_tenths(word) for word in words)}"'
    places = np.rint(10.0 * np.array([words[1::3], words[2::3]], dtype=np.float64)).astype(np.int64)
    steps = np.diff(places, axis=1)
    start = f"M{places[0, 0] / 10:g} {places[1, 0] / 10:g}l"
    # Each coordinate with one decimal, without a leading zero: 0.5 is written .5
    told = [_tenth_texts(row) for row in steps]
    return f' d="{start}{" ".join(f"{x} {y}" for x, y in zip(*told, strict=True))}"'


def _tenths(word: str) -> str:
    try:
        return f"{float(word):.1f}".removesuffix(".0")
    except ValueError:
        return word


def _tenth_texts(tenths: npt.NDArray[np.int64]) -> list[str]:
    known = {
        t: f"{t / 10:g}".replace("0.", ".", 1) if abs(t) < 10 and t else f"{t / 10:g}"
        for t in set(tenths.tolist())
    }
    return [known[t] for t in tenths.tolist()]
