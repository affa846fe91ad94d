"""What a sentence of the page is, and how it says numbers and lists."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One sentence.

    Attributes
    ----------
    tone : str
        ``"good"``, ``"bad"`` (a loss, an inconsistency, a failure) or ``"note"``.
    text : str
        Plain text.
    """

    tone: str
    text: str


def degrees(value: float) -> str:
    """An angle with three significant digits, at most four decimals: ``0.213°``."""
    return f"{significant(value)}\u00b0"


def significant(value: float, *, digits: int = 3) -> str:
    """A number with some significant digits and no exponent, at most four decimals; a dash for none."""
    if not math.isfinite(value):
        return "\u2013"
    if value == 0.0:
        return "0"
    # The exponent of the rounded number: 0.09999 is 0.100, not 0.1000.
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
    decimals = min(max(digits - 1 - exponent, 0), 4)
    return f"{value:.{decimals}f}" if abs(value) >= 5e-5 else "<0.0001"


def interval_verdict(share: float) -> tuple[str, str]:
    """Tone and words for a 95 % interval that holds a share of the truth."""
    if share < 0.9:
        return "bad", "too small"
    return ("note", "larger than its errors") if share > 0.985 else ("good", "about right")


def unbroken(text: str) -> str:
    """A text whose numbers and units are not parted at the end of a line."""
    return re.sub(r"(?<=\d) (?=(?:mm|m|s|%)(?![a-z]))", "\u00a0", text)


def listed(words: Sequence[str]) -> str:
    """Words as a person lists them: a, b and c."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
