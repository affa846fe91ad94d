"""Words of data sheets lead to the keys of their own quantity and unit, and to no other."""

import math
import re

import pytest

from simrail.recording.sheets.figures import FIGURES, MEANINGS, QUANTITIES
from simrail.recording.sheets.sheet_words import ALIASES, explain, in_own_units

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
        ("bandwidth", "255 Hz", "bandwidth_hz", 255.0),
        ("gyro_cutoff_frequency_hz", 255.0, "gyro_bandwidth_hz", 255.0),
        ("accelerometer bandwidth", "0.324 kHz", "accel_bandwidth_hz", 324.0),
        ("gyroscope_noise_density", 4.9e-5, "gyro_noise_degpsqrthz", math.degrees(4.9e-5)),
        ("gyroscope_random_walk", 2.5e-6, "gyro_random_walk_degphpsqrth", math.degrees(2.5e-6) * 3600 * 60),
        ("accelerometer_noise_density", 6e-4, "accel_noise_ugpsqrthz", 6e-4 / G * 1e6),
        ("accelerometer_random_walk", 1e-5, "accel_random_walk_mgpsqrth", 1e-5 / G * 1e3 * 60.0),
        ("gyro_sensitivity", "131 LSB/(deg/s)", "gyro_resolution_degps", 1.0 / 131.0),
        ("accel_sensitivity", "2048 LSB/g", "accel_resolution_mg", 1000.0 / 2048.0),
        ("accel_bias_over_temperature", "0.5 mg/degC", "accel_bias_temperature_mgpk", 0.5),
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
    assert "gyro_noise_degpsqrthz = 0.05 / sqrt(1.57 B)" in remedy
    assert "accel" not in remedy


def test_noise_in_its_key_is_told_as_a_density_for_a_bandwidth() -> None:
    """0.7 mg over 100 Hz of a response of first order: 700 ug over the root of 157 Hz."""
    remedy = explain("accel_noise_mgrms", 0.7) or ""
    assert "accel_noise_ugpsqrthz = 700.0 / sqrt(1.57 B)" in remedy
    assert f"{700.0 / math.sqrt(157.0):.6g} where B is 100 Hz" in remedy


@pytest.mark.parametrize(
    ("key", "value"),
    [("accel_sensitivity_mvpg", 660.0), ("gyro_sensitivity", "0.67 mV/(deg/s)"), ("scale_factor", "1 V/g")],
)
def test_volts_are_no_figure_here(key: str, value: object) -> None:
    remedy = explain(key, value) or ""
    assert "analogue" in remedy and lines(remedy) == {}


def test_cross_axis_names_both_angles_that_it_may_be() -> None:
    remedy = explain("gyro_cross_axis_percent", 1.25) or ""
    assert lines(remedy) == {"gyro_nonorthogonality_mrad": 12.5}
    assert "package_misalignment_mrad" in remedy and "scale" not in remedy


@pytest.mark.parametrize(
    ("key", "value", "line", "number"),
    [
        ("gyro_noise_mdpspsqrthz", 2.8, "gyro_noise_degpsqrthz", 0.0028),
        ("gyro_noise_radpsqrthz", 4.9e-5, "gyro_noise_degpsqrthz", math.degrees(4.9e-5)),
        ("gyro_noise_radpspsqrthz", 4.9e-5, "gyro_noise_degpsqrthz", math.degrees(4.9e-5)),
        ("gyro_noise_dpspsqrthz", 0.0028, "gyro_noise_degpsqrthz", 0.0028),
        ("gyro_noise_degphpsqrthz", 10.08, "gyro_noise_degpsqrthz", 0.0028),
        ("accel_noise_mgpsqrthz", 0.07, "accel_noise_ugpsqrthz", 70.0),
        ("accel_noise_mps2psqrthz", 6e-4, "accel_noise_ugpsqrthz", 6e-4 / G * 1e6),
        ("gyro_scale_temperature_percentpk", 0.03, "gyro_scale_temperature_ppmpk", 300.0),
        ("accel_scale_temperature_%/degC", 0.03, "accel_scale_temperature_ppmpk", 300.0),
        ("gyro_turn_on_bias_mdps", 500.0, "gyro_turn_on_bias_degps", 0.5),
        ("gyro_turn_on_bias_radps", 0.01, "gyro_turn_on_bias_degps", math.degrees(0.01)),
        ("gyro_bias_instability_mdps", 1.0, "gyro_bias_instability_degph", 3.6),
        ("gyro_range_radps", 5.0, "gyro_range_degps", math.degrees(5.0)),
        ("accel_range_mps2", 49.0, "accel_range_g", 49.0 / G),
        ("accel_bias_temperature_ugpk", 150.0, "accel_bias_temperature_mgpk", 0.15),
        ("gyro_nonorthogonality_percent", 1.0, "gyro_nonorthogonality_mrad", 10.0),
        ("bandwidth_khz", 0.25, "bandwidth_hz", 250.0),
    ],
)
def test_a_quantity_in_another_unit_is_accepted(key: str, value: float, line: str, number: float) -> None:
    found = in_own_units({"title": "mine", key: value})
    assert found.pop("title") == "mine"
    assert {FIGURES[name].field for name in found} == {FIGURES[line].field}
    ((name, size),) = found.items()
    assert size * FIGURES[name].si == pytest.approx(number * FIGURES[line].si, rel=1e-9)


@pytest.mark.parametrize(
    "data",
    [
        {"gyro_noise_g": 1.0},
        {"gyro_noise_mgpsqrthz": 1.0},
        {"angle_random_walk_degpsqrth": 1.0},
        {"gyro_noise_mdpspsqrthz": "2.8"},
        {"gyro_noise_mdpspsqrthz": True},
        {"gyro_noise_mdpspsqrthz": 2.8, "gyro_noise_degpsqrthz": 0.0028},
        {"gyro_noise_density_mdps": 1.0},
        {"accel_noise_ugpsqrthz": [1.0, 2.0]},
        {"accel_noise_ugpsqrthz": [1.0, 2.0, "3"]},
        {"accel_turn_on_bias_mg": [1.0, 2.0, 3.0]},
    ],
)
def test_what_is_not_certain_stays_to_be_explained(data: dict[str, object]) -> None:
    assert in_own_units(data) == data


def test_noise_of_each_axis_is_the_largest_and_shares_of_it() -> None:
    found = in_own_units({"accel_noise_mgpsqrthz": [0.16, 0.16, 0.2]})
    assert found == {
        "accel_noise_ugpsqrthz": pytest.approx(200.0),
        "accel_axis_noise": pytest.approx((0.8, 0.8, 1.0)),
    }


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
