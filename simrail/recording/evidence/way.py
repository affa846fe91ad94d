"""How the train moved, by its wheel or odometer alone: smoothed over both directions of time.

A regression on a noisy acceleration comes out too flat. The acceleration here is what is expected given all
readings, before and after (a smoothing spline with the noise of the readings and a white jerk): what is left
of its error is uncorrelated with it, and flattens nothing.
"""

from dataclasses import dataclass
from math import comb

import numpy as np
from scipy.linalg import solveh_banded

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

STEP_S, MOST_STEPS = 0.1, 40_000
"""Step of the smoothed motion, and how many steps there are at most: a longer ride has longer ones."""

JERK_M2PS5 = 0.1
"""Intensity of the white jerk: a ramp of 0.8 m/s3 for a second, four in 30 s, has 0.08."""


@dataclass(frozen=True)
class Way:
    """Motion along the track as a device tells it, before any mending.

    Attributes
    ----------
    device : str
        ``"encoder"``, ``"odometer"`` or ``"odometry"``: the frame of the recording that it is from.
    time_s : ndarray (n,)
        Uniform times of that device.
    way_m, speed_mps, acceleration_mps2 : ndarray (n,)
        Way since the first reading, negative towards smaller s, and its derivatives.
    scale_sd : float
        Relative standard deviation of its scale, as its sheet says.
    """

    device: str
    time_s: FloatArray
    way_m: FloatArray
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    scale_sd: float

    @property
    def step_s(self) -> float:
        """Interval of the times."""
        return float(self.time_s[1] - self.time_s[0])


def way_of(recording: Recording) -> Way | None:
    """Motion by the encoder, else the odometer, else the odometry that the recording came with; None without.

    Parameters
    ----------
    recording : Recording
        The ride.
    """
    if recording.encoder is not None and recording.encoder_sheet is not None:
        stamps = recording.encoder.index.to_numpy(dtype=np.float64)
        pulse = recording.encoder_sheet.pulse_m
        counts = recording.encoder["pulse_count"].to_numpy(dtype=np.float64)
        times = _times(stamps)
        # One reading a step: those of a counter in between are no news of a slow wheel.
        read = np.interp(times, stamps, (counts - counts[0]) * pulse)
        way = _smoothed(times, times, read, _reading_sd(read, pulse), order=3)
        return _way("encoder", times, way, recording.encoder_sheet.radius_relative_sd)
    if recording.odometer is not None and recording.odometer_sheet is not None:
        stamps = recording.odometer.index.to_numpy(dtype=np.float64)
        times, sheet = _times(stamps), recording.odometer_sheet
        speed = _smoothed(
            times, stamps, recording.odometer["speed_mps"].to_numpy(), sheet.speed_sd_mps, order=2
        )
        step = float(times[1] - times[0])
        way = np.concatenate([[0.0], np.cumsum(0.5 * step * (speed[1:] + speed[:-1]))])
        return Way("odometer", times, way, speed, np.gradient(speed, step), sheet.radius_relative_sd)
    if recording.odometry is not None and recording.odometry_source != "truth":
        stamps = recording.odometry.index.to_numpy(dtype=np.float64)
        times = _times(stamps)
        columns = ("position_m", "speed_mps", "acceleration_mps2")
        place, speed, push = (
            np.interp(times, stamps, recording.odometry[name].to_numpy()) for name in columns
        )
        return Way("odometry", times, place - recording.start_position_m, speed, push, 0.005)
    return None


def _reading_sd(read: FloatArray, pulse: float) -> float:
    """Standard deviation of a reading of the way: that of a counter, or more, where the stamps jitter.

    Fourth differences of readings (n,) of a way of limited jerk hold nothing but noise, of 70 times its
    variance; their median is that of a normal law.
    """
    moving = np.abs(np.diff(read[:-3])) > 2.0 * pulse
    fourth = np.diff(read, 4)[moving]
    spread = 0.0 if len(fourth) < 8 else float(np.median(np.abs(fourth))) / 0.6745 / np.sqrt(70.0)
    return float(max(pulse / np.sqrt(12.0), spread))


def _times(stamps: FloatArray) -> FloatArray:
    """Uniform times over a device's stamps."""
    count = int(min(max((stamps[-1] - stamps[0]) / STEP_S, 8.0), MOST_STEPS))
    times: FloatArray = np.linspace(stamps[0], stamps[-1], count + 1)
    return times


def _way(device: str, times: FloatArray, way: FloatArray, scale_sd: float) -> Way:
    step = float(times[1] - times[0])
    speed = np.gradient(way, step)
    push = np.zeros_like(way)
    push[1:-1] = np.diff(way, 2) / step**2
    push[0], push[-1] = push[1], push[-2]
    return Way(device, times, way, speed, push, scale_sd)


def _smoothed(
    times: FloatArray, stamps: FloatArray, read: FloatArray, sd: float, *, order: int
) -> FloatArray:
    """Values (n,) at uniform times of which readings are known: the mean of a process of white noise.

    With D the difference of that order and h the step, it minimises

        sum (x(stamps) - read)^2 / sd^2 + sum (D x)^2 / (JERK h^(2 order - 1)),

    x by straight lines between the times: the posterior mean where the order-th derivative is white.
    """
    n, step = len(times), float(times[1] - times[0])
    at = np.clip((stamps - times[0]) / step, 0.0, n - 1.000001)
    cell = at.astype(np.int64)
    share = at - cell
    weight = sd * sd / (JERK_M2PS5 * step ** (2 * order - 1))
    bands = np.zeros((order + 1, n))  # upper form: bands[order - k, j] is element (j - k, j)
    bands[order] += np.bincount(cell, (1.0 - share) ** 2, n) + np.bincount(cell + 1, share**2, n)
    bands[order - 1, 1:] += np.bincount(cell, share * (1.0 - share), n)[:-1]
    taps = np.array([(-1.0) ** (order - k) * comb(order, k) for k in range(order + 1)])
    for i in range(order + 1):
        for j in range(i, order + 1):
            # Row m of D has its taps at columns m ... m + order.
            bands[order - (j - i), j : n - order + j] += weight * taps[i] * taps[j]
    right = np.bincount(cell, (1.0 - share) * read, n) + np.bincount(cell + 1, share * read, n)
    solved: FloatArray = solveh_banded(bands, right, check_finite=False)
    return solved
