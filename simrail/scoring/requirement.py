"""What somebody asks of an IMU: a figure of the score table below a limit, on a share of the devices.

A *device* is one draw of what stays with a sensor (turn-on biases, scales, misalignments): the rides that
share a draw are what it is used on. `simrail.scoring.verdicts` holds a score table against a requirement.
"""

import re
from dataclasses import dataclass, replace
from typing import NamedTuple

from simrail.core.amounts import amount_in
from simrail.core.errors import InputError, one_of
from simrail.scoring.table import CURVE_PREFIX, FULL, QUANTITY_UNITS, WINDOWS
from simrail.track.bands import BANDS

METRICS = ("rms", "sd", "p95", "p9985", "max")
"""Figures of an error that are the better the smaller."""

QUANTITY_ALIASES = {
    "level": "cross_level",
    "cross-level": "cross_level",
    "crosslevel": "cross_level",
    "cant": "cross_level",
    "profile": "vertical_profile",
    "vertical profile": "vertical_profile",
    "longitudinal level": "vertical_profile",
    "heading": "yaw_debiased",
    "place": "position",
}
"""Words that people use, by the score table's own."""

WINDOW_ALIASES = {
    "curves": "curve",
    "transitions": "transition",
    "straights": "straight",
    "motion": "moving",
    "rest": "standstill",
}

_FOR = re.compile(
    r"^\s*(?P<what>[A-Za-z_ -]+?)(?:\s+(?P<metric>rms|sd|p95|p9985|max))?(?:\s+(?P<band>D[0-3]))?"
    r"\s*<=?\s*(?P<limit>[.\d]+(?:[eE][-+]?\d+)?\s*[^\s,]*)"
    r"(?:\s+in\s+(?P<window>\S+))?(?:\s+at\s+(?P<speed>[.\d]+)\s*km/h)?"
    r"(?:\s+for\s+(?P<share>[.\d]+)\s*%)?\s*$"
)
FORM = "'roll<0.1deg', 'roll p95<0.1deg in curves at 60km/h', 'alignment D1<0.5mm for 90%'"
"""How a requirement is written in one line."""


@dataclass(frozen=True)
class Requirement:
    """A figure of the score table, below a limit.

    Attributes
    ----------
    quantity, metric, band, window, reference : str
        Which figure, in the words of the score table.
    limit : float
        In the unit of the score table; a device that is just at it meets it.
    share : float
        Of the devices that must meet it, in (0, 1).
    over : str
        ``"all"``: a device must meet the limit on all its rides; ``"each"``: each kind of ride has a verdict
        of its own.
    chance : float
        Of a false verdict: that is what a device's maker and its buyer agree to live with.
    """

    quantity: str
    limit: float
    metric: str = "rms"
    band: str = FULL
    window: str = "whole"
    reference: str = "truth"
    share: float = 0.95
    over: str = "all"
    chance: float = 0.05

    @property
    def unit(self) -> str:
        """Of the limit."""
        return QUANTITY_UNITS[self.quantity]

    @property
    def what(self) -> str:
        """The figure, in words."""
        band = "" if self.band == FULL else f" {self.band}"
        where = {"whole": "", "straight": " on straights"}.get(
            self.window,
            f" in {self.window}s"
            if self.window in ("curve", "transition")
            else f" in {self.window.removeprefix(CURVE_PREFIX)}",
        )
        return f"{self.quantity.replace('_', ' ')}{band} {self.metric}{where}"

    @property
    def words(self) -> str:
        """The whole of it, in words."""
        unit = "\u00b0" if self.unit == "deg" else f" {self.unit}"
        return f"{self.what} \u2264 {self.limit:.4g}{unit} for {100.0 * self.share:g} % of the devices"


class Wanted(NamedTuple):
    """A requirement, and the speed, km/h, that it is asked at; None for that of the scenario."""

    requirement: Requirement
    speed_kmh: float | None


def limit_of(value: float | str, quantity: str) -> float:
    """A limit in the unit that the score table has the quantity in.

    Parameters
    ----------
    value : float or str
        A number with its unit, ``"0.1 deg"``; a bare number is in the table's unit.
    quantity : str
        One of `simrail.scoring.table.QUANTITY_UNITS`.

    Raises
    ------
    InputError
        If it is no number above 0, or its unit is none, or one of another kind.
    """
    return amount_in(value, QUANTITY_UNITS[quantity], what=quantity)


def read_requirement(text: str) -> Wanted:
    """A requirement that is written in one line, such as ``roll<0.1deg in curves at 60km/h``.

    The form is ``QUANTITY [METRIC] [BAND] < LIMIT [in WINDOW] [at SPEED km/h] [for SHARE %]``.

    Raises
    ------
    InputError
        If it has another form, or names what the score table does not have.
    """
    found = _FOR.match(text)
    if found is None:
        raise InputError("is no requirement", field="--for", value=text, limit=f"written as {FORM}")
    what = found["what"].strip().lower()
    quantity = QUANTITY_ALIASES.get(what, what.replace(" ", "_").replace("-", "_"))
    one_of(quantity, tuple(QUANTITY_UNITS), "is nothing that is scored", field="--for")
    window = found["window"] or "whole"
    window = WINDOW_ALIASES.get(window, window)
    if not window.startswith(CURVE_PREFIX):
        one_of(window, WINDOWS, "is no part of a ride that is scored", field="--for")
    wanted = Requirement(quantity, limit_of(found["limit"], quantity), window=window)
    if found["metric"]:
        wanted = replace(wanted, metric=found["metric"])
    if found["band"]:
        wanted = replace(wanted, band=found["band"])
    elif quantity in RAILS:
        # A quantity of the rails without a band is mostly what no standard asks for: the longest waves.
        wanted = replace(wanted, band="D1")
    if found["share"]:
        share = float(found["share"]) / 100.0
        if not 0.0 < share < 1.0:
            raise InputError("is no share", field="--for", value=found["share"], limit="0 to 100 %, neither")
        wanted = replace(wanted, share=share)
    judge_band(wanted)
    speed = found["speed"]
    return Wanted(wanted, None if speed is None else float(speed))


RAILS = ("alignment", "vertical_profile", "cross_level", "gauge", "twist")
"""Quantities that are scored in bands of wavelengths."""


def judge_band(wanted: Requirement, known: tuple[str, ...] = tuple(BANDS)) -> None:
    """Refuse a band for what has none, and one that is not scored.

    Raises
    ------
    InputError
        Naming the field.
    """
    if wanted.quantity not in RAILS:
        if wanted.band != FULL:
            raise InputError(
                f"is a band of wavelengths, which {wanted.quantity} has not",
                field="band",
                value=wanted.band,
                limit=FULL,
                remedy="leave it out; bands are of " + ", ".join(RAILS),
            )
        return
    one_of(wanted.band, (FULL, *known), "is no band that is scored", field="band")
