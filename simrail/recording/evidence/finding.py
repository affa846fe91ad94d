"""One figure that a recording says of itself, with what it is worth."""

import math
from dataclasses import dataclass
from typing import Literal

Verdict = Literal["sound", "likely wrong", "surely wrong", "could not be judged"]

LIKELY, SURE = 3.5, 8.0
"""Standard deviations from which on a figure is likely wrong, and surely."""


def verdict_of(off: float) -> Verdict:
    """The judgement of a figure that is so many standard deviations off its nominal value."""
    return "surely wrong" if off > SURE else "likely wrong" if off > LIKELY else "sound"


@dataclass(frozen=True)
class Finding:
    """One quantity, as a ride shows it, beside what the ride file says.

    Attributes
    ----------
    name : str
        What it is, in words.
    key : str
        Which parameter it is (`simrail.recording.evidence.model.GLOBALS`).
    value, sd, nominal : float
        As found, its standard deviation with all that the sheets leave open, and what it should be.
    unit : str
        ``"1"``, ``"m"``, ``"deg"``, ``"s"`` or ``"ppm"``.
    rests_on : str
        What of the ride it was told from.
    verdict : str
        The judgement.
    why : str
        A clause that says so; "" for what is sound.
    setting : str
        Where in the ride file it is mended; "" where it cannot be.
    field : str
        What a message blames.
    remedy : str
        What else to do about it; "" where the setting says it.
    """

    name: str
    key: str
    value: float
    sd: float
    nominal: float
    unit: str
    rests_on: str
    verdict: Verdict
    why: str = ""
    setting: str = ""
    field: str = ""
    remedy: str = ""

    @property
    def wrong(self) -> bool:
        """Whether it is likely or surely wrong."""
        return self.verdict in ("likely wrong", "surely wrong")

    @property
    def shown(self) -> str:
        """Value and standard deviation, rounded to what the latter bears, with the unit."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        if not math.isfinite(self.sd):
            return f"{self.value:.3g}{unit} (sd unknown)"
        digits = max(0, min(6, 1 - _exponent(self.sd)))
        return f"{self.value:.{digits}f} +- {self.sd:.{digits}f}{unit}"


def _exponent(value: float) -> int:
    """Power of ten of the first digit."""
    return int(f"{abs(value):.1e}".partition("e")[2]) if value > 0.0 else -6
