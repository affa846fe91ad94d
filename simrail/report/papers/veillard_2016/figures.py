"""The paper's figures as distributions over lines and devices; its line of Eq. 1; and a curve that leans."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from simrail.campaign.cell import CellResult
from simrail.core.jit import FloatArray
from simrail.report.figures import canvas
from simrail.report.figures.attitude import angle_error
from simrail.report.figures.decimate import Bins
from simrail.report.figures.ride import over_distance
from simrail.report.papers.veillard_2016.lines import PAPER, Draws, Lines
from simrail.report.papers.veillard_2016.ride import SpectrumOverSpeed
from simrail.track.design import Curve

SHOWN = ("own", "average", "smooth", "rough", "standstill", "paper")
"""Parts of the distributions: one method by calibration, and the paper's own form last."""

SHORT = {
    "own": "own ride\n(ablation)",
    "average": "other\nline",
    "smooth": "smoother\nline",
    "rough": "rougher\nline",
    "standstill": "at rest",
    "paper": "as the\npaper",
}
"""How they are called below their slots."""

PANELS = (
    ("along", "acceleration", "acceleration along, mg rms"),
    ("roll", "attitude", "roll, \u00b0 rms"),
    ("pitch", "attitude", "pitch, \u00b0 rms"),
    ("speed", "speed", "speed, m/s rms"),
    ("distance", "distance", "distance, signed, % of the way"),
)
"""Figure, printed figure beside it, and words."""

MOUNT_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#AA4499")

_FRAMES, _MEANS, _LINE = "#b9c3d0", "#111111", "#D55E00"
_MANY = 20
"""More dots of a part at a mount are small."""
_ROOM_M = 150.0
"""Beside a curve that is drawn."""


def distributions_figure(lines: Lines) -> str:
    """Every line and device as a dot, by calibration and mount; the printed figure as a stroke."""
    parts = [part for part in SHOWN if lines.has(part)]
    if not parts:
        return ""
    with canvas.look():
        figure, axes = canvas.panels_beside(
            len(PANELS), tall_in=2.3, across=2, left_in=0.7, top_in=0.45, gap_in=0.75, row_gap_in=0.6
        )
        for axis, (name, printed, words) in zip(axes, PANELS, strict=True):
            for order, mount in enumerate(lines.mounts):
                colour = MOUNT_COLOURS[order % len(MOUNT_COLOURS)]
                for place, part in enumerate(parts):
                    slot = place + (order + 0.5) * 0.8 / len(lines.mounts) - 0.4
                    wide = 0.7 / len(lines.mounts)
                    _dots(
                        axis, lines.draws(part, name, mount), slot, wide, colour, mount if not place else ""
                    )
            for value in _printed(name, printed):
                axis.axhline(value, color=canvas.INK, lw=1.0, ls=(0, (5, 2)), zorder=1)
            canvas.categories(axis, [SHORT[part] for part in parts], size=6.4 if canvas.is_narrow() else 8.0)
            axis.set_ylabel(words)
            if name == "distance":
                axis.axhline(0.0, color=canvas.MUTED, lw=0.7)
            else:
                axis.set_ylim(bottom=0.0)
        canvas.figure_legend(figure, *axes[0].get_legend_handles_labels(), left_in=0.7)
        return canvas.to_svg(
            figure, description="Errors of every line and device by calibration, beside the printed figures"
        )


def _printed(name: str, printed: str) -> list[float]:
    """Where the printed figure stands: of a signed one, whose sign is not told, on both sides."""
    value = PAPER.printed[printed][0][0]
    return [-value, value] if name == "distance" else [value]


def _dots(axis: Axes, draws: Draws, slot: float, wide: float, colour: str, label: str) -> None:
    """Dots of one part at one mount: lines side by side, the devices of each above each other."""
    order = np.unique(draws.lines, return_inverse=True)[1]
    places = slot + wide * ((order + 0.5) / max(draws.line_count, 1) - 0.5)
    size = 2.6 if len(draws.values) > _MANY else 4.2
    axis.plot(places, draws.values, "o", ms=size, color=colour, alpha=0.7, mew=0, label=label or None)


def spectrum_figure(spectra: Mapping[str, SpectrumOverSpeed]) -> str:
    """sqrt(S) of every frame over the true speed, its means by speed, and the line of Eq. 1."""
    if not spectra:
        return ""
    with canvas.look():
        figure, axes = canvas.panels_beside(len(spectra), tall_in=3.0, across=max(len(spectra), 2))
        for axis, (mount, one) in zip(axes, spectra.items(), strict=True):
            axis.plot(one.speed, one.root, "o", ms=2.2, mew=0, alpha=0.6, color=_FRAMES, label="frames")
            axis.plot(one.class_speed, one.class_root, "o-", ms=4.0, color=_MEANS, label="means by speed")
            root = np.array([one.root.min(), one.root.max()])
            axis.plot(
                one.slope * root + one.intercept,
                root,
                color=_LINE,
                lw=1.3,
                label="line of Eq. 1, least squares",
            )
            axis.set(xlabel="true speed, m/s", title=mount, xlim=(-0.5, 1.05 * max(one.speed.max(), 1.0)))
        axes[0].set_ylabel("\u221aS, (m/s\u00b2)$^{1/2}$")
        canvas.figure_legend(figure, *axes[0].get_legend_handles_labels())
        return canvas.to_svg(figure, description="Square root of the spectrum's sum over speed, by mount")


CURVE_PARTS = ("complementary_printed", "complementary", "paper", "standstill")
"""Parts whose roll is drawn over a curve."""


def curve_figure(example: CellResult, names: Mapping[str, str]) -> str:
    """Roll over the curve in which the force leans the most: true, and by the parts of `CURVE_PARTS`."""
    place = sharpest(example)
    shown = [part for part in CURVE_PARTS if names.get(part) in example.estimates]
    if place is None or not shown:
        return ""
    position = example.motion["position_m"].to_numpy()
    inside = (position > place[0] - _ROOM_M) & (position < place[1] + _ROOM_M)
    with canvas.look():
        figure, (axis,) = canvas.panels([2.6], top_in=0.6)
        bins = Bins(position[inside])
        true = example.motion["roll_rad"].to_numpy()
        drawn = [canvas.draw_truth(axis, bins, true[inside])]
        for part in shown:
            roll = np.rad2deg(true + angle_error(example, names[part], 0))[inside]
            x, y = bins.line(roll)
            label, colour = PAPER.parts[part].label, PAPER.parts[part].colour
            axis.plot(x, y, color=colour, lw=1.2, label=label)
            drawn.append(y)
        canvas.fit_limits(axis, drawn, top=0.15)
        axis.set_ylabel("roll, \u00b0")
        over_distance([axis], example, limits=(place[0] - _ROOM_M, place[1] + _ROOM_M))
        canvas.legend_above(axis)
        return canvas.to_svg(figure, description="Roll over a curve, true and estimated")


def sharpest(example: CellResult) -> tuple[float, float] | None:
    """Begin and end of the curve with the greatest lateral acceleration that its cant leaves."""
    position = example.motion["position_m"].to_numpy()
    speed = np.abs(example.motion["speed_mps"].to_numpy())
    start, found, most = example.line.start_m, None, 0.0
    for element in example.line.elements:
        end = start + element.length_m
        if isinstance(element, Curve):
            inside = (position >= start) & (position <= end)
            if inside.any():
                lean = _uncompensated(example, element, position[inside], speed[inside])
                if lean > most:
                    found, most = (start, end), lean
        start = end
    return found


def _uncompensated(example: CellResult, curve: Curve, position: FloatArray, speed: FloatArray) -> float:
    """Mean size of the lateral acceleration in the plane of the rails, m/s2."""
    roll = np.asarray(example.line.frame(position).roll_rad)
    gravity = example.recording.gravity_mps2
    return float(np.mean(np.abs(speed**2 / curve.radius_m + gravity * np.sin(roll))))


def mounts_of(examples: Sequence[CellResult], mounts: Sequence[str]) -> dict[str, CellResult]:
    """The first ride that is drawn of each mount."""
    found: dict[str, CellResult] = {}
    for example in examples:
        if example.recording.mount in mounts:
            found.setdefault(example.recording.mount, example)
    return {mount: found[mount] for mount in mounts if mount in found}
