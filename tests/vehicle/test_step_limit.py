"""Longest steps, against the eigenvalues of the equations themselves and against RK4's own polynomial."""

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import load, shipped
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import load_scenario
from simrail.vehicle.engines.step_limit import ACCURATE, STABLE, contact_resonance
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.linear import running_vehicle


def vehicle(name):
    return load(VehicleFile, "vehicle", name).model(name)


def growth(z):
    """What RK4 makes of exp(z) in one step."""
    return 1.0 + z + z**2 / 2.0 + z**3 / 6.0 + z**4 / 24.0


def test_limits_are_those_of_rk4():
    """Damped oscillations are stable to w h = 2.5, also at double load; frequency right to 1 % at 1.05."""
    angle = np.linspace(0.5 * np.pi, np.pi, 181)
    assert np.abs(growth(STABLE * np.exp(1j * angle))).max() <= 1.0 + 1e-12
    assert abs(growth(1j * STABLE * 2.0 ** (1.0 / 6.0))) <= 1.0
    assert abs(growth(1j * 2.9)) > 1.0
    assert 0.99 < np.angle(growth(1j * ACCURATE)) / ACCURATE < 0.995


@pytest.mark.parametrize("name", ["irw_axle", "metro_irw_bogie", "two_axle_wagon", "scale_vehicle"])
def test_normal_resonance_is_the_highest_of_the_equations(name):
    """Within 5 %: the fastest oscillation of all eigenvalues at speed is the axle in heave or roll."""
    running = running_vehicle(vehicle(name))
    values = np.linalg.eigvals(running.linearised(20.0 if name != "scale_vehicle" else 3.0))
    normal = contact_resonance(running.model).normal_radps
    near = values[np.argmin(np.abs(np.abs(values.imag) - normal))]
    assert abs(near) == pytest.approx(normal, rel=0.05)


@pytest.mark.parametrize("name", sorted(set(shipped("vehicle")) - {"scale_vehicle"}))
def test_full_size_vehicles_run_at_half_a_millisecond(name):
    resonance = contact_resonance(vehicle(name))
    assert 0.5e-3 * resonance.normal_radps < ACCURATE
    assert resonance.longest_step_s > 0.5e-3
    assert resonance.advised_step_s == 0.5e-3


def test_scale_vehicle_swings_at_1_3_khz():
    """sqrt(2 k / m) with k = 1.5 N0 / d0 is 1.1 to 1.4 kHz for axles of 1:10."""
    resonance = contact_resonance(vehicle("scale_vehicle"))
    assert 1100.0 < resonance.normal_radps / (2.0 * np.pi) < 1400.0
    assert resonance.advised_step_s == 0.125e-3


def test_too_long_a_step_is_refused_and_a_long_one_warned_of():
    assert not judge_scenario(load_scenario("scale_ride")).warnings
    (warning,) = judge_scenario(load_scenario("scale_ride", overrides=["step_s=0.00025"])).warnings
    assert "step_s = 0.00025 is long for scale_vehicle" in warning and "step_s = 0.000125" in warning
    with pytest.raises(
        InputError, match=r"scale_ride.toml: step_s: .* unstable.* 0\.0005; .*set step_s = 0\.000125"
    ):
        judge_scenario(load_scenario("scale_ride", overrides=["step_s=0.0005"]))
    judge_scenario(load_scenario("scale_ride", overrides=["step_s=0.0005", "engine=kinematic"]))
