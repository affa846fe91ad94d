"""Figures of the attitude: estimated, true and design over distance, and the errors.

They follow Figs. 11, 13 and 14 of Briales et al. 2021, with the truth added, which a real train does
not have.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from simrail.campaign.cell import CellResult
from simrail.core.columns import ATTITUDE
from simrail.core.jit import FloatArray
from simrail.report.figures import canvas
from simrail.report.figures.decimate import Bins
from simrail.report.figures.ride import over_distance
from simrail.report.tables.methods import MethodStyle

_NAMES = ("roll", "pitch", "yaw")


def attitude_figure(example: CellResult, styles: Sequence[MethodStyle], *, what: str) -> str:
    """Roll, pitch and yaw over distance: design, truth and some methods.

    Parameters
    ----------
    example : CellResult
        The ride.
    styles : sequence of MethodStyle
        Methods to draw, the first on top.
    what : str
        Description for those who cannot see it.
    """
    with canvas.look():
        bins = Bins(example.motion["position_m"].to_numpy())
        frame = example.line.frame(bins.place)
        design = (frame.roll_rad, frame.pitch_rad, frame.yaw_rad)
        figure, axes = canvas.panels([2.05, 2.05, 1.75])
        for column, (axis, angle, name) in enumerate(zip(axes, ATTITUDE, _NAMES, strict=True)):
            true = example.motion[angle].to_numpy()
            lines = [canvas.draw_truth(axis, bins, true), canvas.draw_design(axis, bins.x, design[column])]
            for order, style in enumerate(styles):
                x, y = bins.line(np.rad2deg(true + angle_error(example, style.name, column)))
                depth: dict[str, Any] = {"lw": 1.05, "zorder": 12 - 0.1 * order}
                axis.plot(x, y, color=style.colour, ls=style.stroke, label=style.label, **depth)
                lines.append(y)
            canvas.fit_limits(axis, lines, top=0.16 if column == 0 else 0.08)
            axis.set_ylabel(f"{name}, \u00b0")
        canvas.legend_above(axes[0])
        over_distance(axes, example)
        return canvas.to_svg(figure, description=what)


def error_figure(example: CellResult, styles: Sequence[MethodStyle]) -> str:
    """Errors against the truth over distance, scaled to the methods under test.

    Methods under test are lines through the extremes of each stretch of track; of the baselines the
    mean is drawn, and the range of 'design angles only' as a band. Where a baseline leaves the panel,
    a note says how far it goes.
    """
    with canvas.look():
        bins = Bins(example.motion["position_m"].to_numpy())
        figure, axes = canvas.panels([1.9, 1.9, 1.9])
        tested = [style for style in styles if not style.baseline] or list(styles)
        for column, axis in enumerate(axes):
            error = {style.name: _shown_error(example, style, column) for style in styles}
            most = {name: _percentile(values, 100.0) for name, values in error.items()}
            reach = max(1.15 * max(_percentile(error[s.name], 99.8) for s in tested), 1e-3)
            lowest = 1.15 * min(float(np.nanmin(error[s.name], initial=0.0)) for s in tested)
            highest = 1.15 * max(float(np.nanmax(error[s.name], initial=0.0)) for s in tested)
            for style in styles:
                look_of: dict[str, Any] = {"color": style.colour, "ls": style.stroke, "label": style.label}
                if style in tested:
                    line, depth = bins.line(error[style.name]), 4 - 0.1 * len(axis.lines)
                    axis.plot(*line, lw=1.2, zorder=depth, **look_of)
                    continue
                low, mean, high = bins.envelope(error[style.name])
                if style.uses_imu:
                    axis.plot(bins.x, mean, lw=0.9, zorder=2, **look_of)
                else:
                    tint: dict[str, Any] = {"color": "#b9bec7", "lw": 0, "alpha": 0.55, "zorder": 1.5}
                    axis.fill_between(bins.x, low, high, label=f"{style.label}, range", **tint)
            beyond = [(most[s.name], s.label) for s in styles if most[s.name] > 1.3 * reach]
            axis.axhline(0.0, color="#98a1af", lw=0.7, zorder=-1)
            top = min(highest, reach) + (0.3 if column == 0 else 0.05) * reach
            axis.set_ylim(max(lowest, -reach) - 0.15 * reach, top)
            axis.set_ylabel("yaw drift, \u00b0" if column == 2 else f"{_NAMES[column]} error, \u00b0")
            _note_beyond(axis, beyond)
        canvas.legend_above(axes[0])
        over_distance(axes, example)
        return canvas.to_svg(figure, description="Errors of roll, pitch and yaw over distance")


def _percentile(error: FloatArray, share: float) -> float:
    """Percentile of the size of an error; 0 if it is nowhere finite."""
    finite = np.abs(error[np.isfinite(error)])
    return float(np.percentile(finite, share)) if len(finite) else 0.0


def _note_beyond(axis: Axes, beyond: list[tuple[float, str]]) -> None:
    if not beyond:
        return
    listed = ", ".join(f"{label} {largest:.2g}\u00b0" for largest, label in sorted(beyond, reverse=True))
    box: dict[str, Any] = {"facecolor": "white", "alpha": 0.85, "lw": 0, "pad": 1.5}
    style: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 7.8, "color": "#475467", "zorder": 30}
    words = f"beyond the panel, at most: {listed}"
    axis.text(0.995, 0.03, words, transform=axis.transAxes, bbox=box, **style)


def angle_error(example: CellResult, name: str, column: int) -> FloatArray:
    """Error (n,) of an angle against the truth, wrapped, rad."""
    angle = ATTITUDE[column]
    estimated = example.estimates[name].states[angle].to_numpy(dtype=np.float64)
    error = estimated - example.motion[angle].to_numpy()
    wrapped: FloatArray = (error + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped


def _shown_error(example: CellResult, style: MethodStyle, column: int) -> FloatArray:
    error = angle_error(example, style.name, column)
    return np.rad2deg(error - error[0] if column == 2 else error)
