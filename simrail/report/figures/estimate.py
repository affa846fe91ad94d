"""What is drawn of an estimate on a ride without a truth: over distance, or over time if it stands."""

from collections.abc import Iterator

import numpy as np

from simrail.core.columns import ATTITUDE, ATTITUDE_SD, COLUMNS, INNOVATION, IRREGULARITY, RATE_INNOVATION
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.report.figures.canvas import places_of
from simrail.report.figures.decimate import Bins
from simrail.report.figures.views import (
    FIXED,
    RAILS,
    Axes,
    Look,
    Panel,
    Series,
    View,
    imu_panels,
    line,
    ranged,
)
from simrail.report.tables.geometry import JUDGED, QUANTITIES
from simrail.track.bands import BANDS, Band, band_pass, sd_of_draws, why_not

LEAST_WAY_M = 10.0
"""A ride shorter than this is drawn over time."""

METHOD = "method"
"""Key of the series of the method."""

BINS = 1200


def moves(recording: Recording) -> bool:
    """True if the ride is long enough to be drawn over distance."""
    return bool(np.ptp(place_of(recording)) > LEAST_WAY_M)


def place_of(recording: Recording) -> FloatArray:
    """Where the figures of a recording are drawn, (n,) m: by its odometry; without one, where it began."""
    if recording.odometry is None:
        return np.full(len(recording.imu), recording.start_position_m)
    return recording.odometry["position_m"].to_numpy(dtype=np.float64)


def estimate_looks(label: str) -> dict[str, Look]:
    """Looks of the series of `estimate_view`."""
    return {"design": FIXED["design"], METHOD: Look(label, "test", "#0072B2"), "measured": FIXED["measured"]}


def estimate_view(recording: Recording, estimate: Estimate) -> View:
    """Attitude, rails and innovations as a method has them, and what the ride was like.

    Tinted is the method's own 95 % band, where it has one.
    """
    over_way = moves(recording)
    x = place_of(recording) if over_way else recording.imu.index.to_numpy()
    axes = Axes(BINS)
    bins = axes.of("motion", x)
    panels = [*_attitude(recording, estimate, bins), *_rails(estimate, axes)]
    if over_way and recording.odometry is not None:
        speed = 3.6 * np.abs(recording.odometry["speed_mps"].to_numpy())
        panels.append(
            Panel("ride", "speed by the odometry", "km/h", "motion", (line("measured", bins, speed),))
        )
    panels += imu_panels(recording, bins)
    panels += _innovations(recording, estimate, axes, x)
    return View(
        picks={"ride": recording.name},
        facts=(),
        travel=(1 if x[-1] >= x[0] else -1) if over_way else 0,
        along="distance along the track, m" if over_way else "time, s",
        places=places_of(recording.track) if over_way and recording.track.is_map else (),
        axes=axes.arrays,
        panels=tuple(panels),
    )


def _attitude(recording: Recording, estimate: Estimate, bins: Bins) -> Iterator[Panel]:
    knows_design = recording.odometry is not None and recording.track.is_map
    designs: tuple[FloatArray, ...] = (np.zeros(len(recording.imu)),) * 3
    if knows_design:
        frame = recording.track.frame_extended(place_of(recording))
        designs = frame.roll_rad, frame.pitch_rad, frame.yaw_rad
    for name, sd, design in zip(ATTITUDE, ATTITUDE_SD, designs, strict=True):
        if name not in estimate.states:
            continue
        series, title = [], name.removesuffix("_rad")
        angle = estimate.states[name].to_numpy(dtype=np.float64)
        if knows_design and title == "yaw":
            # Yaw is the way of the line, beside which nothing would be seen of what the method does.
            angle, title = (angle - design + np.pi) % (2.0 * np.pi) - np.pi, "yaw less design"
        elif knows_design:
            series.append(Series("design", y=np.repeat(np.rad2deg(bins.parted(design[bins.first])), 2)))
        angle = np.rad2deg(angle)
        if sd in estimate.states:
            wide = 1.96 * np.rad2deg(estimate.states[sd].to_numpy(dtype=np.float64))
            low, high = bins.envelope(angle - wide).mean, bins.envelope(angle + wide).mean
            series.append(Series(METHOD, low=low, high=high))
        series.append(line(METHOD, bins, angle))
        yield Panel("attitude", title, "\u00b0", "motion", tuple(series))


def _rails(estimate: Estimate, axes: Axes) -> Iterator[Panel]:
    """Rails in each band that the ride is long enough for, and unfiltered."""
    geometry = estimate.geometry
    if geometry is None or len(geometry) < 2:
        return
    place = geometry.index.to_numpy(dtype=np.float64)
    bins = axes.of(RAILS, place)
    for band in (*shown_bands(place), None):
        for quantity in JUDGED:
            found = 1e3 * geometry[f"{quantity}_m"].to_numpy(dtype=np.float64)
            sd = _sd(estimate, quantity, band, place)
            if band is not None:
                found = band_pass(found, band.edges_m(quantity), step_m=float(place[1] - place[0]))
            if not np.isfinite(found).any():
                continue
            series = []
            if sd is not None and np.isfinite(sd).any():
                low, high = (bins.envelope(found + k * sd).mean for k in (-1.96, 1.96))
                series.append(Series(METHOD, low=low, high=high))
            series.append(line(METHOD, bins, found))
            group = f"{RAILS}, unfiltered" if band is None else f"{RAILS} in {band.name}"
            yield Panel(group, QUANTITIES[quantity], "mm", RAILS, tuple(series))


def shown_bands(place: FloatArray) -> list[Band]:
    """Bands that rails over some places are long and fine enough for."""
    step = float(place[1] - place[0])
    return [
        band
        for band in BANDS.values()
        if not any(why_not(band.edges_m(q), count=len(place), step_m=step) for q in JUDGED)
    ]


def _sd(estimate: Estimate, quantity: str, band: Band | None, place: FloatArray) -> FloatArray | None:
    """Standard deviation of rails in mm: in a band by the method's draws, if it has them."""
    assert estimate.geometry is not None
    name, draws = f"{quantity}_sd_m", estimate.geometry_draws
    if band is None:
        return 1e3 * estimate.geometry[name].to_numpy() if name in estimate.geometry else None
    if draws is None:
        return None
    drawn = 1e3 * draws[:, :, IRREGULARITY.index(f"{quantity}_m")]
    return sd_of_draws(band_pass(drawn, band.edges_m(quantity), step_m=float(place[1] - place[0])))


def _innovations(recording: Recording, estimate: Estimate, axes: Axes, x: FloatArray) -> Iterator[Panel]:
    """Measured minus predicted signals, and their normalised square: range and mean."""
    if estimate.innovations is None or len(estimate.innovations) < 2:
        return
    # Innovations may come at fewer times than the samples: an update that was left out has none.
    times = recording.imu.index.to_numpy()
    bins = axes.of("innovations", np.interp(estimate.innovations.index.to_numpy(), times, x))
    for name in (*RATE_INNOVATION, *INNOVATION):
        if name in estimate.innovations:
            values = np.nan_to_num(estimate.innovations[name].to_numpy(dtype=np.float64))
            unit = COLUMNS[name].unit.replace("s2", "s\u00b2")
            word = "NIS" if name == "nis" else f"innovation {name.split('_')[1].upper()}"
            yield Panel("innovations", word, unit, "innovations", (ranged(METHOD, bins, values),))
