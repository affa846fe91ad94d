"""The fit: all faults at once, beside everything that the sheets leave open, with what it all leaves unknown.

Least squares with priors (the posterior of a Gaussian model, relinearised a few times). Beside the faults it
solves for what a sound ride may have: biases, a body that squats and leans, a map with wrong joints, radii
and cants, rails that are not level where the train stands; each as large as its sheet says. So the standard
deviation of a fault holds what it cannot be told from.

The residuals are no white noise. Each channel's noise is its variance times 1 + 2 sum of its correlations
(Bartlett's weights, over ten seconds): so many blocks are worth one independent one. Residuals beyond three
standard deviations weigh less (Huber).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from simrail.core.jit import FloatArray, IntArray
from simrail.recording.evidence.line import K3
from simrail.recording.evidence.model import (
    ACCEL_GAIN,
    CHANNELS,
    CUTS,
    FORCE_X,
    FORCE_Y,
    GAINS,
    GLOBALS,
    GYRO_X,
    GYRO_Y,
    GYRO_Z,
    INDEX,
    LATES,
    PACE,
    RAMPS,
    SINGLE,
    SLOW,
    THEN,
    TURNS,
    Motion,
    Ride,
    blocks_of,
    inside,
    motion,
    start_values,
)
from simrail.recording.evidence.readings import readings, slopes

ROUNDS = 15
"""Relinearisations at most; from a start near by, three or four are enough."""

LESS_NOISE = 0.95
"""Share of the noise that is left, above which nothing hid in it."""

CORRELATED_S = 10.0
"""Time over which correlations of a residual are summed."""

OUTLIER = 3.0
"""Standard deviations from which on a residual weighs less."""

FREE = {"wheel": 10.0, "shift": 3e3, "offset": 30.0, "drift": 1e-3, "gyro_offset": 30.0, "gyro": 30.0}
FREE |= dict.fromkeys((*GAINS, PACE, ACCEL_GAIN, *LATES, *SLOW, *RAMPS, *CUTS), 30.0)
FREE |= dict.fromkeys((*TURNS, *THEN), 3.0)
"""Prior sds of faults: so wide that they say nothing."""

HELD = ("gyro_offset", *SINGLE, *RAMPS, *CUTS, *THEN)
"""Parameters that stay as they are where a fit does not set them free."""

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
"""How far from a body's reference point the place may be at which it turns, beside what is known of it. An
axle turns with what holds it by its primary springs: a bogie, of half a wheelbase of 0.9 to 1.3 m, or a
two-axle wagon, whose 3 m are three of these and are still explained better by a place than by a clock."""

SLUGGISH_SD_S = 0.5
"""How late a body on springs may roll and pitch; it turns about Z with the track."""

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
    weights : ndarray (b, 5)
        Weights of the blocks, below 1 for those that are far off.
    left : ndarray (b, 5)
        Residuals; nothing where the device of the way tells of none.
    strain : float
        Squares of what else is open, by its prior sds, summed.
    """

    x: FloatArray
    covariance: FloatArray
    cost: float
    explained: FloatArray
    standing: np.ndarray
    noise: FloatArray
    weights: FloatArray
    left: FloatArray
    strain: float

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


def fit(
    ride: Ride,
    start: FloatArray,
    *,
    free: Sequence[str] = (),
    noise: FloatArray | None = None,
    rounds: int = ROUNDS,
) -> Fit:
    """Fit a ride from a start near by.

    Parameters
    ----------
    ride : Ride
        The blocks.
    start : ndarray (len(GLOBALS),)
        First values.
    free : sequence of str
        Which of `HELD` are solved for, too; the others stay as they are.
    noise : ndarray (2, 5), optional
        That of the channels, to begin with.
    rounds : int
        Relinearisations at most.
    """
    prior, x = prior_of(ride), start.copy()
    if noise is None:
        noise = np.array([0.01, 0.01, 0.01, 0.1, 0.1]) * np.ones((2, 1))
    weights = np.ones_like(ride.measured)
    for round_ in range(rounds):
        near = linear(ride, x, noise, weights, free)
        here, seen, standing, count = near.solved_for, near.seen, near.standing, len(near.solved_for)
        normal, right = near.normal()
        solved = np.linalg.solve(normal, right)
        step = solved[:count]
        left = near.rest - (near.jacobian @ solved)
        x[here] += np.clip(step, -_LONGEST[here], _LONGEST[here])
        noise, weights = _noise(ride, left, standing, seen)
        done = bool(np.all(np.abs(step) < 0.01 * np.sqrt(np.diag(np.linalg.inv(normal))[:count])))
        if done and round_ >= 3:
            break
    covariance = np.diag(prior**2)
    covariance[np.ix_(here, here)] = np.linalg.inv(normal)[:count, :count]
    strain = float(np.sum(((solved - near.off) / near.sds) ** 2))
    moving = ~standing & seen
    explained = np.zeros(CHANNELS)
    if moving.sum() >= 4:
        total = ride.measured[moving] - ride.measured[moving].mean(axis=0)
        explained = 1.0 - (left[moving] ** 2).sum(axis=0) / np.maximum((total**2).sum(axis=0), 1e-30)
    sizes = np.where(seen[:, None], np.minimum(np.abs(left / _CLASS), OUTLIER), 0.5)
    cost, left = float(np.mean(sizes**2)), left * seen[:, None]
    return Fit(x, covariance, cost, explained, standing, noise, weights, left, strain)


class Near(NamedTuple):
    """A ride near some parameters, as linear in what is solved for.

    Attributes
    ----------
    solved_for : ndarray (m,)
        Which parameters; behind them come what the map and the rails may be wrong, k in all.
    jacobian : ndarray (b, 5, k)
        Slopes of the readings.
    rest : ndarray (b, 5)
        Measured less expected.
    weight : ndarray (b, 5)
        Over squares of the noise.
    sds, off : ndarray (k,)
        Prior sds, and how far from here their means are.
    seen, standing : ndarray (b,)
        Blocks of which the device of the way tells; blocks at rest.
    """

    solved_for: IntArray
    jacobian: FloatArray
    rest: FloatArray
    weight: FloatArray
    sds: FloatArray
    off: FloatArray
    seen: np.ndarray
    standing: np.ndarray

    def column(self, name: str) -> int:
        """Column of a parameter that is solved for."""
        return int(np.flatnonzero(self.solved_for == INDEX[name])[0])

    def only(self, columns: IntArray) -> Self:
        """The same with some of what is solved for, in that order."""
        return self._replace(
            jacobian=self.jacobian[:, :, columns], sds=self.sds[columns], off=self.off[columns]
        )

    def weighed(self, noise: FloatArray, weights: FloatArray) -> Self:
        """The same with another noise."""
        weight = weights / noise[self.standing.astype(np.int64)] ** 2 * self.seen[:, None]
        return self._replace(weight=weight)

    def normal(self) -> tuple[FloatArray, FloatArray]:
        """Normal matrix (k, k) and right side (k,) of the posterior's mean."""
        flat, w = self.jacobian.reshape(-1, len(self.sds)), self.weight.ravel()
        weighted = (flat * w[:, None]).T
        right = weighted @ self.rest.ravel() + self.off / self.sds**2
        return weighted @ flat + np.diag(1.0 / self.sds**2), right


def linear(ride: Ride, x: FloatArray, noise: FloatArray, weights: FloatArray, free: Sequence[str]) -> Near:
    """A ride as it is near some parameters, for a noise, weights and what is free as `fit` has them."""
    solved_for = np.array([i for i, name in enumerate(GLOBALS) if name not in HELD or name in free])
    seen, here, moved = inside(ride, x), readings(ride, x), motion(ride, x)
    standing = np.abs(blocks_of(np.abs(moved.speed_mps))) < STILL_MPS
    by_all = slopes(ride, x, here, solved_for)
    beside, beside_sd = _nuisance(ride, by_all, _places(ride, x, moved), standing, free=free)
    return Near(
        solved_for,
        np.concatenate([by_all[:, :, solved_for], beside], axis=2),
        ride.measured - here.expected,
        weights / noise[standing.astype(np.int64)] ** 2 * seen[:, None],
        np.concatenate([prior_of(ride)[solved_for], beside_sd]),
        np.concatenate([(start_values() - x)[solved_for], np.zeros(len(beside_sd))]),
        seen,
        standing,
    )


def hints(
    ride: Ride, found: Fit, names: Sequence[str], *, free: Sequence[str] = ()
) -> dict[str, tuple[float, float]]:
    """What a fit would find if one more parameter were free, and its sd: by one step from where it ended.

    Parameters
    ----------
    ride : Ride
        The blocks.
    found : Fit
        Of them.
    names : sequence of str
        Which of `HELD` may be free, one at a time.
    free : sequence of str
        Those that were free in the fit.
    """
    near = linear(ride, found.x, found.noise, found.weights, (*free, *names))
    columns = {name: near.column(name) for name in names}
    others = np.setdiff1d(np.arange(len(near.sds)), list(columns.values()))
    told = {}
    for name, column in columns.items():
        part = near.only(np.append(others, column))
        # What is wrong makes noise of its own, and would hide behind it: the noise is taken again without it.
        before = found.noise
        for _ in range(3):
            normal, right = part.normal()
            inverse = np.linalg.inv(normal)
            solved = inverse @ right
            noise, weights = _noise(ride, part.rest - part.jacobian @ solved, part.standing, part.seen)
            if np.all(noise > LESS_NOISE * before):
                break
            part, before = part.weighed(noise, weights), noise
        told[name] = (found.value(name) + float(solved[-1]), float(np.sqrt(inverse[-1, -1])))
    return told


_CLASS = np.array([0.02, 0.02, 0.003, 0.05, 0.1])
"""Sizes of residuals by which two fits of one ride are compared."""

_FAR = {"wheel": 0.2, "shift": 60.0, "drift": 2e-3, PACE: 0.2} | dict.fromkeys(CUTS, 0.1)
_LONGEST = np.array([_FAR.get(name, 1.0) for name in GLOBALS])
"""Longest step of a round: a long one leaves where the model is nearly linear."""


class _Places(NamedTuple):
    """Where a sensor is at its stamps, how fast, and how the line bends there (b,)."""

    place: FloatArray
    speed: FloatArray
    bend: FloatArray
    twist: FloatArray


def _places(ride: Ride, x: FloatArray, moved: Motion) -> tuple[_Places, _Places]:
    """Those of the accelerometer and of the gyro."""
    found = []
    later = float(x[INDEX["gyro_offset"]])
    for one in (moved, motion(ride, x, later_s=later)) if later else (moved,):
        place = blocks_of(one.place_m)
        line = ride.table.at(place)
        found.append(_Places(place, blocks_of(one.speed_mps), line[:, K3], line[:, K3 - 1]))
    return found[0], found[-1]


def _nuisance(
    ride: Ride,
    slopes: FloatArray,
    places: tuple[_Places, _Places],
    standing: np.ndarray,
    *,
    free: Sequence[str],
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
    for _, last, way in ride.slides:
        # Behind a slide the way of the wheel is off by what it lost.
        column = slopes[:, :, INDEX["shift"]].copy()
        column[:last] = 0.0
        columns.append(column)
        sds.append(max(way, 1.0))
    # What holds a body turns as at its own middle, and the body rolls and pushes where it is: that is a
    # place, and no time.
    column = np.zeros((len(place), CHANNELS))
    column[:, GYRO_Z] = slopes[:, GYRO_Z, INDEX["shift"]]
    columns.append(column)
    sds.append(np.hypot(recording.mount_position_m[0], BEHIND_SD_M))
    if "gyro_offset" in free:
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
        lag = np.arange(most + 1)
        later = sliding_window_view(np.vstack([clipped, np.zeros((most, CHANNELS))]), most + 1, axis=0)
        with_lag = np.einsum("nc,ncl->cl", clipped, later) / (len(rest) - lag)
        share = with_lag / np.maximum(with_lag[:, :1], 1e-30)
        longer = share @ ((1.0 + (lag > 0)) * (1.0 - lag / (most + 1.0)))
        noise[kind] = sd * np.sqrt(np.maximum(longer, 1.0))
    return noise, weights
