"""Ride comfort: the mean comfort N_MV of EN 12299 and Sperling's ride index Wz, from accelerations.

**N_MV** (EN 12299, mean comfort standard method): the acceleration on the floor is weighted with W_d along X
and Y and with W_b along Z, its rms taken over periods of 5 s, and of these the 95th percentile of each axis:
N_MV = 6 sqrt(a_X95^2 + a_Y95^2 + a_Z95^2). Below 1.5 a ride is very comfortable, above 4.5 it is not.

The weightings are H(s) = high-pass, low-pass (both Butterworth, second order), acceleration to velocity
transition, and for W_b an upward step, all in one cascade. With w_i = 2 pi f_i:

    H(s) =        s^2              w_2^2            w_4^2 (s/w_3 + 1)          s^2/w_5^2 + s/(Q_5 w_5) + 1
           ----------------- . ----------------- . ------------------------- K ----------------------------
           s^2+s w_1/Q_1+w_1^2 s^2+s w_2/Q_1+w_2^2  s^2 + s w_4/Q_4 + w_4^2    s^2/w_6^2 + s/(Q_6 w_6) + 1

f_1 = 0.4 Hz, f_2 = 100 Hz, Q_1 = 1/sqrt(2). W_d: f_3 = f_4 = 2 Hz, Q_4 = 0.63, K = 1, no step; this is also
the W_d of ISO 2631-1 and of ISO 8041-1 (Table B.3). W_b: f_3 = f_4 = 16 Hz, Q_4 = 0.63, f_5 = 2.5 Hz,
f_6 = 4 Hz, Q_5 = Q_6 = 0.8, K = 0.4, as two public programs after EN 12299 have it (comfpy, in github's
tobias-bettinger/comfpy, and pyridy); the text of the standard could not be read. The W_b of BS 6841 and of
ISO 8041-1 (Table B.1) is another one, with Q_4 = 0.55, Q_5 = 0.9 and Q_6 = 0.95 in the same formula
(`W_B_ISO_8041`): by up to 8 % more at 6 Hz, and by up to 12 % less at 25 Hz.

**Wz** for comfort: Wz = 4.42 a_w^0.3 with a_w the rms of the acceleration weighted by Sperling's

    B(f) = k sqrt( (1.911 f^2 + (0.25 f^2)^2) / ((1 - 0.277 f^2)^2 + (1.563 f - 0.0368 f^3)^2) ),

k = 0.588 vertical, 0.737 lateral, f in Hz, a_w in m/s2 (Garg and Dukkipati 1984; Gangadharan et al. 2004,
Eqs. 7 and 8; as comfpy has it). For a sine of amplitude A in cm/s2 it is the older form (A^2 B^2)^(1/6.67),
of which 4.42 is the factor 100^0.3 2^0.15. From memory: k = 0.737 (programs found take 0.735, 1.25 times
0.588, which is 0.002 less of a Wz of 2.5), and the customary band of 0.5 to 30 Hz. Other variants of the same
name are *not* this one: Sperling's ride index for vehicles has another B(f), and GB/T 5599 reckons
W = 3.57 (A^3 F(f) / f)^0.1 with a table F(f).
"""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

PERIOD_S = 5.0
PERCENTILE = 95.0
LEAST_RATE_HZ = 200.0
"""Lowest rate: weightings reach up to 100 Hz."""

_SETTLING_S = 10.0
"""After this time a weighting has forgotten what was before: it is their slowest part, 0.4 Hz, 25 times."""

SPERLING_FACTOR = {"vertical": 0.588, "lateral": 0.737}
SPERLING_BAND_HZ = (0.5, 30.0)

ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True)
class Weighting:
    """A frequency weighting; see the module for the formula.

    Attributes
    ----------
    transition_hz : float
        f_3 = f_4.
    gain : float
        K.
    step_hz : tuple of float, optional
        (f_5, f_6) of the upward step.
    transition_q : float
        Q_4.
    step_q : tuple of float
        (Q_5, Q_6).
    """

    transition_hz: float
    gain: float = 1.0
    step_hz: tuple[float, float] | None = None
    transition_q: float = 0.63
    step_q: tuple[float, float] = (0.8, 0.8)

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response (n,) at frequencies (n,)."""
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        w1, w2, w3 = (2.0 * np.pi * f for f in (0.4, 100.0, self.transition_hz))
        high = s**2 / (s**2 + np.sqrt(2.0) * w1 * s + w1**2)
        low = w2**2 / (s**2 + np.sqrt(2.0) * w2 * s + w2**2)
        transition = w3**2 * (s / w3 + 1.0) / (s**2 + s * w3 / self.transition_q + w3**2)
        response: ComplexArray = self.gain * high * low * transition
        if self.step_hz is not None:
            up, down = (s / (2.0 * np.pi * f) for f in self.step_hz)
            above, below = self.step_q
            response = response * (up**2 + up / above + 1.0) / (down**2 + down / below + 1.0)
        return response


W_B = Weighting(transition_hz=16.0, gain=0.4, step_hz=(2.5, 4.0))
"""Vertical, for ride comfort in trains (EN 12299)."""
W_B_ISO_8041 = replace(W_B, transition_q=0.55, step_q=(0.9, 0.95))
"""Vertical, in BS 6841 and ISO 8041-1: another one of the same name."""
W_D = Weighting(transition_hz=2.0)
"""Longitudinal and lateral."""


def weighted(acceleration: FloatArray, rate_hz: float, weighting: Weighting) -> FloatArray:
    """Weight an acceleration (n,), m/s2, exactly at every frequency below half the rate.

    The spectrum is multiplied with the response of the analogue filter: no bilinear transform bends it. The
    record counts from its first value, so that gravity does not ring, and is followed by zeros, so that its
    end does not run into its beginning.

    Raises
    ------
    InputError
        If the rate is below `LEAST_RATE_HZ`.
    """
    _judge_rate(rate_hz)
    n = len(acceleration) + int(_SETTLING_S * rate_hz)
    spectrum = np.fft.rfft(acceleration - acceleration[0], n)
    spectrum *= weighting.response(_frequencies(n, rate_hz))
    result: FloatArray = np.fft.irfft(spectrum, n)[: len(acceleration)]
    return result


def period_rms(values: FloatArray, rate_hz: float, *, period_s: float = PERIOD_S) -> FloatArray:
    """Root mean square (k,) over each whole period of time, one after the other."""
    length = round(period_s * rate_hz)
    whole = len(values) // length
    blocks = values[: whole * length].reshape(whole, length)
    rms: FloatArray = np.sqrt(np.mean(blocks**2, axis=1))
    return rms


@dataclass(frozen=True)
class MeanComfort:
    """Mean comfort of EN 12299.

    Attributes
    ----------
    n_mv : float
        The index.
    a_x_mps2, a_y_mps2, a_z_mps2 : float
        95th percentiles of the weighted rms accelerations.
    periods : int
        Periods of 5 s; EN 12299 asks for 60, five minutes, or a multiple.
    """

    n_mv: float
    a_x_mps2: float
    a_y_mps2: float
    a_z_mps2: float
    periods: int


def mean_comfort(acceleration: FloatArray, rate_hz: float, *, counts: npt.NDArray[np.bool_]) -> MeanComfort:
    """Mean comfort N_MV.

    Parameters
    ----------
    acceleration : ndarray (n, 3)
        Along X, Y, Z of the body, m/s2; constant parts do not matter.
    rate_hz : float
        Rate.
    counts : ndarray (n,) of bool
        Where the vehicle runs: a period counts if it does throughout.

    Raises
    ------
    InputError
        If the rate is below `LEAST_RATE_HZ`, or no period counts.
    """
    rms = [
        period_rms(weighted(acceleration[:, axis], rate_hz, weighting), rate_hz)
        for axis, weighting in enumerate((W_D, W_D, W_B))
    ]
    running = period_rms(counts.astype(np.float64), rate_hz) == 1.0
    if not running.any():
        raise InputError(
            "the vehicle does not run for one period of 5 s",
            field="ride_comfort",
            remedy="ride farther",
            limit=">= 5 s of riding",
        )
    x, y, z = (float(np.percentile(one[running], PERCENTILE)) for one in rms)
    return MeanComfort(6.0 * float(np.sqrt(x**2 + y**2 + z**2)), x, y, z, int(running.sum()))


def sperling_weighting(frequency_hz: FloatArray, direction: Literal["vertical", "lateral"]) -> FloatArray:
    """Sperling's B(f) for comfort (n,) at frequencies (n,) in Hz."""
    square = np.asarray(frequency_hz, dtype=np.float64) ** 2
    above = 1.911 * square + (0.25 * square) ** 2
    below = (1.0 - 0.277 * square) ** 2 + square * (1.563 - 0.0368 * square) ** 2
    weighting: FloatArray = SPERLING_FACTOR[direction] * np.sqrt(above / below)
    return weighting


def sperling(
    acceleration: FloatArray,
    rate_hz: float,
    direction: Literal["vertical", "lateral"],
    *,
    band_hz: tuple[float, float] = SPERLING_BAND_HZ,
) -> float:
    """Sperling's Wz for comfort of an acceleration (n,), m/s2, over the whole of it.

    1 is just noticeable, 2 clearly, 3 still tolerable, 4 extremely unpleasant.
    """
    _judge_rate(rate_hz)
    n = len(acceleration)
    frequency = _frequencies(n, rate_hz)
    spectrum = np.abs(np.fft.rfft(acceleration - np.mean(acceleration))) / n
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    lines = spectrum[inside] * sperling_weighting(frequency[inside], direction)
    # Each line but that of zero stands for two of the whole spectrum: of a sine of amplitude A, A/2 each.
    mean_square = float(2.0 * np.sum(lines**2))
    return 4.42 * math.pow(mean_square, 0.15)


def _frequencies(samples: int, rate_hz: float) -> FloatArray:
    """Frequencies of a real spectrum, Hz."""
    return np.asarray(np.fft.rfftfreq(samples, 1.0 / rate_hz), dtype=np.float64)


def _judge_rate(rate_hz: float) -> None:
    if rate_hz < LEAST_RATE_HZ:
        raise InputError(
            "is too low for ride comfort, whose weightings reach up to 100 Hz",
            field="truth_rate_hz",
            value=rate_hz,
            limit=f"{LEAST_RATE_HZ:g} Hz",
            remedy="set truth_rate_hz = 250.0 or more",
        )
