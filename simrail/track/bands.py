"""Wavelength bands of track geometry, the zero-phase filters that cut them out, and twist.

The bands are those of EN 13848-1 as they are commonly quoted; the standard itself was not at hand. That goes
above all for D0, which its edition of 2019 is said to have added.

Functions of values over a uniform grid of places: nothing here knows an estimator or the truth.
"""

from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.special import ndtri, stdtrit

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

ORDER = 4
"""Order of the Butterworth prototype: each side of a band falls with 24 dB per octave, and pass."""

SAMPLES_PER_WAVE = 2.5
"""Samples that the shortest wave of a band needs."""

TWIST_BASE_M = 3.0
"""Base of the twist, unless another is given."""

TOO_SHORT, TOO_COARSE = "line too short for the band", "step too coarse for the band"


@dataclass(frozen=True)
class Band:
    """A band of wavelengths.

    Attributes
    ----------
    name : str
        Its name in the score table.
    shortest_m, longest_m : float
        Its edges, where half of the power passes.
    longest_alignment_m : float, optional
        The longer edge for alignment and gauge, where it is another one.
    """

    name: str
    shortest_m: float
    longest_m: float
    longest_alignment_m: float | None = None

    def edges_m(self, quantity: str) -> tuple[float, float]:
        """Shortest and longest wavelength for a quantity (``"alignment"``, ``"vertical_profile"`` ...)."""
        lateral = quantity in ("alignment", "gauge") and self.longest_alignment_m is not None
        longest = self.longest_alignment_m if lateral else self.longest_m
        assert longest is not None
        return self.shortest_m, longest

    def check(self) -> None:
        """Refuse what is no band.

        Raises
        ------
        InputError
            Naming the band.
        """
        longest = min(self.longest_m, self.longest_alignment_m or self.longest_m)
        if not 0.0 < self.shortest_m < longest < np.inf:
            raise InputError(
                "is not a band",
                field=self.name,
                value=(self.shortest_m, self.longest_m),
                limit="0 < shortest < longest wavelength, m",
            )


BANDS: dict[str, Band] = {
    "D0": Band("D0", 1.0, 5.0),
    "D1": Band("D1", 3.0, 25.0),
    "D2": Band("D2", 25.0, 70.0),
    "D3": Band("D3", 70.0, 150.0, longest_alignment_m=200.0),
}
"""The bands of EN 13848-1 by name."""


def margin_m(edges_m: tuple[float, float]) -> float:
    """Length at each end of a filtered line that does not count: two longest wavelengths of the band.

    There the filter would have to know the rails beyond the end. What a sine that is cut off in the middle
    of a wave leaves behind the margin is below 1 % of its amplitude in D1, 2 % in D0, 4 % in D2 and D3.
    """
    return 2.0 * edges_m[1]


def why_not(edges_m: tuple[float, float], *, count: int, step_m: float) -> str:
    """Why a line of `count` samples has nothing in a band: `TOO_SHORT` or `TOO_COARSE`; empty if it has."""
    if (count - 1) * step_m < _shortest_line_m(edges_m):
        return TOO_SHORT
    return TOO_COARSE if step_m * SAMPLES_PER_WAVE > edges_m[0] else ""


def _shortest_line_m(edges_m: tuple[float, float]) -> float:
    """Both margins, and one longest wave between them."""
    return 2.0 * margin_m(edges_m) + edges_m[1]


def band_pass(values: FloatArray, edges_m: tuple[float, float], *, step_m: float) -> FloatArray:
    """Cut a band out, without any shift along the track.

    A Butterworth filter of fourth order runs forward and backward. Both passes together let half of the power
    pass at the edges of the band (-3 dB; one pass alone then has -1.5 dB there, since its own corners lie
    outside by a factor that makes up for the other one).

    Parameters
    ----------
    values : ndarray (..., n)
        One or more lines over places a step apart.
    edges_m : tuple of float
        Shortest and longest wavelength.
    step_m : float
        Distance of the places.

    Returns
    -------
    ndarray (..., n)
        NaN over the `margin_m` at both ends.

    Raises
    ------
    InputError
        If the line is too short or its step too coarse (`why_not`).
    """
    count = values.shape[-1]
    reason = why_not(edges_m, count=count, step_m=step_m)
    if reason:
        shortest, coarsest = _shortest_line_m(edges_m), edges_m[0] / SAMPLES_PER_WAVE
        raise InputError(
            reason,
            field="band",
            value=f"{edges_m[0]:g} to {edges_m[1]:g} m on {count} places, {step_m:g} m apart",
            limit=f"a line of {shortest:g} m and more, a step of {coarsest:g} m and less",
        )
    pad = min(count - 1, round(3.0 * edges_m[1] / step_m))
    passed: FloatArray = signal.sosfiltfilt(_sections(edges_m, step_m), values, padtype="odd", padlen=pad)
    crop = int(np.ceil(margin_m(edges_m) / step_m - 1e-9))
    passed[..., :crop] = passed[..., count - crop :] = np.nan
    return passed


def _sections(edges_m: tuple[float, float], step_m: float) -> FloatArray:
    """Second-order sections of one pass.

    In the warped frequency W = tan(pi step / wavelength) one pass lets 1/(1 + x^(2 ORDER)) of the power
    pass, x = (W^2 - W1 W2) / (B W). With B = W2 - W1 that is one half at the edges; two passes are to
    let one half pass, so x^(2 ORDER) = sqrt(2) - 1 there.
    """
    low, high = np.tan(np.pi * step_m / edges_m[1]), np.tan(np.pi * step_m / edges_m[0])
    width = (high - low) / (np.sqrt(2.0) - 1.0) ** (0.5 / ORDER)
    outer = 0.5 * (width + np.sqrt(width**2 + 4.0 * low * high))
    corners = 2.0 / np.pi * np.arctan([outer - width, outer])
    sections: FloatArray = signal.butter(ORDER, corners, btype="bandpass", output="sos")
    return sections


def twist(cross_level: FloatArray, *, base_m: float, step_m: float) -> FloatArray:
    """Twist over a base: cross-level minus that a base before, cl(s) - cl(s - base), m.

    Parameters
    ----------
    cross_level : ndarray (..., n)
        m, one or more lines over places a step apart.
    base_m, step_m : float
        The base is a whole number of steps.

    Returns
    -------
    ndarray (..., n)
        NaN over the first base.

    Raises
    ------
    InputError
        If the base is not a whole number of steps.
    """
    steps = round(base_m / step_m)
    if steps < 1 or abs(steps * step_m / base_m - 1.0) > 1e-6:
        raise InputError(
            "is not a whole number of steps",
            field="twist_base_m",
            value=base_m,
            limit=f"a multiple of the step of {step_m:g} m",
        )
    result = np.full(cross_level.shape, np.nan)
    result[..., steps:] = cross_level[..., steps:] - cross_level[..., :-steps]
    return result


def sd_of_draws(draws: FloatArray) -> FloatArray:
    """Standard deviation of an error of which m draws are known, for an interval of 1.96 of it.

    A normal error over the root mean square of m draws like it is Student's t with m degrees of freedom:
    +-t_m of the root holds 95 % of the errors, +-1.96 of it fewer. The root is therefore made larger by
    t_m/1.96: 6 % for 20 draws.

    Parameters
    ----------
    draws : ndarray (m, n)
        Filtered or turned into twist as the error itself.

    Returns
    -------
    ndarray (n,)
    """
    m = len(draws)
    widened = float(stdtrit(m, 0.975) / ndtri(0.975))
    limits: FloatArray = widened * np.sqrt(np.square(draws).sum(axis=0) / m)
    return limits
