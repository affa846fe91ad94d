"""What the curve-matched odometry found at its own steps, told at the times of the IMU.

Of the three that an attitude filter asks for, position and speed are the filter's. The acceleration is
made here, since a train's own acceleration changes slowly, and the accelerometer shakes with the body.

Not here: the filter (`simrail.estimators.odometry.curve_matched`).
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import signal
from simrail.estimators.odometry.encoder import EncoderOdometry
from simrail.estimators.odometry.kernel import S, V

from simrail.core.columns import ODOMETRY, ODOMETRY_SD
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

RATE_HZ = 50.0
"""Rate of the filter. A train's jerk is limited: between two steps nothing happens along the track."""

CALM_HZ = 1.0
"""Up to here an acceleration is the train's."""

HOLD_S = 2.0
"""After a slip the acceleration of the wheel is not believed for so long: its filter still remembers it."""

ACCELERATION_SD_MPS2 = 0.03
"""Of that acceleration: what the body's pitching leaves in it."""

STILL_SD_MPS = 1e-3
"""Of the speed of a train that is known to stand."""


class Trace(NamedTuple):
    """What the filter found at its own steps, n of them.

    Attributes
    ----------
    time_s : ndarray (n,)
        Ends of the steps.
    states, covariance : ndarray (n, 13), (n, 13, 13)
        See `simrail.estimators.odometry.curve_matched`.
    acceleration : ndarray (n,)
        Along the track, over the step; it shakes with the body.
    slipping, resting : ndarray (n,) of bool
        Where the wheel was not believed, and where the train stood.
    """

    time_s: FloatArray
    states: FloatArray
    covariance: FloatArray
    acceleration: FloatArray
    slipping: np.ndarray
    resting: np.ndarray


def at_imu_times(
    trace: Trace, recording: Recording, *, smoothed: bool, start_sd_m: float, radius_sd: float
) -> pd.DataFrame:
    """Position, speed and acceleration along the track at every IMU sample.

    Parameters
    ----------
    trace : Trace
        Of the filter, or of the smoother.
    recording : Recording
        With an encoder.
    smoothed : bool
        True: interpolate. False: use nothing later than each sample.
    start_sd_m, radius_sd : float
        How well the start and, relative, the wheel radius are known.

    Returns
    -------
    pandas.DataFrame
        Columns `simrail.core.columns.ODOMETRY` and `ODOMETRY_SD`, indexed as the IMU.
    """
    wanted = recording.imu.index.to_numpy(dtype=np.float64)
    found = np.column_stack([trace.states[:, [S, V]], _calm(trace, smoothed=smoothed)])
    sd = np.sqrt(np.diagonal(trace.covariance, axis1=1, axis2=2)[:, [S, V]])
    sd = np.column_stack([sd, np.full(len(sd), ACCELERATION_SD_MPS2)])
    # Until the filter's first step: standing at the start.
    start = np.array([[recording.start_position_m, 0.0, 0.0, start_sd_m, STILL_SD_MPS, ACCELERATION_SD_MPS2]])
    found[trace.resting, 1:] = 0.0
    known = np.vstack([start, np.hstack([found, sd])])
    times = np.concatenate([[-np.inf], trace.time_s])
    if smoothed:
        times[0] = min(wanted[0], trace.time_s[0]) - 1.0 / RATE_HZ
        values = np.column_stack([np.interp(wanted, times, column) for column in known.T])
    else:
        last = np.searchsorted(times, wanted, side="right") - 1
        values = known[last]
        slipping = np.concatenate([[False], _held(trace.slipping, HOLD_S)])
        _roll(values, recording, slipping[last], radius_sd)
        ahead = np.where(last > 0, wanted - times[last], 0.0)
        values[:, 0] += ahead * (values[:, 1] + 0.5 * ahead * values[:, 2])
        values[:, 1] += ahead * values[:, 2]
    return pd.DataFrame(values, index=recording.imu.index, columns=[*ODOMETRY, *ODOMETRY_SD])


def _roll(values: FloatArray, recording: Recording, slipping: np.ndarray, radius_sd: float) -> None:
    """Put the wheel's own acceleration into values (n, 6), where the wheel rolls.

    An attitude filter takes the acceleration off the accelerometer. Made from that same accelerometer
    it would take the body's own pitch away as well.
    """
    assert recording.encoder is not None and recording.encoder_sheet is not None
    sheet = replace(recording.encoder_sheet, radius_relative_sd=radius_sd)
    wheel = EncoderOdometry().estimate(replace(recording, encoder_sheet=sheet)).states
    rolls = ~slipping
    values[rolls, 2] = wheel["acceleration_mps2"].to_numpy()[rolls]
    values[rolls, 5] = wheel["acceleration_sd_mps2"].to_numpy()[rolls]


def _calm(trace: Trace, *, smoothed: bool) -> FloatArray:
    """Acceleration without what the body shakes, (n,): the train's own changes slowly."""
    if smoothed:
        slope = np.gradient(trace.states[:, V], 1.0 / RATE_HZ)
        sections = signal.butter(2, CALM_HZ, fs=RATE_HZ, output="sos")
        calm: FloatArray = signal.sosfiltfilt(sections, slope, padlen=min(len(slope) - 1, 150))
        return calm
    # Critically damped: the slope of the speed, followed by two equal lags.
    keep = math.exp(-2.0 * math.pi * CALM_HZ / RATE_HZ)
    passed: FloatArray = signal.lfilter(
        [(1.0 - keep) ** 2], [1.0, -2.0 * keep, keep * keep], trace.acceleration
    )
    return passed


def _held(flags: np.ndarray, hold_s: float) -> np.ndarray:
    """Flags (n,) at the filter's steps, each held on for a time."""
    steps = np.arange(len(flags))
    latest = np.maximum.accumulate(np.where(flags, steps, -len(flags) - 10**6))
    held: np.ndarray = steps - latest <= hold_s * RATE_HZ
    return held
