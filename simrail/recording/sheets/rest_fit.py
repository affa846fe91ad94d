"""From a recording at rest to the figures of a sheet: noise, bias instability, random walk, counts.

The Allan variance of each axis, at averaging times an octave apart, is fitted by a sum of terms that are
linear in the squares of their coefficients (IEEE Std 952): N^2 / tau, B^2 times a floor, K^2 tau / 3 and
3 Q^2 / tau^2, none of them negative. Each point has the weight of its own scatter, from its equivalent
degrees of freedom. The floor is flat (1/f noise) or that of a Gauss-Markov process, whichever fits the three
axes better; its correlation time is searched for on a grid.

What a recording is too short for is said: a coefficient that is not three standard deviations above zero has
an upper bound only.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import nnls

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.recording.sheets.allan import (
    FLICKER_FLOOR,
    bias_sd,
    gauss_markov_allan,
    overlapping_allan,
)

TERMS = ("noise", "bias_instability", "random_walk", "quantisation")
"""N, B, K and Q of IEEE Std 952."""

SHORTEST_S = 60.0
"""A shorter rest shows white noise only, and the detector of motion nothing."""

SEEN = 3.0
"""Standard deviations that the square of a coefficient must be above zero to be told as seen."""

WIDER = 1.25
"""Neighbouring octaves share samples: intervals are wider by this than if they did not (by simulation)."""

WIDER_SEARCHED = 2.0
"""The same of the bias instability where its correlation time was searched for."""

WIDER_WALK = 1.6
"""The same of the random walk, which the longest times alone show (by simulation)."""

SEARCHED = 2.0
"""What a correlation time must lower the misfit by, to be told from 1/f noise, for each triad."""

FIRST_OFF = 0.1
"""Share by which one of the three shortest averaging times may be off before the first is left out."""

SHORTEST_CORRELATION_S = 5.0
"""What correlates for a shorter time is no wandering of a bias, but a filter of the device."""

STILL = {"gyro": 5e-3, "accel": 5e-2}
"""Standard deviation of means over a second, rad/s and m/s2, above which a device is not at rest: sensors of
consumer grade stay below a fifth of it, a train that moves is above."""

SUDDEN = 15.0
"""A second that differs from the last by so many standard deviations (by the median) is a motion."""

GRAVITY_MPS2 = (9.3, 10.3)
"""Size of the mean specific force at rest, with the biases of consumer devices."""

_COLUMNS = {"gyro": GYRO, "accel": ACCEL}


@dataclass(frozen=True)
class Fitted:
    """One coefficient of one axis.

    Attributes
    ----------
    value, low, high : float
        The coefficient in SI and its 95 % interval; of one that is not seen, 0, 0 and its upper bound.
    """

    value: float
    low: float
    high: float

    @property
    def seen(self) -> bool:
        """Whether it is told from nothing."""
        return self.value > 0.0


@dataclass(frozen=True)
class TriadFit:
    """What a rest says of one triad.

    Attributes
    ----------
    axes : tuple of dict
        `Fitted` by `TERMS`, of the axes x, y, z.
    correlation_s : float, optional
        Correlation time of the wandering bias; None for 1/f noise, or where no bias is seen.
    flat_s : tuple of float
        Shortest and longest averaging time that were fitted.
    count : float
        Size of one count of the values, SI; 0 where they have none.
    """

    axes: tuple[dict[str, Fitted], ...]
    correlation_s: float | None
    flat_s: tuple[float, float]
    count: float

    def mean(self, term: str) -> float:
        """Root mean square of a coefficient over the axes on which it is seen; 0 if on none."""
        seen = [axis[term].value for axis in self.axes if axis[term].seen]
        return math.sqrt(sum(value**2 for value in seen) / len(seen)) if seen else 0.0


def fit_rest(imu: pd.DataFrame, rate_hz: float) -> dict[str, TriadFit]:
    """Fit the figures of a device to its recording at rest.

    Parameters
    ----------
    imu : pandas.DataFrame
        Indexed by ``time_s``, uniform; columns `simrail.core.columns.IMU`, on any axes.
    rate_hz : float
        Rate of its samples.

    Returns
    -------
    dict of str to TriadFit
        ``"gyro"`` and ``"accel"``.

    Raises
    ------
    InputError
        If it is shorter than `SHORTEST_S`, or not at rest.
    """
    check_rest(imu, rate_hz)
    tried = {kind: _fit_triad(imu[list(columns)].to_numpy(), rate_hz) for kind, columns in _COLUMNS.items()}
    # A sheet names one process for both triads; a correlation time is one parameter more of each.
    wanders = sum(one[True].misfit - one[False].misfit for one in tried.values()) < -2.0 * SEARCHED * len(
        tried
    )
    return {kind: one[wanders].fit for kind, one in tried.items()}


def check_rest(imu: pd.DataFrame, rate_hz: float) -> None:
    """Refuse a recording in which the device moves, by its means over seconds.

    Raises
    ------
    InputError
        If its specific force is not gravity, its means over seconds scatter as those of a train that moves,
        or one of them leaps; or if it is too short.
    """
    each = max(1, round(rate_hz))
    size = float(np.linalg.norm(imu[list(ACCEL)].to_numpy().mean(axis=0)))
    if not GRAVITY_MPS2[0] < size < GRAVITY_MPS2[1]:
        raise InputError(
            "is not as large as gravity: the unit is another, or the device moves",
            field="imu.accel",
            value=f"{size:.4g} m/s2 in the mean",
            limit=f"{GRAVITY_MPS2[0]:g} to {GRAVITY_MPS2[1]:g} m/s2",
            remedy="mend units.accel",
        )
    for kind, columns in _COLUMNS.items():
        for column in columns:
            values = imu[column].to_numpy()
            whole = len(values) // each * each
            means = values[:whole].reshape(-1, each).mean(axis=1)
            steps = np.diff(means) if len(means) > 1 else np.zeros(1)
            usual = 1.4826 * float(np.median(np.abs(steps))) + 2e-2 * STILL[kind]
            worst = int(np.argmax(np.abs(steps)))
            scatter = float(np.std(steps)) / math.sqrt(2.0)
            if scatter > STILL[kind] or abs(steps[worst]) > SUDDEN * usual:
                raise InputError(
                    f"is not at rest at time_s = {float(imu.index[(worst + 1) * each]):.6g}",
                    field=f"imu.{column}",
                    value=f"{abs(steps[worst]):.3g} from one second's mean to the next",
                    limit=f"{min(SUDDEN * usual, 3.0 * STILL[kind]):.3g}",
                    remedy="cut the recording to where the device stands still on a quiet base",
                )
    seconds = len(imu) / rate_hz
    if seconds < SHORTEST_S:
        raise InputError(
            "is too short to fit noise to",
            field="imu",
            value=f"{seconds:.3g} s",
            limit=f">= {SHORTEST_S:g} s; an hour shows most bias instabilities",
            remedy="record the device at rest for longer",
        )


class _Tried(NamedTuple):
    """A fit of one triad with one kind of floor, and how far it is from the points."""

    misfit: float
    fit: TriadFit


def _fit_triad(values: FloatArray, rate_hz: float) -> dict[bool, _Tried]:
    """Fits with a flat floor (False) and with that of a Gauss-Markov process (True)."""
    numbers = 2 ** np.arange(int(np.log2(len(values) / 6.0)) + 1)
    taus = numbers / rate_hz
    scatter = np.array([_freedom(len(values), int(m)) for m in numbers])
    all_ = np.array([overlapping_allan(values[:, axis], rate_hz, taus) ** 2 for axis in range(3)])
    first = 0
    while True:
        tried = {
            wanders: _best_of(floors, all_[:, first:], taus[first:], scatter[first:], values, rate_hz)
            for wanders, floors in _floors(taus[first:], len(values) / rate_hz).items()
        }
        off = min(one.first_off for one in tried.values())
        # A filter of the device correlates neighbouring samples: the shortest times show it, not the noise.
        if off < max(FIRST_OFF, 5.0 * math.sqrt(2.0 / scatter[first])) or len(taus) - first <= 8:
            return {wanders: _Tried(one.misfit, one.fit) for wanders, one in tried.items()}
        first += 1


class _Best(NamedTuple):
    misfit: float
    first_off: float
    fit: TriadFit


def _floors(tau: FloatArray, seconds: float) -> dict[bool, list[tuple[float | None, FloatArray]]]:
    """Floors of unit bias instability: the flat one, and those of correlation times that can be seen."""
    least = max(8.0 * tau[0], SHORTEST_CORRELATION_S)
    searched = np.geomspace(least, max(seconds / 5.0, 2.0 * least), 60)
    return {
        False: [(None, np.full(len(tau), FLICKER_FLOOR**2))],
        True: [
            (float(time), gauss_markov_allan(tau, sd=bias_sd(1.0), correlation_s=float(time)) ** 2)
            for time in searched
        ],
    }


def _best_of(
    floors: list[tuple[float | None, FloatArray]],
    variances: FloatArray,
    tau: FloatArray,
    freedom: FloatArray,
    values: FloatArray,
    rate_hz: float,
) -> _Best:
    misfit, time, found = math.inf, None, []
    for correlation, floor in floors:
        terms = np.column_stack([1.0 / tau, floor, tau / 3.0, 3.0 / tau**2])
        fits = [_fit_axis(variance, terms, freedom) for variance in variances]
        total = sum(one.misfit for one in fits)
        if total < misfit:
            misfit, time, found = total, correlation, fits
    count = count_of(values)
    widened = np.array([1.0, WIDER_SEARCHED if time else 1.0, WIDER_WALK, 1.0])
    axes = tuple(_coefficients(one.squares, one.sds * widened, count**2 / (12.0 * rate_hz)) for one in found)
    seen = any(axis["bias_instability"].seen for axis in axes)
    fit = TriadFit(axes, time if seen else None, (float(tau[0]), float(tau[-1])), count)
    return _Best(misfit, max(one.first_off for one in found), fit)


class _AxisFit(NamedTuple):
    squares: FloatArray
    sds: FloatArray
    misfit: float
    first_off: float


def _fit_axis(variance: FloatArray, terms: FloatArray, freedom: FloatArray) -> _AxisFit:
    """Squares of the coefficients (4,) by weighted least squares without negative ones, and their scatter."""
    model, squares = variance, np.zeros(terms.shape[1])
    scale = terms.max(axis=0)
    for _ in range(6):
        # Relative scatter of a variance with f degrees of freedom: sqrt(2 / f).
        weight = np.sqrt(freedom / 2.0) / model
        squares = nnls(terms / scale * weight[:, None], variance * weight)[0] / scale
        model = np.maximum(terms @ squares, 1e-3 * variance)
    weight = np.sqrt(freedom / 2.0) / model
    scaled = terms / scale * weight[:, None]
    active = squares > 0.0
    sds = np.zeros(len(squares))
    if active.any():
        inner = np.linalg.pinv(scaled[:, active].T @ scaled[:, active])
        sds[active] = np.sqrt(np.diag(inner))
    for term in np.flatnonzero(~active):
        sds[term] = 1.0 / math.sqrt(float(scaled[:, term] @ scaled[:, term]))
    likelihood = float(np.sum(freedom * (variance / model - 1.0 - np.log(variance / model))))
    first_off = float(np.abs(variance[:3] / model[:3] - 1.0).max())
    return _AxisFit(squares, WIDER * sds / scale, likelihood, first_off)


def _coefficients(squares: FloatArray, sds: FloatArray, rounding: float) -> dict[str, Fitted]:
    found = {}
    # Counts of a rate are white noise; those of an angle are the term Q itself.
    less = 0.0 if squares[3] > SEEN * sds[3] else rounding
    for term, square, sd in zip(TERMS, squares, sds, strict=True):
        value = max(float(square) - (less if term == "noise" else 0.0), 0.0)
        if value < SEEN * sd:
            found[term] = Fitted(0.0, 0.0, math.sqrt(value + 1.96 * sd))
            continue
        low, high = max(value - 1.96 * sd, 0.0), value + 1.96 * sd
        found[term] = Fitted(math.sqrt(value), math.sqrt(low), math.sqrt(high))
    return found


def count_of(values: FloatArray) -> float:
    """Size of one count: the least step, if all steps are whole numbers of it; 0 if they are not."""
    steps = np.abs(np.diff(values[:200_000], axis=0)).ravel()
    steps = steps[steps > 0.0]
    if not len(steps):
        return 0.0
    # A mean of those of one count takes off what decimals and a unit add.
    least = float(steps.min())
    least = float(np.mean(steps[steps < 1.5 * least]))
    counts = steps / least
    near = np.abs(counts - np.rint(counts)) < 0.05
    return least if float(np.mean(near[counts < 10.0])) > 0.99 else 0.0


def _freedom(count: int, m: int) -> float:
    """Equivalent degrees of freedom of an overlapping Allan variance over m samples: least of three noises.

    White noise, 1/f noise and random walk of the rate, after Howe, Allan and Barnes (1981), by memory.
    """
    n = count + 1
    white = (3.0 * (n - 1) / (2.0 * m) - 2.0 * (n - 2) / n) * 4.0 * m**2 / (4.0 * m**2 + 5.0)
    flicker = 2.0 * (n - 2) / (2.3 * n - 4.9) * n if m == 1 else 5.0 * n**2 / (4.0 * m * (n + 3.0 * m))
    walk = (n - 2) / m * ((n - 1) ** 2 - 3.0 * m * (n - 1) + 4.0 * m**2) / (n - 3) ** 2
    return max(min(white, flicker, walk), 1.0)
