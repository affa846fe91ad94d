"""Where the spectrum of long waves and the roughness of short ones meet, and the step between them."""

import numpy as np

from simrail.track.irregularity import Irregularity
from simrail.track.roughness import RoughnessTable

LONGEST_M = 1.5
"""Longest wave of the roughness where no spectrum of long waves says otherwise."""


def longest_short_wave_m(irregularity: Irregularity, table: RoughnessTable) -> float:
    """Where the roughness begins: at the shortest wave that the laid track has, or that the table has."""
    if irregularity.spectrum == "none" and irregularity.measured is None:
        return min(LONGEST_M, table.longest_m)
    return min(irregularity.wavelengths_m[0], table.longest_m)


def step_db(irregularity: Irregularity, table: RoughnessTable, *, offset_db: float = 0.0) -> float | None:
    """How far the density of a rail's roughness lies above that of its long waves where they meet, dB.

    A rail's height is the vertical profile and half the cross-level, which are independent, so that its
    density is ``S_v + S_c / 4``. None where there is no spectrum to meet.
    """
    if irregularity.spectrum == "none":
        return None
    frequency = np.array([1.0 / longest_short_wave_m(irregularity, table)])
    densities = irregularity.drawn_from.densities
    vertical, level = (
        irregularity.scale_of(name) ** 2 * densities[name].density(frequency)[0]
        for name in ("vertical_profile_m", "cross_level_m")
    )
    long_waves = vertical + 0.25 * level
    rough = 10.0 ** (0.1 * offset_db) * table.density(frequency * (1.0 + 1e-9))[0]
    if not (long_waves > 0.0 and rough > 0.0):
        return None
    return float(10.0 * np.log10(rough / long_waves))
