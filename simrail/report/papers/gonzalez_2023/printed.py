"""What Gonzalez-Carbajal et al. 2023 printed, each figure once.

Called "the paper" in this package. Its track is 1:10, its measuring system has a camera on either rail, and
its reference is a survey of the track; filtered is to wavelengths of 0.3 to 7 m.
"""

from __future__ import annotations

from typing import NamedTuple


class Printed(NamedTuple):
    """Difference to the reference: mean, standard deviation, largest, mm."""

    mean: float
    sd: float
    largest: float


COLUMNS = (
    ("cross_level", False),
    ("cross_level", True),
    ("alignment", True),
    ("vertical_profile", True),
)
"""Quantities of its Tables 1 and 2, and whether they are filtered."""

TABLES: dict[str, tuple[Printed, Printed, Printed, Printed]] = {
    "cml": (
        Printed(0.054, 0.162, 1.185),
        Printed(0.004, 0.119, 1.051),
        Printed(0.040, 1.030, 6.952),
        Printed(0.008, 0.375, 1.877),
    ),
    "kom": (
        Printed(0.028, 0.167, 1.242),
        Printed(0.002, 0.114, 1.105),
        Printed(-0.017, 0.659, 3.621),
        Printed(0.005, 0.360, 1.800),
    ),
    "kom_start": (
        Printed(0.032, 0.173, 1.280),
        Printed(0.002, 0.111, 1.053),
        Printed(-0.005, 0.891, 3.369),
        Printed(0.007, 0.356, 1.828),
    ),
    "kom_end": (
        Printed(-0.063, 0.500, 2.509),
        Printed(0.0004, 0.119, 1.211),
        Printed(-0.007, 0.792, 3.471),
        Printed(0.007, 0.356, 1.844),
    ),
    "cml_noise": (
        Printed(0.053, 0.166, 1.161),
        Printed(0.003, 0.119, 1.050),
        Printed(0.024, 0.999, 5.641),
        Printed(0.007, 0.368, 1.869),
    ),
}
"""Its Tables 1 and 2, by row, in the order of `COLUMNS`."""

COVERAGE = (49.0, 73.0, 98.0, 99.0)
"""Its section 6.2: share of the track inside the 95 % interval, %, in the order of `COLUMNS`."""

ALIGNMENT_WITHOUT_PEAK_MM = 0.7
"""Its section 6.1: standard deviation of the alignment by CML without the first metres of the ride."""
