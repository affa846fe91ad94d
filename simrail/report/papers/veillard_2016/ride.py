"""What one recording shows: how sqrt(S) goes with the speed, and where two sums of an acceleration lead."""

from typing import NamedTuple

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.columns import ACCELERATION
from simrail.core.jit import FloatArray
from simrail.estimators.odometry.spectral import FRAME, frames_of
from simrail.scoring.windows import STANDSTILL_MPS

BIN_MPS = 2.0
"""Width of the classes of speed whose means are taken."""

FEWEST_FRAMES = 10
"""Of a class, for a mean of it."""


class SpectrumOverSpeed(NamedTuple):
    """sqrt(S) of a recording's frames over the true speed, and what a straight line makes of it.

    Attributes
    ----------
    speed, root : ndarray (m,)
        At the middle of each frame, m/s; of each frame, (m/s2)^0.5.
    class_speed, class_root : ndarray (c,)
        Means by class of speed.
    slope, intercept : float
        Line v = slope sqrt(S) + intercept by least squares over all frames.
    rms : float
        What it leaves of the speed, m/s.
    explained : float
        Share of the variance of the frames' speed that it explains.
    explained_of_means : float
        Share of the variance of the means of sqrt(S) by class that a line over the speed explains.
    exponent : float
        Of the moving classes: d log(sqrt(S)) / d log(v), by least squares. A line through the origin has 1.
    """

    speed: FloatArray
    root: FloatArray
    class_speed: FloatArray
    class_root: FloatArray
    slope: float
    intercept: float
    rms: float
    explained: float
    explained_of_means: float
    exponent: float


def spectrum_over_speed(example: CellResult) -> SpectrumOverSpeed:
    """Frames of a recording beside its true speed; the mended sum, from k = 2 on."""
    frames = frames_of(example.recording)
    good = np.isfinite(frames.root)
    speed = np.abs(example.motion["speed_mps"].to_numpy()[frames.ends[good] - FRAME // 2])
    root = frames.root[good]
    slope, intercept = np.polyfit(root, speed, 1)
    left = speed - slope * root - intercept
    number = np.where(speed < STANDSTILL_MPS, -1, (speed / BIN_MPS).astype(int))
    classes = [k for k in np.unique(number) if (number == k).sum() >= FEWEST_FRAMES]
    mean_speed, mean_root = (
        np.array([float(values[number == k].mean()) for k in classes]) for values in (speed, root)
    )
    moving = mean_speed > STANDSTILL_MPS
    exponent = (
        float(np.polyfit(np.log(mean_speed[moving]), np.log(mean_root[moving]), 1)[0])
        if moving.sum() > 1
        else float("nan")
    )
    return SpectrumOverSpeed(
        speed,
        root,
        mean_speed,
        mean_root,
        float(slope),
        float(intercept),
        float(np.sqrt(np.mean(left**2))),
        1.0 - float(left.var() / speed.var()),
        _explained(mean_speed, mean_root),
        exponent,
    )


def _explained(x: FloatArray, y: FloatArray) -> float:
    """Share of the variance of y that a line over x explains; NaN of fewer than three."""
    if len(x) < 3:
        return float("nan")
    return float(np.corrcoef(x, y)[0, 1] ** 2)


class Distances(NamedTuple):
    """Signed errors of the way at the end of a ride, %: by one sum of the speed, two of the acceleration."""

    by_speed: float
    by_acceleration: float


def distances_of(example: CellResult, name: str) -> Distances | None:
    """How the way ends by the two sums that the paper's Fig. 7 compares; None without the states.

    Both are sums along the track, so that a slope counts nothing.
    """
    estimate = example.estimates.get(name)
    if estimate is None or not {ACCELERATION[0], "speed_mps"} <= set(estimate.states.columns):
        return None
    step = 1.0 / example.recording.imu_sheet.rate_hz
    true = example.motion["position_m"].to_numpy()
    way = float(np.abs(np.diff(true)).sum())
    gained = true[-1] - true[0]
    speed, acceleration = (
        estimate.states[column].to_numpy(dtype=np.float64) for column in ("speed_mps", ACCELERATION[0])
    )
    once, twice = step * speed.sum(), step * step * np.cumsum(acceleration).sum()
    return Distances(*(100.0 * (float(one) - gained) / way for one in (once, twice)))
