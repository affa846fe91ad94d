"""How figures look, and how they become inline SVG, or a file.

Figures are `matplotlib.figure.Figure` objects made under `look()`; pyplot and its global state are
not used. Text stays text, so it is set in the page's own fonts and can be searched. `drawn` makes a figure
twice, for a desk and for a phone, with the page's variables as its colours, so that it follows dark mode;
`only` makes one figure of a page as a file instead.
"""

import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache
from html import escape
from io import BytesIO, StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from simrail.core.atomic_files import write_whole
from simrail.core.jit import FloatArray
from simrail.report.figures.decimate import Bins
from simrail.report.figures.shorter import shorter
from simrail.report.tables.methods import MethodStyle, mixed
from simrail.report.tables.pivot import Mean
from simrail.track.design import CURVE, TRANSITION, Curve, TrackDesign

WIDE_IN, NARROW_IN = 11.25, 3.67
"""Width of a figure on a desk and on a phone: 1080 and 352 CSS pixels."""

_WIDTH: ContextVar[float] = ContextVar("width", default=WIDE_IN)

LEFT_IN = 0.84
"""Margin left of the axes: tick labels such as -0.25, then two lines of label."""

PRINT_DPI = 220
"""Dots per inch of a PNG: sharp on a slide, 2475 across."""

MOST_UPRIGHT = 3
"""Words of slots on a phone that are written level; more stand upright."""

INK, MUTED, GRID = "#1b2430", "#667085", "#e4e7ec"
TRUTH, DESIGN = "#c2c8d1", "#111111"
CURVE_TINT, TRANSITION_TINT = "#eef1e6", "#f6f8f2"

_VARIABLES = {
    INK: "ink",
    MUTED: "muted",
    "#6b7280": "muted",
    "#66714a": "muted",
    GRID: "line",
    "#d0d5dd": "line",
    "#f2f4f7": "line",
    "#b8bec8": "axis",
    "#98a1af": "axis",
    DESIGN: "ink",
    CURVE_TINT: "curve",
    TRANSITION_TINT: "transition",
    "#ffffff": "page",
    "#dfe4ea": "line",
    "#e8ebf0": "line",
    "#dbe9f4": "tint",
    "#15803d": "good",
    "#b42318": "bad",
}
"""Variables of the page that stand for colours of the figures, so that dark mode has its own."""

LIGHT = {name: colour for colour, name in reversed(_VARIABLES.items())}
"""Colours of these variables by day, where no page gives them: without one, all is black."""


NIGHT = "#12171d"
"""The page's ground in dark mode."""

ENOUGH = 5.0
"""Contrast to a ground (WCAG 2) from which on a thin line is seen well; below it night has its own."""

_LEAST = 3.3
"""Contrast by night of what would have none; what is darker stays darker, so that shades stay apart."""


def contrast(one: str, other: str) -> float:
    """Contrast of two colours by WCAG 2: (L1 + 0.05) / (L2 + 0.05) of their relative luminances."""
    light = []
    for colour in (one, other):
        linear = [((c + 0.055) / 1.055) ** 2.4 if c > 0.04045 else c / 12.92 for c in to_rgb(colour)]
        light.append(0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] + 0.05)
    return max(light) / min(light)


@cache
def by_night(colour: str) -> str:
    """What a colour of a series is in dark mode: with white where it would hardly be seen."""
    own = contrast(colour, NIGHT)
    if own >= ENOUGH:
        return colour
    wanted = _LEAST + (own - 1.0) / (ENOUGH - 1.0) * (ENOUGH - _LEAST)
    shares = (0.02 * step for step in range(51))
    return next(seen for share in shares if contrast(seen := mixed(colour, share), NIGHT) >= wanted)


def day_and_night(name: str, colour: str) -> str:
    """A property of a style with a colour of a series; a browser without ``light-dark`` takes the first."""
    night = by_night(colour.lower())
    later = f"; {name}: light-dark({colour}, {night})" if night != colour.lower() else ""
    return f"{name}: {colour}{later}"


def by_itself(svg: str) -> str:
    """Inline SVG with colours and a font of its own: as a file, outside of a page."""
    svg = re.sub(r"light-dark\((#\w+), #\w+\)", r"\1", svg)
    coloured = re.sub(r"var\(--(\w+)\)", lambda name: LIGHT[name[1]], svg)
    return coloured.replace("<svg ", '<svg font-family="sans-serif" ', 1)


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
    "text.color": INK,
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
    # A line of the grid shows where they are.
    "xtick.minor.size": 0.0,
    "ytick.minor.size": 0.0,
    "lines.linewidth": 1.1,
    "lines.solid_joinstyle": "round",
    "path.simplify_threshold": 0.75,
    "legend.frameon": False,
    "legend.fontsize": 8.8,
    "legend.handlelength": 1.8,
}


def width_in() -> float:
    """Width of the figure that is being made."""
    return _WIDTH.get()


def is_narrow() -> bool:
    """Whether it is made for a phone."""
    return width_in() < 0.5 * WIDE_IN


class Drawing(Markup):
    """Inline SVG of a figure, with the name by which `simrail figure` makes it again."""

    name: str = ""


@dataclass
class Order:
    """A figure that is wanted as a file, and the names of all that were met while it was looked for."""

    wanted: str
    path: Path
    names: list[str] = field(default_factory=list)
    written: bool = False


_ORDER: ContextVar[Order | None] = ContextVar("order", default=None)


@contextmanager
def only(wanted: str, path: Path) -> Iterator[Order]:
    """Context in which `drawn` makes one figure, and writes it: SVG or PDF by the end of the file's name."""
    order = Order(wanted, path)
    token = _ORDER.set(order)
    try:
        yield order
    finally:
        _ORDER.reset(token)


def drawn(
    name: str, make: Callable[[], str], *, widths_in: tuple[float, float] = (WIDE_IN, NARROW_IN)
) -> Drawing:
    """A figure of the page, for a desk and for a phone; "" if there is nothing to draw.

    Parameters
    ----------
    name : str
        By which it is asked for; once on a page.
    make : callable
        Makes it: what `to_svg` returned, or "".
    widths_in : tuple of float
        Of both.
    """
    order = _ORDER.get()
    if order is not None:
        order.names.append(name)
        order.written |= name == order.wanted and bool(make())
        return Drawing()
    sizes = []
    for width in widths_in:
        token = _WIDTH.set(width)
        try:
            sizes.append(make())
        finally:
            _WIDTH.reset(token)
        if not sizes[0]:
            return Drawing()
    drawing = Drawing(f'<div class="wide">{sizes[0]}</div><div class="narrow">{sizes[1]}</div>')
    drawing.name = name
    return drawing


def look() -> AbstractContextManager[None]:
    """Context in which figures are made and written."""
    return mpl.rc_context(_RC)


def add_panel(
    figure: Figure, left_in: float, low_in: float, wide_in: float, tall_in: float, **options: Any
) -> Axes:
    """Add a panel to a figure, at a place in inches."""
    wide, tall = figure.get_size_inches()
    return figure.add_axes((left_in / wide, low_in / tall, wide_in / wide, tall_in / tall), **options)


def panels(
    heights_in: Sequence[float], *, top_in: float = 0.42, bottom_in: float = 0.5
) -> tuple[Figure, list[Axes]]:
    """Make a figure of panels above each other over one x axis.

    Margins are in inches, so that the axes of all figures of the page stand at the same place.
    """
    gap, bottom, right = 0.14, bottom_in, 0.2
    height = top_in + bottom + sum(heights_in) + gap * (len(heights_in) - 1)
    figure = Figure(figsize=(width_in(), height))
    axes: list[Axes] = []
    edge = height - top_in
    wide = width_in() - LEFT_IN - right
    for tall in heights_in:
        axis = add_panel(figure, LEFT_IN, edge - tall, wide, tall, sharex=axes[0] if axes else None)
        # A fixed place, so that no label depends on the width of its tick labels.
        axis.yaxis.set_label_coords(-0.64 / wide, 0.5)
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
    bottom_in: float = 0.5,
    share_y: bool = False,
) -> tuple[Figure, list[Axes]]:
    """Make a figure of panels beside each other, in rows; lengths in inches."""
    across = 1 if is_narrow() else across
    rows = -(-count // across)
    height = top_in + rows * tall_in + (rows - 1) * row_gap_in + bottom_in
    wide = (width_in() - left_in - right_in - gap_in * (across - 1)) / across
    figure = Figure(figsize=(width_in(), height))
    axes: list[Axes] = []
    for number in range(count):
        row, column = divmod(number, across)
        low = height - top_in - tall_in - row * (tall_in + row_gap_in)
        left = left_in + column * (wide + gap_in)
        axes.append(add_panel(figure, left, low, wide, tall_in, sharey=axes[0] if share_y and axes else None))
    return figure, axes


def slots_panel(tall_in: float, words: Sequence[str], *, top_in: float = 0.42) -> tuple[Figure, list[Axes]]:
    """Make a figure of one panel with a slot of its x axis for each word; upright words on a phone."""
    upright = is_narrow() and len(words) > MOST_UPRIGHT
    lines = [parted(word) for word in words]
    longest = max((len(word) for word in words), default=0)
    rows = max((line.count("\n") for line in lines), default=0)
    size = 8.0 if len(words) < 9 else 7.0
    bottom = 0.2 + 0.6 / 72.0 * size * longest if upright else 0.32 + 0.14 * rows
    figure, axes = panels([tall_in], top_in=top_in, bottom_in=bottom)
    categories(axes[0], words if upright else lines, size=size)
    if upright:
        axes[0].tick_params(axis="x", labelrotation=90.0)
    return figure, axes


def parted(name: str, *, longest: int = 10) -> str:
    """A name in lines of some ten letters, parted at blanks and underscores."""
    lines = [""]
    for part in re.split(r"(?<=[_ ])", name.replace(".imu.toml", "").replace(".toml", "")):
        if lines[-1] and len(lines[-1]) + len(part.rstrip()) > longest:
            lines.append("")
        lines[-1] += part
    return "\n".join(line.rstrip(" ") for line in lines)


def title_panels(axes: Sequence[Axes], titles: Sequence[str], **how: Any) -> None:
    """Titles of panels, in as many lines as the width of a panel asks for; before their legend."""
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    wide, _ = figure.get_size_inches()
    for axis, title in zip(axes, titles, strict=True):
        letters = int(axis.get_position().width * wide * 72.0 / (0.6 * _RC["axes.titlesize"]))
        axis.set_title(textwrap.fill(title, letters), **how)


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


def fitting_words(labels: Sequence[str], width_in: float) -> tuple[list[str], int, int]:
    """Labels of a legend as they fit into a width, its columns, and its lines if it had one column.

    Where there is room for one column only, long labels are broken.
    """
    columns, words = fitting_columns(labels, width_in), list(labels)
    if columns == 1:
        letters = int((width_in * 72.0 / _RC["legend.fontsize"] - 4.2) / 0.6)
        words = [textwrap.fill(label, letters) for label in labels]
    return words, columns, sum(label.count("\n") + 1 for label in words)


LEGEND_ROW_IN = 0.184
"""Height of a row of a legend."""


def _make_room(figure: Figure, count: int, columns: int, *, free_in: float) -> None:
    """Grow a figure at its top where a legend needs more than is free there."""
    more = LEGEND_ROW_IN * -(-count // columns) + 0.06 - free_in
    if more <= 0.0:
        return
    wide, tall = figure.get_size_inches()
    figure.set_size_inches(wide, tall + more)
    for axis in figure.axes:
        box = axis.get_position()
        axis.set_position(
            (box.x0, box.y0 * tall / (tall + more), box.width, box.height * tall / (tall + more))
        )


def _free_above(figure: Figure) -> float:
    """Height above the topmost panel, in inches."""
    top = max(axis.get_position().y1 for axis in figure.axes)
    return float((1.0 - top) * figure.get_size_inches()[1])


def label_upright(axis: Axes, words: str, **how: Any) -> None:
    """Label of a y axis, whose second line finds room beside the numbers, however wide these are."""
    axis.set_ylabel(words, **how)
    if "\n" in words:
        figure = axis.get_figure(root=True)
        assert figure is not None
        wide, _ = figure.get_size_inches()
        axis.yaxis.set_label_coords(-0.52 / (axis.get_position().width * wide), 0.5)


def legend_above(*axes: Axes) -> None:
    """Put the legend of some panels above the first, outside of the data; truth and design first."""
    by_label: dict[str, Any] = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            by_label.setdefault(str(label), handle)
    labels = sorted(by_label, key=lambda label: {"truth": 0, "design": 1}.get(label, 2))
    words, columns, lines = fitting_words(labels, width_in() - LEFT_IN)
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    _make_room(figure, lines, columns, free_in=_free_above(figure))
    axes[0].legend(
        [by_label[label] for label in labels],
        words,
        loc="lower left",
        bbox_to_anchor=(-0.005, 1.0),
        ncols=columns,
        borderaxespad=0.15,
        columnspacing=1.4,
    )


def figure_legend(
    figure: Figure, handles: Sequence[Artist], labels: Sequence[str], *, left_in: float = LEFT_IN
) -> None:
    """Put a legend at the top of a figure."""
    words, columns, lines = fitting_words(labels, width_in() - (0.0 if is_narrow() else left_in))
    lines_above = max(len(axis.get_title(loc="left").splitlines()) for axis in figure.axes)
    titles_in = 0.22 + 0.16 * (lines_above - 1) if lines_above else 0.0
    _make_room(figure, lines, columns, free_in=_free_above(figure) - titles_in)
    figure.legend(
        handles,
        words,
        loc="upper left",
        bbox_to_anchor=((0.0 if is_narrow() else left_in / WIDE_IN - 0.01), 1.0),
        ncols=columns,
        borderaxespad=0.1,
    )


@dataclass(frozen=True)
class Place:
    """A curve or a transition of the line, between two places in metres; its words are of its design."""

    start: float
    end: float
    kind: str
    words: str = ""


def places_of(track: TrackDesign) -> tuple[Place, ...]:
    """Curves and transitions of a line, curves with the radius that they were designed with."""
    places, start = [], track.start_m
    for element in track.elements:
        end = start + element.length_m
        if element.kind in (CURVE, TRANSITION):
            words = ""
            if isinstance(element, Curve):
                words = f"R {abs(element.radius_m):g} {'left' if element.radius_m > 0 else 'right'}"
            places.append(Place(start, end, "curve" if element.kind == CURVE else "transition", words))
        start = end
    return tuple(places)


def shade_places(axes: Sequence[Axes], places: Sequence[Place], *, limits: tuple[float, float]) -> None:
    """Tint curves and transitions of a plot over distance, and name the curves in the first panel."""
    low, high = limits
    last_label, room = -np.inf, (0.3 if is_narrow() else 0.05) * (high - low)
    # Half of a name, which must not reach over the numbers beside the panel.
    half = (0.13 if is_narrow() else 0.035) * (high - low)
    for place in places:
        if place.end > low and place.start < high:
            tint = CURVE_TINT if place.kind == "curve" else TRANSITION_TINT
            for axis in axes:
                axis.axvspan(max(place.start, low), min(place.end, high), color=tint, lw=0, zorder=-5)
            middle = 0.5 * (place.start + place.end)
            inside = low < middle < high
            middle = min(max(middle, low + half), high - half)
            if place.words and middle - last_label > room and inside:
                at_top = axes[0].get_xaxis_transform()
                axes[0].annotate(place.words, (middle, 1.0), (0, -3), xycoords=at_top, **_CURVE_NAME)
                last_label = middle
    axes[0].set_xlim(low, high)


def distance_axis(
    axis: Axes, *, direction: int | None = None, words: str = "distance along the track, m"
) -> None:
    """Label the x axis of a plot over distance, with the direction of travel where there is one."""
    axis.set_xlabel(words.replace(" along the track", "") if is_narrow() else words)
    if not direction:
        return
    arrow, side, x = ("travel \u2192", "right", 1.0) if direction > 0 else ("\u2190 travel", "left", 0.0)
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
    order = _ORDER.get()
    if order is not None:
        form, picture = order.path.suffix.removeprefix("."), BytesIO()
        metadata = {"Title": description} if form != "png" else None
        figure.savefig(picture, format=form, metadata=metadata, dpi=PRINT_DPI)
        write_whole(order.path, picture.getvalue(), what="figure")
        return Markup(description)
    out = StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text, flags=re.DOTALL)
    # A tenth of a point is 0.13 pixels. Only within tags: a label of 0.0001 is no place.
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(?<=\.\d)\d{3,}", "", tag.group()), text)
    # Several figures share the page: an id that nothing refers to would only stand there twice.
    used = set(re.findall(r"#([\w-]+)", text))
    text = re.sub(r' id="([\w.-]+)"', lambda m: m.group(0) if m.group(1) in used else "", text)
    # The page chooses the fonts; matplotlib's versions write them in two ways.
    text = re.sub(r'font-family: [^;"]*;? ?', "", text)
    text = re.sub(r'font: ([\d.]+px) [^;"]*', r"font-size: \1", text)
    text = re.sub(
        r"#[0-9a-f]{6}", lambda m: f"var(--{_VARIABLES[m[0]]})" if m[0] in _VARIABLES else m[0], text
    )
    text = re.sub(r'style="[^"]*"', _of_both, text)
    view = re.search(r'viewBox="[^"]*"', text)
    assert view is not None
    link = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    head = f'<svg {view.group()} {link} role="img" aria-label="{escape(description, quote=True)}">'
    text = re.sub(r"\s*\n\s*", "\n", head + text[text.index(">") + 1 :])
    return Markup(shorter(re.sub(r"\n([MLz\"])", r"\1", text).strip()))


def _of_both(style: re.Match[str]) -> str:
    """A style whose strokes, and marks of their colour, are seen by day and by night; areas stay."""
    text = style.group()
    for colour in dict.fromkeys(re.findall(r"stroke: (#[0-9a-f]{6})", text)):
        for name in ("fill", "stroke"):
            text = text.replace(f"{name}: {colour}", day_and_night(name, colour))
    return text
