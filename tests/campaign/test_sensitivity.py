"""Indices of sensitivity against closed forms: of given responses, and through the campaign loop."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.campaign import run_campaign
from simrail.campaign.result import CampaignResult
from simrail.campaign.sensitivity import (
    INDEX_COLUMNS,
    FigureName,
    Sensitivity,
    _responses,
    indices_of,
    sensitivities,
    sensitivity_table,
)
from simrail.cli.main import BAD_INPUT, CELL_FAILED, call
from simrail.cli.sensitivity import _designed
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.scenario.cells import cells, count, first_cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.designs import block_size, design_shares
from simrail.scenario.scenario import Scenario, load_scenario
from simrail.sensors.imu import streams_of

A, B = 7.0, 0.1
"""Coefficients of Ishigami's function, sin x1 + A sin^2 x2 + B x3^4 sin x1 on [-pi, pi]^3."""

STANDS = """
title = "A device at rest"
seed = 5
track = "level_straight"
vehicle = "suspended_wheelset"
engine = "kinematic"
truth_rate_hz = 100.0
odometry = "none"
[monte_carlo]
method = "saltelli"
samples = 16
[[ride]]
name = "rest"
start_m = 50.0
rest_s = 2.0
final_rest_s = 0.0
[[imu]]
name = "axle"
grade = "./mine.toml"
body = "axle"
position_m = [0.0, 0.0, 0.0]
[score]
windows = ["whole"]
metrics = ["rms"]
"""

DEVICE = """
title = "Mine"
source = "made up for tests"
synthetic = true
rate_hz = 50.0
gyro_noise_degpsqrth = 0.3
accel_noise_ugpsqrthz = 100.0
"""

TOYS = """
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.core.columns import ATTITUDE
from simrail.estimation.estimate import Estimate


def roll_of(recording, roll):
    angles = np.zeros((len(recording.imu), 3))
    angles[:, 0] = roll
    states = pd.DataFrame(angles, index=recording.imu.index, columns=list(ATTITUDE))
    return Estimate(states=states, mount=recording.mount)


@dataclass(frozen=True)
class Ishigami:
    "A roll error of Ishigami's function, in milliradians and above 20 of them; it fails by digits of x2."
    x1: float
    x2: float
    x3: float
    fails: float = 0.0
    causal = True

    def estimate(self, recording):
        if abs(1e4 * self.x2) % 1.0 < self.fails:
            raise ValueError("planted failure")
        y = np.sin(self.x1) * (1.0 + 0.1 * self.x3**4) + 7.0 * np.sin(self.x2) ** 2
        return roll_of(recording, 1e-3 * (y + 20.0))


@dataclass(frozen=True)
class Linear:
    "Means of what the sensors say, weighed: the errors of the device as they are."
    causal = True

    def estimate(self, recording):
        means = recording.imu.mean()
        return roll_of(recording, 0.5 + 10.0 * means["gyro_x_radps"] + 2.0 * means["accel_y_mps2"])
"""

ISHIGAMI = """
[[estimator]]
name = "toy"
method = "./toys.py:Ishigami"
[estimator.options]
x1 = { uniform = [-3.141592653589793, 3.141592653589793] }
x2 = { uniform = [-3.141592653589793, 3.141592653589793] }
x3 = { uniform = [-3.141592653589793, 3.141592653589793] }
"""

LINEAR = """
[[estimator]]
name = "toy"
method = "./toys.py:Linear"
"""
BIASES = [
    "imu.sheet.gyro_turn_on_bias_degps={uniform=[0.0, 0.4]}",
    "imu.sheet.accel_turn_on_bias_mg={uniform=[1.0, 5.0]}",
    "imu.sheet.gyro_bias_instability_degph={log_uniform=[0.001, 0.01]}",
]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rides: Path) -> Path:
    (tmp_path / "toys.py").write_text(TOYS)
    (tmp_path / "mine.toml").write_text(DEVICE)
    (tmp_path / "ishigami.toml").write_text(STANDS + ISHIGAMI)
    (tmp_path / "linear.toml").write_text(STANDS + LINEAR)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def ran(name: str, *settings: str, batch_cells: int | None = None) -> tuple[Scenario, CampaignResult]:
    scenario = load_scenario(f"{name}.toml", overrides=settings)
    return scenario, run_campaign(scenario, workers=1, batch_cells=batch_cells)


def only_one(scenario: Scenario, result: CampaignResult) -> Sensitivity:
    (found,) = sensitivities(scenario.spec, result.scores, result.cells, FigureName())
    return found


def ishigami(shares: FloatArray) -> FloatArray:
    x = math.pi * (2.0 * shares - 1.0)
    y: FloatArray = np.sin(x[:, 0]) * (1.0 + B * x[:, 2] ** 4) + A * np.sin(x[:, 1]) ** 2
    return y


def ishigami_indices() -> tuple[list[float], list[float]]:
    """First-order and total indices, by integrals of the function's parts."""
    first = 0.5 * (1.0 + B * math.pi**4 / 5.0) ** 2
    second = A**2 / 8.0
    both = 8.0 * B**2 * math.pi**8 / 225.0
    whole = first + second + both
    return [first / whole, second / whole, 0.0], [(first + both) / whole, second / whole, both / whole]


def agree(found: pd.DataFrame, first: list[float], total: list[float], *, neglected: float = 1e-9) -> None:
    """Within two half widths of a 95 % interval: 3.9 standard deviations; and what is neglected."""
    for name, values in (("first", first), ("total", total)):
        away = np.abs(found[name].to_numpy() - values)
        assert np.all(away <= 2.0 * found[f"{name}_pm"].to_numpy() + neglected), found


def test_sobol_of_ishigami() -> None:
    shares = design_shares("saltelli", 1024, ["x1", "x2", "x3"], seed=3)
    found, dropped, why = indices_of("saltelli", ["x1", "x2", "x3"], shares, ishigami(shares), seed=3)
    assert (dropped, why) == (0, "")
    agree(found, *ishigami_indices())
    assert found.filter(like="_pm").to_numpy().max() < 0.12


@pytest.mark.parametrize("method", ["morris", "saltelli"])
def test_a_library_that_is_not_there_is_named(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shares = design_shares(method, 4, ["a", "b"], seed=1)
    for part in ("sample", "analyze"):
        for name in ("morris", "sobol"):
            monkeypatch.setitem(sys.modules, f"SALib.{part}.{name}", None)
    with pytest.raises(InputError, match=r"SALib, which is not installed.*simrail\[sensitivity\]") as error:
        design_shares(method, 4, ["a", "b"], seed=1)
    assert "\n" not in str(error.value)
    with pytest.raises(InputError, match=r"simrail\[sensitivity\]"):
        indices_of(method, ["a", "b"], shares, shares[:, 0], seed=1)


def test_sobol_of_a_linear_response() -> None:
    """S = ST = a^2 / sum(a^2), for uniform values of equal width."""
    names, slopes = list("abcd"), np.array([1.0, 2.0, -3.0, 0.0])
    shares = design_shares("saltelli", 256, names, seed=4)
    found, _, _ = indices_of("saltelli", names, shares, shares @ slopes, seed=4)
    expected = (slopes**2 / (slopes**2).sum()).tolist()
    agree(found, expected, expected)
    assert found["total"]["d"] == 0.0


def test_morris_of_a_linear_response() -> None:
    """Every elementary effect is the slope: mu = a, mu* = |a|, sigma = 0, exactly."""
    names, slopes = list("abcd"), np.array([1.0, 2.0, -3.0, 0.0])
    shares = design_shares("morris", 6, names, seed=4)
    found, _, _ = indices_of("morris", names, shares, shares @ slopes, seed=4)
    np.testing.assert_allclose(found["mu"], slopes, atol=1e-12)
    np.testing.assert_allclose(found["mu_star"], np.abs(slopes), atol=1e-12)
    np.testing.assert_allclose(found["sigma"], 0.0, atol=1e-12)


@pytest.mark.parametrize("method", ["morris", "saltelli"])
def test_a_failed_sample_takes_its_block_with_it(method: str) -> None:
    """As without that block at all; SALib alone turns one NaN into zeros, silently."""
    names = ["x1", "x2", "x3"]
    size = block_size(method, 3)
    shares = design_shares(method, 32, names, seed=6)
    values = ishigami(shares)
    holes = values.copy()
    holes[[5 * size, 5 * size + 2, 9 * size + 1]] = np.nan
    found, dropped, why = indices_of(method, names, shares, holes, seed=6)
    kept = np.ones(len(values), dtype=bool)
    for block in (5, 9):
        kept[block * size : (block + 1) * size] = False
    without, _, _ = indices_of(method, names, shares[kept], values[kept], seed=6)
    assert (dropped, why) == (2, "")
    pd.testing.assert_frame_equal(found, without)
    assert found.iloc[:2, 0].abs().min() > 0.05


@pytest.mark.parametrize(
    ("values", "words"), [(np.ones(20), "does not change"), (np.full(20, np.nan), "fewer than two blocks")]
)
def test_where_there_are_no_indices_it_is_said(values: FloatArray, words: str) -> None:
    shares = design_shares("saltelli", 4, list("abc"), seed=1)
    found, _, why = indices_of("saltelli", list("abc"), shares, values, seed=1)
    assert words in why
    assert found.isna().all(axis=None)


def failing(shares: FloatArray, share: float) -> FloatArray:
    """Samples at which the toy fails: by digits of x2 that have nothing to do with the response."""
    x2 = math.pi * (2.0 * shares[:, 1] - 1.0)
    mask: FloatArray = np.abs(1e4 * x2) % 1.0 < share
    return mask


def ishigami_through_the_loop(blocks: int) -> Sensitivity:
    """Run it with 5 % of the values of x2 failing, and judge all but the indices."""
    scenario, result = ran(
        "ishigami", "estimator.options.fails=0.05", f"monte_carlo.samples={blocks}", "seed=2"
    )
    found = only_one(scenario, result)
    failed = np.isnan(found.values)
    np.testing.assert_array_equal(failed, failing(found.shares, 0.05))
    assert 0 < found.dropped == np.count_nonzero(failed.reshape(blocks, 5).any(axis=1)) < 0.4 * blocks
    assert "planted failure" in found.note
    responses = np.degrees(1e-3 * (ishigami(found.shares) + 20.0))
    np.testing.assert_allclose(found.values[~failed], responses[~failed], rtol=1e-9)
    return found


def test_ishigami_through_the_campaign_loop_with_failures(place: Path) -> None:
    """Few blocks: held against what so few give of the function itself, over 60 other seeds."""
    found = ishigami_through_the_loop(16)
    names = list(found.indices.index)
    others = []
    for seed in range(100, 160):
        shares = design_shares("saltelli", 16, names, seed=seed)
        values = np.where(failing(shares, 0.05), np.nan, ishigami(shares))
        others.append(
            indices_of("saltelli", names, shares, values, seed=seed)[0][["first", "total"]].to_numpy()
        )
    mean, sd = np.mean(others, axis=0), np.std(others, axis=0)
    assert np.all(np.abs(found.indices[["first", "total"]].to_numpy() - mean) < 4.0 * sd)
    table = sensitivity_table([found])
    assert sorted(table["value"]) == [f"estimator.toy.options.{name}" for name in ("x1", "x2", "x3")]
    assert table["dropped"].eq(found.dropped).all()


@pytest.mark.slow
def test_ishigami_through_the_campaign_loop_equals_the_closed_form(place: Path) -> None:
    agree(ishigami_through_the_loop(512).indices, *ishigami_indices())


def linear_slopes(scenario: Scenario) -> FloatArray:
    """What the biases do to the roll of `Linear`, deg over their distributions, by the device's own draws."""
    cell = next(cells(scenario))
    streams = streams_of(cell.sensor_seed, cell.sensor_draw, cell.imu.name)
    gyro, accel = (streams(f"{kind}_turn_on_bias").uniform(-1.0, 1.0, 3) for kind in ("gyro", "accel"))
    widths = np.array([10.0 * gyro[0] * math.radians(0.4), 2.0 * accel[1] * 4e-3 * 9.80665])
    return np.degrees(widths)


def test_terms_of_a_sheet_through_the_campaign_loop(place: Path) -> None:
    """A response that is linear in two biases of one device: Morris and Sobol have closed forms.

    Only if the seeds are common to all samples: else the sign and size of the biases, and the noise, would
    change from sample to sample.
    """
    _, result = ran("linear", *BIASES)
    scenario = load_scenario("linear.toml", overrides=BIASES)
    found = only_one(scenario, result)
    slopes = linear_slopes(scenario)
    names = [
        "imu.axle.sheet.gyro_turn_on_bias_degps",
        "imu.axle.sheet.accel_turn_on_bias_mg",
        "imu.axle.sheet.gyro_bias_instability_degph",
    ]
    assert sorted(found.indices.index) == sorted(names)
    ordered = found.indices.loc[names]
    places = [list(found.indices.index).index(name) for name in names[:2]]
    rest = found.values - found.shares[:, places] @ slopes
    assert np.ptp(rest) < 1e-3 * np.abs(slopes).min()  # the bias that wanders; noise is the same everywhere
    shares = [*(slopes**2 / (slopes**2).sum()), 0.0]
    agree(ordered, shares, shares, neglected=1e-3)
    assert len(result.rides) == 1
    design = [*BIASES, "monte_carlo.method='morris'", "monte_carlo.samples=4"]
    scenario, result = ran("linear", *design)
    screened = only_one(scenario, result).indices.loc[names]
    np.testing.assert_allclose(screened["mu"][:2], slopes, rtol=1e-6)
    assert screened["mu_star"].iloc[2] < 1e-3 * np.abs(slopes).min()


def test_devices_are_averaged_and_the_same_in_every_sample(place: Path) -> None:
    """Of more draws, the mean over the same devices; a sample of which one draw failed has no response."""
    scenario, result = ran("linear", *BIASES, "monte_carlo.samples=4", "monte_carlo.sensor_draws=3")
    found = only_one(scenario, result)
    scores = result.scores
    of_roll = scores[(scores["quantity"] == "roll") & (scores["reference"] == "truth")]
    assert len(of_roll) == 3 * len(found.values)
    np.testing.assert_allclose(found.values, of_roll["value"].to_numpy().reshape(-1, 3).mean(axis=1))
    holed = result.scores.copy()
    row = of_roll.index[4]  # the second draw of the second sample
    holed.loc[row, "value"] = np.nan
    holed["status"] = holed["status"].astype(str)
    holed.loc[row, "status"] = "planted"
    (missing,) = sensitivities(scenario.spec, holed, result.cells, FigureName())
    assert np.flatnonzero(np.isnan(missing.values)).tolist() == [1]
    assert (missing.dropped, missing.note) == (1, "planted")


def test_the_same_bits_in_batches_of_any_size(place: Path) -> None:
    small = [*BIASES, "monte_carlo.samples=2"]
    tables = [ran("linear", *small, batch_cells=size)[1].scores for size in (1, 7)]
    pd.testing.assert_frame_equal(*tables)


@pytest.mark.parametrize(
    ("settings", "rides_expected"),
    [
        ([], 1),
        (["irregularity.scale={uniform=[0.5, 1.5]}"], 4 * 2),
        (["monte_carlo.track_draws=2"], 2),
        (["monte_carlo.method='sobol'"], 4),
    ],
)
def test_samples_that_differ_in_sensors_only_share_the_ride(
    settings: list[str], rides_expected: int, place: Path
) -> None:
    """Of one value of the rails, a block of Saltelli has two: that of A, and that of B."""
    scenario = load_scenario("linear.toml", overrides=[*BIASES, "monte_carlo.samples=4", *settings])
    listed = list(cells(scenario))
    assert count(scenario) == (rides_expected, len(listed))
    assert [cell.number for cell in listed] == list(range(len(listed)))
    rides = [cell.ride_number for cell in listed]
    assert rides == sorted(rides) and len(set(rides)) == rides_expected
    for cell in first_cells(scenario):
        assert listed[cell.number].settings == cell.settings
        assert listed[cell.number].ride_number == cell.ride_number
    plan = judge_scenario(scenario)
    by_number = {cell.ride_number: plan.parts.ride(cell) for cell in listed}
    for cell in listed:
        assert plan.parts.ride(cell) is by_number[cell.ride_number]
    shares = scenario.spec.monte_carlo.method == "saltelli"
    assert (len({cell.sensor_seed for cell in listed if cell.track_draw == 0}) == 1) == shares


def test_figures_of_a_sheet_take_the_place_of_its_own(place: Path) -> None:
    settings = ["imu.sheet.gyro_noise_degpsqrthz=[0.01, 0.02]", "monte_carlo.method='sobol'"]
    scenario = load_scenario("linear.toml", overrides=[*settings, "monte_carlo.samples=1"])
    plan = judge_scenario(scenario)
    grades = [plan.parts.grade(cell) for cell in cells(scenario)]
    assert [grade.gyro_noise_radpsqrts for grade in grades] == [math.radians(0.01), math.radians(0.02)]
    for grade in grades:
        assert grade.accel_noise_mpsqrts == pytest.approx(1e-4 * 9.80665)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["linear.toml"], ["monte_carlo.method", "no value is one", "imu.sheet"]),
        (["ishigami.toml", "--samples", "12"], ["samples", "12", "16"]),
        (["ishigami.toml", "--method", "fast"], ["--method", "morris, saltelli"]),
        (
            ["linear.toml", "--set", "imu.sheet.angle_random_walk='0.3 deg/sqrt(h)'"],
            ["gyro_noise_degpsqrth = 0.3"],
        ),
        (
            ["linear.toml", "--set", "imu.sheet.gyro_range_degps={uniform=[-1.0, 5.0]}"],
            ["imu[0].sheet", "> 0"],
        ),
        (
            [
                "linear.toml",
                "--set",
                BIASES[0],
                "--set",
                "imu.sheet.gyro_scale_error_percent={uniform=[0, 90.0]}",
            ],
            ["imu[0].sheet", "gyro_scale_error", "< 0.2"],
        ),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], words: list[str], place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["sensitivity", *arguments]) == BAD_INPUT
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    for word in words:
        assert word in said.err
    assert not (place / "results").exists()


def test_requirements_are_left_out_and_the_design_put_in(place: Path) -> None:
    """Verdicts are over devices, and all samples of a design have the same."""
    required = (place / "ishigami.toml").read_text() + '[[require]]\nquantity = "roll"\nlimit = "1 deg"\n'
    (place / "required.toml").write_text(required)
    assert load_scenario("required.toml").spec.require
    spec = _designed("required.toml", "morris", 3, None, []).spec
    assert (spec.require, spec.monte_carlo.method, spec.monte_carlo.samples) == ((), "morris", 3)
    assert _designed("required.toml", None, None, None, []).spec.monte_carlo.samples == 16  # its own
    assert _designed("required.toml", "morris", None, None, []).spec.monte_carlo.samples == 10  # the usual
    with pytest.raises(InputError, match="does not go with require"):
        judge_scenario(load_scenario("required.toml"))


@pytest.mark.parametrize("table", ["stop", "passes"])
def test_a_design_is_run_whole(table: str, place: Path) -> None:
    other = {
        "stop": '[stop]\nestimator = "toy"\nquantity = "roll"\nmetric = "rms"\nwidth = 1.0\n',
        "passes": "",
    }[table]
    text = (place / "ishigami.toml").read_text() + other
    (place / "stopped.toml").write_text(text.replace("title =", "passes = 1\ntitle =") if not other else text)
    with pytest.raises(InputError, match=f"does not go with {table}"):
        judge_scenario(load_scenario("stopped.toml"))


def test_the_command_writes_tables_and_figures_and_does_not_run_twice(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One of 8 blocks has a failure: it is told, and ends with the code of failed cells."""
    arguments = ["sensitivity", "ishigami.toml", "--samples", "8", "--workers", "1", "--seed", "2"]
    arguments += ["--set", "estimator.options.fails=0.05"]
    assert call(arguments) == CELL_FAILED
    said = capsys.readouterr()
    assert "estimator.toy.options.x1" in said.out and "first order" in said.out
    assert "1 of 8 blocks left out: ValueError: planted failure" in said.out
    folder = place / "results" / "ishigami_saltelli"
    table = pd.read_csv(folder / "sensitivity_roll_rms_whole.csv")
    assert list(table["rank"]) == [1, 2, 3] and list(table["dropped"]) == [1, 1, 1]
    figure = (folder / "sensitivity_roll_rms_whole_toy.svg").read_text()
    assert figure.startswith("<svg") and figure.count("total index") == 3
    assert call(arguments) == CELL_FAILED
    again = capsys.readouterr()
    assert "of the finished results" in again.err and again.out == said.out
    assert call([*arguments, "--of", "rol"]) == BAD_INPUT
    assert "--of" in capsys.readouterr().err


@pytest.mark.parametrize(("method", "by"), [("saltelli", "total"), ("morris", "mu_star")])
def test_the_most_influential_is_first_by_the_total_effect_or_the_mean_size(method: str, by: str) -> None:
    """What acts together with others alone has no first-order effect; what has no index is last."""
    rising = np.arange(12.0).reshape(3, 4)
    table = pd.DataFrame(-rising, index=["a", "b", "c"], columns=list(INDEX_COLUMNS[method]))
    table[by] = [0.2, np.nan, 0.7]
    shares, values = np.zeros((0, 3)), np.zeros(0)
    found = Sensitivity("", "ekf", FigureName(), "deg", method, table, shares, values, 2, 0)
    assert found.order == ["c", "a", "b"]


def test_a_sample_counts_by_all_of_its_draws_or_not_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """The mean of its draws; where one has no value, or no row, it has none, and the reason is told."""
    monkeypatch.setattr("simrail.campaign.sensitivity.sample_count", lambda _: 4)
    cells = pd.DataFrame({"cell": range(8), "sample": [0, 0, 1, 1, 2, 2, 3, 3]})
    rows = pd.DataFrame(
        {
            "cell": [7, 0, 1, 2, 3, 4, 6],
            "value": [5.0, 1.0, 3.0, 9.0, np.nan, 9.0, 6.0],
            "status": ["ok", "ok", "ok", "ok", "time limit", "ok", "ok"],
        }
    )
    values, reason = _responses(None, rows, cells)  # type: ignore[arg-type]
    np.testing.assert_array_equal(values, [2.0, np.nan, np.nan, 5.5])
    assert reason == "time limit"
    values, reason = _responses(None, rows[rows["cell"] != 3], cells)  # type: ignore[arg-type]
    np.testing.assert_array_equal(values, [2.0, np.nan, np.nan, 5.5])
    assert reason == ""
