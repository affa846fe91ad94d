"""Where is the train, how fast, and with what acceleration: a small causal filter on encoder counts.

A Kalman filter with a constant-acceleration model (white jerk) of position s, speed V and
acceleration A. What a counter tells is not a position but an interval between two edges; the
filter's measurement is the middle of the smallest interval that the count allows, with the variance
width^2/12. A train without pulses is put to rest exactly: its estimated speed would otherwise decay
for ever, and drift.

Of the wheel it knows the nominal radius; how far the true rolling radius may be from that (wear, taper,
running on the flange in a curve) enters the standard deviations through the sheet's `radius_relative_sd`, as
one constant factor. It knows nothing of slip, nor of the longer way of the outer wheel. The error of a
count is treated as white. That is wrong in one case: at an exactly constant speed of a whole number
of pulses per reading the count's error is a slow sawtooth, which the filter follows.

An odometer that shows the speed, in place of a counter, runs through the same model.

A recording that begins at speed is another matter (`simrail.estimators.odometry.moving_start`): the filter
begins anew where readings have shown it, or, with hindsight, answers the first seconds by later ones.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from simrail.estimators.kalman import mirror, take, update
from simrail.estimators.odometry.moving_start import (
    ACCELERATION_SD_MPS2,
    BACK_S,
    SHOWN_S,
    SPEED_SD_MPS,
    Shown,
    Start,
    reading_variance,
    shown_by,
    smoothed_back,
    start_of,
    start_of_counts,
    state_so_far,
    told_start,
)

from simrail.core.columns import ODOMETRY, ODOMETRY_SD
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, njit, njit_inline
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import EncoderSheet, OdometerSheet, Recording

JERK_INTENSITY_M2PS5 = 0.01
"""Intensity of the model's white jerk. Small enough for quiet accelerations at constant speed, large
enough to follow service braking (0.6 m/s2, jerk 0.4 m/s3) with a lag of about 0.15 s."""


FADE_S = 1.5
"""Time constant with which a ride that begins at speed goes over to the filter of all others, which takes
stamps at their word: it follows traction the faster for it."""


@dataclass(frozen=True)
class EncoderOdometry:
    """Position, speed and acceleration from the wheel alone: encoder counts, or an odometer's speed.

    Attributes
    ----------
    jerk_intensity_m2ps5 : float
        Intensity of the white jerk.
    still_s : float
        Shortest time without pulses after which the train is at rest. A train that was slow at its
        last pulse is given three pulse intervals, at most ten times `still_s`.
    still_mps : float
        An odometer's reading below this is a train at rest.
    hindsight : bool
        Whether the first seconds of a ride that begins at speed are answered by later ones: for a ride that
        is over, and not causal. Nothing else changes by it.
    """

    jerk_intensity_m2ps5: float = JERK_INTENSITY_M2PS5
    still_s: float = 0.5
    still_mps: float = 0.02
    hindsight: bool = False

    needs = ("encoder",)
    uses_imu = False
    label = "encoder odometry"

    @property
    def causal(self) -> bool:
        """Without hindsight it is."""
        return not self.hindsight

    def __post_init__(self) -> None:
        for name in ("jerk_intensity_m2ps5", "still_s", "still_mps"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise InputError("is out of range", field=name, value=getattr(self, name), limit="> 0")

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate position, speed and acceleration along the track at every IMU sample.

        Raises
        ------
        InputError
            If the recording has neither encoder nor odometer.
        """
        times, start_m = recording.imu.index.to_numpy(dtype=np.float64), recording.start_position_m
        if recording.encoder is not None and recording.encoder_sheet is not None:
            start = start_of(recording) if self.hindsight else told_start(recording)
            states = self.from_counts(recording.encoder, recording.encoder_sheet, times, start_m, start=start)
        elif recording.odometer is not None and recording.odometer_sheet is not None:
            states = self.from_speed(recording.odometer, recording.odometer_sheet, times, start_m)
        else:
            raise InputError(
                "the recording has no encoder",
                field="encoder",
                value=recording.name,
                remedy="add an [encoder] to the scenario, or [encoder] or [odometer] to the ride",
                limit="a recording with an encoder",
            )
        return Estimate(states=states, mount=recording.mount)

    def from_counts(
        self,
        encoder: pd.DataFrame,
        sheet: EncoderSheet,
        times: FloatArray,
        start_position_m: float,
        *,
        start: Start | None = None,
    ) -> pd.DataFrame:
        """Odometry from encoder counts.

        The count c says that the train is between (c - 1/2) q and (c + 1/2) q from its start, on average
        over the unknown place between two edges where the wheel first stood; q is the way of one pulse.
        A count that has just changed by one says more at low speed: the edge was passed less than one
        reading ago.

        Parameters
        ----------
        encoder : pandas.DataFrame
            Indexed by ``time_s``, column ``pulse_count``.
        sheet : EncoderSheet
            Pulses per revolution, nominal wheel radius and how far the rolling one may be from it.
        times : ndarray (n,)
            Increasing times at which the odometry is wanted, s. The answer at a time uses no count read
            after it.
        start_position_m : float
            Position s at the first count.
        start : Start, optional
            Speed at the first count; where it is not given, found out by the first second with hindsight,
            and 0 without.

        Returns
        -------
        pandas.DataFrame
            Indexed by `times`, columns `simrail.core.columns.ODOMETRY` and `ODOMETRY_SD`. At rest speed
            and acceleration are exactly 0.
        """
        quantum = sheet.pulse_m
        read, counts = np.array(encoder.index.to_numpy(dtype=np.float64)), encoder["pulse_count"].to_numpy()
        way = (counts - counts[0]).astype(np.float64) * quantum
        if start is None:
            start = start_of_counts(read, way, quantum) if self.hindsight else Start()
        shown = Shown() if self.hindsight or start.speed_mps else shown_by(read, way, quantum)
        moves, counted = start.speed_mps != 0.0, quantum**2 / 12.0
        variance = reading_variance(read, way, quantum) if moves and self.hindsight else counted
        anew, anew_p = np.zeros(STATES), np.zeros((STATES, STATES))
        if shown.told >= 0:
            known = slice(shown.told + 1)
            variance = reading_variance(read[known], way[known], quantum)
            anew, anew_p = state_so_far(read[known], way[known], variance)
        states = _filter(
            read,
            counts.astype(np.float64),
            np.array(times, dtype=np.float64),
            quantum,
            self.jerk_intensity_m2ps5,
            self.still_s,
            start.speed_mps,
            start.sd_mps,
            variance - counted,
            shown.first,
            shown.told,
            anew,
            anew_p,
        )
        if moves and self.hindsight:
            self._look_back(states, read, way, times, start, variance)
        # The unknown first place between two edges shifts every position alike, by up to half a pulse.
        states[:, 3] += quantum**2 / 12.0
        return _frame(states, times, start_position_m, sheet.radius_relative_sd)

    def _look_back(
        self,
        states: FloatArray,
        read: FloatArray,
        way: FloatArray,
        times: FloatArray,
        start: Start,
        variance: float,
    ) -> None:
        """Put what all the first seconds say in place of states (n, 6) of those seconds."""
        intensity = self.jerk_intensity_m2ps5
        means, covariances = smoothed_back(read, way, start, variance=variance, intensity=intensity)
        last = np.searchsorted(read[: len(means)], times, side="right") - 1
        for i in np.flatnonzero(times < read[0] + BACK_S):
            k = max(int(last[i]), 0)
            ahead(means[k], covariances[k], float(times[i] - read[k]), intensity, states[i])

    def from_speed(
        self, odometer: pd.DataFrame, sheet: OdometerSheet, times: FloatArray, start_position_m: float
    ) -> pd.DataFrame:
        """Odometry from readings of the speed (column ``speed_mps``), otherwise as `from_counts`."""
        states = _speed_filter(
            np.array(odometer.index.to_numpy(dtype=np.float64)),
            np.array(odometer["speed_mps"].to_numpy(dtype=np.float64)),
            np.array(times, dtype=np.float64),
            sheet.speed_sd_mps**2,
            self.jerk_intensity_m2ps5,
            self.still_mps,
        )
        return _frame(states, times, start_position_m, sheet.radius_relative_sd)


def _frame(states: FloatArray, times: FloatArray, start_m: float, scale_sd: float) -> pd.DataFrame:
    """The odometry of states and variances (n, 6), whose way has a scale of relative sd `scale_sd`."""
    for k in range(3):  # one after another: of a ride of hours, all at once would be held three times
        states[:, 3 + k] = np.sqrt(states[:, 3 + k] + (scale_sd * states[:, k]) ** 2)
    states[:, 0] += start_m
    return pd.DataFrame(states, index=pd.Index(times, name="time_s"), columns=[*ODOMETRY, *ODOMETRY_SD])


STATES = 3
S, V, A = range(STATES)


@njit_inline
def predict(x: FloatArray, p: FloatArray, dt: float, intensity: float) -> None:
    """X <- F x, P <- F P F' + Q in place; F and Q of a triple integrator driven by white noise.

    Written out for its three states: by `chain` and `chain_covariance` of `simrail.estimators.kalman` the
    whole filter takes 1.6 times as long, and twice as long to compile.
    """
    half = 0.5 * dt * dt
    x[S] += dt * x[V] + half * x[A]
    x[V] += dt * x[A]
    for j in range(STATES):
        p[S, j] += dt * p[V, j] + half * p[A, j]
        p[V, j] += dt * p[A, j]
    for i in range(STATES):
        p[i, S] += dt * p[i, V] + half * p[i, A]
        p[i, V] += dt * p[i, A]
    p[S, S] += intensity * dt**5 / 20.0
    p[S, V] += intensity * dt**4 / 8.0
    p[S, A] += intensity * dt**3 / 6.0
    p[V, V] += intensity * dt**3 / 3.0
    p[V, A] += intensity * dt**2 / 2.0
    p[A, A] += intensity * dt
    mirror(p)


@njit_inline
def ahead(x: FloatArray, p: FloatArray, lead: float, intensity: float, out: FloatArray) -> None:
    """Write s, V, A and their variances into ``out`` (6,), as `predict` by a time has them."""
    half = 0.5 * lead * lead
    out[S] = x[S] + lead * x[V] + half * x[A]
    out[V] = x[V] + lead * x[A]
    out[A] = x[A]
    across = lead * p[S, V] + half * p[S, A] + lead * half * p[V, A]
    out[3] = p[S, S] + lead**2 * p[V, V] + half**2 * p[A, A] + 2.0 * across + intensity * lead**5 / 20.0
    out[4] = p[V, V] + lead**2 * p[A, A] + 2.0 * lead * p[V, A] + intensity * lead**3 / 3.0
    out[5] = p[A, A] + intensity * lead


@njit_inline
def _begin(p: FloatArray, q: float, speed_sd: float) -> None:
    """Covariance of a train at speed before any reading has been followed, in place."""
    p[:, :] = 0.0
    p[S, S] = q * q / 12.0
    p[V, V] = speed_sd**2
    p[A, A] = ACCELERATION_SD_MPS2**2


@njit_inline
def _stand(
    x: FloatArray, p: FloatArray, q: float, quiet: float, start_speed: float, start_acceleration: float
) -> None:
    """Put a train to rest that has had no pulse for a time ``quiet``, in place."""
    x[V] = 0.0
    x[A] = 0.0
    p[:, :] = 0.0
    p[S, S] = q * q / 12.0
    # Less than one pulse in this time, in either direction: uniform in [-b, b] has sd b/sqrt(3).
    p[V, V] = min(start_speed, q / quiet) ** 2 / 3.0
    p[A, A] = min(start_acceleration, 2.0 * q / quiet**2) ** 2 / 3.0


@njit
def _filter(
    time: FloatArray,
    count: FloatArray,
    wanted: FloatArray,
    q: float,
    intensity: float,
    still: float,
    first_speed: float,
    first_speed_sd: float,
    jitter: float,
    seen: int,
    shown: int,
    anew: FloatArray,
    anew_p: FloatArray,
) -> FloatArray:
    """Run over all readings; returns s, V, A and their variances (n, 6) at the wanted times.

    From rest, where ``first_speed`` is 0; ``jitter`` is what stamps add to the variance of a count at first.
    At reading ``shown`` (-1 for none) it begins anew, by ``anew`` with covariance ``anew_p``; from ``seen``
    (-1 for none) until then, for `SHOWN_S` at most, it says the mean speed so far, and how little that is.
    """
    out = np.empty((len(wanted), 6))
    x, p, h = np.zeros(STATES), np.zeros((STATES, STATES)), np.zeros(STATES)
    gain, work = np.zeros(STATES), np.zeros(STATES)
    h[S] = 1.0
    # A start with constant jerk from rest: speed and acceleration when the first pulse comes.
    jerk = 0.5
    start_speed = 0.5 * jerk ** (1.0 / 3.0) * (6.0 * q) ** (2.0 / 3.0)
    start_acceleration = (6.0 * q * jerk * jerk) ** (1.0 / 3.0)
    resting = True
    idle = 0.0
    patience = still
    direction = 0.0
    if first_speed != 0.0:
        resting = False
        direction = np.sign(first_speed)
        x[V] = first_speed
        _begin(p, q, first_speed_sd)
    next_out = 0
    for k in range(len(time)):
        dt = time[k] - time[k - 1] if k > 0 else 0.0
        change = count[k] - count[k - 1] if k > 0 else 0.0
        way = (count[k] - count[0]) * q
        fading = jitter * np.exp((time[max(shown, 0)] - time[k]) / FADE_S) if k > shown else 0.0
        idle += dt
        if not resting:
            predict(x, p, dt, intensity)
        if change != 0.0:
            direction = 1.0 if change > 0.0 else -1.0
            steps = abs(change)
            if resting:
                fastest = start_speed + q / idle + (steps - 1.0) * q / dt
                p[:, :] = 0.0
                p[S, S] = q * q
                p[V, V] = 0.25 * fastest**2
                p[A, A] = start_acceleration**2
                x[V] = 0.5 * direction * fastest
                resting = False
            width = q
            if steps == 1.0:
                width = min(q, max(0.1 * q, (abs(x[V]) + 2.0 * np.sqrt(p[V, V])) * dt))
            middle = way - 0.5 * direction * (q - width)
            update(x, p, h, middle - x[S], width * width / 12.0 + fading, gain, work)
            idle = 0.0
            patience = min(max(3.0 * q / max(abs(x[V]), 1e-9), still), 10.0 * still)
        elif not resting:
            # No pulse although one was due: the train is at most at the edge.
            if abs(x[S] - way) > 0.5 * q:
                edge = way + np.sign(x[S] - way) * 0.5 * q
                update(x, p, h, edge - x[S], q * q / 12.0 + fading, gain, work)
            if x[V] * direction <= 0.0 or idle > patience:
                resting = True
        if 0 <= seen <= k and time[k] - time[0] < SHOWN_S[0]:
            resting = False
            x[S], x[V], x[A] = way, way / (time[k] - time[0]), 0.0
            _begin(p, q, SPEED_SD_MPS)
        if k == shown:
            resting = False
            take(x, p, anew, anew_p)
        if resting:
            _stand(x, p, q, max(idle, 1e-3), start_speed, start_acceleration)
        until = time[k + 1] if k + 1 < len(time) else np.inf
        while next_out < len(wanted) and wanted[next_out] < until:
            ahead(x, p, 0.0 if resting else wanted[next_out] - time[k], intensity, out[next_out])
            next_out += 1
    return out


@njit
def _speed_filter(
    time: FloatArray, speed: FloatArray, wanted: FloatArray, variance: float, intensity: float, still: float
) -> FloatArray:
    """Run over all readings; returns s, V, A and their variances (n, 6) at the wanted times."""
    out = np.empty((len(wanted), 6))
    x, p, h = np.zeros(STATES), np.zeros((STATES, STATES)), np.zeros(STATES)
    gain, work = np.zeros(STATES), np.zeros(STATES)
    h[V] = 1.0
    resting = True
    next_out = 0
    for k in range(len(time)):
        if k > 0 and not resting:
            predict(x, p, time[k] - time[k - 1], intensity)
        if abs(speed[k]) < still:
            resting = True
            x[V] = 0.0
            x[A] = 0.0
            for i in range(STATES):
                p[i, V] = p[V, i] = p[i, A] = p[A, i] = 0.0
            p[V, V] = still * still / 3.0
        else:
            if resting:
                # Setting off, or the first reading of a moving train: an acceleration of up to 1 m/s2.
                x[V] = speed[k]
                p[V, V] = variance
                p[A, A] = 1.0
                resting = False
            update(x, p, h, speed[k] - x[V], variance, gain, work)
        until = time[k + 1] if k + 1 < len(time) else np.inf
        while next_out < len(wanted) and wanted[next_out] < until:
            ahead(x, p, 0.0 if resting else wanted[next_out] - time[k], intensity, out[next_out])
            next_out += 1
    return out
