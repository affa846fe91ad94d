"""A claim of the paper and its verdict, and the limits that verdicts follow from.

A verdict is computed, never written down beforehand, and its limit stands in the sentence.
"""

from __future__ import annotations

from dataclasses import dataclass

from simrail.report.paper_000.rides import Rides

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


@dataclass(frozen=True)
class Claim:
    """One claim of the paper and what became of it.

    Attributes
    ----------
    key : str
        Short name, for tests.
    said : str
        What the paper says, and where.
    holds : bool or None
        Whether it reproduces; None if the methods that it speaks of were not run.
    found : str
        Our figures and the limit that the verdict follows from.
    cause : str
        Why it does not reproduce, or what else the figures show; may be empty.
    """

    key: str
    said: str
    holds: bool | None
    found: str
    cause: str = ""

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        return {True: "Reproduces.", False: "Does not reproduce.", None: "Not asked."}[self.holds]

    @property
    def tone(self) -> str:
        """How the page marks it."""
        return {True: "good", False: "bad", None: "note"}[self.holds]


def cropped(rides: Rides, part: str, quantity: str) -> float:
    """Mean over the rides as in Table 3: against the design angles, cropped."""
    return rides.mean(part, quantity, window="cropped", reference="design")[0]


def near(one: float, other: float) -> bool:
    return abs(one - other) <= max(SAME_YAW * max(one, other), SAME_YAW_DEG)
