"""Distributions as values: quantiles against scipy, the joint design, and what a sample changes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells, count, first_cells, methods
from simrail.scenario.check import judge_scenario
from simrail.scenario.distributions import Distribution, dimensions, samples_of
from simrail.scenario.scenario import Scenario, read_scenario

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
SPEED = "ride.out.speed_kmh={ uniform = [20.0, 50.0] }"
SCALE = "irregularity.scale={ log_uniform = [0.5, 2.0] }"
ROLL = "imu.axle.roll_deg={ normal = [0.0, 1.0], bounds = [-2.0, 3.0] }"
GAIN = "estimator.ekf_uncompensated.options.doubt={ uniform = [1.0, 9.0] }"


def read(*settings: str, samples: int = 16, method: str = "latin_hypercube") -> Scenario:
    monte_carlo = [f"monte_carlo.samples={samples}", f"monte_carlo.method={method}"]
    return read_scenario(GOOD, name="drawn", overrides=[*monte_carlo, *settings])


def column(scenario: Scenario, name: str) -> np.ndarray:
    return np.array([sample[name] for sample in samples_of(scenario.spec)])


@pytest.mark.parametrize(
    ("distribution", "oracle"),
    [
        (Distribution("uniform", (20.0, 70.0)), stats.uniform(20.0, 50.0)),
        (Distribution("log_uniform", (0.1, 10.0)), stats.loguniform(0.1, 10.0)),
        (Distribution("normal", (50.0, 5.0), (35.0, 57.0)), stats.truncnorm(-3.0, 1.4, 50.0, 5.0)),
    ],
)
def test_values_are_quantiles(distribution: Distribution, oracle: stats.rv_continuous) -> None:
    shares = np.linspace(0.0, 1.0, 101)
    found = np.array([distribution.at(share) for share in shares])
    assert found == pytest.approx(oracle.ppf(shares), rel=1e-9)


def test_every_item_of_a_choice_is_as_likely() -> None:
    choice = Distribution("choice", ("a", "b", "c"))
    assert [choice.at(share) for share in (0.0, 0.333, 0.334, 0.666, 0.667, 1.0)] == list("aabbcc")


def test_a_latin_hypercube_has_one_value_in_each_share_of_every_dimension() -> None:
    scenario = read(SPEED, SCALE, ROLL, samples=25)
    assert list(dimensions(scenario.spec)) == [
        "irregularity.scale",
        "ride.out.speed_kmh",
        "imu.axle.roll_deg",
    ]
    speed = (column(scenario, "ride.out.speed_kmh") - 20.0) / 30.0
    scale = np.log(column(scenario, "irregularity.scale") / 0.5) / np.log(4.0)
    roll = stats.truncnorm(-2.0, 3.0).cdf(column(scenario, "imu.axle.roll_deg"))
    for share in (speed, scale, roll):
        assert sorted((25.0 * share).astype(int)) == list(range(25))
    # Columns are independent: 3/sqrt(n - 1) is three standard deviations of a correlation.
    assert np.abs(np.corrcoef([speed, scale, roll])[np.triu_indices(3, 1)]).max() < 3.0 / np.sqrt(24.0)


def test_sobol_points_fill_every_elementary_box() -> None:
    """A digital shift keeps the net: of 16 points one in each box of 2^-a x 2^-b with a + b = 4."""
    scenario = read(SPEED, SCALE, samples=16, method="sobol")
    x = (column(scenario, "ride.out.speed_kmh") - 20.0) / 30.0
    y = np.log(column(scenario, "irregularity.scale") / 0.5) / np.log(4.0)
    for a in range(5):
        boxes = {(int(px * 2**a), int(py * 2 ** (4 - a))) for px, py in zip(x, y, strict=True)}
        assert len(boxes) == 16


def test_a_new_distribution_changes_no_other() -> None:
    plain = column(read(SPEED), "ride.out.speed_kmh")
    assert np.array_equal(column(read(SPEED, SCALE, ROLL, GAIN), "ride.out.speed_kmh"), plain)
    fewer = column(read(SPEED, ROLL, method="sobol"), "ride.out.speed_kmh")
    more = column(read(SPEED, ROLL, GAIN, samples=64, method="sobol"), "ride.out.speed_kmh")
    assert np.array_equal(more[:16], fewer)  # Sobol: nor does a new sample


def test_another_seed_draws_others() -> None:
    for method in ("latin_hypercube", "sobol"):
        one, other = (column(read(SPEED, f"seed={k}", method=method), "ride.out.speed_kmh") for k in (1, 2))
        assert not np.isclose(one, other).any()


def test_every_sample_has_its_values_everywhere_and_draws_of_its_own() -> None:
    settings = [SPEED, SCALE, ROLL, GAIN, "odometry=['encoder', 'truth']", "monte_carlo.track_draws=2"]
    scenario = read(*settings, samples=4)
    listed, values = list(cells(scenario)), samples_of(scenario.spec)
    assert count(scenario) == (4 * 2, len(listed)) == (8, 4 * 2 * 2 * 2 * 2)
    assert [cell.number for cell in listed] == list(range(len(listed)))
    assert len({cell.case for cell in listed}) == 4  # two odometries, two grades: chance makes no case
    for cell in listed:
        drawn = values[cell.sample]
        assert cell.ride.speed_kmh == cell.settings["ride.speed_kmh"] == drawn["ride.out.speed_kmh"]
        assert cell.spec.irregularity is not None
        assert cell.spec.irregularity.scale == drawn["irregularity.scale"]
        assert cell.imu.roll_deg == drawn["imu.axle.roll_deg"]
        name = "estimator.ekf_uncompensated.options.doubt"
        assert cell.settings[name] == drawn[name]
    seeds = {(cell.sample, cell.track_draw): (cell.ride_seed, cell.sensor_seed) for cell in listed}
    assert len({seed for pair in seeds.values() for seed in pair}) == 2 * 4 * 2
    first = [cell for cell in listed if cell.track_draw == cell.sensor_draw == 0]
    assert list(first_cells(scenario)) == first


def test_estimators_have_the_options_of_the_sample() -> None:
    scenario = read(GAIN, samples=4)
    parts = Parts(scenario)
    for k, sample in enumerate(samples_of(scenario.spec)):
        made = parts.estimators(k)
        assert list(made) == [method.name for method in methods(scenario)]
        assert made["ekf_uncompensated"].doubt == sample["estimator.ekf_uncompensated.options.doubt"]  # type: ignore[attr-defined]
        assert made["ekf_compensated"] is parts.estimators(0)["ekf_compensated"]


def test_seeds_do_not_change_with_lists_and_samples() -> None:
    plain = next(cells(read_scenario(GOOD, name="plain")))
    many = ["ride.out.speed_kmh=[50.0, 20.0]", SCALE, "monte_carlo.track_draws=3"]
    grown = [cell for cell in cells(read(*many, samples=8)) if cell.sample == cell.track_draw == 0]
    assert {(cell.ride_seed, cell.sensor_seed) for cell in grown} == {(plain.ride_seed, plain.sensor_seed)}


def test_reversed_rides_turn_start_end_and_stops() -> None:
    stops = "ride.stops=[{position_m = 100.0, dwell_s = 3.0}, {position_m = 400.0, dwell_s = 4.0}]"
    scenario = read_scenario(GOOD, name="turned", overrides=["ride.reverse=[false, true]", stops])
    judge_scenario(scenario)
    there, back = (
        cell.ride for cell in cells(scenario) if cell.sensor_draw == 0 and cell.imu.grade == "ideal"
    )
    assert (there.start_m, there.end_m) == (back.end_m, back.start_m) == (10.0, 590.0)
    assert [stop.position_m for stop in there.stops] == [100.0, 400.0]
    assert [stop.position_m for stop in back.stops] == [400.0, 100.0]


def test_an_imu_may_have_fewer_draws() -> None:
    two = GOOD.replace(
        "[encoder]",
        '[[imu]]\nname = "floor"\ngrade = "ideal"\nbody = "front"\nposition_m = [0.0, 0.0, 0.6]\n'
        "sensor_draws = 2\n\n[encoder]",
    )
    settings = ["monte_carlo.sensor_draws=5", "monte_carlo.track_draws=2", "imu.axle.grade=consumer"]
    scenario = read_scenario(two, name="floor", overrides=settings)
    listed = list(cells(scenario))
    assert count(scenario) == (2, 2 * (5 + 2)) == (2, len(listed))
    assert [cell.number for cell in listed] == list(range(len(listed)))
    assert [cell.sensor_draw for cell in listed if cell.imu.name == "floor"] == [0, 1, 0, 1]
    assert [cell.number for cell in first_cells(scenario)] == [0, 5]
    few = read_scenario(two, name="floor", overrides=["monte_carlo.sensor_draws=1"])
    assert {cell.sensor_draw for cell in cells(few)} == {0}


def test_samples_that_draw_nothing_and_draws_of_one_sample_are_warned_of() -> None:
    assert "counts for nothing" in judge_scenario(read(samples=4)).warnings[0]
    assert "set monte_carlo.samples" in judge_scenario(read(SCALE, samples=1)).warnings[0]
    assert judge_scenario(read(SCALE, samples=2)).warnings == ()


def test_every_sample_is_judged_before_anything_runs() -> None:
    too_fast = "ride.speed_kmh={ uniform = [60.0, 95.0] }"
    with pytest.raises(InputError, match="cannot hold this speed"):
        judge_scenario(read("ride.acceleration_mps2=2.5", "ride.jerk_mps3=5.0", too_fast))
