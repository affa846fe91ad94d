"""Figures of lessons in the look of the reports, as inline SVG that a notebook shows."""

import threading
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.ticker import MaxNLocator

from simrail.core.jit import FloatArray
from simrail.report.figures.canvas import (
    INK,
    LIGHT,
    MUTED,
    WIDE_IN,
    drawn,
    legend_above,
    log_scale,
    look,
    panels,
    to_svg,
)

COLOURS = {
    "true": "#0b7a55",
    "first": "#0072B2",
    "second": "#D55E00",
    "third": "#8a3ffc",
    "fourth": "#009E73",
    "faint": "#b8c1cc",
    "ink": INK,
}


@dataclass(frozen=True)
class Line:
    """One line of a panel: its name (none without a label), places and values, and how it is drawn."""

    name: str
    x: FloatArray
    y: FloatArray
    colour: str = "first"
    dashed: bool = False
    marks: bool = False
    width: float = 1.4


@dataclass(frozen=True)
class Band:
    """An area between two lines."""

    x: FloatArray
    low: FloatArray
    high: FloatArray
    colour: str = "first"
    name: str = ""


@dataclass(frozen=True)
class Panel:
    """One panel: what stands on its y axis, and what is in it."""

    label: str
    lines: Sequence[Line]
    bands: Sequence[Band] = ()
    spans: Sequence[tuple[float, float]] = field(default=())
    log: bool = False
    limits: tuple[float, float] | None = None


_ONE_AT_A_TIME = threading.Lock()
"""The look of a figure is matplotlib's for all threads: each browser's lesson runs in one of its own."""

_NOTEBOOK = {
    "page": "background",
    "ink": "foreground",
    "muted": "muted-foreground",
    "axis": "muted-foreground",
}
"""Which of marimo's own colours the figures take, by day and by night; all else is as on a report by day."""

_STYLE = "; ".join(
    f"--{name}: var(--{_NOTEBOOK[name]}, {colour})" if name in _NOTEBOOK else f"--{name}: {colour}"
    for name, colour in (LIGHT | {"line": "#98a1af55", "curve": "#9aa86a33"}).items()
)


_ONE_OF_BOTH = (
    ".lesson-figure { container-type: inline-size } .lesson-figure > .narrow { display: none } "
    f"@container (max-width: {96.0 * 0.5 * WIDE_IN:.0f}px) "
    "{ .lesson-figure > .narrow { display: block } .lesson-figure > .wide { display: none } }"
)
"""Where the notebook's column has less than half of a desk's width, the figure for a phone is shown."""


def draw(
    parts: Sequence[Panel], *, x_label: str, description: str, log_x: bool = False, tall_in: float = 1.7
) -> str:
    """Draw panels for a notebook, for a desk and a phone, in its colours; otherwise as `svg_of`."""
    both = drawn(
        "lesson",
        lambda: svg_of(parts, x_label=x_label, description=description, log_x=log_x, tall_in=tall_in),
    )
    return f'<div class="lesson-figure" style="{_STYLE}"><style>{_ONE_OF_BOTH}</style>{both}</div>'


def svg_of(
    parts: Sequence[Panel], *, x_label: str, description: str, log_x: bool = False, tall_in: float = 1.7
) -> str:
    """Draw panels above each other over one x axis; returns SVG in the colours of its page.

    Parameters
    ----------
    parts : sequence of Panel
        From above; ``spans`` of a panel are shaded, curves for instance.
    x_label, description : str
        Words below, and for those who do not see it.
    log_x : bool
        Logarithmic x axis.
    tall_in : float
        Height of a panel.
    """
    with _ONE_AT_A_TIME, look():
        figure, axes = panels([tall_in] * len(parts))
        for axis, panel in zip(axes, parts, strict=True):
            for low, high in panel.spans:
                axis.axvspan(low, high, color="#eef1e6", lw=0, zorder=-5)
            for band in panel.bands:
                colour = COLOURS[band.colour]
                axis.fill_between(
                    band.x, band.low, band.high, color=colour, alpha=0.18, lw=0, label=band.name or None
                )
            for line in panel.lines:
                axis.plot(
                    line.x,
                    line.y,
                    color=COLOURS[line.colour],
                    lw=0.0 if line.marks else line.width,
                    ls=(0, (4, 3)) if line.dashed else "-",
                    marker="o" if line.marks else None,
                    ms=4,
                    label=line.name or None,
                )
            if panel.limits is not None:
                axis.set_ylim(*panel.limits)
            if log_x:
                log_scale(axis.xaxis)
            if panel.log:
                log_scale(axis.yaxis)
            else:
                axis.axhline(0.0, color=MUTED, lw=0.6, zorder=-1)
            axis.set_ylabel(panel.label)
        if all(np.array_equal(line.x, np.rint(line.x)) for panel in parts for line in panel.lines):
            axes[-1].xaxis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10], integer=True))
        axes[-1].set_xlabel(x_label)
        if any(axis.get_legend_handles_labels()[1] for axis in axes):
            legend_above(*axes)
        return str(to_svg(figure, description=description))
