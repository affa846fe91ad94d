"""Units as data sheets and people write them: ``deg/sqrt(h)``, ``°/s/√Hz``, ``mdps_rthz``, ``ug/rt-Hz``.

`read_unit` gives the size of a unit in SI and its dimension: two spellings of one unit are alike in both, two
units of one quantity in their dimension, and those of unlike quantities in neither.
"""

from __future__ import annotations

import math
import re
from fractions import Fraction
from typing import NamedTuple

STANDARD_GRAVITY_MPS2 = 9.80665
"""The g of data sheets (mg, ug), by definition; local gravity is a matter of the recording."""


class Dimension(NamedTuple):
    """Exponents of metre, second, radian and kelvin; those of sqrt(Hz) are halves."""

    metre: Fraction = Fraction(0)
    second: Fraction = Fraction(0)
    radian: Fraction = Fraction(0)
    kelvin: Fraction = Fraction(0)


class Unit(NamedTuple):
    """One unit: its size in SI, its dimension, and whether it is spelt with a root of hertz."""

    si: float
    dimension: Dimension
    per_root_hertz: bool = False


class Measured(NamedTuple):
    """A number with its unit, as text such as ``"±2 mg"`` says it; no unit where none was said."""

    number: float
    unit: str


_DEG = math.pi / 180.0
_ANGLE = Dimension(radian=Fraction(1))
_TIME = Dimension(second=Fraction(1))
_PER_TIME = Dimension(second=Fraction(-1))
_LENGTH = Dimension(metre=Fraction(1))
_ACCELERATION = Dimension(metre=Fraction(1), second=Fraction(-2))
_TURN_RATE = Dimension(second=Fraction(-1), radian=Fraction(1))
_KELVIN = Dimension(kelvin=Fraction(1))
_NUMBER = Dimension()

_SPELT: tuple[tuple[str, float, Dimension], ...] = (
    ("deg degs degree degrees °", _DEG, _ANGLE),
    ("mdeg", 1e-3 * _DEG, _ANGLE),
    ("arcmin", _DEG / 60.0, _ANGLE),
    ("arcsec", _DEG / 3600.0, _ANGLE),
    ("rad rads radian radians", 1.0, _ANGLE),
    ("mrad", 1e-3, _ANGLE),
    ("urad", 1e-6, _ANGLE),
    ("dps", _DEG, _TURN_RATE),
    ("mdps", 1e-3 * _DEG, _TURN_RATE),
    ("udps", 1e-6 * _DEG, _TURN_RATE),
    ("dph", _DEG / 3600.0, _TURN_RATE),
    ("s sec secs second seconds", 1.0, _TIME),
    ("ms msec", 1e-3, _TIME),
    ("us usec", 1e-6, _TIME),
    ("ns nsec", 1e-9, _TIME),
    ("min minute minutes", 60.0, _TIME),
    ("h hr hrs hour hours", 3600.0, _TIME),
    ("hz hertz", 1.0, _PER_TIME),
    ("khz", 1e3, _PER_TIME),
    ("m", 1.0, _LENGTH),
    ("mm", 1e-3, _LENGTH),
    ("um", 1e-6, _LENGTH),
    ("ft", 0.3048, _LENGTH),
    ("g", STANDARD_GRAVITY_MPS2, _ACCELERATION),
    ("mg", 1e-3 * STANDARD_GRAVITY_MPS2, _ACCELERATION),
    ("ug", 1e-6 * STANDARD_GRAVITY_MPS2, _ACCELERATION),
    ("ng", 1e-9 * STANDARD_GRAVITY_MPS2, _ACCELERATION),
    ("gal", 1e-2, _ACCELERATION),
    ("mgal", 1e-5, _ACCELERATION),
    ("k c kelvin celsius °c °k degc", 1.0, _KELVIN),
    ("% percent pct", 1e-2, _NUMBER),
    ("ppm", 1e-6, _NUMBER),
    ("lsb digit count samples fs fso", 1.0, _NUMBER),
)
_ATOMS = {word: (si, dimension) for words, si, dimension in _SPELT for word in words.split()}
_BY_LENGTH = sorted(_ATOMS, key=len, reverse=True)

_REWRITTEN = (
    (r"[µμ]", "u"),
    (r"micro[ _-]?(?=g|rad)", "u"),
    (r"º", "°"),
    (r"²", "2"),
    (r"[·\u00d7*]", " "),
    (r"\bof\b|\bfull[ _-]?scale\b|(?<![a-z])rms(?![a-z])|rms$", " "),
    (r"(?<![a-z])per(?![a-z])", "/"),
    (r"√|(?<![a-z])(?:square[ _-]?)?root(?![a-z])|(?<![a-z])sqr(?:t|)(?![a-z])", "sqrt"),
    (r"(?<![a-z])rt[ _-]?(?=[(]?(?:h|s))", "sqrt"),
    (r"sqrt[ _(-]*", "sqrt"),
    (r"[()\[\]{}]", " "),
)
"""What spellings are made into, in this order."""

_ROOTS = ("sqrt", "rt")

_POWER = re.compile(r"\^ ?(-?[0-9.]+(?:/[0-9]+)?)")


def read_unit(text: str) -> Unit | None:
    """Read a unit; None if it is not understood.

    Atoms up to the first division are multiplied, all others divide: no data sheet has a unit in which
    ``deg/s sqrt(Hz)`` or ``deg/(s sqrt(Hz))`` would mean anything else. Case does not count. The letter p
    stands for "per" within a word, as in the keys of IMU files (``degpsqrth``), and an underscore too.
    """
    words = text.strip().lower()
    for pattern, replaced in _REWRITTEN:
        words = re.sub(pattern, replaced, words)
    words = _POWER.sub(lambda found: f"^{float(Fraction(found[1]))} ", words)
    si, exponents, rooted = 1.0, [Fraction(0)] * 4, False
    above, found = True, False
    for sign, word in re.findall(r"([/_ ]*)([^/_ ]+)", words):
        above = above and "/" not in sign and ("_" not in sign or not found)
        atoms = _solid(word)
        if atoms is None:
            return None
        for divides, name, power in atoms:
            above = above and not divides
            signed = power if above else -power
            size, dimension = _ATOMS[name]
            si *= size ** float(signed)
            exponents = [
                sum_ + signed * exponent for sum_, exponent in zip(exponents, dimension, strict=True)
            ]
            rooted |= name == "hz" and power.denominator == 2
            found = True
    return Unit(si, Dimension(*exponents), rooted) if found else None


def _solid(word: str) -> list[tuple[bool, str, Fraction]] | None:
    """Atoms of a word without separators: whether it divides, name, power; None if it is no unit."""
    root = word.startswith(_ROOTS)
    rest = word.removeprefix("sqrt").removeprefix("rt") if root else word
    for name in _BY_LENGTH:
        if not rest.startswith(name):
            continue
        match = re.match(r"\^(-?[0-9.]+)|([23])?", rest[len(name) :])
        assert match is not None  # it matches nothing, too
        power = Fraction(match[1] or match[2] or 1)
        if root:
            power /= 2
        after = rest[len(name) + match.end() :]
        if not after:
            return [(False, name, power)]
        divided = after.startswith("p")
        following = _solid(after[1:] if divided else after) if divided or after.startswith(_ROOTS) else None
        if following is not None:
            first = (True, *following[0][1:])
            return [(False, name, power), first, *following[1:]]
    return None


_NUMBER_TEXT = re.compile(r"[ ±+<>≤≥~=/-]*([0-9]*\.?[0-9]+(?:e[+-]?[0-9]+)?) *(.*)", re.IGNORECASE)


def read_measured(value: object) -> Measured | None:
    """Read a number, or text that begins with one, such as ``"< 0.1 mg"``; None if there is none.

    A sign that stands for a bound (±, <) is left out. Of several numbers, one for each axis, the largest.
    """
    if isinstance(value, list):
        read = [read_measured(item) for item in value]
        known = [one for one in read if one is not None]
        return max(known, key=lambda one: abs(one.number)) if known and len(known) == len(read) else None
    if isinstance(value, int | float) and not isinstance(value, bool):
        return Measured(float(value), "")
    match = _NUMBER_TEXT.fullmatch(value.strip()) if isinstance(value, str) else None
    return None if match is None else Measured(float(match[1]), match[2].strip())
