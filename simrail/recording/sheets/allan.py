"""Allan deviations: closed forms of the error processes of inertial sensors, and of a sampled series.

Notation and coefficients are those of IEEE Std 952: white noise N, bias instability B, rate random
walk K, quantisation Q. The closed forms are those of processes in continuous time; sampled ones agree
where the averaging time is many samples long. Which process a device has is said by its grade
(`simrail.recording.sheets.grades`); samples are drawn by `simrail.sensors.imu_noise`.
"""

import math

import numpy as np

from simrail.core.jit import FloatArray

FLICKER_FLOOR = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""Allan floor of a process with bias instability B, over B (IEEE Std 952): 0.664."""

# Peak of the Allan deviation of a Gauss-Markov process over its standard deviation, and where it lies
# in correlation times. Both follow from `gauss_markov_allan`; a test finds them again. In terms of the
# driving noise q = sigma sqrt(2/T) the peak reads 0.437 q sqrt(T), as printed by IEEE Std 952.
GAUSS_MARKOV_PEAK = 0.6173643
GAUSS_MARKOV_PEAK_AT = 1.8926

STAGE_RATIO = 8.0
"""Largest ratio of neighbouring correlation times in `flicker_stages`."""


def white_allan(averaging_s: FloatArray, density: float) -> FloatArray:
    """N / sqrt(tau): Allan deviation of white noise."""
    allan: FloatArray = density / np.sqrt(averaging_s)
    return allan


def random_walk_allan(averaging_s: FloatArray, coefficient: float) -> FloatArray:
    """K sqrt(tau / 3): Allan deviation of a random walk of the rate."""
    allan: FloatArray = coefficient * np.sqrt(np.asarray(averaging_s) / 3.0)
    return allan


def gauss_markov_allan(averaging_s: FloatArray, *, sd: float, correlation_s: float) -> FloatArray:
    """Allan deviation of a stationary first-order Gauss-Markov process.

    With x = tau/T:  sigma_A^2 = sd^2 (2/x) [1 - (3 - 4 exp(-x) + exp(-2x)) / (2x)]  (IEEE Std 952,
    annex on exponentially correlated noise, with q^2 T/2 = sd^2).

    Parameters
    ----------
    averaging_s : ndarray
        Averaging times tau, s, > 0.
    sd : float
        Standard deviation of the process.
    correlation_s : float
        Correlation time T, s.

    Returns
    -------
    ndarray
        Allan deviation, in the unit of `sd`.
    """
    x = np.asarray(averaging_s, dtype=np.float64) / correlation_s
    # 2x - 3 + 4 exp(-x) - exp(-2x) cancels to 2x^3/3 - x^4/2 for small x.
    bracket = np.where(
        x < 1e-3,
        x**2 / 3.0 - x**3 / 4.0,
        (2.0 * x + 4.0 * np.expm1(-x) - np.expm1(-2.0 * x)) / (2.0 * x),
    )
    allan: FloatArray = sd * np.sqrt(2.0 / x * bracket)
    return allan


def bias_sd(bias_instability: float) -> float:
    """Standard deviation of the Gauss-Markov process whose Allan deviation peaks at the floor 0.664 B.

    sd = 0.6643 B / 0.6174 = 1.076 B: the peak of the process, at 1.89 correlation times, is as high
    as the flat floor that a data sheet's bias instability stands for.
    """
    return bias_instability * FLICKER_FLOOR / GAUSS_MARKOV_PEAK


def flicker_stages(bias_instability: float, range_s: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Gauss-Markov processes whose sum has a flat Allan deviation 0.664 B over a range.

    Flicker noise has the one-sided density B^2 / (pi f). Processes of variance v per unit of ln T, with
    densities 4 v T / (1 + (2 pi f T)^2), sum up to v / f, so v = B^2 / pi: stages a factor r apart have
    the variance B^2 ln(r) / pi each. The first and the last stand for all that are left out beyond them:
    far away the Allan variance of a stage falls like its ratio to tau, so the left-out geometric series
    is worth 1/(r - 1) of the last stage, which is enlarged by it.

    Parameters
    ----------
    bias_instability : float
        B; the floor is 0.664 B (within 2 %, by the closed form).
    range_s : tuple of float
        Shortest and longest averaging time of the flat part.

    Returns
    -------
    correlation_s, sd : ndarray (m,)
        Correlation times, from a fifth of the shortest to twice the longest averaging time, at most
        `STAGE_RATIO` apart, and standard deviations.
    """
    low, high = range_s[0] / 5.0, 2.0 * range_s[1]
    count = math.ceil(math.log(high / low) / math.log(STAGE_RATIO)) + 1
    ratio = (high / low) ** (1.0 / (count - 1))
    variance = np.full(count, bias_instability**2 * math.log(ratio) / math.pi)
    variance[[0, -1]] *= ratio / (ratio - 1.0)
    return low * ratio ** np.arange(count), np.sqrt(variance)


def overlapping_allan(series: FloatArray, rate_hz: float, averaging_s: FloatArray) -> FloatArray:
    """Overlapping Allan deviation of sampled rates.

    With the running sum x and m = tau rate, the mean square of
    (x[k + 2m] - 2 x[k + m] + x[k]) / (sqrt(2) m) over all k.

    Parameters
    ----------
    series : ndarray (n,)
        Uniform samples.
    rate_hz : float
        Their rate.
    averaging_s : ndarray (k,)
        Averaging times, rounded to whole samples; at most half of the series.

    Returns
    -------
    ndarray (k,)
    """
    x = np.concatenate([[0.0], np.cumsum(series - np.mean(series))])
    found = []
    for m in np.rint(np.asarray(averaging_s) * rate_hz).astype(np.int64):
        second = x[2 * m :] - 2.0 * x[m : len(x) - m] + x[: len(x) - 2 * m]
        found.append(np.sqrt(np.mean(second**2) / 2.0) / m)
    return np.array(found)
