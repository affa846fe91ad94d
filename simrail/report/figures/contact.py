"""Figure of the forces between the wheels of the leading axle and their rails, over distance."""

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.columns import CONTACT
from simrail.core.jit import FloatArray
from simrail.report.figures.canvas import draw_envelope, legend_above, look, panels, to_svg
from simrail.report.figures.decimate import Bins
from simrail.report.figures.ride import direction_of, over_distance

_TINTS = {"left": "#0072B2", "right": "#D55E00"}
_POSITION, _LOAD, _GUIDING = (CONTACT.index(n) for n in ("position_m", "wheel_load_n", "guiding_force_n"))


def leading_axle(example: CellResult) -> dict[str, FloatArray]:
    """Contact (k, 12) of the left and right wheel of the axle that runs ahead."""
    forward = direction_of(example)
    first = max(example.contacts.values(), key=lambda rows: forward * rows[0, _POSITION])[0, _POSITION]
    return {
        wheel.rpartition(".")[2]: np.asarray(rows)
        for wheel, rows in example.contacts.items()
        if rows[0, _POSITION] == first
    }


def contact_figure(example: CellResult) -> str:
    """Q, Y and Y/Q of both wheels of the leading axle: range of the samples and their mean."""
    with look():
        figure, axes = panels([1.2] * 3)
        for side, rows in leading_axle(example).items():
            bins = Bins(rows[:, _POSITION], bins=500)
            load, guiding = rows[:, _LOAD], rows[:, _GUIDING]
            outward = guiding * (-1.0 if side == "left" else 1.0)
            ratio = np.where(load > 0.0, outward / np.where(load > 0.0, load, 1.0), 0.0)
            signals = 1e-3 * load, 1e-3 * guiding, ratio
            for axis, signal in zip(axes, signals, strict=True):
                draw_envelope(axis, bins, signal, colour=_TINTS[side])
            axes[0].plot([], [], color=_TINTS[side], label=f"{side} wheel")
        for axis, label in zip(axes, ("Q, kN", "Y, kN", "Y/Q"), strict=True):
            axis.set_ylabel(label)
        axes[0].set_ylim(bottom=0.0)
        legend_above(axes[0])
        over_distance(axes, example)
        return to_svg(figure, description="Forces between the leading axle and the rails over distance")
