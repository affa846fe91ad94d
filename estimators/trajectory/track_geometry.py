"""What the rails look like, from the trajectory of a body: the four irregularities over the track.

With a sensor that sees the rails from the body, each rail is where the body is plus what the sensor sees: the
measuring system of Gonzalez-Carbajal et al. 2023 (paper 001), whose camera is numbers here. Without one the
body itself is the probe: its points that nominally stand on the rails are taken for the rails. For an IMU on
a wheelset the contact keeps that true but for the wheelset's own play between the rails; for one on a bogie
or a body the motion of the suspensions stays in as well. Gauge is then not observable.

It has no filter of its own: the trajectory is smoothed before, its samples, taken at any places in any order,
are brought to uniform places along the track here, and wavelength bands are cut out after
(`simrail.track.bands`).
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import ndimage, signal
from scipy.interpolate import CubicSpline
from simrail.estimators.trajectory.geometry_kernel import (
    means_of_cells,
    on_spline,
    rails_seen,
    spline_slopes,
    thinned,
    variances,
)

from simrail.core.columns import ATTITUDE, IRREGULARITY, IRREGULARITY_SD, RELATIVE_POSITION, require
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording, odometry_of

OUTLIER_SDS = 5.0
"""Standard deviations of the noise from the running median beyond which a view of the rails is not used."""

FINE = 8
"""Cells per step in which samples are averaged before the step's own low-pass."""

_REACH = 10
"""Steps that the low-pass sees on either side."""

_LOW_PASS = signal.firwin(2 * _REACH * FINE + 1, 1.0 / FINE, window=("kaiser", 5.0))
"""Passes waves longer than 2.5 steps to 0.2 % and stops those shorter than 1.7 to 1 %."""


def track_geometry(
    estimate: Estimate,
    recording: Recording,
    *,
    step_m: float = 0.25,
) -> pd.DataFrame:
    """Irregularities of the rails from a trajectory.

    With A the rotation from body to track frame, y and z the IMU's place in that frame, u_l and u_r the rails
    seen from the IMU in body axes, and b half the design track's rail base:

        r_l = (0, y, z) + A u_l,     d_l = r_l - (0, b, 0)        (r_r and d_r alike, with -b)
        alignment        = (d_l,y + d_r,y)/2        cross-level = d_l,z - d_r,z
        vertical profile = (d_l,z + d_r,z)/2        gauge       = d_l,y - d_r,y

    Without a rail sensor u_l = (0, b - m_y, -m_z), the nominal place of the rail seen from the mount m.
    For small angles alignment is then y + m_z roll and cross-level 2 b roll (less the mount's own y).

    Parameters
    ----------
    estimate : Estimate
        Its states hold the attitude, ``lateral_m`` and ``vertical_m`` of the IMU; ``position_m`` counts
        before the odometry's where it is there. Standard deviations (``roll_sd_rad``, ``lateral_sd_m``,
        ``vertical_sd_m``), or the covariance of these three states, are carried through to first order;
        without them there are none in the answer.
    recording : Recording
        Its odometry, design track, mount, and rail sensor if there is one.
    step_m : float
        Distance of the places, whole multiples of it. Samples of the same eighth of a step are averaged,
        whenever they were taken: in a stop, running backwards, or passing again. Then a low-pass without
        shift takes off what the step cannot carry.

    Returns
    -------
    pandas.DataFrame
        Indexed by ``position_m`` (uniform), columns `IRREGULARITY`, and `IRREGULARITY_SD` where known.
        ``gauge_m`` is NaN throughout without a rail sensor: it is not observable. No rows if the train moved
        by less than a step. Standard deviations speak of the trajectory, the sensor, and the position along
        the track as far as its own sd is known (``position_sd_m``), but not of what a wheelset does between
        the rails, nor of the design cant that a wrong position takes off a transition.

    Raises
    ------
    InputError
        If the states lack a column or a number, or the step is not positive.
    """
    return geometry_of(sight_of(estimate, recording), step_m=step_m)


class Sight(NamedTuple):
    """Rails at each of n samples, before they are brought over space.

    Attributes
    ----------
    place, place_sd : ndarray (n,)
        Position along the track and its standard deviation, 0 where that is not known, m.
    arms : ndarray (n, 2, 3)
        From the IMU to left and right rail, track axes, m.
    rails : ndarray (n, 2, 2)
        Deviation of left and right rail from the design, along y and z, m.
    use : ndarray of bool (n,)
        Which samples are used (`trusted`).
    noise_sd : float
        Of the rail sensor, m; 0 without one.
    gauge_known : bool
        Whether there is a rail sensor.
    covariance : ndarray (n, 3, 3), optional
        Of roll, lateral and vertical position.
    """

    place: FloatArray
    place_sd: FloatArray
    arms: FloatArray
    rails: FloatArray
    use: np.ndarray
    noise_sd: float
    gauge_known: bool
    covariance: FloatArray | None


def sight_of(estimate: Estimate, recording: Recording) -> Sight:
    """Where the rails are by an estimate; see `track_geometry`."""
    states = estimate.states
    require(states, (*ATTITUDE, *RELATIVE_POSITION), what="states")
    sheet = recording.rail_sensor_sheet if recording.rail_displacement is not None else None
    known = states if "position_m" in states.columns else odometry_of(recording)
    if len(known) != len(states):
        raise InputError(
            "states are not at the recording's times",
            field="states",
            value=len(states),
            limit="a row for each sample",
            remedy="index them by the times of the IMU",
        )
    track = recording.track
    base = track.rail_base_m
    place = np.clip(known["position_m"].to_numpy(dtype=np.float64), track.start_m, track.end_m)
    values = states[[*ATTITUDE, *RELATIVE_POSITION]].to_numpy(dtype=np.float64)
    if not (np.isfinite(place).all() and np.isfinite(values).all()):
        raise InputError(
            "holds a value that is not finite",
            field="states",
            limit="finite numbers",
            remedy="mend the estimate",
        )
    frame = track.frame(place, places=False)
    seen, arms, rails = _seen(recording, base), np.empty((len(place), 2, 3)), np.empty((len(place), 2, 2))
    design = np.array([frame.roll_rad, frame.pitch_rad, frame.yaw_rad])
    rails_seen(design, values, seen, 0.5 * base, arms, rails)
    use, noise_sd = np.ones(len(place), dtype=bool), 0.0
    if sheet is not None:
        use, noise_sd = trusted(seen[:, :, 1:].reshape(-1, 4), sheet.noise_m), sheet.noise_m
    place_sd = known["position_sd_m"].to_numpy(dtype=np.float64) if "position_sd_m" in known else 0.0 * place
    return Sight(place, place_sd, arms, rails, use, noise_sd, sheet is not None, _covariance(estimate))


def geometry_of(sight: Sight, *, step_m: float) -> pd.DataFrame:
    """The rails over space; see `track_geometry`."""
    if not 0.0 < step_m < np.inf:
        raise InputError("is out of range", field="step_m", value=step_m, limit="> 0 m")
    use, variance = sight.use, None
    if sight.covariance is not None:
        variance = np.column_stack([_variance(sight.arms, sight.covariance), sight.place_sd**2])[use]
    found = over_space(sight.place[use], irregularities(sight.rails)[use], step_m=step_m, variance=variance)
    columns = dict(zip(IRREGULARITY, found.values.T, strict=True))
    if found.variance is not None:
        # Of mean and difference of two rails with equal, independent noise.
        white = found.noise_gain[:, None] * sight.noise_sd**2 * np.array([0.5, 0.5, 2.0, 2.0])
        moved = displaced(found.position_m, found.values, np.sqrt(found.variance[:, 4]))
        sds = np.sqrt(found.variance[:, :4] + white + moved)
        columns |= dict(zip(IRREGULARITY_SD, sds.T, strict=True))
    if not sight.gauge_known:
        for name in [column for column in columns if column.startswith("gauge")]:
            columns[name] = np.full(len(found.position_m), np.nan)
    return pd.DataFrame(columns, index=pd.Index(found.position_m, name="position_m"))


def irregularities(rails: FloatArray) -> FloatArray:
    """The four of `simrail.core.columns.IRREGULARITY` (n, 4) from deviations (n, left and right, y and z)."""
    left, right, found = rails[:, 0], rails[:, 1], np.empty((len(rails), 4))
    found[:, :2] = 0.5 * (left + right)
    found[:, 2] = left[:, 1] - right[:, 1]
    found[:, 3] = left[:, 0] - right[:, 0]
    return found


def _seen(recording: Recording, base_m: float) -> FloatArray:
    """Rails seen from the IMU, body axes (n, left and right, 3); one row if nothing sees them."""
    frame = recording.rail_displacement
    seen = np.zeros((1 if frame is None else len(recording.imu), 2, 3))
    if frame is not None:
        seen[:, :, 1:] = frame.to_numpy(dtype=np.float64).reshape(-1, 2, 2)
        return seen
    _, across, height = recording.mount_position_m
    seen[:, 0, 1], seen[:, 1, 1] = 0.5 * base_m - across, -0.5 * base_m - across
    seen[:, :, 2] = -height
    return seen


def trusted(seen: FloatArray, noise_m: float) -> np.ndarray:
    """Which samples (n,) of the views (n, m) are no outliers.

    A sample is dropped if one of its values is more than `OUTLIER_SDS` standard deviations from the median
    of the five around it: those of the sheet, or, where the rails themselves move more, of that
    difference (1.4826 times its median).
    """
    away = np.abs(seen - ndimage.median_filter(seen, size=(5, 1), mode="nearest"))
    limit = OUTLIER_SDS * np.maximum(noise_m, 1.4826 * np.median(away, axis=0))
    return np.asarray((away <= limit).all(axis=1))


def _covariance(estimate: Estimate) -> FloatArray | None:
    """Covariance (n, 3, 3) of roll, lateral and vertical position, where it is known."""
    names = ("roll_rad", *RELATIVE_POSITION)
    if estimate.covariance is not None and set(names) <= set(estimate.covariance_of):
        at = [estimate.covariance_of.index(name) for name in names]
        of_three = np.empty((len(estimate.covariance), 3, 3))
        for i, row in enumerate(at):
            for j, column in enumerate(at):
                of_three[:, i, j] = estimate.covariance[:, row, column]
        return of_three
    sds = ("roll_sd_rad", "lateral_sd_m", "vertical_sd_m")
    if not set(sds) <= set(estimate.states.columns):
        return None
    squares = np.square(estimate.states[list(sds)].to_numpy(dtype=np.float64))
    return np.ascontiguousarray(squares[:, :, None] * np.eye(3))


def _variance(arms: FloatArray, covariance: FloatArray) -> FloatArray:
    """Variance (n, 4) of the irregularities."""
    found = np.empty((len(arms), len(IRREGULARITY)))
    variances(arms, covariance, found)
    return found


def slopes(arms: FloatArray) -> FloatArray:
    """How the irregularities depend on roll, y and z, (n, 4, 3).

    A turn by d about X moves a rail by d (-arm_z, arm_y).
    """
    slope = np.zeros((len(arms), 4, 3))
    slope[:, :, 0] = irregularities(np.stack([-arms[:, :, 2], arms[:, :, 1]], axis=-1))
    slope[:, 0, 1] = slope[:, 1, 2] = 1.0
    return slope


def displaced(position: FloatArray, lines: FloatArray, sd: FloatArray) -> FloatArray:
    """Mean square (n, m) by which lines over places change if they are moved along, by normal displacements.

    By Gauss and Hermite's quadrature of five points, so that it holds for displacements that are not small
    against the waves of the lines as well. Beyond their ends the lines stay as they are there.
    """
    if len(position) == 0 or not sd.any():
        return np.zeros_like(lines)
    roots, weights = np.polynomial.hermite_e.hermegauss(5)
    between = CubicSpline(position, lines)
    moved = [between(np.clip(position + root * sd, position[0], position[-1])) for root in roots]
    return np.asarray(np.einsum("k,knm->nm", weights / weights.sum(), np.square(np.array(moved) - lines)))


class OverSpace(NamedTuple):
    """Samples brought from time to uniform places.

    Attributes
    ----------
    position_m : ndarray (g,)
        Whole multiples of the step.
    values : ndarray (g, m)
    variance : ndarray (g, m), optional
        That of the samples there: errors of a trajectory hardly change over a step, no mean lessens them.
    noise_gain : ndarray (g,)
        Variance that is left of white noise of variance 1 in the samples; too small over the last few
        steps at each end, unless the train stood there.
    """

    position_m: FloatArray
    values: FloatArray
    variance: FloatArray | None
    noise_gain: FloatArray


def over_space(
    place: FloatArray, values: FloatArray, *, step_m: float, variance: FloatArray | None = None
) -> OverSpace:
    """Bring samples (n, m) taken at places (n,), in any order, to uniform places.

    They are averaged in cells of an eighth of the step, a cubic spline joins the means at the mean places,
    and a symmetric low-pass thins the spline out to the step. Over the ten steps at each end it sees the line
    turned about its end point.
    """
    first, last = (np.ceil(place.min() / step_m - 1e-9), np.floor(place.max() / step_m + 1e-9))
    if last - first < 1:
        nothing, spread = np.empty((0, values.shape[1])), None if variance is None else variance[:0]
        return OverSpace(np.empty(0), nothing, spread, np.empty(0))
    cell_m = step_m / FINE
    kinds = np.unique(np.floor(place / cell_m).astype(np.int64), return_inverse=True)[1]
    at = np.bincount(kinds, place) / np.bincount(kinds)
    # Two means may be close where the train stood on the border of two cells: make one of both.
    close = np.diff(at, prepend=-np.inf) < 0.25 * cell_m
    kinds = (np.arange(len(at)) - np.cumsum(close))[kinds]
    count = np.bincount(kinds)

    def mean(columns: FloatArray) -> FloatArray:
        found = np.zeros((len(count), columns.shape[1]))
        means_of_cells(kinds, columns, count, found)
        return found

    at = np.ascontiguousarray(mean(place[:, None])[:, 0])
    position = np.arange(first, last + 1) * step_m
    fine = first * step_m + cell_m * np.arange((len(position) - 1) * FINE + 1)
    line = _spline(at, mean(values), fine)
    line = _thinned(line, _LOW_PASS, odd=True)
    density = count * cell_m / np.gradient(at)  # samples per cell; below one where the train is fast
    spread = np.interp(fine, at, 1.0 / density)[:, None]
    gain = _thinned(spread, _LOW_PASS**2, odd=False)[:, 0]
    if variance is not None:
        means = mean(variance)
        variance = np.stack([np.interp(position, at, column) for column in means.T], axis=-1)
    return OverSpace(position, line, variance, np.minimum(gain, 1.0))


def _spline(at: FloatArray, values: FloatArray, places: FloatArray) -> FloatArray:
    """Cubic spline through values (c, m) at places (n,) that do not decrease; beyond its ends it stays."""
    if len(at) < 4:
        return np.asarray(CubicSpline(at, values)(np.clip(places, at[0], at[-1])))
    slopes, found = np.empty_like(values), np.empty((len(places), values.shape[1]))
    spline_slopes(at, values, np.empty(len(at)), slopes)
    on_spline(at, values, slopes, places, found)
    return found


def _thinned(line: FloatArray, taps: FloatArray, *, odd: bool) -> FloatArray:
    """Low-pass a line (n, m) and keep every `FINE`-th sample; beyond its ends it is turned or mirrored."""
    n, columns = line.shape
    padded = np.zeros((n, 4 * -(-columns // 4)))
    padded[:, :columns] = line
    found = np.empty(((n - 1) // FINE + 1, padded.shape[1]))
    thinned(padded, taps, FINE, odd, found)
    return found[:, :columns]
