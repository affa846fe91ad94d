"""Attitude over distance, estimated, true and by design, and its error."""

from collections.abc import Sequence
from typing import Any

import numpy as np

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


def angle_error(example: CellResult, name: str, column: int) -> FloatArray:
    """Error (n,) of an angle against the truth, wrapped, rad."""
    angle = ATTITUDE[column]
    estimated = example.estimates[name].states[angle].to_numpy(dtype=np.float64)
    error = estimated - example.motion[angle].to_numpy()
    wrapped: FloatArray = (error + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped
