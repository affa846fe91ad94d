"""Numbers with their units as a person writes them: ``"0.1 deg"``, ``"4 mm"``."""

import re

from simrail.core.errors import InputError

_PI = 3.141592653589793
_SI = {
    "deg": ("angle", _PI / 180.0),
    "\u00b0": ("angle", _PI / 180.0),
    "arcmin": ("angle", _PI / 10800.0),
    "mrad": ("angle", 1e-3),
    "rad": ("angle", 1.0),
    "mm": ("length", 1e-3),
    "cm": ("length", 1e-2),
    "m": ("length", 1.0),
    "m/s": ("speed", 1.0),
    "mm/s": ("speed", 1e-3),
    "km/h": ("speed", 1.0 / 3.6),
    "m/s2": ("acceleration", 1.0),
    "m/s\u00b2": ("acceleration", 1.0),
    "mg": ("acceleration", 9.80665e-3),
    "ug": ("acceleration", 9.80665e-6),
    "g": ("acceleration", 9.80665),
    "deg/s": ("rate", _PI / 180.0),
    "deg/h": ("rate", _PI / 648000.0),
    "rad/s": ("rate", 1.0),
    "1": ("ratio", 1.0),
    "%": ("ratio", 1e-2),
    "kN": ("force", 1e3),
    "N": ("force", 1.0),
    "1/s": ("growth", 1.0),
}
"""Kind of quantity that a unit is of, and its size in SI."""

_FORM = re.compile(r"^\s*([-+.\deE]+)\s*(\S.*?)?\s*$")


def amount_in(value: float | str, unit: str, *, what: str, field: str = "limit") -> float:
    """A number above 0 in a unit.

    Parameters
    ----------
    value : float or str
        With its unit, ``"0.1 deg"``; a bare number is in `unit`.
    unit : str
        The unit of what is returned.
    what : str
        The quantity, for messages.
    field : str
        Where it stands, for messages.

    Raises
    ------
    InputError
        If it is no number above 0, or its unit is none, or one of another kind.
    """
    kind, size = _SI[unit]
    alike = ", ".join(name for name, (of, _) in _SI.items() if of == kind)
    found = _FORM.match(str(value))
    try:
        number = float(found[1]) if found else float("nan")
    except ValueError:
        number = float("nan")
    if not 0.0 < number < float("inf"):
        raise InputError(
            "is no limit", field=field, value=value, limit=f"a number above 0 with a unit: {alike}"
        )
    written = (found[2] or unit) if found else unit
    if written not in _SI:
        raise InputError("has a unit that is not known", field=field, value=value, limit=f"{what}: {alike}")
    if _SI[written][0] != kind:
        raise InputError(
            f"has a unit of {_SI[written][0]}; {what} is measured in {unit}",
            field=field,
            value=value,
            limit=alike,
            remedy=f"give it in {unit}",
        )
    return number * _SI[written][1] / size
