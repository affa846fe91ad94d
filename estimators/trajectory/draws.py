"""Draws of the trajectory smoother's error, and of the rails' that follow from it.

A standard deviation at each place does not say how the error hangs together along the track, so nothing
follows from it for a band of wavelengths. Draws of the whole error do: each is filtered as the rails are, and
their root mean square in a band is the standard deviation there (`simrail.track.bands.sd_of_draws`).

What is drawn is what `simrail.estimators.trajectory.track_geometry` has in its standard deviations, each as
it hangs together:

* the smoother's error: from the joint posterior of all samples
(`simrail.estimators.trajectory.kernel`);
* the accelerometer's turn-on bias, taken for roll, and that of the package: one number each, uniform;
* the rail sensor's noise: white;
* the odometry's error of position: one normal number per draw times its sd at each place, as if it were of
  one cause.

A draw is the truth minus the estimate: added to the estimate it is rails that the recording allows.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from simrail.estimators.trajectory.kernel import ROLL, ROWS, STATES, Model, Past, Y, Z, trajectory_error
from simrail.estimators.trajectory.track_geometry import Sight, over_space, slopes

from simrail.core.columns import IRREGULARITY
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.recording.recording import Recording

FELT = (ROLL, Y, Z)
"""States that the rails depend on to first order."""

ROOT = 0
"""Of the streams: an estimator has no seed of its own, and the same recording gives the same draws."""


NAMED_BY = 1e-6
"""Unit of the IMU's first sample in the name of a stream, rad/s and m/s2: far below any IMU's noise, and far
above what two machines differ by."""


def stream_of(recording: Recording, draw: int, term: str) -> np.random.Generator:
    """Random numbers of one term of one draw; those of another recording are others, all methods share them.

    If all draws of the sensors and of the track shared them, the error of a standard deviation by few draws
    would be the same in each, and no mean over these would lessen it. A recording is known by its ride, its
    IMU and the noise of its first sample; an ideal IMU at the same start has none, and shares them.
    """
    first = np.rint(recording.imu.iloc[:1].to_numpy(dtype=np.float64) / NAMED_BY).astype(np.int64).ravel()
    return stream(ROOT, "rail draws", recording.name, recording.mount, *first.tolist(), draw, term)


def state_errors(model: Model, past: Past, streams: Sequence[np.random.Generator]) -> FloatArray:
    """Draws of the smoothing error of the states `FELT`.

    Parameters
    ----------
    model : Model
        What the filter had.
    past : Past
        What it left behind.
    streams : sequence of numpy.random.Generator
        One for each of m draws.

    Returns
    -------
    ndarray (m, n, 3)
        rad and m.
    """
    n = len(past.states)
    roots = np.asarray(np.linalg.cholesky(model.process), dtype=np.float64)
    drawn, errors, innovations = np.empty((len(streams), n, 3)), np.empty((n, STATES)), np.empty((n, ROWS))
    for draw, rng in enumerate(streams):
        normals = rng.standard_normal((n, STATES + ROWS))
        trajectory_error(model, past, roots, np.sqrt(model.noise), normals, innovations, errors)
        drawn[draw] = errors[:, FELT]
    return drawn


def geometry_draws(
    sight: Sight,
    geometry: pd.DataFrame,
    errors: FloatArray,
    recording: Recording,
    *,
    tilts_rad: Sequence[float],
    step_m: float,
) -> FloatArray:
    """Draws of true minus estimated irregularities.

    Parameters
    ----------
    sight : Sight
        Of the estimate (`simrail.estimators.trajectory.track_geometry.sight_of`).
    geometry : pandas.DataFrame
        The estimated rails.
    errors : ndarray (m, n, 3)
        Draws of the error of the states `FELT` (`state_errors`).
    recording : Recording
        Names the draws.
    tilts_rad : sequence of float
        Bounds of the roll that each thing that is constant over the ride is taken for.
    step_m : float
        As in `simrail.estimators.trajectory.track_geometry.track_geometry`.

    Returns
    -------
    ndarray (m, places, 4)
        `simrail.core.columns.IRREGULARITY` over the places of ``geometry``, m; NaN where that is.
    """
    slope, place = slopes(sight.arms)[sight.use], sight.place[sight.use]
    variance = np.square(sight.place_sd[sight.use])[:, None]
    at = geometry.index.to_numpy(dtype=np.float64)
    lines = geometry[list(IRREGULARITY)].to_numpy(dtype=np.float64)
    unknown = np.isnan(lines)
    white = sight.noise_sd * np.sqrt([0.5, 0.5, 2.0, 2.0])  # of mean and difference of two rails
    drawn, known = np.empty((len(errors), *lines.shape)), np.where(unknown, 0.0, lines)
    moves = len(at) > 0 and bool(variance.any())
    if moves:
        spread = over_space(place, variance, step_m=step_m, variance=variance).variance
        assert spread is not None
        along, sd = CubicSpline(at, known), np.sqrt(spread[:, 0])
    for draw, error in enumerate(errors):
        states = error[sight.use]
        shares = stream_of(recording, draw, "tilt").uniform(-1.0, 1.0, len(tilts_rad))
        states[:, 0] += sum(share * bound for share, bound in zip(shares, tilts_rad, strict=True))
        # Not by BLAS, whose sums depend on how many threads it has.
        rails = np.einsum("nij,nj->ni", slope, states)
        if sight.noise_sd > 0.0:
            rails += white * stream_of(recording, draw, "rail_sensor").standard_normal(rails.shape)
        drawn[draw] = over_space(place, rails, step_m=step_m).values
        if moves:
            moved = at + stream_of(recording, draw, "position").standard_normal() * sd
            drawn[draw] += along(np.clip(moved, at[0], at[-1])) - known
        drawn[draw][unknown] = np.nan
    return drawn
