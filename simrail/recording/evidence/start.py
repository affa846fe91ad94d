"""Where the fit begins: factors, angle, clock and place that may be far from what the ride file says.

By two scans that need no other start. The push along the train: for each offset of the clock the complex
reading x + i y of the accelerometer on the wheel's acceleration; its slope is a factor and an angle. The
curves: for each shift (and a few factors of the wheel) the gyro's Z on the map's curvature times speed.
"""

import numpy as np

from simrail.core.jit import FloatArray
from simrail.recording.evidence.line import K3
from simrail.recording.evidence.model import (
    FORCE_X,
    FORCE_Y,
    GYRO_Z,
    INDEX,
    Ride,
    blocks_of,
    motion,
    start_values,
)

OFFSETS_S = np.arange(-6.0, 6.01, 0.1)
TURN_OFFSETS_S = np.arange(-30.0, 30.01, 0.25)
SHIFTS_M, SHIFT_STEP_M = 500.0, 5.0
FACTORS = (1.0, -1.0, 0.5, 2.0, 0.25, 4.0, 0.2, 5.0, 0.318, 3.14, 0.667, 1.5, 0.8, 1.25)

LEAST_PUSH = 0.05
"""Share of what else is left of the accelerometer that the push has to explain for its scan to be a start."""

FOLLOWS, LEAST_PACE = 0.8, 0.02
"""Share of the gyro's Z that curves explain where only their speed is wrong; and how far off that is."""

DRIFTS, CLOSER = np.arange(-20, 21) * 0.005, 0.5
"""Drifts that are tried: up to 10 %; and share of what a ride without leaves, that one may leave."""

QUARTERS_RAD = (np.pi, 0.5 * np.pi, -0.5 * np.pi)
"""Angles at which devices are mounted that are not told of."""


def scan(ride: Ride) -> list[FloatArray]:
    """Starts for the fit, the sound ride first."""
    sound = start_values()
    pushed = _by_push(ride)
    likely = [sound]
    if pushed is not None:
        backwards = pushed.copy()
        backwards[INDEX["wheel"]] *= -1.0
        backwards[INDEX["yaw"]] = np.remainder(pushed[INDEX["yaw"]], 2.0 * np.pi) - np.pi
        timed = sound.copy()
        timed[INDEX["offset"]] = pushed[INDEX["offset"]]
        likely += [timed, pushed, backwards]
    starts = [sound]
    for x in likely:
        starts += _by_curves(ride, x, free=pushed is None)
    mirrored = sound.copy()
    mirrored[INDEX["gyro"]] = -1.0  # the curves' scan has no start for a gyro of the other sign
    starts.append(mirrored)
    for angle in QUARTERS_RAD:
        turned = sound.copy()
        turned[INDEX["yaw"]] = angle
        starts.append(turned)
    return starts + likely[1:]


def scan_turns(ride: Ride, x: FloatArray) -> FloatArray | None:
    """Start with the offset of the gyro's clock by which its Z fits the curves best; None without any."""
    measured = ride.measured[:, GYRO_Z]
    best, found = 0.0, None
    for offset in TURN_OFFSETS_S:
        trial = x.copy()
        trial[INDEX["gyro_offset"]] = offset
        moved = motion(ride, trial, later_s=float(offset))
        bend = blocks_of(ride.table.at(moved.place_m)[:, K3] * moved.speed_mps)
        off = bend - bend.mean()
        power = float(off @ off)
        if power < 1e-6:
            continue
        slope = float(off @ measured) / power
        if slope > 0.0 and slope * slope * power > best:
            best, found = slope * slope * power, trial
            found[INDEX["gyro"]] = slope
    return found


def pace_by_turns(ride: Ride) -> float | None:
    """How many times as fast as the ride its stamps run, if they are why the gyro turns more than the track.

    The way and so the curves are where they are by any stamps; the speed by which they are passed is not.
    None where the gyro does not follow the curves, or as it should.
    """
    moved = motion(ride, start_values())
    bend = blocks_of(ride.table.at(moved.place_m)[:, K3] * moved.speed_mps)
    off, measured = bend - bend.mean(), ride.measured[:, GYRO_Z] - ride.measured[:, GYRO_Z].mean()
    power = float(off @ off)
    found = float(off @ measured) / power if power > 1e-6 else 0.0
    follows = found * found * power > FOLLOWS * float(measured @ measured)
    return found if follows and found > 0.0 and abs(found - 1.0) > LEAST_PACE else None


def drift_by_turns(ride: Ride) -> float | None:
    """Drift, from the first stamps on, of the clock of the way by which the gyro's Z fits the curves best.

    None where it fits about as well without. A drift as of stamps that were counted at another rate moves the
    end of a ride by seconds: no step of a fit leads there.
    """
    measured = ride.measured[:, GYRO_Z] - ride.measured[:, GYRO_Z].mean()
    total = float(measured @ measured)
    shares = []
    for drift in DRIFTS:
        moved = motion(ride, drifted(ride, float(drift)))
        bend = blocks_of(ride.table.at(moved.place_m)[:, K3] * moved.speed_mps)
        off = bend - bend.mean()
        power, along = float(off @ off), float(off @ measured)
        shares.append(along * along / (power * total) if power > 1e-6 and along > 0.0 else 0.0)
    best = int(np.argmax(shares))
    if best in (0, len(DRIFTS) - 1):
        return None
    better = 1.0 - shares[best] < CLOSER * (1.0 - shares[len(DRIFTS) // 2])
    return float(DRIFTS[best]) if better and shares[best] > FOLLOWS else None


def drifted(ride: Ride, drift: float) -> FloatArray:
    """A sound ride's values (len(GLOBALS),), but for a drift that begins at the first stamps."""
    x = start_values()
    x[INDEX["drift"]], x[INDEX["offset"]] = drift, drift * (ride.middle_s - float(ride.way.time_s[0]))
    return x


def _by_push(ride: Ride) -> FloatArray | None:
    """Start by the push along the train; None where there is none."""
    force = ride.measured[:, FORCE_X] + 1j * ride.measured[:, FORCE_Y]
    turn = ride.measured[:, GYRO_Z]
    best, x = -np.inf, None
    for offset in OFFSETS_S:
        trial = start_values()
        trial[INDEX["offset"]] = offset
        moved = motion(ride, trial)
        push = blocks_of(moved.acceleration_mps2)
        if np.var(push) < 1e-3:
            return None
        beside = blocks_of(moved.speed_mps) * turn
        columns = np.column_stack([push, beside, np.ones_like(push)]).astype(np.complex128)
        slope, *_ = np.linalg.lstsq(columns, force, rcond=None)
        without = columns[:, 1:]
        less, *_ = np.linalg.lstsq(without, force, rcond=None)
        rest = float(np.sum(np.abs(force - columns @ slope) ** 2))
        gain = 1.0 - rest / max(float(np.sum(np.abs(force - without @ less) ** 2)), 1e-30)
        score = gain
        if score > best:
            best, x = score, trial.copy()
            x[INDEX["wheel"]] = min(max(abs(slope[0]), 0.1), 10.0)
            x[INDEX["yaw"]] = -np.angle(slope[0])
    return x if best > LEAST_PUSH else None


def _by_curves(ride: Ride, x: FloatArray, *, free: bool) -> list[FloatArray]:
    """The start with the shift (and, if free, the factor of the wheel) by which the curves fit best."""
    measured = ride.measured[:, GYRO_Z]
    if not np.any(ride.table.rows[:, K3]):
        return []
    trials = []
    for factor in FACTORS if free else (1.0,):
        trial = x.copy()
        trial[INDEX["wheel"]] *= factor
        moved = motion(ride, trial)
        place, speed = blocks_of(moved.place_m), blocks_of(moved.speed_mps)
        for shift in np.arange(-SHIFTS_M, SHIFTS_M + 1.0, SHIFT_STEP_M):
            bend = ride.table.at(place + shift)[:, K3] * speed
            off = bend - bend.mean()
            power = float(off @ off)
            if power < 1e-6:
                continue
            slope = float(off @ measured) / power
            trials.append((slope * slope * power if slope > 0.0 else 0.0, factor, shift, slope))
    if not trials:
        return []
    _, factor, shift, slope = max(trials)
    if slope <= 0.0:
        return []
    start = x.copy()
    start[INDEX["wheel"]] *= factor
    start[INDEX["shift"]] = shift
    start[INDEX["gyro"]] = slope
    return [start]
