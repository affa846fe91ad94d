"""From the figures that a data sheet prints, in its own units, to an IMU grade, and back for reading.

The only place in simrail where degrees per hour, milli-g, ppm and their like are turned into SI units.
"""

import math
from typing import Any, Literal, NamedTuple

from simrail.core.errors import InputError, did_you_mean
from simrail.recording.sheets.grades import ImuGrade, judge_choice

STANDARD_GRAVITY_MPS2 = 9.80665
"""The g of data sheets (mg, ug), by definition; local gravity is a matter of the recording."""

_G = STANDARD_GRAVITY_MPS2
_DEG = math.pi / 180.0
_DEGPH = _DEG / 3600.0


class Figure(NamedTuple):
    """One figure as sheets print it: the field of the grade, SI value of one unit, and the unit in words."""

    field: str
    si: float
    unit: str


_BOTH = {
    "{}_scale_error_percent": ("{}_scale_error", 1e-2, "%"),
    "{}_scale_error_ppm": ("{}_scale_error", 1e-6, "ppm"),
    "{}_nonlinearity_percentfs": ("{}_nonlinearity", 1e-2, "% of full scale"),
    "{}_nonlinearity_ppmfs": ("{}_nonlinearity", 1e-6, "ppm of full scale"),
    "{}_nonorthogonality_deg": ("{}_nonorthogonality_rad", _DEG, "deg"),
    "{}_nonorthogonality_mrad": ("{}_nonorthogonality_rad", 1e-3, "mrad"),
    "{}_scale_temperature_ppmpk": ("{}_scale_temperature_1pk", 1e-6, "ppm/K"),
    "{}_bias_correlation_s": ("{}_bias_correlation_s", 1.0, "s"),
}

FIGURES: dict[str, Figure] = {
    "gyro_noise_degpsqrthz": Figure("gyro_noise_radpsqrts", _DEG, "deg/s/sqrt(Hz)"),
    "gyro_noise_degpsqrth": Figure("gyro_noise_radpsqrts", _DEG / 60.0, "deg/sqrt(h)"),
    "accel_noise_ugpsqrthz": Figure("accel_noise_mpsqrts", 1e-3 * (1e-3 * _G), "ug/sqrt(Hz)"),
    "accel_noise_mpspsqrth": Figure("accel_noise_mpsqrts", 1.0 / 60.0, "m/s/sqrt(h)"),
    "gyro_bias_instability_degph": Figure("gyro_bias_instability_radps", _DEGPH, "deg/h"),
    "accel_bias_instability_mg": Figure("accel_bias_instability_mps2", 1e-3 * _G, "mg"),
    "accel_bias_instability_ug": Figure("accel_bias_instability_mps2", 1e-6 * _G, "ug"),
    "gyro_random_walk_degphpsqrth": Figure("gyro_random_walk_radpspsqrts", _DEGPH / 60.0, "deg/h/sqrt(h)"),
    "accel_random_walk_mgpsqrth": Figure("accel_random_walk_mps2psqrts", 1e-3 * _G / 60.0, "mg/sqrt(h)"),
    "gyro_turn_on_bias_degps": Figure("gyro_turn_on_bias_radps", _DEG, "deg/s"),
    "gyro_turn_on_bias_degph": Figure("gyro_turn_on_bias_radps", _DEGPH, "deg/h"),
    "accel_turn_on_bias_mg": Figure("accel_turn_on_bias_mps2", 1e-3 * _G, "mg"),
    "gyro_g_sensitivity_degpspg": Figure("gyro_g_sensitivity_radspm", _DEG / _G, "deg/s/g"),
    "gyro_g_sensitivity_degphpg": Figure("gyro_g_sensitivity_radspm", _DEGPH / _G, "deg/h/g"),
    "gyro_vibration_rectification_degphpg2": Figure(
        "gyro_vibration_rectification_rads3pm2", _DEGPH / _G**2, "deg/h/g2"
    ),
    "accel_vibration_rectification_ugpg2": Figure("accel_vibration_rectification_s2pm", 1e-6 / _G, "ug/g2"),
    "gyro_bias_temperature_degpspk": Figure("gyro_bias_temperature_radpspk", _DEG, "deg/s/K"),
    "gyro_bias_temperature_degphpk": Figure("gyro_bias_temperature_radpspk", _DEGPH, "deg/h/K"),
    "accel_bias_temperature_mgpk": Figure("accel_bias_temperature_mps2pk", 1e-3 * _G, "mg/K"),
    "package_misalignment_deg": Figure("package_misalignment_rad", _DEG, "deg"),
    "package_misalignment_mrad": Figure("package_misalignment_rad", 1e-3, "mrad"),
    "gyro_range_degps": Figure("gyro_range_radps", _DEG, "deg/s"),
    "accel_range_g": Figure("accel_range_mps2", _G, "g"),
    "gyro_resolution_degps": Figure("gyro_resolution_radps", _DEG, "deg/s"),
    "accel_resolution_mg": Figure("accel_resolution_mps2", 1e-3 * _G, "mg"),
    "vibration_averaging_s": Figure("vibration_averaging_s", 1.0, "s"),
    "bandwidth_hz": Figure("bandwidth_hz", 1.0, "Hz"),
    "clock_jitter_us": Figure("clock_jitter_s", 1e-6, "us"),
    "clock_drift_ppm": Figure("clock_drift", 1e-6, "ppm"),
    "dropped_percent": Figure("dropped_fraction", 1e-2, "%"),
    "dropped_burst_samples": Figure("dropped_burst", 1.0, "samples"),
} | {
    name.format(kind): Figure(field.format(kind), si, unit)
    for name, (field, si, unit) in _BOTH.items()
    for kind in ("gyro", "accel")
}
"""Every figure of a data sheet, by its name in IMU files. Several may stand for one field of a grade."""

_OPTIONS = ("source", "bias_process", "flicker_range_s", "oversampling", "output")
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
        ``source``, ``bias_process``, ``flicker_range_s``, ``oversampling`` and ``output`` as in `ImuGrade`,
        and keys of `FIGURES`, e.g. ``gyro_noise_degpsqrthz=0.005``; None is a figure that is not printed.

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
    for key, number in figures.items():
        if key not in FIGURES:
            raise InputError(
                "no data sheet prints this figure",
                field=key,
                value=number,
                remedy=did_you_mean(key, FIGURES) or "see simrail.recording.sheets.datasheet.FIGURES",
            )
        if number is None:
            continue
        figure = FIGURES[key]
        if figure.field in said:
            raise InputError(
                "is given twice, in two units",
                field=key,
                value=number,
                limit=f"either this or {said[figure.field]}",
                remedy="keep the one that the sheet prints",
            )
        said[figure.field] = key
        reading = math.sqrt(0.5) if key in _DENSITIES and noise_reading == "one_sided_density" else 1.0
        values[figure.field] = _in_si(key, number, figure.si) * reading
    return ImuGrade(
        name=name,
        rate_hz=rate_hz,
        assumed=(*([assumed.strip()] if assumed.strip() else []), *_assumptions(said, noise_reading)),
        **values,
    )


def _in_si(key: str, number: float, si: float) -> float:
    """One figure in SI units, multiplied in the order in which its unit is made up."""
    if isinstance(number, bool) or not isinstance(number, int | float):
        raise InputError("is no number", field=key, value=number)
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
