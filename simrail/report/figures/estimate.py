"""What is drawn of estimates on a ride without a truth: over distance, or over time if it stands."""

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from simrail.core.columns import ATTITUDE, ATTITUDE_SD, COLUMNS, INNOVATION, RATE_INNOVATION
from simrail.core.jit import FloatArray
from simrail.recording.files.asked import RideReference
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
from simrail.report.tables.geometry import QUANTITIES
from simrail.report.tables.recorded import MethodResult
from simrail.scoring.measured_reference import REFERENCE, motion_errors
from simrail.scoring.score import wrap
from simrail.track.rail_limits import TWIST, UNFILTERED, RailLimits, RailLine

LEAST_WAY_M = 10.0
"""A ride shorter than this is drawn over time."""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Of the methods, in their order."""

BINS, LEAST_BINS = 1200, 300
"""Of each series of one method; of several, a share each."""

LONGEST_JOIN_S = 2.0
"""Samples of a reference further apart than this are not joined."""


def moves(recording: Recording) -> bool:
    """True if the ride is long enough to be drawn over distance."""
    return bool(np.ptp(place_of(recording)) > LEAST_WAY_M)


def place_of(recording: Recording) -> FloatArray:
    """Where the figures of a recording are drawn, (n,) m: by its odometry; without one, where it began."""
    if recording.odometry is None:
        return np.full(len(recording.imu), recording.start_position_m)
    return recording.odometry["position_m"].to_numpy(dtype=np.float64)


def estimate_looks(results: Sequence[MethodResult]) -> dict[str, Look]:
    """Looks of the series of `estimate_view`."""
    methods = {
        result.name: Look(
            result.name if len(results) > 1 else result.label, "test", COLOURS[number % len(COLOURS)]
        )
        for number, result in enumerate(results)
    }
    return {
        "design": FIXED["design"],
        **methods,
        REFERENCE: Look("reference", "truth"),
        "limit": Look("limit", "signal", "#B42318", (2.0, 3.0)),
        "measured": FIXED["measured"],
    }


def estimate_view(
    results: Sequence[MethodResult], limits: RailLimits, reference: RideReference | None = None
) -> View:
    """Attitude, rails and innovations as methods have them, and what the ride was like.

    Tinted is the first method's own 95 % band, where it has one; places are its own as well.

    Parameters
    ----------
    results : sequence of MethodResult
        The methods.
    limits : RailLimits
        Drawn beside the rails.
    reference : RideReference, optional
        Drawn beside what it measured.
    """
    recording = results[0].recording
    over_way = moves(recording)
    x = place_of(recording) if over_way else recording.imu.index.to_numpy()
    axes = Axes(max(BINS // len(results), LEAST_BINS))
    bins = axes.of("motion", x)
    panels = [
        *_attitude(results, bins, reference),
        *_beside_reference(results, bins, reference),
        *_rails(results, axes, limits, reference),
    ]
    if over_way and recording.odometry is not None:
        speed = 3.6 * np.abs(recording.odometry["speed_mps"].to_numpy())
        panels.append(
            Panel("ride", "speed by the odometry", "km/h", "motion", (line("measured", bins, speed),))
        )
    panels += imu_panels(recording, bins)
    panels += _innovations(results, axes, x)
    return View(
        picks={"ride": recording.name},
        facts=(),
        travel=(1 if x[-1] >= x[0] else -1) if over_way else 0,
        along="distance along the track, m" if over_way else "time, s",
        places=places_of(recording.track) if over_way and recording.track.is_map else (),
        axes=axes.arrays,
        panels=tuple(panels),
    )


def _attitude(
    results: Sequence[MethodResult], bins: Bins, reference: RideReference | None
) -> Iterator[Panel]:
    recording = results[0].recording
    knows_design = recording.odometry is not None and recording.track.is_map
    designs: tuple[FloatArray, ...] = (np.zeros(len(recording.imu)),) * 3
    if knows_design:
        frame = recording.track.frame_extended(place_of(recording))
        designs = frame.roll_rad, frame.pitch_rad, frame.yaw_rad
    for name, sd, design in zip(ATTITUDE, ATTITUDE_SD, designs, strict=True):
        having = [result for result in results if name in result.estimate.states]
        if not having:
            continue
        series, title = [], name.removesuffix("_rad")
        # Yaw is the way of the line, beside which nothing would be seen of what the method does.
        is_turned = knows_design and title == "yaw"
        if knows_design and not is_turned:
            series.append(Series("design", y=np.repeat(np.rad2deg(bins.parted(design[bins.first])), 2)))
        for result in having:
            states = result.estimate.states
            angle = states[name].to_numpy(dtype=np.float64)
            angle = np.rad2deg(wrap(angle - design) if is_turned else angle)
            if sd in states and result is having[0]:
                wide = 1.96 * np.rad2deg(states[sd].to_numpy(dtype=np.float64))
                low, high = bins.envelope(angle - wide).mean, bins.envelope(angle + wide).mean
                series.append(Series(result.name, low=low, high=high))
            series.append(line(result.name, bins, angle))
        measured = _joined(reference, name, recording)
        if measured is not None:
            angle = np.rad2deg(wrap(measured - design) if is_turned else measured)
            series.append(line(REFERENCE, bins, angle))
        yield Panel("attitude", "yaw less design" if is_turned else title, "\u00b0", "motion", tuple(series))


def _joined(reference: RideReference | None, column: str, recording: Recording) -> FloatArray | None:
    """A reference at the IMU's times, where it has samples near enough; None where it has none of it."""
    if reference is None or reference.motion is None or column not in reference.motion.columns:
        return None
    known = reference.motion[column].dropna()
    if not len(known):
        return None
    have, times = known.index.to_numpy(dtype=np.float64), recording.imu.index.to_numpy(dtype=np.float64)
    values = np.unwrap(known.to_numpy()) if column in ATTITUDE else known.to_numpy()
    found = np.interp(times, have, values, left=np.nan, right=np.nan)
    behind = np.clip(np.searchsorted(have, times, side="right"), 1, max(len(have) - 1, 1))
    if len(have) > 1:
        found[have[behind] - have[behind - 1] > LONGEST_JOIN_S] = np.nan
    return np.asarray(found)


def _beside_reference(
    results: Sequence[MethodResult], bins: Bins, reference: RideReference | None
) -> Iterator[Panel]:
    """What methods say less what the reference measured, between its samples by straight lines."""
    if reference is None:
        return
    times = results[0].recording.imu.index.to_numpy(dtype=np.float64)
    panels: dict[str, list[Series]] = {}
    units = {}
    for result in results:
        for series, at in motion_errors(result.estimate, reference):
            error = np.interp(times, at, series.error, left=np.nan, right=np.nan)
            if np.isfinite(error).sum() > 1:
                panels.setdefault(series.quantity, []).append(line(result.name, bins, error))
                angle = series.quantity in ("roll", "pitch", "yaw", "yaw_debiased")
                units[series.quantity] = "\u00b0" if angle else "m/s" if series.quantity == "speed" else "m"
    for quantity, shown in panels.items():
        if quantity != "yaw":
            title = f"{quantity.replace('_debiased', ', from its first sample,')} less the reference"
            yield Panel("beside the reference", title, units[quantity], "motion", tuple(shown))


def _rails(
    results: Sequence[MethodResult], axes: Axes, limits: RailLimits, reference: RideReference | None
) -> Iterator[Panel]:
    """Rails in each band that the ride is long enough for, unfiltered, and twist."""
    having = [result for result in results if result.lines]
    if not having:
        return
    place = having[0].lines[0].place
    bins = axes.of(RAILS, place)
    pairs = dict.fromkeys((one.quantity, one.band) for one in chain(*(result.lines for result in having)))
    for quantity, band in pairs:
        series = []
        for result in having:
            own = next((o for o in result.lines if (o.quantity, o.band) == (quantity, band)), None)
            if own is None or not np.isfinite(own.value).any():
                continue
            found = 1e3 * _at(place, own, own.value)
            if own.sd is not None and result is having[0]:
                sd = 1e3 * _at(place, own, own.sd)
                low, high = (bins.envelope(found + k * sd).mean for k in (-1.96, 1.96))
                series.append(Series(result.name, low=low, high=high))
            series.append(line(result.name, bins, found))
        if not series:
            continue
        measured = _measured(reference, quantity, band, place)
        if measured is not None:
            series.append(line(REFERENCE, bins, 1e3 * measured))
        limit = limits.peaks.get((quantity, band))
        if limit is not None:
            series += [line("limit", bins, np.full(len(place), sign * 1e3 * limit)) for sign in (1.0, -1.0)]
        words = QUANTITIES[quantity] if band == UNFILTERED else f"{QUANTITIES[quantity]} in {band}"
        yield Panel(rail_group(quantity, band), words, "mm", RAILS, tuple(series))


def rail_group(quantity: str, band: str) -> str:
    """Group of panels that a quantity stands in."""
    if quantity == TWIST:
        return TWIST
    return f"{RAILS}, unfiltered" if band == UNFILTERED else f"{RAILS} in {band}"


def _at(place: FloatArray, own: RailLine, values: FloatArray) -> FloatArray:
    """Values at other places; NaN beyond the ends."""
    if len(place) == len(own.place) and np.array_equal(place, own.place):
        return values
    return np.asarray(np.interp(place, own.place, values, left=np.nan, right=np.nan))


def _measured(
    reference: RideReference | None, quantity: str, band: str, place: FloatArray
) -> FloatArray | None:
    """Rails as a reference has them, where it has them in that band."""
    column = f"{quantity}_m"
    if reference is None or reference.rails is None or column not in reference.rails.columns:
        return None
    if (reference.rail_band or UNFILTERED) != band:
        return None
    known = reference.rails[column].dropna()
    if len(known) < 2:
        return None
    return np.asarray(np.interp(place, known.index.to_numpy(), known.to_numpy(), left=np.nan, right=np.nan))


def _innovations(results: Sequence[MethodResult], axes: Axes, x: FloatArray) -> Iterator[Panel]:
    """Measured minus predicted signals, and their normalised square: range and mean."""
    having = [r for r in results if r.estimate.innovations is not None and len(r.estimate.innovations) > 1]
    if not having:
        return
    # Innovations may come at fewer times than the samples: an update that was left out has none.
    times = having[0].recording.imu.index.to_numpy()
    for result in having:
        innovations = result.estimate.innovations
        assert innovations is not None
        axis = "innovations" if len(having) == 1 else f"innovations of {result.name}"
        bins = axes.of(axis, np.interp(innovations.index.to_numpy(), times, x))
        for name in (*RATE_INNOVATION, *INNOVATION):
            if name in innovations:
                values = np.nan_to_num(innovations[name].to_numpy(dtype=np.float64))
                unit = COLUMNS[name].unit.replace("s2", "s\u00b2")
                word = "NIS" if name == "nis" else f"innovation {name.split('_')[1].upper()}"
                yield Panel(axis, word, unit, axis, (ranged(result.name, bins, values),))
