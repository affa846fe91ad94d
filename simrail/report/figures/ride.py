"""Figures of one ride: how it was driven, what the IMU felt, and where the odometry thought it was."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from simrail.campaign.cell import CellResult
from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.core.turning import turning_rows
from simrail.recording.recording import odometry_of
from simrail.report.figures.canvas import (
    INK,
    distance_axis,
    draw_envelope,
    legend_above,
    look,
    panels,
    shade_track,
    to_svg,
)
from simrail.report.figures.decimate import Bins
from simrail.scenario.tables import RailConditionPart

_TINTS = ("#0072B2", "#009E73", "#D55E00")


def direction_of(example: CellResult) -> int:
    """+1 towards larger s, -1 towards smaller s; of a ride that turns back, that of its first run."""
    _, position = runs_of(example)
    return 1 if position[1] >= position[0] else -1


def runs_of(example: CellResult) -> tuple[int, FloatArray]:
    """Number n of runs of a ride, and the places (n + 1,) between which they lie."""
    position = example.motion["position_m"].to_numpy()
    rows = turning_rows(position, step=max(1, len(position) // 50_000))
    return len(rows) - 1, position[rows]


def over_distance(
    axes: Sequence[Axes],
    example: CellResult,
    *,
    limits: tuple[float, float] | None = None,
    arrow: bool = True,
) -> None:
    """Finish panels over the distance of a ride: curves, and the direction of travel below the last."""
    if limits is None:
        position = example.motion["position_m"].to_numpy()
        low, high = float(position.min()), float(position.max())
        room = 0.01 * max(high - low, 1.0)
        limits = low - room, high + room
    shade_track(axes, example.line, limits=limits)
    distance_axis(axes[-1], direction=direction_of(example) if arrow and runs_of(example)[0] == 1 else None)


def speed_figure(example: CellResult, *, conditions: Sequence[RailConditionPart] = ()) -> str:
    """True speed over distance, and where something lay on the rails."""
    with look():
        position = example.motion["position_m"].to_numpy()
        bins = Bins(position)
        figure, (axis,) = panels([1.5], top_in=0.15)
        speed = 3.6 * np.abs(example.motion["speed_mps"].to_numpy())
        axis.plot(*bins.line(speed), color=INK, lw=1.3)
        axis.set(ylim=(0.0, 1.3 * max(float(speed.max()), 1.0)), ylabel="speed, km/h")
        for at in conditions:
            axis.axvspan(at.start_m, at.end_m, ymax=0.06, color="#b5651d", alpha=0.55, lw=0)
            axis.annotate(at.words, (at.start_m, 0.08), xycoords=axis.get_xaxis_transform(), fontsize=7.2)
        over_distance([axis], example)
        return to_svg(figure, description=f"Speed of ride {example.recording.name} over distance")


def imu_figure(example: CellResult) -> str:
    """The six signals of the IMU over distance: range of the samples and their mean."""
    with look():
        recording, bins = example.recording, Bins(example.motion["position_m"].to_numpy(), bins=500)
        figure, axes = panels([0.82] * 6, top_in=0.15)
        names = [(name, 180.0 / np.pi, "\u00b0/s", "rate") for name in GYRO]
        names += [(name, 1.0, "m/s\u00b2", "accel.") for name in ACCEL]
        for i, (axis, (name, scale, unit, word)) in enumerate(zip(axes, names, strict=True)):
            signal = scale * recording.imu[name].to_numpy()
            envelope = draw_envelope(axis, bins, signal, colour=_TINTS[i % 3])
            axis.set_ylabel(f"{word} {name.split('_')[1].upper()}\n{unit}", fontsize=8.2)
            low, high = np.percentile(envelope.low, 0.5), np.percentile(envelope.high, 99.5)
            room = 0.12 * max(high - low, 1e-6)
            axis.set_ylim(low - room, high + (2.6 if i == 0 else 1.0) * room)
            axis.yaxis.set_major_locator(MaxNLocator(nbins=3, steps=[1, 2, 2.5, 5, 10]))
        over_distance(axes, example)
        return to_svg(figure, description=f"Signals of the IMU {recording.mount} over distance")


def odometry_figure(example: CellResult) -> str:
    """Position error of the odometry over distance, with its own 95 % band."""
    with look():
        recording, motion = example.recording, example.motion
        bins = Bins(motion["position_m"].to_numpy())
        error = odometry_of(recording)["position_m"].to_numpy() - motion["position_m"].to_numpy()
        band = 1.96 * odometry_of(recording)["position_sd_m"].to_numpy()
        figure, (axis,) = panels([1.5])
        wide = bins.envelope(band).mean
        axis.fill_between(bins.x, -wide, wide, color="#009E73", alpha=0.14, lw=0, label="its own 95 % band")
        axis.plot(*bins.line(error), color="#009E73", lw=1.3, label=f"odometry: {recording.odometry_source}")
        axis.axhline(0.0, color="#b8bec8", lw=0.7, zorder=-1)
        largest = float(np.abs(error).max())
        reach = max(1.25 * largest, min(float(wide.max()), 5.0 * largest), 1e-3)
        axis.set(ylim=(-1.1 * reach, 1.25 * reach), ylabel="position error, m")
        legend_above(axis)
        over_distance([axis], example)
        return to_svg(figure, description="Position error of the odometry over distance")
