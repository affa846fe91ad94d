"""A device that shows nothing beyond some value: flat tops of a range that is smaller than its sheet's, or 0.

The greatest value of a signal with noise is rare, and the values just below it are less so. Where it stands
many more times than the values below it let expect, the device was at the end of its range. A signal that
comes to 0 time and again and never goes beyond, while the axes beside it do, has lost its sign.
"""

import math

import numpy as np
from scipy.stats import poisson

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.check_samples import LIVING
from simrail.recording.evidence.finding import Finding
from simrail.recording.evidence.slopes import LEAST as LEAST_RMS
from simrail.recording.evidence.slopes import expected_of, seconds_of
from simrail.recording.recording import Recording

LEAST, BELOW = 4, 20
"""Samples at the greatest value from which on they are counted; and samples below it that say how dense they
are there."""

CHANCE = 1e-7
"""Chance of so many from which on they are no chance."""

AT_RANGE = 0.99
"""Share of the range of the sheet from which on a device has done what its sheet says."""


AT_ZERO = 20
"""Samples within half the noise of a sample of 0, on one side alone, from which on a sign is missing: of a
signal that only happens to end there its last few are so near."""


BOTH, FOLLOWS, CLOSER = 0.1, 0.8, 0.5
"""Share of the squares of what is expected that either sign has at least, for a sign to be missed; share that
its size explains of a signal without one; and share of what the signed leaves, that the size may leave."""


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
            others = recording.imu[[other for other in names if other != name]].to_numpy()
            # An accelerometer passes 0 too fast to tell, and in curves of one side it has one sign.
            if names is GYRO and _is_unsigned(values, others, sample):
                found.append(_without_sign(name, values))
                continue
            if names is ACCEL and _is_folded(recording, name):
                found.append(_without_sign(name, values))
                continue
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


def _is_unsigned(values: FloatArray, others: FloatArray, noise: float) -> bool:
    """Whether a signal (n,) lost its sign: it is dense up to 0 and has one side, an other (n, 2) has two."""
    two_sided = (others.min(axis=0) < 0.0) & (others.max(axis=0) > 0.0)
    if values.min() < 0.0 < values.max() or not two_sided.any():
        return False
    # Under way a body shakes: what is near by is taken from what one sample differs from the next.
    size, near = np.abs(values), max(noise, float(np.diff(values, n=2).std()) / math.sqrt(6.0))
    count, next_to = int(np.sum(size < 0.5 * near)), int(np.sum((size >= 0.5 * near) & (size < near)))
    if len(np.unique(size[size < near])) < 3:
        return False  # rounded: what is small is 0
    return count >= max(AT_ZERO, next_to // 2) and float(size.max()) > near


def _is_folded(recording: Recording, name: str) -> bool:
    """Whether a signal never passes 0 and follows the size of what is expected, not that itself."""
    values = recording.imu[name].to_numpy()
    if values.min() < 0.0 < values.max():
        return False
    expected = expected_of(recording).get(name)
    if expected is None:
        return False
    parts = [float(np.sum(np.minimum(side * expected, 0.0) ** 2)) for side in (1.0, -1.0)]
    if min(parts) < BOTH * sum(parts) or sum(parts) < len(expected) * LEAST_RMS[name] ** 2:
        return False
    size = np.abs(seconds_of(recording, name))
    folded, signed = (float(np.corrcoef(size, of)[0, 1]) ** 2 for of in (np.abs(expected), expected))
    return folded > FOLLOWS and 1.0 - folded < CLOSER * (1.0 - signed)


def _without_sign(name: str, values: FloatArray) -> Finding:
    """The finding of a signal that comes to 0 and never goes beyond."""
    side = "below" if values.max() > 0.0 else "above"
    axis = " ".join(name.split("_")[:2])
    return Finding(
        f"share of {axis} that is {side} 0",
        f"unsigned_{name}",
        0.0,
        1.0 / math.sqrt(len(values)),
        0.5,
        "1",
        f"{len(values)} samples",
        "surely wrong",
        f"comes to 0 time and again and is never {side} it, as the axes beside it are: its sign is lost",
        field=f"imu.{name}",
        remedy="log that column with its sign: what was written is an absolute value, or a count without one",
    )


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
