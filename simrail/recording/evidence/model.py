"""What gyro and accelerometer should show of a ride, given its map and its wheel, and a few faults of both.

Means over blocks of half a second of five channels (gyro X, Y, Z, accelerometer X, Y). With w(t) the way of
the wheel, the train is at

    s = start + shift + wheel w(t - offset - drift (t - middle)),   V = ds/dt,   A = dV/dt,

its body, on springs in the track frame (roll phi, pitch theta, Darboux curvatures k), turns and feels

    rate  = V k + (d roll/dt, d pitch/dt + roll V k3, 0),   roll = lean a/g,   pitch = -squat A/g
    force = (A (1 + squat + stretch) - g sin theta, a (1 + lean), g cos theta cos phi - V^2 k2)
    a     = V^2 k3 + g cos theta sin phi

and the device, whose axes are turned against those that were claimed by R(roll, pitch, yaw), reads

    gyro (R' rate) + bias,   R' force + bias,

the turns of the time t + gyro_offset where the clock of the gyro is another than the accelerometer's.

Faults of one axis, one sensor or the time itself are parameters too, each of which stays at its sound value
unless a fit sets it free: a gain of one channel, a channel that is late alone, a sensor behind a low-pass of
the first order, a factor of the accelerometer, angles of the gyro against the accelerometer, and a pace:
stamps of which one unit is no second, so V and A are pace and pace^2 times what they are by the stamps, while
the way stays. And a few may change at one moment of the ride: a device that came loose, a clock or an offset
that jumps, a counter that counts otherwise.

Not here: motion of the body in the track, which averages out or is noise, and the height of the mount.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.evidence.line import MapTable, map_table
from simrail.recording.evidence.way import Way, way_of
from simrail.recording.recording import Recording

BLOCK_S, MOST_BLOCKS = 0.5, 6000
"""Length of a block: below it sway and vibration, above it ramps of traction; and most blocks of a ride."""

FINE = 5
"""Times in a block at which the model is evaluated."""

MARGIN_M = 600.0
"""How far beyond the ride the map is looked at."""

CHANNELS = 5
GYRO_X, GYRO_Y, GYRO_Z, FORCE_X, FORCE_Y = range(CHANNELS)

OF_CHANNEL = (*GYRO, *ACCEL[:2])
"""Columns of the IMU that the channels are."""

GAINS, LATES = (tuple(f"{what}_{name}" for name in OF_CHANNEL) for what in ("gain", "late"))
SLOW, PACE, ACCEL_GAIN = ("slow_gyro", "slow_accel"), "pace", "accel"

TURNS = ("gyro_roll", "gyro_pitch", "gyro_yaw")

SINGLE = (*GAINS, *LATES, *SLOW, PACE, ACCEL_GAIN, *TURNS)
"""Parameters of a fault of one axis, one sensor or the time: each free only where it is asked for."""

RAMPS, CUTS = tuple(f"ramp_{name}" for name in OF_CHANNEL), ("cut_gyro", "cut_accel")
"""Parameters of a sensor that is not steady: how far the offset of a channel grows in the ride; and the
corner, in rad/s, of a high-pass of the first order."""

THEN = {f"then_{name}": name for name in ("roll", "pitch", "yaw", "offset", "wheel")}
THEN |= {
    f"then_{name}": name
    for name in ("gyro_bias_x", "gyro_bias_y", "gyro_bias_z", "accel_bias_x", "accel_bias_y")
}
"""Parameters of what changes within the ride: by how much another one is more from `Ride.then` on."""

GLOBALS = (
    "wheel",
    "shift",
    "offset",
    "drift",
    "gyro_offset",
    "gyro",
    "roll",
    "pitch",
    "yaw",
    "squat",
    "lean",
    "stretch",
    *SINGLE,
    *RAMPS,
    *CUTS,
    *THEN,
    "gyro_bias_x",
    "gyro_bias_y",
    "gyro_bias_z",
    "accel_bias_x",
    "accel_bias_y",
)
"""Parameters that hold for the whole ride, in the order of their columns."""

INDEX = {name: i for i, name in enumerate(GLOBALS)}

NOMINAL = {"wheel": 1.0, "gyro": 1.0, PACE: 1.0, ACCEL_GAIN: 1.0} | dict.fromkeys(GAINS, 1.0)
"""Of parameters whose sound value is not 0."""


@dataclass(frozen=True)
class Ride:
    """A ride in blocks, ready for the fit.

    Attributes
    ----------
    recording : Recording
        What was recorded.
    way : Way
        Its motion by the wheel.
    table : MapTable
        The map.
    fine_s : ndarray (b * FINE,)
        Times of the IMU's clock in the blocks.
    measured : ndarray (b, 5)
        Means of the five channels.
    block_s : float
        Length of a block.
    slides : tuple of (int, int, float)
        First and last block of each slide of the wheel, and the way that it may have cost, m.
    slid : ndarray (b,), optional
        Blocks in which the wheel slides; none if nothing is said.
    drift : float
        What has been taken off the clock of the device of the way against the IMU's, from its first stamp on.
    of_imu : bool
        Whether by the stamps of the IMU.
    then : int, optional
        Block from which on `THEN` holds; none if nothing changes.
    """

    recording: Recording
    way: Way
    table: MapTable
    fine_s: FloatArray
    measured: FloatArray
    block_s: float
    slides: tuple[tuple[int, int, float], ...] = ()
    slid: np.ndarray | None = None
    drift: float = 0.0
    of_imu: bool = False
    then: int | None = None

    @cached_property
    def told(self) -> FloatArray:
        """Way and its derivatives (n, 3), as the device of the way tells them."""
        return np.column_stack([self.way.way_m, self.way.speed_mps, self.way.acceleration_mps2])

    @property
    def reading_s(self) -> float:
        """Interval of the readings of the device that says the way."""
        frame = getattr(self.recording, self.way.device)
        return float((frame.index[-1] - frame.index[0]) / (len(frame) - 1))

    @property
    def middle_s(self) -> float:
        """Time from which the drift of a clock is counted."""
        return float(0.5 * (self.fine_s[0] + self.fine_s[-1]))


def retimed(recording: Recording, pace: float) -> Recording:
    """A recording with stamps that ran `pace` times too fast set right; devices of the evidence alone."""
    frames = {}
    for name in ("imu", "encoder", "odometer", "odometry"):
        frame = getattr(recording, name)
        if frame is not None:
            index = pd.Index(frame.index.to_numpy(dtype=np.float64) / pace, name="time_s")
            frames[name] = frame.set_axis(index, axis=0)
    sheet = recording.imu_sheet
    sheet = replace(sheet, rate_hz=sheet.rate_hz * pace, lag_s=sheet.lag_s / pace)
    return replace(recording, imu_sheet=sheet, **frames)


def without_drift(recording: Recording, drift: float, *, of_imu: bool) -> Recording:
    """A recording whose way has a clock that drifts against the IMU's from its first stamp on, set right.

    By the stamps of the IMU, which another rate counted, or else by those of the device of the way.
    """
    way = {name: getattr(recording, name) for name in ("encoder", "odometer", "odometry")}
    frames = {name: frame for name, frame in way.items() if frame is not None}
    first, factor = float(next(iter(frames.values())).index[0]), 1.0 / (1.0 - drift)
    if of_imu:
        frames, factor = {"imu": recording.imu}, 1.0 - drift
    for name, frame in frames.items():
        stamps = first + factor * (frame.index.to_numpy(dtype=np.float64) - first)
        frames[name] = frame.set_axis(pd.Index(stamps, name="time_s"), axis=0)
    rate = recording.imu_sheet.rate_hz / (factor if of_imu else 1.0)
    return replace(recording, imu_sheet=replace(recording.imu_sheet, rate_hz=rate), **frames)


def ride_of(recording: Recording) -> Ride | None:
    """Blocks of a recording; None where nobody says how the train moved, or it is shorter than eight."""
    way = way_of(recording)
    if way is None:
        return None
    stamps = recording.imu.index.to_numpy(dtype=np.float64)
    rate, lag = recording.imu_sheet.rate_hz, recording.imu_sheet.lag_s
    block_s = max(BLOCK_S, 2.0 / rate, (stamps[-1] - stamps[0]) / MOST_BLOCKS)
    count = int((stamps[-1] - stamps[0]) / block_s)
    if count < 8:
        return None
    # A sample stands for the interval around its stamp: sums up to the ends of those intervals.
    signals = recording.imu[[*OF_CHANNEL]].to_numpy(dtype=np.float64)
    ends = np.concatenate([stamps - 0.5 / rate, [stamps[-1] + 0.5 / rate]])
    sums = np.vstack([np.zeros(CHANNELS), np.cumsum(signals, axis=0)]) / rate
    edges = stamps[0] + block_s * np.arange(count + 1)
    sums = np.column_stack([np.interp(edges, ends, column) for column in sums.T])
    # What a stamp says is as old as the device's response.
    fine = edges[0] - lag + block_s / FINE * (np.arange(count * FINE) + 0.5)
    low, high = way.way_m.min(), way.way_m.max()
    start = recording.start_position_m
    low, high = start + 2.0 * min(low, 0.0) - MARGIN_M, start + 2.0 * max(high, 0.0) + MARGIN_M
    track = recording.track
    low, high = max(low, track.start_m - 50.0), min(high, track.end_m + 50.0)
    table = map_table(track, low, max(high, low + 50.0))
    return Ride(recording, way, table, fine, np.diff(sums, axis=0) / block_s, block_s)


class Motion(NamedTuple):
    """Place, speed and acceleration (b * FINE,) of the train for a set of parameters, and whether known."""

    place_m: FloatArray
    speed_mps: FloatArray
    acceleration_mps2: FloatArray


def start_values() -> FloatArray:
    """Parameters of a sound ride."""
    return np.array([NOMINAL.get(name, 0.0) for name in GLOBALS])


def when_of(ride: Ride, x: FloatArray, *, later_s: float = 0.0) -> FloatArray:
    """Way, and its derivatives (b * FINE, 3), some time after the stamps of the accelerometer."""
    offset, drift = x[INDEX["offset"]], x[INDEX["drift"]]
    way, when = ride.way, ride.fine_s + later_s
    times = when - offset - drift * (when - ride.middle_s)
    # Uniform times: the cell of each is found without a search.
    at = np.clip((times - way.time_s[0]) / way.step_s, 0.0, len(way.time_s) - 1.000001)
    cell = at.astype(np.int64)
    first = ride.told[cell]
    told: FloatArray = first + (at - cell)[:, None] * (ride.told[cell + 1] - first)
    return told


def motion_of(ride: Ride, x: FloatArray, told: FloatArray) -> Motion:
    """How the train moved, for parameters (len(GLOBALS),), of what the way says (b * FINE, 3)."""
    wheel, shift, pace = x[INDEX["wheel"]], x[INDEX["shift"]], x[INDEX[PACE]]
    place = ride.recording.start_position_m + shift + wheel * told[:, 0]
    return Motion(place, wheel * pace * told[:, 1], wheel * pace**2 * told[:, 2])


def motion(ride: Ride, x: FloatArray, *, later_s: float = 0.0) -> Motion:
    """How the train moved some time after the stamps of the accelerometer, for parameters (len(GLOBALS),)."""
    moved = motion_of(ride, x, when_of(ride, x, later_s=later_s))
    if ride.then is None:
        return moved
    x, first = after(ride, x), ride.then * FINE
    then = motion_of(ride, x, when_of(ride, x, later_s=later_s))
    return Motion(
        *(np.concatenate([one[:first], other[first:]]) for one, other in zip(moved, then, strict=True))
    )


def after(ride: Ride, x: FloatArray) -> FloatArray:
    """Parameters (len(GLOBALS),) as they are from `Ride.then` on; there the train is where it was."""
    assert ride.then is not None
    then = x.copy()
    for name, of in THEN.items():
        then[INDEX[of]] += x[INDEX[name]]
        then[INDEX[name]] = 0.0
    then[INDEX["shift"]] -= x[INDEX["then_wheel"]] * way_then(ride, x)
    return then


def way_then(ride: Ride, x: FloatArray) -> float:
    """What the way says at `Ride.then`, m."""
    assert ride.then is not None
    return float(when_of(ride, x)[ride.then * FINE, 0])


def laters(x: FloatArray) -> FloatArray:
    """How far (5,) after the stamps the motion is that each channel shows, s."""
    later = x[[INDEX[name] for name in LATES]].copy()
    later[: GYRO_Z + 1] += x[INDEX["gyro_offset"]]
    return later


def inside(ride: Ride, x: FloatArray) -> np.ndarray:
    """Blocks (b,) of which the device of the way tells, for a clock of that offset."""
    times = ride.fine_s[::FINE] - x[INDEX["offset"]]
    time, apart = ride.way.time_s, laters(x)
    seen: np.ndarray = (times + min(apart.min(), 0.0) >= time[0]) & (
        times + max(apart.max(), 0.0) + ride.block_s <= time[-1]
    )
    return seen if ride.slid is None else seen & ~ride.slid


def blocks_of(values: FloatArray) -> FloatArray:
    """Means (b,) over blocks of values (b * FINE,)."""
    means: FloatArray = values.reshape(-1, FINE).mean(axis=1)
    return means
