"""Figures of an estimate on a ride without a truth: attitude beside the design, and innovations."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from simrail.core.columns import ATTITUDE, ATTITUDE_SD, COLUMNS, INNOVATION, RATE_INNOVATION
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.report.figures import canvas
from simrail.report.figures.decimate import Bins

ESTIMATE, BAND = "#0072B2", "#0072B2"
LEAST_WAY_M = 10.0
"""A ride shorter than this is drawn over time."""


def moves(recording: Recording) -> bool:
    """True if the ride is long enough to be drawn over distance."""
    return bool(np.ptp(place_of(recording)) > LEAST_WAY_M)


def place_of(recording: Recording) -> FloatArray:
    """Where the figures of a recording are drawn, (n,) m: by its odometry; without one, where it began."""
    if recording.odometry is None:
        return np.full(len(recording.imu), recording.start_position_m)
    return recording.odometry["position_m"].to_numpy(dtype=np.float64)


def estimated_attitude_figure(recording: Recording, estimate: Estimate, *, label: str) -> str:
    """Estimated roll, pitch and yaw with their 95 % bands, and the design angles."""
    with canvas.look():
        x = _axis(recording)
        bins = Bins(x)
        design: tuple[FloatArray, ...] = ()
        if recording.track.is_map:
            frame = recording.track.frame_extended(place_of(recording)[bins.first])
            design = tuple(bins.parted(angle) for angle in (frame.roll_rad, frame.pitch_rad, frame.yaw_rad))
        drawn = [name for name in ATTITUDE if name in estimate.states]
        figure, axes = canvas.panels([1.9] * len(drawn))
        for axis, name in zip(axes, drawn, strict=True):
            angle = np.rad2deg(estimate.states[name].to_numpy(dtype=np.float64))
            place, line = bins.line(angle)
            sd = ATTITUDE_SD[ATTITUDE.index(name)]
            if sd in estimate.states:
                wide = 1.96 * np.rad2deg(estimate.states[sd].to_numpy(dtype=np.float64))
                low, high = bins.envelope(angle - wide).mean, bins.envelope(angle + wide).mean
                axis.fill_between(bins.x, low, high, color=BAND, alpha=0.16, lw=0, label="its own 95 % band")
            axis.plot(place, line, color=ESTIMATE, lw=1.05, zorder=12, label=label)
            lines = [line]
            if recording.odometry is not None and design:
                lines.append(canvas.draw_design(axis, bins.x, design[ATTITUDE.index(name)]))
            canvas.fit_limits(axis, lines, top=0.16)
            axis.set_ylabel(f"{name.removesuffix('_rad')}, \u00b0")
        canvas.legend_above(axes[0])
        _finish(axes, recording, x)
        return canvas.to_svg(
            figure, description=f"Attitude of ride {recording.name}, estimated and by design"
        )


def innovation_figure(recording: Recording, estimate: Estimate) -> str:
    """Range and mean of each innovation."""
    assert estimate.innovations is not None
    with canvas.look():
        times = recording.imu.index.to_numpy()
        # Innovations may come at fewer times than the samples: an update that was left out has none.
        x = np.interp(estimate.innovations.index.to_numpy(), times, _axis(recording))
        bins = Bins(x, bins=500)
        names = [name for name in (*RATE_INNOVATION, *INNOVATION) if name in estimate.innovations]
        figure, axes = canvas.panels([1.0] * len(names), top_in=0.15)
        for axis, name in zip(axes, names, strict=True):
            values = np.nan_to_num(estimate.innovations[name].to_numpy(dtype=np.float64))
            envelope = canvas.draw_envelope(axis, bins, values, colour="#009E73")
            unit = COLUMNS[name].unit.replace("s2", "s\u00b2")
            word = "NIS" if name == "nis" else f"innov. {name.split('_')[1].upper()}\n{unit}"
            axis.set_ylabel(word, fontsize=8.2)
            canvas.pad_limits(axis, np.percentile(envelope.low, 1.0), np.percentile(envelope.high, 99.0))
        _finish(axes, recording, x)
        return canvas.to_svg(figure, description="Innovations: measured minus predicted signals")


def _axis(recording: Recording) -> FloatArray:
    """What the figures are drawn over: distance, or time for a train that hardly moves."""
    if moves(recording):
        return place_of(recording)
    return recording.imu.index.to_numpy()


def _finish(axes: list[Axes], recording: Recording, x: FloatArray) -> None:
    low, high = float(x.min()), float(x.max())
    room = 0.01 * max(high - low, 1e-3)
    if moves(recording):
        limits: Any = (low - room, high + room)
        canvas.shade_track(axes, recording.track, limits=limits)
        canvas.distance_axis(axes[-1], direction=1 if x[-1] >= x[0] else -1)
    else:
        axes[0].set_xlim(low - room, high + room)
        axes[-1].set_xlabel("time, s")
