"""A claim of a publication and its verdict, which is computed, never written down beforehand."""

from __future__ import annotations

from dataclasses import dataclass


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
