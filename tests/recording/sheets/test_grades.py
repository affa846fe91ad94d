"""Units of data sheets, and the Allan deviation of a Gauss-Markov process."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from simrail.core.errors import InputError
from simrail.core.toml_files import judge, shipped
from simrail.recording.sheets.allan import (
    FLICKER_FLOOR,
    GAUSS_MARKOV_PEAK,
    GAUSS_MARKOV_PEAK_AT,
    bias_sd,
    gauss_markov_allan,
)
from simrail.recording.sheets.figures import FIGURES
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import ImuFile, load_grade, load_imu


def test_data_sheet_units_by_hand():
    grade = load_grade("lord_3dm_gx4_25")
    # The values of paper 000, Table 1, converted with a pocket calculator.
    assert grade.gyro_noise_radpsqrts == pytest.approx(8.72665e-5, rel=1e-5)
    assert grade.accel_noise_mpsqrts == pytest.approx(9.80665e-4, rel=1e-5)
    assert grade.gyro_bias_instability_radps == pytest.approx(4.84814e-5, rel=1e-5)
    assert grade.accel_bias_instability_mps2 == pytest.approx(3.92266e-4, rel=1e-5)
    assert grade.gyro_turn_on_bias_radps == pytest.approx(8.72665e-4, rel=1e-5)
    assert grade.accel_turn_on_bias_mps2 == pytest.approx(0.0196133, rel=1e-5)
    assert grade.gyro_range_radps == pytest.approx(5.23599, rel=1e-5)
    assert grade.accel_range_mps2 == pytest.approx(49.03325, rel=1e-5)
    assert grade.gyro_resolution_radps == pytest.approx(1.39626e-4, rel=1e-5)
    assert grade.accel_resolution_mps2 == pytest.approx(9.80665e-4, rel=1e-5)
    assert grade.rate_hz == 250.0


def test_ideal_has_no_errors_and_the_rate_of_the_real_one():
    ideal, real = load_grade("ideal"), load_grade("lord_3dm_gx4_25")
    assert ideal == ImuGrade("ideal", real.rate_hz, source=ideal.source)


def test_every_shipped_imu_has_a_source():
    for name, path in shipped("imu").items():
        assert load_grade(name).source, path


@pytest.mark.parametrize("x", (0.003, 0.1, 1.0, 1.89, 10.0, 1000.0))
def test_gauss_markov_allan_variance_from_its_autocovariance(x):
    # Independent: with v the mean over tau, 2 sigma_A^2 = E (v2 - v1)^2 = 2 (C(0) - C(tau)), where C is the
    # autocovariance of v: the integral of sd^2 exp(-|d|/T) under a triangle of half width tau.
    sd, correlation = 0.7, 20.0
    tau = x * correlation

    def mean_covariance(lag: float) -> float:
        def integrand(u: float) -> float:
            return (1.0 - abs(u)) * math.exp(-abs(lag + u * tau) / correlation)

        return sd**2 * quad(integrand, -1.0, 1.0, points=[0.0], epsabs=1e-14, epsrel=1e-12, limit=400)[0]

    variance = mean_covariance(0.0) - mean_covariance(tau)
    found = gauss_markov_allan(np.array([tau]), sd=sd, correlation_s=correlation)[0]
    assert found == pytest.approx(math.sqrt(variance), rel=1e-6)


def test_gauss_markov_allan_is_smooth_where_its_series_takes_over():
    tau = np.array([0.999e-3, 1.001e-3])
    low, high = gauss_markov_allan(tau, sd=1.0, correlation_s=1.0)
    assert high / low == pytest.approx(math.sqrt(1.001 / 0.999), rel=1e-5)


def test_peak_of_the_gauss_markov_process_is_the_flicker_floor():
    peak = minimize_scalar(
        lambda x: -gauss_markov_allan(np.array([x]), sd=1.0, correlation_s=1.0)[0],
        bounds=(1.0, 3.0),
        method="bounded",
    )
    assert -peak.fun == pytest.approx(GAUSS_MARKOV_PEAK, rel=1e-6)
    assert peak.x == pytest.approx(GAUSS_MARKOV_PEAK_AT, rel=1e-4)
    # IEEE Std 952 prints the peak as 0.437 q sqrt(T) at 1.89 T, with q = sd sqrt(2/T).
    assert GAUSS_MARKOV_PEAK / math.sqrt(2.0) == pytest.approx(0.437, abs=1e-3)
    assert abs(FLICKER_FLOOR - 0.664) < 5e-4
    assert bias_sd(2.0) * GAUSS_MARKOV_PEAK == pytest.approx(2.0 * FLICKER_FLOOR)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("rate_hz", 0.0),
        ("gyro_noise_radpsqrts", -1.0),
        ("accel_bias_correlation_s", 0.0),
        ("bandwidth_hz", 0.0),
        ("gyro_range_radps", 0.0),
        ("accel_resolution_mps2", math.nan),
    ],
)
def test_impossible_grades_are_refused(field, value):
    figures = {"rate_hz": 100.0} | {field: value}
    with pytest.raises(InputError, match="out of range") as caught:
        ImuGrade("bad", **figures)
    assert field in str(caught.value)


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"gyro_noise_degpsqrthz": -0.005}, "gyro_noise_degpsqrthz"),
        ({"bandwidth_hz": 0.0}, "bandwidth_hz"),
        ({"gyro_noise_degpsqrtz": 0.005}, "did you mean gyro_noise_degpsqrthz"),
        ({"accel_range_g": "5 g"}, "accel_range_g"),
        ({"rate_hz": float("nan")}, "rate_hz"),
    ],
)
def test_impossible_imu_files_are_refused(change, part):
    data = {"title": "x", "source": "y", "rate_hz": 250.0} | change
    with pytest.raises(InputError) as caught:
        judge(ImuFile, data, file="mine.toml")
    assert part in str(caught.value)
    assert "mine.toml" in str(caught.value)


@pytest.mark.parametrize(
    "key", ["gyro_noise_degpsqrthz", "gyro_noise_degpsqrth", "accel_bias_instability_ug"]
)
def test_another_figure_takes_the_place_of_its_quantity_in_whatever_unit(key: str) -> None:
    """Whichever unit the sheet has it in: it is given once afterwards, and nothing else has changed."""
    file, grade = load_imu("tactical")
    other = file.with_figures({key: 0.5}).grade("tactical")
    field = FIGURES[key].field
    assert getattr(other, field) == pytest.approx(0.5 * FIGURES[key].si)
    assert replace(other, assumed=grade.assumed, **{field: getattr(grade, field)}) == grade
