"""Scores: where the truth and the estimate meet, and the only place.

An estimate is compared with the true attitude of its mount and with the design angles of the track
at its true position (the papers' reference), over windows that the track and the true speed define.
Figures go into the score table of `simrail.scoring.table`. Nothing here knows scenarios or draws.

``nis`` and ``us_per_sample`` belong to a method as a whole and stand beside its first quantity. What
the other metrics mean stands in `simrail.scoring.metrics`.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
import pandas as pd
from scipy.signal import butter, sosfiltfilt

from simrail.core.columns import (
    ACCEL,
    ACCELERATION,
    ATTITUDE,
    FAULT,
    MOTION,
    ODOMETRY,
    RELATIVE_POSITION,
    require,
)
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.ride.truth import Mount, Truth
from simrail.scoring.metrics import Bounds, IntArray, Row, Series, figures, nis_figures
from simrail.scoring.table import OK, table_of
from simrail.scoring.windows import chosen_metrics, chosen_windows, windows_of


@dataclass(frozen=True)
class Reference:
    """What estimates of one recording are compared with; made once by `reference_of`.

    Attributes
    ----------
    motion : pandas.DataFrame
        True motion of the mount at the recording's IMU times, columns `SCORED` at least.
    design : ndarray (n, 3)
        Design roll, pitch and yaw of the track at the true position, rad.
    windows : dict of str to ndarray of int
        Sample numbers of every window, possibly none.
    gravity_mps2 : float
        What the true specific force holds beside the acceleration.
    """

    motion: pd.DataFrame
    design: FloatArray
    windows: Mapping[str, IntArray]
    gravity_mps2: float = 9.81


SCORED = (*ATTITUDE, *ACCEL, *ODOMETRY, *RELATIVE_POSITION)
"""Columns of a motion that estimates are compared with."""

ACCELERATION_HZ = 1.0
"""Errors of an acceleration are scored below this frequency: a train takes seconds to change its own, and
what its floor shakes by beside that is no matter of where it is."""


def truth_at_imu(truth: Truth, recording: Recording, columns: Sequence[str] = MOTION) -> pd.DataFrame:
    """True motion of the recording's mount at its IMU times, or some columns of it.

    Raises
    ------
    InputError
        If the recording is not inside the time span of the truth.
    """
    mount = Mount(recording.mount, recording.mount_body, recording.mount_position_m)
    have = truth.time_s
    want = recording.imu.index.to_numpy(dtype=np.float64)
    step = (have[-1] - have[0]) / max(len(have) - 1, 1)
    if want[0] < have[0] - 1e-6 * step or want[-1] > have[-1] + 1e-6 * step:
        raise InputError(
            "the recording is not inside the time span of the truth",
            field="imu.time_s",
            value=(float(want[0]), float(want[-1])),
            limit=f"{have[0]} to {have[-1]} s",
            remedy="score a recording against the ride that it was measured on",
        )
    place = (want - have[0]) / step if step > 0 else np.zeros(len(want))
    nearest = np.rint(place).astype(np.intp)
    if np.abs(place - nearest).max() < 1e-3:
        rows = range(nearest[0], nearest[-1] + 1, nearest[1] - nearest[0] if len(nearest) > 1 else 1)
        if len(rows) == len(nearest) and np.array_equal(nearest, rows):
            return truth.motion(mount, rows, columns).set_axis(recording.imu.index)
        return truth.motion(mount, columns=columns).iloc[nearest].set_axis(recording.imu.index)
    motion = truth.motion(mount, columns=columns)
    values = {name: np.interp(want, have, motion[name].to_numpy()) for name in motion.columns}
    return pd.DataFrame(values, index=recording.imu.index)


def reference_of(truth: Truth | pd.DataFrame, recording: Recording) -> Reference:
    """Make what the estimates of a recording are compared with.

    Parameters
    ----------
    truth : Truth or pandas.DataFrame
        The truth, or its motion at the IMU times as `truth_at_imu` gives it.
    recording : Recording
        The recording. The design that was laid defines the windows and the design angles; with a frame,
        which does not know it, the recording's map does.
    """
    track = recording.track if isinstance(truth, pd.DataFrame) else truth.track
    motion = truth if isinstance(truth, pd.DataFrame) else truth_at_imu(truth, recording, SCORED)
    require(motion, (*ATTITUDE, *ODOMETRY), what="truth")
    if len(motion) != len(recording.imu):
        raise InputError(
            "the truth is not at the IMU's times",
            field="truth",
            value=len(motion),
            limit="a row for each sample of the IMU",
            remedy="take it by truth_at_imu",
        )
    if not np.isfinite(motion[[n for n in MOTION if n in motion.columns]].to_numpy()).all():
        raise InputError(
            "the truth holds a value that is not finite",
            field="truth",
            limit="finite numbers",
            remedy="simulate the ride again",
        )
    position = motion["position_m"].to_numpy()
    frame = track.frame(position)
    design = np.column_stack((frame.roll_rad, frame.pitch_rad, frame.yaw_rad))
    time = recording.imu.index.to_numpy(dtype=np.float64)
    windows = windows_of(track, position, motion["speed_mps"].to_numpy(), time_s=time)
    return Reference(motion, design, windows, recording.gravity_mps2)


def score(
    estimate: Estimate,
    truth: Truth | pd.DataFrame | Reference,
    recording: Recording,
    *,
    us_per_sample: float | None = None,
    windows: Collection[str] | None = None,
    metrics: Collection[str] | None = None,
) -> pd.DataFrame:
    """Score an estimate.

    Parameters
    ----------
    estimate : Estimate
        What the estimator concluded, at the recording's IMU times.
    truth : Truth, pandas.DataFrame or Reference
        The truth, its motion at the IMU times, or (fastest for many estimates) `reference_of` both.
    recording : Recording
        What the estimator saw.
    us_per_sample : float, optional
        Time that the method took, in microseconds per IMU sample.
    windows, metrics : collection of str, optional
        What to keep; by default all. ``"curve:*"`` in `windows` keeps the window of every curve.

    Returns
    -------
    pandas.DataFrame
        Columns `simrail.scoring.table.FIGURE_COLUMNS`, one row per figure. What could not be computed
        is a row whose status says why.

    Raises
    ------
    InputError
        If the estimate speaks of another mount or other times.
    """
    against = truth if isinstance(truth, Reference) else reference_of(truth, recording)
    states = estimate.states
    if estimate.mount != recording.mount:
        raise InputError("the estimate speaks of another mount", value=estimate.mount, limit=recording.mount)
    if not np.array_equal(states.index.to_numpy(), recording.imu.index.to_numpy()):
        raise InputError(
            "the estimate is not at the recording's IMU times",
            field="states.time_s",
            limit="the times of recording.imu",
            remedy="index the states by them",
        )
    chosen = chosen_windows(against.windows, windows)
    keep = chosen_metrics(metrics)
    rows: list[Row] = []
    for series in chain(
        _attitude_series(states, against),
        _other_series(states, against.motion),
        _acceleration_series(states, against),
    ):
        rows += figures(series, chosen, keep)
    first = rows[0][0] if rows else "roll"
    if estimate.innovations is not None and "nis" in keep:
        rows += nis_figures(estimate.innovations, first, chosen)
    if us_per_sample is not None and "us_per_sample" in keep:
        n = len(states)
        rows.append((first, "full", "truth", "whole", "us_per_sample", float(us_per_sample), "us", n, OK))
    return table_of(rows)


def error_of(estimate: Estimate, against: Reference, quantity: str) -> FloatArray | None:
    """Error (n,) of a quantity against the truth, in the score table's unit; None if it is not estimated."""
    states = estimate.states
    for series in chain(_attitude_series(states, against), _other_series(states, against.motion)):
        if series.quantity == quantity and series.reference == "truth":
            return series.error
    return None


def score_odometry(
    recording: Recording,
    truth: Truth | pd.DataFrame | Reference,
    *,
    windows: Collection[str] | None = None,
    metrics: Collection[str] | None = None,
) -> pd.DataFrame:
    """Score the recording's odometry: position, speed and relative distance, as `score` does.

    The estimator's name for it in the score table is ``odometry:<source>``. The relative distance
    is the position error gained since the start over the true distance run in the whole ride. A recording
    without odometry has no rows.
    """
    states = recording.odometry
    if states is None:
        return table_of([])
    against = truth if isinstance(truth, Reference) else reference_of(truth, recording)
    chosen, keep = chosen_windows(against.windows, windows), chosen_metrics(metrics)
    rows: list[Row] = []
    if recording.odometry_source == "truth":
        states = states[list(ODOMETRY)]  # its sds are zero, of which nothing can be scored
    for series in _other_series(states, against.motion):
        rows += figures(series, chosen, keep)
    return table_of(rows)


def wrap(angle: FloatArray) -> FloatArray:
    """Angle in [-pi, pi)."""
    with np.errstate(invalid="ignore"):  # what is not finite stays so, and is counted later
        wrapped: FloatArray = (angle + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped


def _attitude_series(states: pd.DataFrame, against: Reference) -> Iterator[Series]:
    for column, name in enumerate(ATTITUDE):
        if name not in states.columns:
            continue
        quantity = name.removesuffix("_rad")
        angle = states[name].to_numpy(dtype=np.float64)
        sd_name = f"{quantity}_sd_rad"
        sd = np.rad2deg(states[sd_name].to_numpy(dtype=np.float64)) if sd_name in states.columns else None
        for reference, values in (
            ("truth", against.motion[name].to_numpy()),
            ("design", against.design[:, column]),
        ):
            error = wrap(angle - values)
            true = reference == "truth"
            bounds = _bounds(states, against.motion, f"{quantity}_bound_rad", 180.0 / np.pi) if true else None
            yield Series(quantity, reference, np.rad2deg(error), sd if true else None, bounds=bounds)
            if quantity == "yaw":
                # The initial heading is given to the methods, not found by them.
                reason = "" if np.isfinite(error[0]) else "estimate not finite at the first sample"
                yield Series("yaw_debiased", reference, np.rad2deg(wrap(error - error[0])), None, reason)


def _bounds(states: pd.DataFrame, motion: pd.DataFrame, name: str, scale: float) -> Bounds | None:
    """The bounds of a quantity, where the estimate has some."""
    if name not in states.columns:
        return None
    time = states.index.to_numpy(dtype=np.float64)
    way = np.abs(motion["speed_mps"].to_numpy()) * np.gradient(time) if len(time) > 1 else np.zeros(len(time))
    fault = states[FAULT].to_numpy(dtype=np.float64) if FAULT in states.columns else np.zeros(len(time))
    return Bounds(scale * states[name].to_numpy(dtype=np.float64), fault, way)


_LINEAR = (
    ("lateral", "lateral_m", "lateral_sd_m", 1e3),
    ("vertical", "vertical_m", "vertical_sd_m", 1e3),
    ("position", "position_m", "position_sd_m", 1.0),
    ("speed", "speed_mps", "speed_sd_mps", 1.0),
)


def _other_series(states: pd.DataFrame, motion: pd.DataFrame) -> Iterator[Series]:
    for quantity, name, sd_name, scale in _LINEAR:
        if name not in states.columns or name not in motion.columns:
            continue
        error = scale * (states[name].to_numpy(dtype=np.float64) - motion[name].to_numpy())
        sd = scale * states[sd_name].to_numpy(dtype=np.float64) if sd_name in states.columns else None
        bounds = _bounds(states, motion, f"{quantity}_bound_m", scale)
        yield Series(quantity, "truth", error, sd, bounds=bounds)
        if quantity == "position":
            run = float(np.abs(np.diff(motion[name].to_numpy())).sum())
            reason = "" if run > 1.0 else "less than 1 m run"
            yield Series("distance_relative", "truth", (error - error[0]) / max(run, 1.0), None, reason)


def true_acceleration(motion: pd.DataFrame, *, gravity_mps2: float) -> FloatArray:
    """Acceleration of a mount in its own axes (n, 3), m/s2: its true specific force without gravity.

    f_x = a_x - g sin(pitch), f_y = a_y + g sin(roll) cos(pitch), f_z = a_z + g cos(roll) cos(pitch)
    (Veillard et al. 2016, Eq. 7).
    """
    roll, pitch = (motion[name].to_numpy(dtype=np.float64) for name in ATTITUDE[:2])
    gravity = gravity_mps2 * np.column_stack(
        (-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch))
    )
    acceleration: FloatArray = motion[list(ACCEL)].to_numpy(dtype=np.float64) - gravity
    return acceleration


def _acceleration_series(states: pd.DataFrame, against: Reference) -> Iterator[Series]:
    """Errors of the acceleration in body axes, below `ACCELERATION_HZ`, by a filter without delay."""
    estimated = [name for name in ACCELERATION if name in states.columns]
    if not estimated or not set(ACCEL) <= set(against.motion.columns):
        return
    true = true_acceleration(against.motion, gravity_mps2=against.gravity_mps2)
    for name in estimated:
        error = states[name].to_numpy(dtype=np.float64) - true[:, ACCELERATION.index(name)]
        yield Series(name.removesuffix("_mps2"), "truth", _slow(error, states.index.to_numpy()), None)


def _slow(error: FloatArray, time_s: FloatArray) -> FloatArray:
    """What of an error lies below `ACCELERATION_HZ`; as it is where it is not finite, or too short for that.

    A Butterworth filter of second order, run forward and backward, so that nothing is delayed.
    """
    rate = (len(error) - 1) / (time_s[-1] - time_s[0]) if len(error) > 1 else 0.0
    if len(error) < rate / ACCELERATION_HZ or rate <= 2.0 * ACCELERATION_HZ or not np.isfinite(error).all():
        return error
    slow: FloatArray = sosfiltfilt(butter(2, ACCELERATION_HZ, fs=rate, output="sos"), error)
    return slow
