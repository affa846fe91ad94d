"""A ride that begins at speed: how fast the train is at its first sample, by its first second.

A filter that takes every recording to begin at rest meets a train at 40 km/h with a speed of 0, known to
11 mm/s, and makes of its surprise an acceleration that was not there. Whether a train stands at first is seen
by its counts: from rest no train is further than `START_JERK_MPS3` t^3 / 6 after a time t. Where it is, the
filter begins with a speed that is unknown by metres per second.

A causal odometry says so from the reading on that shows it, and begins where half a second of them have told
how fast (`shown_by`); before the first of them it takes the train to stand. With hindsight an odometry does
so from the first sample on, and what it says of the first `BACK_S` is smoothed back from some seconds later:
it is not causal then, and says so.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

START_JERK_MPS3 = 1.5
"""No train leaves with more: service traction has half of it and less."""

BY_S = (0.2, 0.5, 1.0)
"""Times after the first reading at which the way is held against that of a start from rest."""

SPEED_SD_MPS, ACCELERATION_SD_MPS2 = 2.0, 1.0
"""How much of speed and acceleration is unknown at first, before any reading has been followed."""

BACK_S = 4.0
"""So much of the beginning is answered with hindsight: until an attitude filter has settled as well."""


SHOWN_S = (0.5, 1.0)
"""Times after the first reading between which a causal odometry holds the way against a start from rest."""


class Start(NamedTuple):
    """Speed at the first sample, and its standard deviation, m/s; (0, 0) of a train at rest."""

    speed_mps: float = 0.0
    sd_mps: float = 0.0


def start_of_counts(time: FloatArray, way_m: FloatArray, pulse_m: float) -> Start:
    """Whether a train moves when its recording begins, by the way (n,) of its wheel at times (n,).

    Parameters
    ----------
    time, way_m : ndarray (n,)
        Times of readings, s, and the way since the first, m.
    pulse_m : float
        Way of a count: two of them are no sign of motion.
    """
    for by in BY_S:
        last = int(np.searchsorted(time, time[0] + by, side="right")) - 1
        if last < 1:
            continue
        after, went = float(time[last] - time[0]), float(way_m[last] - way_m[0])
        if abs(went) > 2.0 * pulse_m + START_JERK_MPS3 * after**3 / 6.0:
            return Start(went / after, SPEED_SD_MPS)
    return Start()


class Shown(NamedTuple):
    """Numbers of readings: the first that shows a train at speed, the first that tells how fast; or -1."""

    first: int = -1
    told: int = -1


def shown_by(time: FloatArray, way_m: FloatArray, pulse_m: float) -> Shown:
    """The readings by which a train is seen to have moved from the start, as `start_of_counts`.

    Nothing later than each of them enters it.
    """
    after = time[: _within(time, SHOWN_S[1])] - time[0]
    went = np.abs(way_m[: len(after)] - way_m[0])
    moves = went > 2.0 * pulse_m + START_JERK_MPS3 * after**3 / 6.0
    early, late = (np.flatnonzero(moves & flags) for flags in (after < SHOWN_S[0], after >= SHOWN_S[0]))
    return Shown(int(early[0]) if len(early) else -1, int(late[0]) if len(late) else -1)


def state_so_far(time: FloatArray, way_m: FloatArray, variance: float) -> tuple[FloatArray, FloatArray]:
    """State s, V, A (3,) at the last of some readings (n,) of a train at speed, and its covariance (3, 3).

    A parabola through them, each of that variance, with what is unknown of speed and acceleration before any.
    """
    since = time - time[-1]
    rows = np.column_stack([np.ones_like(since), since, 0.5 * since**2])
    mean = (way_m[-1] - way_m[0]) / (time[-1] - time[0])
    known = np.diag([0.0, SPEED_SD_MPS**-2, ACCELERATION_SD_MPS2**-2])
    covariance = np.linalg.inv(rows.T @ rows / variance + known)
    state = covariance @ (rows.T @ (way_m - way_m[0]) / variance + known @ np.array([0.0, mean, 0.0]))
    return state, covariance


def told_start(recording: Recording) -> Start:
    """Speed of a train at the first sample, where its ride file says one; (0, 0) where it says nothing."""
    told = recording.start_speed_mps
    return Start(told, SPEED_SD_MPS) if told else Start()


def start_of(recording: Recording) -> Start:
    """Speed of a train at the first sample of a recording: as its ride file says, else by its encoder."""
    if recording.start_speed_mps is not None:
        return told_start(recording)
    if recording.encoder is None or recording.encoder_sheet is None:
        return Start()
    time = recording.encoder.index.to_numpy(dtype=np.float64)
    first = recording.encoder["pulse_count"].to_numpy()[: _within(time, max(BY_S))].astype(np.float64)
    pulse = recording.encoder_sheet.pulse_m
    return start_of_counts(time[: len(first)], first * pulse, pulse)


def _within(time: FloatArray, seconds: float) -> int:
    """Number of readings in the first seconds."""
    return int(np.searchsorted(time, time[0] + seconds, side="right"))


def reading_variance(time: FloatArray, way_m: FloatArray, pulse_m: float) -> float:
    """Variance of a reading of the way (n,) of a train at speed, m2, by its first second.

    That of a count, or more: a stamp that jitters by a millisecond moves a train by a centimetre. It is what
    is left of a parabola through the readings.
    """
    counted, m = pulse_m**2 / 12.0, _within(time, max(BY_S))
    if m <= 5:
        return counted
    since = time[:m] - time[0]
    left = way_m[:m] - np.polyval(np.polyfit(since, way_m[:m], 2), since)
    return max(counted, float(left @ left) / (m - 3))


def smoothed_back(
    time: FloatArray, way_m: FloatArray, start: Start, *, variance: float, intensity: float
) -> tuple[FloatArray, FloatArray]:
    """States s, V, A (m, 3) and covariances (m, 3, 3) at the readings of the first `BACK_S`, by all of them.

    A fixed-interval smoother (Rauch, Tung and Striebel 1965) of a triple integrator driven by white jerk.

    Parameters
    ----------
    time, way_m : ndarray (n,)
        Readings, of which those of the first `BACK_S` are used.
    start : Start
        Speed at first.
    variance : float
        Of a reading of the way, m2.
    intensity : float
        Of the white jerk, m2/s5.
    """
    m = _within(time, BACK_S)
    x, p = (
        np.array([0.0, start.speed_mps, 0.0]),
        np.diag([variance, start.sd_mps**2, ACCELERATION_SD_MPS2**2]),
    )
    states, covariances = np.empty((m, 3)), np.empty((m, 3, 3))
    before: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for k in range(m):
        if k > 0:
            dt = float(time[k] - time[k - 1])
            f = np.array([[1.0, dt, 0.5 * dt * dt], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
            q = np.array(
                [
                    [dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0],
                    [dt**4 / 8.0, dt**3 / 3.0, dt**2 / 2.0],
                    [dt**3 / 6.0, dt**2 / 2.0, dt],
                ]
            )
            x, p = f @ x, f @ p @ f.T + intensity * q
            before.append((f, x, p))
            gain = p[:, 0] / (p[0, 0] + variance)
            x = x + gain * (way_m[k] - x[0])
            p = p - np.outer(gain, p[0])
        states[k], covariances[k] = x, p
    for k in range(m - 2, -1, -1):
        f, ahead, ahead_p = before[k]
        gain_back = np.linalg.solve(ahead_p, f @ covariances[k]).T
        states[k] += gain_back @ (states[k + 1] - ahead)
        covariances[k] += gain_back @ (covariances[k + 1] - ahead_p) @ gain_back.T
    return states, covariances
