"""Figures over the axes of a campaign: box plots, and the error against curvature."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from simrail.campaign.cell import CellResult
from simrail.core.jit import FloatArray
from simrail.report.campaign.axes import CampaignAxis, along, held
from simrail.report.figures import canvas
from simrail.report.figures.attitude import angle_error
from simrail.report.tables.methods import MethodStyle

MOST_CURVATURES = 4
"""Rides that are drawn over curvature."""

LONG_WORD = 16
"""Longer names of values are told in two lines, so that neighbours do not touch;"""

MOST_IN_ONE_LINE = 4
"""of more values than these, names of half that length."""


def box_figure(
    draws: pd.DataFrame, styles: Sequence[MethodStyle], axes: Sequence[CampaignAxis], *, what: str
) -> str:
    """How the figure spreads over cells with a value of an axis, for each axis a panel.

    What somebody chooses is held (`simrail.report.campaign.axes.held`) but along its own axis.
    """
    styles = [style for style in styles if (draws["estimator"] == style.name).any()]
    positive = draws.loc[draws["value"] > 0.0, "value"]
    if not styles or not axes or positive.empty:
        return ""
    limits = 0.8 * float(positive.quantile(0.001)), 1.25 * float(positive.quantile(0.999))
    across = min(len(axes), 2)
    with canvas.look():
        lines = max(word.count("\n") for axis in axes for word in _slot_words(axis))
        figure, panels = canvas.panels_beside(
            len(axes),
            tall_in=2.2,
            across=across,
            gap_in=0.7,
            row_gap_in=0.75 + 0.14 * lines,
            right_in=0.2,
            bottom_in=0.5 + 0.14 * lines,
        )
        for number, (panel, axis) in enumerate(zip(panels, axes, strict=True)):
            _draw_boxes(panel, held(axes, axis).of(along(draws, axis)), styles, axis)
            panel.set_ylim(*limits)
            canvas.log_scale(panel.yaxis)
            if number % across == 0:
                panel.set_ylabel("rms roll error, \u00b0")
        _legend(figure, styles)
        return canvas.to_svg(figure, description=what)


def _legend(figure: Figure, styles: Sequence[MethodStyle]) -> None:
    canvas.figure_legend(
        figure, [Patch(color=style.colour) for style in styles], [style.label for style in styles]
    )


def _draw_boxes(panel: Axes, draws: pd.DataFrame, styles: Sequence[MethodStyle], axis: CampaignAxis) -> None:
    slot = 0.8 / len(styles)
    for k, style in enumerate(styles):
        own = draws[(draws["estimator"] == style.name) & (draws["value"] > 0.0)]
        for i, value in enumerate(axis.values):
            values = own.loc[own[axis.column] == value, "value"].to_numpy()
            if len(values) == 0:
                continue
            x = i - 0.4 + (k + 0.5) * slot
            low, first, middle, third, high = np.percentile(values, [5.0, 25.0, 50.0, 75.0, 95.0])
            panel.plot([x, x], [low, high], color=style.colour, lw=1.0, solid_capstyle="butt", zorder=2)
            panel.bar(x, third - first, 0.78 * slot, first, color=style.colour, lw=0, zorder=3)
            ends = [x - 0.39 * slot, x + 0.39 * slot]
            # A box without height is seen as a bar.
            panel.plot(ends, [middle, middle], color=style.colour, lw=3.6, solid_capstyle="butt", zorder=2)
            panel.plot(ends, [middle, middle], color="white", lw=1.3, solid_capstyle="butt", zorder=4)
    canvas.categories(panel, _slot_words(axis))
    panel.set_xlabel(axis.title)


def _slot_words(axis: CampaignAxis) -> list[str]:
    if canvas.is_narrow():
        return [canvas.parted(word) for word in axis.words]
    longest = LONG_WORD if len(axis.words) <= MOST_IN_ONE_LINE else LONG_WORD // 2
    return [in_two(word, longest=longest) for word in axis.words]


def in_two(word: str, *, longest: int = LONG_WORD) -> str:
    """A name longer than `longest` in two lines, parted at the underscore that is nearest to its middle."""
    places = [i for i, letter in enumerate(word) if letter == "_"]
    if len(word) <= longest or not places:
        return word
    at = min(places, key=lambda i: abs(i - len(word) // 2)) + 1
    return f"{word[:at]}\n{word[at:]}"


def curvature_figure(
    examples: Sequence[CellResult], styles: Sequence[MethodStyle], *, words: Sequence[str], what: str
) -> str:
    """Mean roll error against the curvature of the design track, from single rides; "" without curves."""
    rides = [
        (example, word, *_curvature_bins(example))
        for example, word in zip(examples, words, strict=True)
        if example.estimates
    ]
    rides = [ride for ride in rides if len(ride[2]) > 1][:MOST_CURVATURES]
    if not rides:
        return ""
    with canvas.look():
        figure, axes = canvas.panels_beside(
            len(rides),
            tall_in=2.5,
            across=len(rides),
            gap_in=0.3,
            row_gap_in=0.95,
            right_in=0.2,
            share_y=True,
        )
        for axis, (example, _, middles, number_of) in zip(axes, rides, strict=True):
            for style in styles:
                if style.name not in example.estimates:
                    continue
                error = np.rad2deg(angle_error(example, style.name, 0))
                means = [float(np.mean(error[number_of == k])) for k in range(len(middles))]
                face = "white" if style.baseline else style.colour
                axis.plot(middles, means, "o-", color=style.colour, mfc=face, ms=4.4, mew=1.1, lw=1.0)
            axis.axhline(0.0, color=canvas.MUTED, lw=0.7, zorder=1)
            axis.set_xlabel("curvature, 1/km (positive to the left)")
            axis.tick_params(labelleft=axis is axes[0])
        axes[0].set_ylabel("mean roll error, \u00b0")
        canvas.title_panels(axes, [word for _, word, *_ in rides], color=canvas.INK)
        _legend(figure, [style for style in styles if any(style.name in e.estimates for e, *_ in rides)])
        return canvas.to_svg(figure, description=what)


def _curvature_bins(example: CellResult) -> tuple[FloatArray, np.ndarray]:
    """Mean curvature (b,) 1/km of the bins ridden through for half a second, and the bin (n,) or -1."""
    motion, rate = example.motion, example.recording.imu_sheet.rate_hz
    curvature = 1e3 * example.line.frame(motion["position_m"].to_numpy()).k[:, 2]
    moving = np.abs(motion["speed_mps"].to_numpy()) > 0.5
    width = max(float(np.ptp(curvature)) / 10.0, 1e-6)
    bins = np.rint(curvature / width).astype(np.intp)
    passed = [k for k in np.unique(bins) if np.count_nonzero(moving & (bins == k)) >= 0.5 * rate]
    number = np.full(len(bins), -1)
    for place, k in enumerate(passed):
        number[moving & (bins == k)] = place
    return np.array([curvature[number == place].mean() for place in range(len(passed))]), number
