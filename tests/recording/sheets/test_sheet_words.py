"""Words of data sheets lead to the keys of their own quantity and unit, and to no other."""

import math
import re

import pytest

from simrail.recording.sheets.figures import FIGURES, MEANINGS, QUANTITIES
from simrail.recording.sheets.sheet_words import ALIASES, explain

G = 9.80665


def lines(remedy: str) -> dict[str, float]:
    """Keys and numbers of the lines that a remedy says to write."""
    return {key: float(number) for key, number in re.findall(r"(\w+) = ([0-9.e+-]+)", remedy)}


def keys(remedy: str) -> set[str]:
    """All keys of IMU files that a remedy names."""
    return {word for word in re.findall(r"\w+", remedy) if word in FIGURES or word == "rate_hz"}


@pytest.mark.parametrize(
    ("key", "value", "line", "number"),
    [
        ("angle_random_walk", "0.34 deg/sqrt(h)", "gyro_noise_degpsqrth", 0.34),
        ("ARW", "0.34 °/√h", "gyro_noise_degpsqrth", 0.34),
        ("arw_deg_sqrt_h", 0.34, "gyro_noise_degpsqrth", 0.34),
        ("Angle Random Walk (deg/√h)", 0.34, "gyro_noise_degpsqrth", 0.34),
        ("angular random walk", "0.005 deg/s/√Hz", "gyro_noise_degpsqrthz", 0.005),
        ("vrw", "0.1 m/s/rt-hr", "accel_noise_mpspsqrth", 0.1),
        ("velocity_random_walk", "60 ug/√Hz", "accel_noise_ugpsqrthz", 60.0),
        ("noise_density", "5 mdps/√Hz", "gyro_noise_degpsqrthz", 0.005),
        ("noise_density", "0.1 mg/√Hz", "accel_noise_ugpsqrthz", 100.0),
        ("gyro_noise_density", "3e-4 rad/s/√Hz", "gyro_noise_degpsqrthz", math.degrees(3e-4)),
        ("gyroNoiseDensity", "0.01 dps/rtHz", "gyro_noise_degpsqrthz", 0.01),
        ("gyro_noise_radpsqrts", 1e-4, "gyro_noise_degpsqrth", math.degrees(1e-4) * 60.0),
        ("random_walk", "0.3 deg/sqrt(h)", "gyro_noise_degpsqrth", 0.3),
        ("random_walk", "0.3 deg/h/sqrt(h)", "gyro_random_walk_degphpsqrth", 0.3),
        ("rate_random_walk", "3 deg/h/√h", "gyro_random_walk_degphpsqrth", 3.0),
        ("in-run bias stability", "10 deg/h", "gyro_bias_instability_degph", 10.0),
        ("accel_in_run_bias_instability", "0.04 mg", "accel_bias_instability_mg", 0.04),
        ("accelerometer_bias_repeatability", "±2 mg", "accel_turn_on_bias_mg", 2.0),
        ("turn-on bias", "0.5 deg/s", "gyro_turn_on_bias_degps", 0.5),
        ("zero_g_offset", "0.2 m/s^2", "accel_turn_on_bias_mg", 0.2 / G * 1000.0),
        ("gyroscope scale factor error", "0.3 %", "gyro_scale_error_percent", 0.3),
        ("accel_non_linearity", "0.5 % of FS", "accel_nonlinearity_percentfs", 0.5),
        ("accel_cross_axis_sensitivity", "0.5 %", "accel_nonorthogonality_mrad", 5.0),
        ("axis_to_package_misalignment", "0.1 deg", "package_misalignment_deg", 0.1),
        ("resolution", "0.1 mg", "accel_resolution_mg", 0.1),
        ("sensitivity", "8 mdps/LSB", "gyro_resolution_degps", 0.008),
        ("full_scale_range", "±2000 dps", "gyro_range_degps", 2000.0),
        ("range", "±5 g", "accel_range_g", 5.0),
        ("gyro_bandwidth_hz", 255.0, "bandwidth_hz", 255.0),
        ("accelerometer bandwidth", "0.324 kHz", "bandwidth_hz", 324.0),
        ("bias tempco", "0.02 dps/°C", "gyro_bias_temperature_degpspk", 0.02),
        ("gyro_sensitivity", "0.01 %/K", "gyro_scale_temperature_ppmpk", 100.0),
        ("linear acceleration effect on bias", "0.003 deg/s/g", "gyro_g_sensitivity_degpspg", 0.003),
        ("vibration rectification", "50 ug/g^2", "accel_vibration_rectification_ugpg2", 50.0),
        ("output_data_rate", "1 kHz", "rate_hz", 1000.0),
        ("sample_rate", 200, "rate_hz", 200.0),
        ("gyro_noise_z_degpsqrthz", 0.01, "gyro_noise_degpsqrthz", 0.01),
        ("accel_noise_ugpsqrthz", "100 µg/√Hz", "accel_noise_ugpsqrthz", 100.0),
        ("angle_radnom_walk", "0.3 deg/sqrt(h)", "gyro_noise_degpsqrth", 0.3),
    ],
)
def test_one_line_with_the_number_converted(key: str, value: object, line: str, number: float) -> None:
    remedy = explain(key, value)
    assert remedy is not None
    assert lines(remedy) == {line: pytest.approx(number, rel=1e-5)}


def test_words_that_mean_two_things_name_both() -> None:
    found = lines(explain("gyro_bias_stability", "10 deg/h") or "")
    assert found == {"gyro_bias_instability_degph": 10.0, "gyro_turn_on_bias_degph": 10.0}
    found = lines(explain("cross axis", "1 %") or "")
    assert found == {"gyro_nonorthogonality_mrad": 10.0, "accel_nonorthogonality_mrad": 10.0}


def test_a_number_without_unit_is_not_guessed_at() -> None:
    remedy = explain("angle_random_walk", 0.34) or ""
    assert "0.34" not in remedy
    assert keys(remedy) == {"gyro_noise_degpsqrth", "gyro_noise_degpsqrthz"}


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("rate_random_walk", "3 deg/sqrt(h)"),
        ("angle_random_walk", "3 deg/h/sqrt(h)"),
        ("gyro_noise_density", "100 ug/√Hz"),
        ("gyro_range", "16 g"),
        ("bandwidth", "3 mg"),
    ],
)
def test_a_unit_of_another_quantity_is_said_so(key: str, value: str) -> None:
    remedy = explain(key, value) or ""
    assert "of another quantity" in remedy
    assert lines(remedy) == {}


def test_noise_over_a_bandwidth_is_told_from_its_density() -> None:
    remedy = explain("gyro_rms_noise", "0.05 deg/s") or ""
    assert "gyro_noise_degpsqrthz = noise / sqrt(1.57 B)" in remedy
    assert "accel" not in remedy


@pytest.mark.parametrize(
    "word", ["bias_drift_rate_of_change", "weight_g", "startup_time_s", "price", "clock", "axis"]
)
def test_words_that_are_not_known_lead_nowhere(word: str) -> None:
    assert explain(word, 1.0) is None


def test_a_table_is_read_key_by_key() -> None:
    remedy = explain("gyro", {"noise_density": "0.005 deg/s/√Hz", "range": "300 dps"}) or ""
    assert lines(remedy) == {"gyro_noise_degpsqrthz": 0.005, "gyro_range_degps": 300.0}


def test_every_phrase_speaks_of_quantities_that_there_are() -> None:
    stems = {quantity.split("_", 1)[1] for quantity in QUANTITIES if quantity.startswith(("gyro_", "accel_"))}
    for phrase, quantities in ALIASES.items():
        for quantity in quantities:
            assert quantity in QUANTITIES or quantity in stems or quantity == "rate", phrase
    assert set(MEANINGS) == set(QUANTITIES)


# What a misspelling may do to a key: leave a letter out, double one, swap two.
def misspellings(key: str) -> list[str]:
    return (
        [key[:i] + key[i + 1 :] for i in range(len(key))]
        + [key[:i] + key[i] + key[i:] for i in range(len(key))]
        + [key[:i] + key[i + 1] + key[i] + key[i + 2 :] for i in range(len(key) - 1)]
    )


@pytest.mark.parametrize("quantity", sorted(QUANTITIES))
def test_no_misspelling_leads_to_another_quantity(quantity: str) -> None:
    """A guess by letters alone would: ``angle_random_walk`` came nearest to the walk of the rate."""
    guessed = 0
    wrong = []
    for key in QUANTITIES[quantity]:
        for word in misspellings(key):
            if word in FIGURES:
                continue
            remedy = explain(word, 1.0)
            guessed += remedy is not None
            wrong += [word] if keys(remedy or "") - set(QUANTITIES[quantity]) else []
    assert guessed > 0
    assert wrong == []
