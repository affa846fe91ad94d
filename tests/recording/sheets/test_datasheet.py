"""Figures as data sheets print them: units by hand, conventions, what was assumed, and what is refused."""

import math

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.recording.sheets.datasheet import FIGURES, STANDARD_GRAVITY_MPS2
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import load_grade, load_imu

G = STANDARD_GRAVITY_MPS2

# One of each unit, converted with a pocket calculator (g = 9.80665 m/s2).
BY_HAND = {
    "gyro_noise_degpsqrthz": 1.745329e-2,
    "gyro_noise_degpsqrth": 2.908882e-4,
    "accel_noise_ugpsqrthz": 9.80665e-6,
    "accel_noise_mpspsqrth": 1.666667e-2,
    "gyro_bias_instability_degph": 4.848137e-6,
    "accel_bias_instability_mg": 9.80665e-3,
    "accel_bias_instability_ug": 9.80665e-6,
    "gyro_random_walk_degphpsqrth": 8.080228e-8,
    "accel_random_walk_mgpsqrth": 1.634442e-4,
    "gyro_turn_on_bias_degps": 1.745329e-2,
    "gyro_turn_on_bias_degph": 4.848137e-6,
    "accel_turn_on_bias_mg": 9.80665e-3,
    "gyro_g_sensitivity_degpspg": 1.779740e-3,
    "gyro_g_sensitivity_degphpg": 4.943723e-7,
    "gyro_vibration_rectification_degphpg2": 5.041194e-8,
    "accel_vibration_rectification_ugpg2": 1.019716e-7,
    "gyro_bias_temperature_degpspk": 1.745329e-2,
    "gyro_bias_temperature_degphpk": 4.848137e-6,
    "accel_bias_temperature_mgpk": 9.80665e-3,
    "package_misalignment_deg": 1.745329e-2,
    "package_misalignment_mrad": 1e-3,
    "gyro_range_degps": 1.745329e-2,
    "accel_range_g": 9.80665,
    "gyro_resolution_degps": 1.745329e-2,
    "accel_resolution_mg": 9.80665e-3,
    "clock_jitter_us": 1e-6,
    "clock_drift_ppm": 1e-6,
    "dropped_percent": 1e-2,
    "dropped_burst_samples": 1.0,
    "bandwidth_hz": 1.0,
    "vibration_averaging_s": 1.0,
} | {
    f"{kind}_{stem}": value
    for kind in ("gyro", "accel")
    for stem, value in {
        "scale_error_percent": 1e-2,
        "scale_error_ppm": 1e-6,
        "nonlinearity_percentfs": 1e-2,
        "nonlinearity_ppmfs": 1e-6,
        "nonorthogonality_deg": 1.745329e-2,
        "nonorthogonality_mrad": 1e-3,
        "scale_temperature_ppmpk": 1e-6,
        "bias_correlation_s": 1.0,
        "bandwidth_hz": 1.0,
    }.items()
}


@pytest.mark.parametrize("figure", FIGURES)
def test_every_unit_by_hand(figure):
    assert set(BY_HAND) == set(FIGURES)
    more = {"gyro_range_degps": 100.0, "accel_range_g": 10.0} if "nonlinearity" in figure else {}
    grade = ImuGrade.from_datasheet("one", 250.0, **{figure: 1.0}, **more)
    assert getattr(grade, FIGURES[figure].field) == pytest.approx(BY_HAND[figure], rel=1e-6)


def test_a_density_is_the_allan_coefficient_unless_read_as_one_sided():
    # Sampled at 250 Hz: N sqrt(250) against density sqrt(125).
    plain = ImuGrade.from_datasheet("a", 250.0, gyro_noise_degpsqrthz=0.005, accel_noise_ugpsqrthz=100.0)
    other = ImuGrade.from_datasheet(
        "b",
        250.0,
        gyro_noise_degpsqrthz=0.005,
        accel_noise_ugpsqrthz=100.0,
        noise_reading="one_sided_density",
    )
    assert plain.gyro_noise_radpsqrts * math.sqrt(250.0) == pytest.approx(1.380e-3, rel=1e-3)
    assert other.gyro_noise_radpsqrts * math.sqrt(250.0) == pytest.approx(
        math.radians(0.005) * math.sqrt(125.0)
    )
    assert other.accel_noise_mpsqrts == pytest.approx(1e-4 * G / math.sqrt(2.0))
    assert any("Allan coefficient N" in sentence for sentence in plain.assumed)
    assert any("one-sided" in sentence for sentence in other.assumed)
    walk = ImuGrade.from_datasheet("c", 250.0, gyro_noise_degpsqrth=0.3, noise_reading="one_sided_density")
    assert walk.gyro_noise_radpsqrts == pytest.approx(math.radians(0.005)), "a random walk is N by definition"


def test_what_a_sheet_leaves_out_is_said():
    assumed = " ".join(ImuGrade.from_datasheet("a", 250.0, gyro_noise_degpsqrthz=0.005).assumed)
    for word in ("bias instability", "scale factor", "misalignment", "temperature", "vibration", "range"):
        assert word in assumed
    more = ImuGrade.from_datasheet(
        "b", 250.0, gyro_bias_instability_degph=10.0, gyro_scale_error_ppm=500.0, assumed="Mounted upright."
    ).assumed
    assert more[0] == "Mounted upright."
    assert "correlation time of 300 s" in " ".join(more)
    assert "scale factor" not in " ".join(more)


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        ({"gyro_noise_degpsqrthz": 0.005, "gyro_noise_degpsqrth": 0.3}, ["twice", "gyro_noise_degpsqrthz"]),
        ({"accel_noise_ugpsqrthz": 100.0, "accel_noise_mpspsqrth": 0.06}, ["twice", "accel_noise"]),
        ({"gyro_noise_degpsqrthz": -0.005}, ["gyro_noise_radpsqrts", "out of range", ">= 0"]),
        ({"gyro_noise_degpsqrtz": 0.005}, ["gyro_noise_degpsqrtz", "did you mean gyro_noise_degpsqrthz"]),
        ({"bandwidth_hz": 0.0}, ["bandwidth_hz", "> 0"]),
        ({"noise_reading": "two_sided"}, ["noise_reading", "one_sided_density"]),
        ({"gyro_nonlinearity_ppmfs": 100.0}, ["gyro_nonlinearity", "full scale", "gyro_range_radps"]),
        ({"dropped_percent": 60.0}, ["dropped_fraction", "< 0.5"]),
        ({"dropped_burst_samples": 0.5}, ["dropped_burst", ">= 1"]),
        ({"clock_jitter_us": 1000.0}, ["clock_jitter_s", "tenth"]),
        ({"package_misalignment_deg": 30.0}, ["package_misalignment_rad", "< 0.2"]),
        ({"gyro_scale_error_percent": math.nan}, ["gyro_scale_error"]),
        ({"output": "counts"}, ["output", "increments"]),
        ({"bias_process": "brown"}, ["bias_process", "flicker"]),
        ({"bias_process": "flicker", "flicker_range_s": (10.0, 1.0)}, ["flicker_range_s", "shortest"]),
        ({"gyro_range_degps": "300"}, ["gyro_range_degps", "no number"]),
    ],
)
def test_impossible_figures_are_refused_by_name(figures, words):
    with pytest.raises(InputError) as caught:
        ImuGrade.from_datasheet("bad", 250.0, **figures)
    for word in words:
        assert word in str(caught.value)


def test_shipped_imus_say_what_they_are():
    for name in shipped("imu"):
        file, grade = load_imu(name)
        assert grade.source
        if name != "ideal":
            assert grade.assumed
        if file.synthetic:
            assert "preset" in file.title
    for name in ("consumer", "industrial", "tactical", "navigation"):
        assert load_imu(name)[0].synthetic


def test_grades_are_in_order():
    tau = np.array([1.0, 100.0])
    curves = [load_grade(name).allan(tau) for name in ("consumer", "industrial", "tactical", "navigation")]
    for better, worse in zip(curves[1:], curves[:-1], strict=True):
        assert (better["gyro"] <= worse["gyro"]).all()
    # The tactical preset's 0.05 m/s/sqrt(h) is 85 ug/sqrt(Hz), a little more than the industrial one's 80.
    assert (curves[3]["accel"] < curves[1]["accel"]).all()
    assert (load_grade("ideal").allan(tau)["gyro"] == 0.0).all()
