"""What a sentence of the page is, and how it says numbers, lists, axes and recordings."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from simrail.recording.recording import Recording
from simrail.report.words.ablations import value_words
from simrail.scoring.ablations import ABLATIONS
from simrail.scoring.published_spectra import known, shipped_spectra


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
    return ("note", "larger than need be") if share > 0.985 else ("good", "about right")


def unbroken(text: str) -> str:
    """A text whose numbers and units are not parted at the end of a line, with a minus that is no hyphen."""
    text = re.sub(r"(?<![\w.)])-(?=\d)", "\u2212", text)
    return re.sub(r"(?<=\d) (?=(?:mm|m|s|km/h|Hz|kHz|%)(?![a-z]))", "\u00a0", text)


def listed(words: Sequence[str]) -> str:
    """Words as a person lists them: a, b and c."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


UNITS = {
    "kmh": "km/h",
    "mps2": "m/s\u00b2",
    "mps3": "m/s\u00b3",
    "m": "m",
    "s": "s",
    "hz": "Hz",
    "deg": "\u00b0",
}
"""Units by the ends of names."""


def vibration_facts(shaken: Mapping[str, str] | None) -> list[str]:
    """What shakes a ride and what its forces hold, a line each.

    Parameters
    ----------
    shaken : mapping of str to str, optional
        Names of the sources that shake the ride, with where their figures come from; None if nothing does.
    """
    if shaken is None:
        return ["no vibration by short waves (an ablation: every vehicle shakes)"]
    named = ", ".join(name.replace("_", " ") for name in shaken)
    return [
        f"shaken by {named}",
        f"{'; '.join(known(shipped_spectra()).values())} (simrail spectra compares)",
        "forces between wheels and rails hold the long waves only; short ones are superposed on the motion",
    ]


def axis_name(name: str) -> tuple[str, str]:
    """Words and unit of an axis: ``ride.speed_kmh`` is the speed in km/h; a unit of "" for none."""
    *words, last = name.rpartition(".")[2].split("_")
    if words and last in UNITS:
        return " ".join(words), UNITS[last]
    return " ".join([*words, last]), ""


def axis_words(name: str, value: object) -> str:
    """A value of an axis as people say it: ``ride.speed_kmh``, 20.0 becomes ``speed 20 km/h``."""
    ablation = next((one for one in ABLATIONS if one.axis == name), None)
    if ablation is not None:
        return value_words(
            ablation, ablation.ablated if str(value) == str(True) else ablation.own, title=True
        )
    words, unit = axis_name(name)
    if words == "reverse":
        return "backward" if str(value) == str(True) else "forward"
    return f"{words} {_number_or_text(value)} {unit}".rstrip()


def _number_or_text(value: object) -> str:
    """A number without needless zeros, also if it is written as a text."""
    if not isinstance(value, (float, str)):
        return str(value)
    try:
        return f"{float(value):g}"
    except ValueError:
        return str(value)


def recording_facts(recording: Recording) -> list[str]:
    """IMU and odometry of a recording, a line each."""
    x, y, z = recording.mount_position_m
    odometry = "no odometry: only a method that finds the place itself says where the train is"
    if recording.odometry is not None:
        ablation = " (an ablation: a train has no such thing)" if recording.odometry_source == "truth" else ""
        odometry = f"position and speed from the odometry '{recording.odometry_source}'{ablation}"
    return [
        f"IMU {recording.imu_sheet.grade} at {recording.imu_sheet.rate_hz:g} Hz on '{recording.mount_body}', "
        f"{x:g}, {y:g}, {z:g} m (forward, left, up)",
        odometry,
    ]


FILTERS: dict[str, Callable[..., str]] = {
    "deg": degrees,
    "mm": significant,
    "g": "{:g}".format,
    "listed": listed,
    "unbroken": unbroken,
}
"""How the words of templates write what they are given."""
