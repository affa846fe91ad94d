"""What a lesson says in figures, checked each time that it runs.

A claim has bounds that follow from theory or from the number of draws, not from what came out. Run as a
script a lesson ends with an error if one does not hold; shown in a browser, it marks it.
"""

from collections.abc import Sequence
from dataclasses import dataclass


class ClaimError(AssertionError):
    """A lesson's claim does not hold."""


@dataclass(frozen=True)
class Claim:
    """One sentence, the value that speaks for it, and the bounds within which it is true."""

    words: str
    value: float
    low: float
    high: float
    unit: str = ""

    @property
    def holds(self) -> bool:
        """Whether the value lies within the bounds."""
        return self.low <= self.value <= self.high

    @property
    def line(self) -> str:
        """The claim in one line."""
        unit = f" {self.unit}" if self.unit else ""
        mark = "holds" if self.holds else "DOES NOT HOLD"
        return f"{mark}: {self.words}: {self.value:.4g}{unit} (within {self.low:.4g} and {self.high:.4g})"


def about(words: str, value: float, expected: float, relative: float, unit: str = "") -> Claim:
    """A claim that a value is what theory expects, to a relative tolerance."""
    reach = abs(expected) * relative
    return Claim(words, float(value), expected - reach, expected + reach, unit)


def table(claims: Sequence[Claim]) -> str:
    """The claims as a table in Markdown."""
    rows = ["| | claim | found | bounds |", "|:-:|:--|--:|--:|"]
    for claim in claims:
        mark = "\N{CHECK MARK}" if claim.holds else "**\N{BALLOT X}**"
        value = f"{claim.value:.4g}\N{NO-BREAK SPACE}{claim.unit}".rstrip()
        rows.append(f"| {mark} | {claim.words} | {value} | {claim.low:.4g} to {claim.high:.4g} |")
    return "\n".join(rows)


def insist(claims: Sequence[Claim]) -> None:
    """Print the claims, and fail if one does not hold.

    Raises
    ------
    ClaimError
        With the lines of those that do not hold.
    """
    for claim in claims:
        print(claim.line)
    broken = [claim.line for claim in claims if not claim.holds]
    if broken:
        raise ClaimError("; ".join(broken))


def conclusion(claims: Sequence[Claim], *, script: bool) -> str:
    """How every lesson ends: its claims as Markdown; run as a script it prints them, and fails if one falls.

    (A notebook's last cell is this one call: marimo wants cells in the file of the notebook.)

    Raises
    ------
    ClaimError
        In a script, if a claim does not hold.
    """
    if script:
        insist(claims)
    return "## What this lesson claims\n\nAt fixed settings, each time that it is opened.\n\n" + table(claims)
