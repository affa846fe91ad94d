"""The limits that verdicts on the paper's claims (`simrail.report.papers.claim`) follow from.

Each stands in the sentence of its verdict.
"""

from __future__ import annotations

from simrail.report.papers.briales_2021.rides import Rides

HELPS_FACTOR = 1.5
"""A method that helps makes the error at least this many times smaller."""

SAME_YAW, SAME_YAW_DEG = 0.05, 0.1
"""Two yaw errors are the same if they differ by less than this share or angle."""

FAILS_DEG = 10.0
"""A yaw that is wrong by tens of degrees has at least this rms error."""

SAME_DIRECTION_DEG = 0.03
"""Roll errors of rides in both directions are the same if they differ by no more."""

FAILS_BACKWARD_FACTOR = 1.5
"""A method fails on backward rides if its error in curves is this many times the forward one."""

REPEATS_FACTOR = 1.2
"""A method repeats worse than another if its spread is this many times as large."""

SIZE_FACTOR = 2.0
"""Figures agree in size if they lie within this factor."""


def cropped(rides: Rides, part: str, quantity: str) -> float:
    """Mean over the rides as in Table 3: against the design angles, cropped."""
    return rides.mean(part, quantity, window="cropped", reference="design")[0]


def near(one: float, other: float) -> bool:
    return abs(one - other) <= max(SAME_YAW * max(one, other), SAME_YAW_DEG)
