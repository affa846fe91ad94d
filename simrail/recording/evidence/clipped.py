"""A device that shows nothing beyond some value: flat tops of a range that is smaller than its sheet's.

The greatest value of a signal with noise is rare, and the values just below it are less so. Where it stands
many more times than the values below it let expect, the device was at the end of its range.
"""

import math

import numpy as np
from scipy.stats import poisson

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.check_samples import LIVING
from simrail.recording.evidence.finding import Finding
from simrail.recording.recording import Recording

LEAST, BELOW = 4, 20
"""Samples at the greatest value from which on they are counted; and samples below it that say how dense they
are there."""

CHANCE = 1e-7
"""Chance of so many from which on they are no chance."""

AT_RANGE = 0.99
"""Share of the range of the sheet from which on a device has done what its sheet says."""


def weigh_clipped(recording: Recording) -> tuple[Finding, ...]:
    """What a ride says of the ranges of its IMU: a finding for each axis that is cut off.

    Parameters
    ----------
    recording : Recording
        A ride; one whose sheet has no noise was computed, and may stand at a value.
    """
    sheet, found = recording.imu_sheet, []
    for names, noise, most, unit in (
        (GYRO, sheet.gyro_noise_radpsqrts, sheet.gyro_range_radps, "rad/s"),
        (ACCEL, sheet.accel_noise_mpsqrts, sheet.accel_range_mps2, "m/s2"),
    ):
        for name in names if noise > 0.0 else ():
            values, sample = recording.imu[name].to_numpy(), noise * math.sqrt(sheet.rate_hz)
            if float(np.diff(values, n=2).std()) < LIVING * sample:
                continue  # what was smoothed stands at a value
            for side in (1.0, -1.0):
                count, top, step = _flat(side * values)
                if count and step < sample and (most is None or abs(top) < AT_RANGE * most):
                    found.append(_finding(name, side * top, step, count, unit, most))
    return tuple(found)


def _flat(values: FloatArray) -> tuple[int, float, float]:
    """Samples at the greatest value, if more than chance; that value, and the step of the values."""
    if len(values) < 10 * BELOW:
        return 0, 0.0, 0.0
    part = np.sort(np.partition(values, -10 * BELOW)[-10 * BELOW :])[::-1]
    top, slack = float(part[0]), 1e-9 * float(np.abs(part).max())
    count = int(np.sum(values >= top - slack))
    if count < LEAST:
        return 0, top, 0.0
    rest = values[values < top - slack]
    if len(rest) < BELOW:
        return 0, top, 0.0
    below = np.sort(np.partition(rest, -BELOW)[-BELOW:])[::-1]
    steps = -np.diff(below)
    step = float(min(steps[steps > slack].min(initial=math.inf), top - below[0]))
    expected = BELOW * step / float(top - below[-1])
    return (count if poisson.sf(count - 1, expected) < CHANCE else 0), top, step


def _finding(name: str, top: float, step: float, count: int, unit: str, most: float | None) -> Finding:
    limit = math.copysign(most, top) if most is not None else math.inf
    shown, by = (math.degrees(top), "deg/s") if unit == "rad/s" else (top / 9.80665, "g")
    return Finding(
        f"end of the range of {' '.join(name.split('_')[:2])}",
        f"clipped_{name}",
        top,
        step,
        limit,
        unit,
        f"{count} samples",
        "likely wrong",
        f"stands {count} times at {shown:.4g} {by} and never beyond: the device is saturated there",
        field=f"imu.{name}",
        remedy="set a wider range of the device, or cut the ride there; or mend the range in its sheet",
    )
