"""The fit: all faults at once, beside everything that the sheets leave open, with what it all leaves unknown.

Least squares with priors (the posterior of a Gaussian model, relinearised a few times). Beside the faults it
solves for what a sound ride may have: biases, a body that squats and leans, a map with wrong joints, radii
and cants, rails that are not level where the train stands; each as large as its sheet says. So the standard
deviation of a fault holds what it cannot be told from.

The residuals are no white noise. Each channel's noise is its variance times 1 + 2 sum of its correlations
(Bartlett's weights, over ten seconds): so many blocks are worth one independent one. Residuals beyond three
standard deviations weigh less (Huber).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from simrail.core.jit import FloatArray
from simrail.recording.evidence.line import K3
from simrail.recording.evidence.model import (
    CHANNELS,
    FORCE_X,
    FORCE_Y,
    GLOBALS,
    GYRO_X,
    GYRO_Y,
    GYRO_Z,
    INDEX,
    Motion,
    Ride,
    blocks_of,
    expected,
    inside,
    motion,
)

ROUNDS = 15
"""Relinearisations at most; from a start near by, three or four are enough."""

CORRELATED_S = 10.0
"""Time over which correlations of a residual are summed."""

OUTLIER = 3.0
"""Standard deviations from which on a residual weighs less."""

FREE = {"wheel": 10.0, "shift": 3e3, "offset": 30.0, "drift": 1e-3, "gyro_offset": 30.0, "gyro": 30.0}
"""Prior sds of faults: so wide that they say nothing."""

MOUNT_SD_RAD = 3.0
"""The same of a mounting angle."""

SQUAT_SD = 0.1
"""As `CurveMatchedOdometry.squat_sd`: a body that pitches by 1 deg at 1 m/s2 has 0.17."""

STRETCH_SD = 0.005
"""Of the accelerometer's scale, where its sheet says nothing."""

LEAN_SD = 0.3
"""A body leans out of a curve by some tenths of what its cant leaves: flexibility coefficients of coaches."""

STOP_SD_RAD = 4e-3
"""Of roll and pitch where a train stands, beside the map's: 5 mm of level over two metres."""

BEHIND_SD_M = 1.0
"""How far from a body's reference point the place may be at which it turns, beside what is known of it."""

SLUGGISH_SD_S = 0.5
"""How late a body on springs may roll and pitch; it turns about Z with the track."""

STEPS = {"wheel": 1e-4, "shift": 0.05, "offset": 5e-3, "drift": 1e-6, "gyro_offset": 5e-3}
"""Steps of the differences for the slopes; 1e-5 for the others."""

STILL_MPS = 0.05
"""Slower than this in its mean, a block is one at rest."""


@dataclass(frozen=True)
class Fit:
    """What a fit concludes.

    Attributes
    ----------
    x : ndarray (len(GLOBALS),)
        Parameters.
    covariance : ndarray (len(GLOBALS), len(GLOBALS))
        Theirs, all else unknown.
    cost : float
        Mean of the weighted squares of the residuals, by the noise of the first round: to compare starts.
    explained : ndarray (5,)
        Of each channel, the share of its variance while the train moves that the model explains.
    standing : ndarray (b,)
        Blocks at rest.
    noise : ndarray (2, 5)
        Noise of each channel, moving and at rest.
    """

    x: FloatArray
    covariance: FloatArray
    cost: float
    explained: FloatArray
    standing: np.ndarray
    noise: FloatArray

    def value(self, name: str) -> float:
        """A parameter."""
        return float(self.x[INDEX[name]])

    def sd(self, name: str) -> float:
        """Standard deviation of a parameter."""
        return float(np.sqrt(self.covariance[INDEX[name], INDEX[name]]))

    def by_gyro(self) -> Self:
        """The same with both offsets against the gyro's clock; its own is then the accelerometer's."""
        turn = np.eye(len(GLOBALS))
        offset, apart = INDEX["offset"], INDEX["gyro_offset"]
        turn[offset, apart] = turn[apart, apart] = -1.0
        return replace(self, x=turn @ self.x, covariance=turn @ self.covariance @ turn.T)


def prior_of(ride: Ride) -> FloatArray:
    """Prior standard deviations (len(GLOBALS),) about the values of a sound ride."""
    sheet = ride.recording.imu_sheet
    root3 = np.sqrt(3.0)
    sds = dict.fromkeys(GLOBALS, MOUNT_SD_RAD) | FREE
    sds |= {
        "squat": SQUAT_SD,
        "stretch": float(np.hypot(STRETCH_SD, sheet.accel_scale_error / root3)),
        "lean": LEAN_SD,
        "accel_bias_x": sheet.accel_turn_on_bias_mps2 / root3 + sheet.accel_bias_instability_mps2 + 1e-3,
    }
    sds["accel_bias_y"] = sds["accel_bias_x"]
    # A stop shows the gyro's bias; what its sheet says of it is not needed, and often too small.
    for axis in "xyz":
        sds[f"gyro_bias_{axis}"] = 0.1
    return np.array([sds[name] for name in GLOBALS])


def fit(ride: Ride, start: FloatArray, *, apart: bool = False, noise: FloatArray | None = None) -> Fit:
    """Fit a ride from a start near by.

    Parameters
    ----------
    ride : Ride
        The blocks.
    start : ndarray (len(GLOBALS),)
        First values.
    apart : bool
        Whether gyro and accelerometer may have clocks of their own; else their offset stays as it is.
    noise : ndarray (2, 5), optional
        That of the channels, to begin with.
    """
    nominal = np.array([1.0 if name in ("wheel", "gyro") else 0.0 for name in GLOBALS])
    prior = prior_of(ride)
    x = start.copy()
    if noise is None:
        noise = np.array([0.01, 0.01, 0.01, 0.1, 0.1]) * np.ones((2, 1))
    weights = np.ones_like(ride.measured)
    for round_ in range(ROUNDS):
        seen = inside(ride, x)
        model = expected(ride, x)
        moved = motion(ride, x)
        standing = np.abs(blocks_of(np.abs(moved.speed_mps))) < STILL_MPS
        slopes = _slopes(ride, x, model)
        if not apart:
            slopes[:, :, INDEX["gyro_offset"]] = 0.0
        beside, beside_sd = _nuisance(ride, slopes, _places(ride, x, moved), standing, apart=apart)
        rest = ride.measured - model
        jacobian = np.concatenate([slopes, beside], axis=2)
        sds = np.concatenate([prior, beside_sd])
        scale = noise[standing.astype(np.int64)]
        weight = weights / scale**2 * seen[:, None]
        flat, w = jacobian.reshape(-1, len(sds)), weight.ravel()
        normal = (flat * w[:, None]).T @ flat + np.diag(1.0 / sds**2)
        off = np.concatenate([nominal - x, np.zeros(len(beside_sd))])
        solved = np.linalg.solve(normal, (flat * w[:, None]).T @ rest.ravel() + off / sds**2)
        step = solved[: len(GLOBALS)]
        left = rest - (jacobian @ solved)
        x = x + np.clip(step, -_LONGEST, _LONGEST)
        noise, weights = _noise(ride, left, standing, seen)
        done = bool(np.all(np.abs(step) < 0.01 * np.sqrt(np.diag(np.linalg.inv(normal))[: len(GLOBALS)])))
        if done and round_ >= 3:
            break
    covariance = np.linalg.inv(normal)[: len(GLOBALS), : len(GLOBALS)]
    moving = ~standing & seen
    explained = np.zeros(CHANNELS)
    if moving.sum() >= 4:
        total = ride.measured[moving] - ride.measured[moving].mean(axis=0)
        explained = 1.0 - (left[moving] ** 2).sum(axis=0) / np.maximum((total**2).sum(axis=0), 1e-30)
    sizes = np.where(seen[:, None], np.minimum(np.abs(left / _CLASS), OUTLIER), 0.5)
    return Fit(x, covariance, float(np.mean(sizes**2)), explained, standing, noise)


_CLASS = np.array([0.02, 0.02, 0.003, 0.05, 0.1])
"""Sizes of residuals by which two fits of one ride are compared."""

_LONGEST = np.array(
    [
        {"wheel": 0.2, "shift": 60.0, "offset": 1.0, "drift": 2e-3, "gyro_offset": 1.0}.get(n, 1.0)
        for n in GLOBALS
    ]
)
"""Longest step of a round: a long one leaves where the model is nearly linear."""


def _slopes(ride: Ride, x: FloatArray, model: FloatArray) -> FloatArray:
    """Slopes (b, 5, len(GLOBALS)) of the expected readings."""
    slopes = np.zeros((*model.shape, len(GLOBALS)))
    for i, name in enumerate(GLOBALS[:-CHANNELS]):
        step = STEPS.get(name, 1e-5)
        other = x.copy()
        other[i] += step
        slopes[:, :, i] = (expected(ride, other) - model) / step
    for channel in range(CHANNELS):
        slopes[:, channel, len(GLOBALS) - CHANNELS + channel] = 1.0
    return slopes


class _Places(NamedTuple):
    """Where a sensor is at its stamps, how fast, and how the line bends there (b,)."""

    place: FloatArray
    speed: FloatArray
    bend: FloatArray
    twist: FloatArray


def _places(ride: Ride, x: FloatArray, moved: Motion) -> tuple[_Places, _Places]:
    """Those of the accelerometer and of the gyro."""
    found = []
    for one in (moved, motion(ride, x, turns=True)) if x[INDEX["gyro_offset"]] else (moved,):
        place = blocks_of(one.place_m)
        line = ride.table.at(place)
        found.append(_Places(place, blocks_of(one.speed_mps), line[:, K3], line[:, K3 - 1]))
    return found[0], found[-1]


def _nuisance(
    ride: Ride, slopes: FloatArray, places: tuple[_Places, _Places], standing: np.ndarray, *, apart: bool
) -> tuple[FloatArray, FloatArray]:
    """Slopes (b, 5, m) by what the map and the rails may be wrong, and its sds (m,)."""
    errors, table, recording = ride.recording.map_errors, ride.table, ride.recording
    gravity, base = recording.gravity_mps2, recording.track.rail_base_m
    felt, turned = places
    place = felt.place
    low, high = float(place.min()) - 30.0, float(place.max()) + 30.0
    columns, sds = [], []
    for joint in table.joints(low, high):
        share = np.empty((len(place), CHANNELS))
        share[:, :FORCE_X] = table.moved(joint, turned.place)[:, None]
        share[:, FORCE_X:] = table.moved(joint, place)[:, None]
        columns.append(-share * slopes[:, :, INDEX["shift"]])
        sds.append(max(errors.place_sd_m, 0.3))
    for curve in table.curves_in(low, high):
        share, share_turned = (table.in_curve(int(curve), one.place) for one in places)
        column = np.zeros((len(place), CHANNELS))
        column[:, GYRO_Z] = turned.speed * turned.bend * share_turned
        column[:, FORCE_Y] = felt.speed**2 * felt.bend * share
        column[:, GYRO_Y] = turned.speed * turned.twist * share_turned
        columns.append(column)
        sds.append(errors.radius_relative_sd + 1e-3)
        column = np.zeros((len(place), CHANNELS))
        column[:, FORCE_Y], column[:, GYRO_Y] = gravity * share, turned.speed * turned.bend * share_turned
        column[:, GYRO_X] = np.gradient(share_turned, ride.block_s)
        columns.append(column)
        sds.append(np.hypot(np.hypot(errors.cant_sd_m, errors.cant_along_sd_m), 0.003) / base)
    for first, last in _runs(standing):
        for channel in (FORCE_X, FORCE_Y):
            column = np.zeros((len(place), CHANNELS))
            column[first:last, channel] = gravity
            columns.append(column)
            sds.append(np.hypot(STOP_SD_RAD, errors.cant_along_sd_m / base))
    if apart:
        # A body turns as at its middle, and pushes as at the device: that is a place, and no time.
        column = slopes[:, :, INDEX["shift"]].copy()
        column[:, FORCE_X:] = 0.0
        columns.append(column)
        sds.append(np.hypot(recording.mount_position_m[0], BEHIND_SD_M))
        for channel in (GYRO_X, GYRO_Y):
            column = np.zeros((len(place), CHANNELS))
            column[:, channel] = slopes[:, channel, INDEX["gyro_offset"]]
            columns.append(column)
            sds.append(SLUGGISH_SD_S)
    if not columns:
        return np.zeros((*slopes.shape[:2], 0)), np.zeros(0)
    return np.stack(columns, axis=2), np.array(sds, dtype=np.float64)


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Begin and end of each run of flags that are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _noise(
    ride: Ride, left: FloatArray, standing: np.ndarray, seen: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """Noise (2, 5) of a block, moving and at rest, as the sd of white noise; weights of the blocks (b, 5)."""
    sheet, lags = ride.recording.imu_sheet, max(1, round(CORRELATED_S / ride.block_s))
    floor = np.array(
        3 * [np.hypot(sheet.gyro_noise_radpsqrts / np.sqrt(ride.block_s), sheet.gyro_resolution_radps / 10.0)]
        + 2
        * [np.hypot(sheet.accel_noise_mpsqrts / np.sqrt(ride.block_s), sheet.accel_resolution_mps2 / 10.0)]
    )
    floor = np.maximum(floor, [1e-5, 1e-5, 1e-5, 1e-3, 1e-3])
    noise = np.ones((2, CHANNELS))
    weights = np.ones_like(left)
    for kind, flags in enumerate((~standing & seen, standing & seen)):
        if flags.sum() < 4:
            noise[kind] = noise[0] if kind else 0.05
            continue
        rest = left[flags]
        sd = np.maximum(1.4826 * np.median(np.abs(rest), axis=0), floor)
        clipped = np.clip(rest, -4.0 * sd, 4.0 * sd)
        sd = np.maximum(np.sqrt(np.mean(clipped**2, axis=0)), floor)
        weights[flags] = np.minimum(1.0, OUTLIER * sd / np.maximum(np.abs(rest), 1e-12))
        most = min(lags, len(rest) // 4)
        power = np.mean(clipped**2, axis=0)
        longer = np.ones(CHANNELS)
        for lag in range(1, most + 1):
            with_lag = np.mean(clipped[lag:] * clipped[:-lag], axis=0) / np.maximum(power, 1e-30)
            longer += 2.0 * (1.0 - lag / (most + 1.0)) * with_lag
        noise[kind] = sd * np.sqrt(np.maximum(longer, 1.0))
    return noise, weights
