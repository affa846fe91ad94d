"""Sections of a line: stretches of one maintenance, each rougher or smoother than the next.

A section's gain on amplitudes is lognormal, its square 1 in the mean, so that the density of a spectrum is
that of the whole line. Sections have lengths drawn evenly between two limits; from one to the next the
logarithm of the gain passes over in a quintic smooth step.

The form and its figures are synthetic: no published statistics of it were found.
"""

from dataclasses import dataclass

import numpy as np

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream

PASSING_M = 20.0
"""Length over which one section's gain passes into the next one's, centred on where they meet."""


@dataclass(frozen=True)
class SectionGain:
    """Gain on amplitudes by sections.

    Attributes
    ----------
    sd : float
        Standard deviation of the logarithm of the gain.
    lengths_m : tuple of float
        Shortest and longest section, not below `PASSING_M`.
    """

    sd: float
    lengths_m: tuple[float, float] = (100.0, 400.0)


def section_scores(
    s_m: FloatArray, lengths_m: tuple[float, float], *, start_m: float, seed: int
) -> FloatArray:
    """Standard normal score (n,) of the section at places s, smooth in s; sections count from ``start_m``."""
    generator = stream(seed, "track", "sections")
    if len(s_m) == 0:
        return np.zeros(0)
    count = 2 + int(max(float(np.max(s_m)) - start_m, 0.0) / lengths_m[0])
    # Each section takes two numbers in turn, so that a longer line begins with the same ones.
    drawn = np.array([(generator.uniform(*lengths_m), generator.standard_normal()) for _ in range(count)])
    ends, scores = start_m + np.cumsum(drawn[:, 0]), drawn[:, 1]
    at = np.minimum(np.searchsorted(ends + 0.5 * PASSING_M, s_m, side="right"), count - 2)
    u = np.clip((s_m - ends[at]) / PASSING_M + 0.5, 0.0, 1.0)
    passed: FloatArray = scores[at] + (scores[at + 1] - scores[at]) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return passed


def section_gain(s_m: FloatArray, gain: SectionGain, *, start_m: float, seed: int) -> FloatArray:
    """Gain (n,) on amplitudes at places s: ``exp(sd n - sd^2)``, n the section's normal score.

    The mean of its square is 1: E exp(2 sd n) = exp(2 sd^2).
    """
    score = section_scores(s_m, gain.lengths_m, start_m=start_m, seed=seed)
    gains: FloatArray = np.exp(gain.sd * score - gain.sd**2)
    return gains
