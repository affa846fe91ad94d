"""The figures that data sheets print: their keys in IMU files, units and meanings, one table.

A key says quantity and unit; several keys, in several units, may stand for one quantity. IMU files, what
`simrail new imu` writes, and what is said of the words of data sheets
(`simrail.recording.sheets.sheet_words`) are made from it.
"""

import math
from typing import NamedTuple

from simrail.recording.sheets.units import STANDARD_GRAVITY_MPS2, Dimension, read_unit

_G = STANDARD_GRAVITY_MPS2
_DEG = math.pi / 180.0
_DEGPH = _DEG / 3600.0


class Figure(NamedTuple):
    """One figure as sheets print it: the field of the grade, SI value of one unit, and the unit in words."""

    field: str
    si: float
    unit: str

    @property
    def dimension(self) -> Dimension:
        """Dimension of its unit."""
        unit = read_unit(self.unit)
        assert unit is not None
        return unit.dimension


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
    "gyro_bandwidth_hz": Figure("gyro_bandwidth_hz", 1.0, "Hz"),
    "accel_bandwidth_hz": Figure("accel_bandwidth_hz", 1.0, "Hz"),
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

QUANTITIES: dict[str, tuple[str, ...]] = {
    quantity: tuple(name for name in FIGURES if name.rpartition("_")[0] == quantity)
    for quantity in dict.fromkeys(name.rpartition("_")[0] for name in FIGURES)
}
"""Keys of each quantity, which differ by their units, by what they have in common: ``gyro_noise``."""

_MEANT = {
    "noise": "white noise, as a density or as {walk} random walk",
    "bias_instability": "in-run bias instability: the floor of the Allan deviation over 0.664",
    "bias_correlation": "correlation time of the bias that wanders in a run (sheets do not print it)",
    "random_walk": "random walk of the {rate}, K of the Allan deviation ({walk} random walk is noise)",
    "turn_on_bias": "bound of the bias that a device has from switch-on: initial bias, repeatability, offset",
    "scale_error": "bound of the error of the scale factor (sensitivity)",
    "nonlinearity": "largest deviation from a straight line; needs the range",
    "nonorthogonality": "bound of the angles between the axes, off their 90 degrees: cross-axis sensitivity",
    "g_sensitivity": "bound of the rate that a steady acceleration causes",
    "vibration_rectification": "bound of the bias that vibration causes, per its mean square",
    "bias_temperature": "bound of the bias per kelvin away from 25 degrees Celsius",
    "scale_temperature": "bound of the error of the scale factor per kelvin away from 25 degrees Celsius",
    "range": "largest magnitude that is measured",
    "resolution": "size of one count",
    "bandwidth": "-3 dB frequency of its response of second order, where it has one of its own",
}
_MEANT_OF_DEVICE = {
    "package_misalignment": "bound of the angles between package and axes of the sensors, both triads alike",
    "vibration_averaging": "time constant over which vibration is averaged",
    "bandwidth": "-3 dB frequency of the response of second order, of both triads",
    "clock_jitter": "standard deviation of the time at which a sample is really taken",
    "clock_drift": "bound of the relative error of the device's clock",
    "dropped": "share of the samples that never arrive",
    "dropped_burst": "mean number of samples that are lost in a row",
}
_TRIADS = {
    "gyro": ("gyro", {"walk": "angle", "rate": "rate"}),
    "accel": ("accelerometer", {"walk": "velocity", "rate": "acceleration"}),
}

MEANINGS: dict[str, str] = {
    f"{triad}_{term}": f"{name}: {meaning.format(**words)}"
    for triad, (name, words) in _TRIADS.items()
    for term, meaning in _MEANT.items()
    if f"{triad}_{term}" in QUANTITIES
} | _MEANT_OF_DEVICE
"""What each of `QUANTITIES` means, in words: those of the gyro, of the accelerometer, of the device."""
