"""From the figures that a data sheet prints, in its own units, to an IMU grade.

Only here are degrees per hour, milli-g, ppm and their like (`simrail.recording.sheets.figures`) turned into
SI units.
"""

import math
from typing import Any, Literal

from simrail.core.errors import Faults, InputError
from simrail.recording.sheets.figures import FIGURES, Figure
from simrail.recording.sheets.grades import ImuGrade, judge_choice
from simrail.recording.sheets.sheet_words import explain
from simrail.recording.sheets.units import STANDARD_GRAVITY_MPS2

_G = STANDARD_GRAVITY_MPS2

_OPTIONS = (
    "source",
    "bias_process",
    "flicker_range_s",
    "oversampling",
    "output",
    "gyro_axis_noise",
    "accel_axis_noise",
)
"""What a grade says beside its figures."""

_DENSITIES = ("gyro_noise_degpsqrthz", "accel_noise_ugpsqrthz")


def grade_from_datasheet(
    name: str,
    rate_hz: float,
    *,
    noise_reading: Literal["allan", "one_sided_density"] = "allan",
    assumed: str = "",
    **figures: Any,
) -> ImuGrade:
    """Build a grade from the figures of a data sheet, in the units that data sheets print.

    Parameters
    ----------
    name : str
        Name of the grade.
    rate_hz : float
        Output rate.
    noise_reading : {"allan", "one_sided_density"}
        How a printed noise density (deg/s/sqrt(Hz), ug/sqrt(Hz)) is read: as the Allan coefficient N, or
        as a one-sided density, of which one sample has the standard deviation density sqrt(rate / 2), so
        that N = density / sqrt(2). Random walks (deg/sqrt(h), m/s/sqrt(h)) are N by definition.
    assumed : str
        What else was assumed.
    **figures : float, optional
        ``source``, ``bias_process``, ``flicker_range_s``, ``oversampling``, ``output``, ``gyro_axis_noise``
        and ``accel_axis_noise`` as in `ImuGrade`, and keys of `FIGURES`, e.g.
        ``gyro_noise_degpsqrthz=0.005``; None is a figure that is not printed.

    Returns
    -------
    ImuGrade
        The same figures in SI units; g is the standard 9.80665 m/s2. Its ``assumed`` says how noise and
        bias were read, and what is missing.

    Raises
    ------
    InputError
        If a figure is unknown, stands there in two units, or is impossible.
    """
    judge_choice("noise_reading", noise_reading, ("allan", "one_sided_density"))
    values = {name: figures.pop(name) for name in _OPTIONS if name in figures}
    said: dict[str, str] = {}
    faults = Faults()
    for key, number in figures.items():
        if number is None and key in FIGURES:
            continue
        with faults.gathered():
            figure = _figure(key, number, said)
            reading = math.sqrt(0.5) if key in _DENSITIES and noise_reading == "one_sided_density" else 1.0
            values[figure.field] = _in_si(key, number, figure.si) * reading
            said[figure.field] = key
    with faults.gathered():
        grade = ImuGrade(
            name=name,
            rate_hz=rate_hz,
            assumed=(*([assumed.strip()] if assumed.strip() else []), *_assumptions(said, noise_reading)),
            **values,
        )
    faults.refuse()
    return grade


def _figure(key: str, number: Any, said: dict[str, str]) -> Figure:
    """The figure of a key, or what is wrong with it beside those that were said before."""
    if key not in FIGURES:
        raise InputError(
            "no data sheet prints this figure",
            field=key,
            value=number,
            remedy=explain(key, number) or "see simrail.recording.sheets.figures.FIGURES",
            limit="a figure of a data sheet",
        )
    figure = FIGURES[key]
    if figure.field in said:
        raise InputError(
            "is given twice, in two units",
            field=key,
            value=number,
            limit=f"either this or {said[figure.field]}",
            remedy="keep the one that the sheet prints",
        )
    return figure


def _in_si(key: str, number: float, si: float) -> float:
    """One figure in SI units, multiplied in the order in which its unit is made up."""
    if isinstance(number, bool) or not isinstance(number, int | float):
        raise InputError(
            "is no number", field=key, value=number, limit="a number", remedy="write it without quotes"
        )
    if key.endswith("_degph"):
        return math.radians(number) / 3600.0
    if key.endswith("_ugpsqrthz"):
        return number * 1e-3 * (1e-3 * _G)
    return number * si


def _assumptions(said: dict[str, str], noise_reading: str) -> list[str]:
    """What the conventions add to a sheet, and what it is silent about."""
    if not said:
        return []
    words = []
    if any(key in _DENSITIES for key in said.values()):
        how = "the Allan coefficient N" if noise_reading == "allan" else "a one-sided density, N sqrt(2)"
        words.append(f"Noise density read as {how}.")
    for kind, title in (("gyro", "Gyro"), ("accel", "Accelerometer")):
        wanders = any(field.startswith(f"{kind}_bias_instability") for field in said)
        if wanders and f"{kind}_bias_correlation_s" not in said:
            words.append(f"{title} bias wanders with the default correlation time of 300 s.")
    if any("turn_on" in field for field in said):
        words.append("Initial bias read as a uniform bound.")
    silent = [
        word for word, terms in _SILENT.items() if not any(term in field for field in said for term in terms)
    ]
    if silent:
        words.append(f"Not given, and left out: {', '.join(silent)}.")
    return words


_SILENT = {
    "bias instability": ("bias_instability",),
    "rate random walk": ("random_walk",),
    "initial bias": ("turn_on_bias",),
    "scale factor error": ("scale_error",),
    "nonlinearity": ("nonlinearity",),
    "misalignment": ("package_misalignment", "nonorthogonality"),
    "g-sensitivity": ("g_sensitivity",),
    "vibration rectification": ("vibration_rectification",),
    "temperature drift": ("bias_temperature", "scale_temperature"),
    "range": ("range",),
    "resolution": ("resolution",),
    "bandwidth": ("bandwidth",),
    "clock error": ("clock_jitter", "clock_drift"),
}
"""Words for what a sheet may be silent about, and parts of the names of the fields that would say it."""
