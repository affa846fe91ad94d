"""How far rails from several rides have to be moved along the track to lie on each other.

Each ride has a position error of its own, which changes slowly along the track. Waves of a few metres show
the difference of two rides' errors far better than either knows its own. What all rides have in common, such
as a curve that the map has at a wrong place, shows in none of them.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded

from simrail.core.jit import FloatArray

NODE_M = 10.0
"""Distance of the nodes between which shifts are linear."""

CORRELATION_M = 100.0
"""Length over which a position error hangs together: an exponential covariance."""

MOST_SHIFT_M = 10.0
"""Greatest constant shift that is looked for."""

UNKNOWN_SD_M = 1.0
"""Of a position error, where a pass does not say."""

ROUNDS = 5
"""Of linearising again; the last ones change nothing that could be seen."""


class Shifts(NamedTuple):
    """Position errors of n passes, less their mean.

    Attributes
    ----------
    shift_m : ndarray (n, places)
        A pass has the rails of place s at s + shift.
    sd_m : ndarray (n, places)
        Of the shift from the mean of all.
    """

    shift_m: FloatArray
    sd_m: FloatArray


def shifts_of(waves: FloatArray, claimed_sd_m: FloatArray, step_m: float) -> Shifts:
    """Find the shifts of passes by least squares of their waves.

    With x_i the waves of pass i, moved by what is known of its shift so far, and m_i the mean of the others,
    both over the scatter of the pass, the next change d minimises

        sum (m_i - x_i - x_i' d)^2 / var(m_i - x_i),

    place by place, which gives each node an information and a change; these are smoothed by the covariance
    c^2 exp(-|s|/CORRELATION_M) of a position error with the claimed sd c. Errors of waves hang together along
    the track: the information is lessened by as much as sums scatter more for that.

    Parameters
    ----------
    waves : ndarray (n, m, places)
        Of n >= 2 passes, m quantities, in the band of a few metres.
    claimed_sd_m : ndarray (n,)
        Root mean square of the position's sd by each pass.
    step_m : float
    """
    n, _, count = waves.shape
    shift = np.zeros((n, count)) + _constant(waves, step_m)[:, None]
    place = step_m * np.arange(count, dtype=np.float64)
    nodes = np.asarray(np.linspace(0.0, place[-1], max(2, round(place[-1] / NODE_M) + 1)), dtype=np.float64)
    splines = [CubicSpline(place, lines, axis=-1) for lines in waves]
    sd = np.zeros((n, count))
    for _ in range(ROUNDS):
        at = np.clip(place + shift, place[0], place[-1])
        moved = np.stack([spline(where) for spline, where in zip(splines, at, strict=True)])
        slope = np.stack([spline(where, 1) for spline, where in zip(splines, at, strict=True)])
        others, scatter = others_of(moved)
        apart = (others - moved) / scatter
        repeated = _repeated(slope / scatter, apart)
        push, info = (slope / scatter * apart).sum(axis=1), np.square(slope / scatter).sum(axis=1)
        own = n / (n - 1.0)  # a pass is apart from the mean of the others by more than from that of all
        for i in range(n):
            summed, known = _at_nodes(push[i], place, nodes), _at_nodes(info[i], place, nodes)
            known_well = own**2 * known / repeated[i]
            pulled = known_well * np.interp(nodes, place, shift[i])
            pulled += known_well * np.divide(summed, own * known, out=np.zeros_like(known), where=known > 0.0)
            values, variance = smoothed(known_well, pulled, claimed_sd_m[i], nodes[1] - nodes[0])
            shift[i], sd[i] = np.interp(place, nodes, values), np.sqrt(np.interp(place, nodes, variance))
        weight = np.square(1.0 / claimed_sd_m)
        shift -= (weight @ shift) / weight.sum()
    return Shifts(shift, sd)


def others_of(lines: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the other passes (n, m, places), and the root mean square of what a pass differs from it."""
    n = len(lines)
    others = (lines.sum(axis=0) - lines) / (n - 1.0)
    for _ in range(3):
        square = np.square(lines - others).mean(axis=-1, keepdims=True)
        least = 1e-6 * np.square(lines).mean(axis=-1, keepdims=True) + 1e-30
        weight = 1.0 / np.maximum(square, least)
        others = ((weight * lines).sum(axis=0) - weight * lines) / (weight.sum(axis=0) - weight)
    scatter: FloatArray = np.sqrt(np.maximum(np.square(lines - others).mean(axis=-1, keepdims=True), least))
    return others, scatter


def alike_of(waves: FloatArray) -> FloatArray:
    """Correlation (n,) of each pass with the mean of the others: the greatest of its quantities.

    Parameters
    ----------
    waves : ndarray (n, m, places)
    """
    others, _ = others_of(waves)
    products = (waves * others).sum(axis=-1)
    norms = np.sqrt(np.square(waves).sum(axis=-1) * np.square(others).sum(axis=-1)) + 1e-300
    alike: FloatArray = (products / norms).max(axis=-1)
    return alike


def _constant(waves: FloatArray, step_m: float) -> FloatArray:
    """Constant shifts (n,), in steps, by the greatest correlation with the first pass, less their median."""
    n, _, count = waves.shape
    reach = min(round(MOST_SHIFT_M / step_m), count // 4)
    unit = waves / np.sqrt(np.square(waves).sum(axis=-1, keepdims=True) + 1e-300)
    spectra = np.fft.rfft(unit, 2 * count, axis=-1)
    first = spectra[0]
    lags = np.zeros(n)
    for i in range(1, n):
        along = np.fft.irfft(spectra[i] * np.conj(first), 2 * count, axis=-1).sum(axis=0)
        along = np.concatenate([along[-reach:], along[: reach + 1]])
        lags[i] = (np.argmax(along) - reach) * step_m
    return lags - np.median(lags)


def _at_nodes(values: FloatArray, place: FloatArray, nodes: FloatArray) -> FloatArray:
    """Sums of values (places,) for the nodes, by the hats of linear interpolation."""
    at = np.clip((place - nodes[0]) / (nodes[1] - nodes[0]), 0.0, len(nodes) - 1.0)
    low = np.minimum(at.astype(np.int64), len(nodes) - 2)
    share = at - low
    sums = np.bincount(low, values * (1.0 - share), len(nodes))
    return np.asarray(sums + np.bincount(low + 1, values * share, len(nodes)))


def _repeated(slope: FloatArray, apart: FloatArray) -> FloatArray:
    """How much more sums of slope times difference scatter than if each place had an own error, (n,).

    Over a length that is long against the waves, the variance of the sum is the integral of the product of
    both power spectra; it is set against that of white lines of the same mean squares.
    """
    both = [np.square(np.abs(np.fft.rfft(lines, axis=-1)[..., 1:])) for lines in (slope, apart)]
    product = (both[0] * both[1]).mean(axis=-1)
    white = both[0].mean(axis=-1) * both[1].mean(axis=-1)
    share = np.square(slope).mean(axis=-1)  # what each quantity adds to the information
    ratio = product / np.maximum(white, 1e-300)
    return np.asarray(np.maximum((share * ratio).sum(axis=-1) / np.maximum(share.sum(axis=-1), 1e-300), 1.0))


def smoothed(info: FloatArray, pulled: FloatArray, sd: float, step_m: float) -> tuple[FloatArray, FloatArray]:
    """Mean and variance (nodes,) of a process of exponential covariance, by what is known at its nodes.

    Parameters
    ----------
    info : ndarray (nodes,)
        Inverse variance of each measurement.
    pulled : ndarray (nodes,)
        Measurement times that.
    sd : float
        Of the process, > 0.
    step_m : float
        Between nodes.
    """
    a = np.exp(-step_m / CORRELATION_M)
    inner = 1.0 / (sd**2 * (1.0 - a**2))
    diagonal = np.full(len(info), (1.0 + a**2) * inner)
    diagonal[[0, -1]] = inner
    banded = np.zeros((2, len(info)))
    banded[0, 1:], banded[1] = -a * inner, diagonal + info
    mean = solveh_banded(banded, pulled)
    return mean, _diagonal_of_inverse(banded[1], -a * inner)


def _diagonal_of_inverse(diagonal: FloatArray, off: float) -> FloatArray:
    """Diagonal of the inverse of a symmetric tridiagonal matrix with equal off-diagonals.

    With u_k = d_k - off^2/u_(k-1) from above and w_k alike from below, the inverse has 1/(u_k + w_k - d_k).
    """
    up, down = diagonal.copy(), diagonal.copy()
    for k in range(1, len(diagonal)):
        up[k] -= off**2 / up[k - 1]
        down[-1 - k] -= off**2 / down[-k]
    inverse: FloatArray = 1.0 / (up + down - diagonal)
    return inverse
