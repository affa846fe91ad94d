"""Faults in what a scenario asks of the ride itself: one message that names field, value and remedy."""

import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import read_scenario

QUICK = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
COMPILED = QUICK.replace('engine = "kinematic"', 'engine = "compiled"')
SAFETY, COMFORT = "\n[running_safety]\n", "\n[ride_comfort]\n"
RATE = 'track = "smooth_curve"'

FAULTS = {
    "forces of a body that follows the rails": (
        QUICK + SAFETY,
        ["contact_rate_hz", "no forces", "compiled or exudyn"],
    ),
    "forces that are kept too rarely": (
        COMPILED.replace(RATE, f"{RATE}\ncontact_rate_hz = 50.0") + SAFETY,
        ["contact_rate_hz", "too low for [running_safety]", "50.0", ">= 100 Hz", "take [running_safety] out"],
    ),
    "a truth that is too coarse for comfort": (
        QUICK.replace(RATE, f"{RATE}\ntruth_rate_hz = 100.0") + COMFORT,
        ["truth_rate_hz", "too low for [ride_comfort]", "100.0", ">= 200 Hz", "take [ride_comfort] out"],
    ),
    "a vehicle that is none": (
        COMPILED + SAFETY + 'vehicle = "tram"\n',
        ["running_safety.vehicle", "'tram'", "'passenger' or 'freight'"],
    ),
    "a limit of nothing": (
        COMPILED + SAFETY + "derailment_limit = 0.0\n",
        ["running_safety.derailment_limit", "0.0", "> 0"],
    ),
    "an estimator of the name that the ride has": (
        QUICK.replace('name = "design_angles"', 'name = "truth"') + COMFORT,
        ["estimator", "'truth'", "the ride itself", "another name"],
    ),
    "a stop rule on forces that are not scored": (
        QUICK + '[stop]\nestimator = "truth"\nquantity = "wheel_unloading"\nmetric = "max"\nwidth = 0.01\n',
        ["stop.estimator", "'truth'", "ekf_compensated"],
    ),
    "a kick behind the ride": (
        QUICK.replace("end_m = 590.0", "end_m = 590.0\nkick_end_m = 595.0"),
        ["ride[0].kick_end_m", "595.0", "10 to 590 m", "between start_m and end_m"],
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_one_message(fault):
    text, wanted = FAULTS[fault]
    with pytest.raises(InputError) as caught:
        judge_scenario(read_scenario(text, name="faulty"))
    for word in wanted:
        assert word in str(caught.value)


def test_a_stop_rule_may_ask_for_a_figure_of_the_ride():
    rule = '[stop]\nestimator = "truth"\nquantity = "comfort_nmv"\nmetric = "p95"\nwidth = 0.1\n'
    rule += "least_draws = 2\n"
    draws = QUICK.replace("sensor_draws = 2", "track_draws = 3")
    judge_scenario(read_scenario(draws + COMFORT + rule, name="stops"))
