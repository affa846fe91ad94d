"""The scenario model: reading, axes, settings, cells."""

from __future__ import annotations

import tomllib
from itertools import product
from math import radians
from pathlib import Path

import pytest
from pydantic import Field

from simrail.cli.templates import write_template
from simrail.core.errors import InputError
from simrail.core.toml_files import Part, judge, shipped
from simrail.scenario import check
from simrail.scenario.axes import Axis, Listed, axes_of, expand
from simrail.scenario.build import Parts
from simrail.scenario.build_estimator import estimator_of
from simrail.scenario.cells import cells, count, derived_seed, methods
from simrail.scenario.check import judge_scenario
from simrail.scenario.distributions import distributions_of
from simrail.scenario.overrides import override
from simrail.scenario.scenario import load_scenario, read_scenario
from simrail.scenario.vibration_tables import VibrationPart
from simrail.sensors.encoder import EncoderSpec, Slip
from simrail.sensors.magnetic_surroundings import Steel, Traction
from simrail.sensors.magnetometer import EarthField, MagnetometerSpec, VehicleIron
from simrail.track.map_errors import MapErrors

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")


class Inner(Part):
    size_m: Listed[float] = 1.0
    place_m: tuple[float, float] = (0.0, 0.0)


class Outer(Part):
    name: str = "x"
    speed: Listed[float] = 1.0
    inner: Inner = Inner()
    options: dict[str, object] = Field(default_factory=dict)


def hunts_above_255(model: object, top_mps: float, *, gravity_mps2: float) -> float | None:
    """In the place of the search for a critical speed."""
    return 255.0 / 3.6 if top_mps > 255.0 / 3.6 else None


LARGE = ("bounds", "bounds_multibody")
"""Scenarios of thousands of rides, each of which is judged."""


@pytest.mark.parametrize(
    "name",
    [
        *(
            pytest.param(name, marks=[pytest.mark.long] * (name in LARGE))
            for name in sorted(shipped("scenario"))
        ),
        pytest.param("", marks=pytest.mark.slow),
    ],
)
def test_shipped_scenarios_are_good(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The critical speed of the kicked vehicle is searched for in the slow case, without a name."""
    if name == "manchester_cases":
        monkeypatch.setattr("simrail.vehicle.hunting.critical_below", hunts_above_255)
    name = name or "manchester_cases"
    plan = judge_scenario(load_scenario(name))
    # A kick is ridden above the critical speed on purpose, one of the vehicles of the odometry has none, and
    # the fastest rides of the track-relative smoother are faster through the curves than is comfortable.
    warned = {
        "manchester_cases": "hunts above",
        "odometry": "irw_car runs unstably above",
        "track_relative": "uncompensated lateral acceleration",
        "passes": "uncompensated lateral acceleration",
        "bounds": "uncompensated lateral acceleration",
        "bounds_multibody": "irw_car runs unstably above",
        "coverage": "uncompensated lateral acceleration",
    }
    assert bool(plan.warnings) == (name in warned)
    several = ("track_relative", "passes", "bounds", "bounds_multibody", "coverage")
    assert name in several or len(plan.warnings) <= 1
    assert all(warned[name] in warning for warning in plan.warnings)
    # Where rails are scored alone, the baseline is that of rails.
    rails_alone = ("passes", "vertical_profile")
    # An IMU without a map has no design angles to be held against; its page holds it against the paper.
    baseline = "zero_track" if name in rails_alone else "design_angles"
    bounds_alone = ("bounds", "bounds_multibody", "coverage", "scale_greatest")
    assert (baseline in plan.estimators) == (name not in ("imu_only", *bounds_alone))
    grades = {cell.imu.grade for cell in cells(load_scenario(name))}
    # The floor of every estimator is in every table; a table of odometries alone has none of an estimator,
    # ranges of a sheet are no grade, and a ladder is of what can be bought.
    without = ("odometry", "track_relative_parts", "sensitivity", "imu_only", "which_imu", *bounds_alone)
    assert ("ideal" in grades) == (name not in without)


@pytest.mark.parametrize("name", sorted(shipped("scenario")))
def test_a_train_knows_its_line_by_a_map_that_errs_and_a_laboratory_exactly(name: str) -> None:
    """Full-size scenarios have the default map; what shows an exact one beside it is told here."""
    spec = load_scenario(name).spec
    if name in ("scale_ride", "scale_track", "scale_greatest"):
        assert spec.map is None
        return
    assert spec.map is not None
    beside = {"go20a", "metro_table3", "metro_geometry", "odometry", "passes"}
    assert axes_of(spec.map) == ({"exact": (False, True)} if name in beside else {})
    assert next(cells(load_scenario(name))).map_label == "drawn", "the ablation does not come first"
    if name == "sensitivity":
        assert set(distributions_of(spec.map)) == {"cant_sd_mm"}
        return
    assert all(part.errors() == MapErrors() for _, part in expand(spec.map) if not part.exact)


@pytest.mark.parametrize("name", sorted(shipped("scenario")))
def test_full_size_vehicles_shake_by_default_and_say_it(name: str) -> None:
    """Each with the sources of the bare table; what shows silence beside it is told here.

    A scale model, a body that follows the rails, and noise at rest are without, and say why.
    """
    scenario = load_scenario(name)
    part, first = scenario.spec.vibration, next(cells(scenario))
    laboratory = ("scale_ride", "scale_track", "scale_greatest")
    if name in (*laboratory, "quick_kinematic", "standstill", "sensitivity", "bounds"):
        assert part is None and first.vibration_label == "off"
        assert "# Without [vibration]" in scenario.text or "Without\n# [vibration]" in scenario.text
        return
    assert part is not None and first.vibration_label == "on", "the ablation does not come first"
    beside = {"go20a", "metro_table3", "metro_geometry", "shaking"}
    assert axes_of(part) == ({"off": (False, True)} if name in beside else {})
    default = VibrationPart().model_dump(exclude={"off", "join", "rate_hz"})
    assert part.model_dump(exclude={"off", "join", "rate_hz"}) == default
    labels = {(cell.vibration_label, cell.spec.vibration.off) for cell in cells(scenario)}
    assert labels == ({("on", False), ("off", True)} if name in beside else {("on", False)})


def test_a_template_has_the_default_map(tmp_path: Path) -> None:
    path, _ = write_template("scenario", "my_line", folder=tmp_path)
    part = load_scenario(str(path)).spec.map
    assert part is not None and part.errors() == MapErrors()
    ride, _ = write_template("ride", "my_ride", folder=tmp_path)
    assert "[map]\n" in ride.read_text(encoding="utf-8")


def test_go20a_is_the_ride_of_the_paper() -> None:
    scenario = load_scenario("go20a")
    first = Parts(scenario).resolve(next(cells(scenario)))
    profile = first.ride.profile
    assert profile.speed_mps == pytest.approx(20.0 / 3.6)
    assert profile.direction == 1 and profile.rest_s == 20.0
    assert first.mount.body == "front" and first.mount.position_m == (0.0, 0.0, 0.6)
    assert first.encoder is not None and first.encoder.wheel == "trailing.left"
    ride = first.ride
    assert ride.engine == "exudyn" and ride.vehicle.synthetic and ride.track.synthetic
    assert {method.name for method in methods(scenario)} >= {
        f"{method}_{word}" for method in ("ekf", "gda") for word in ("compensated", "uncompensated")
    }


def test_axes_are_found_in_nested_tables_and_options_but_lists_by_nature_are_none() -> None:
    model = judge(
        Outer,
        {"speed": [1, 2.5], "inner": {"size_m": [3.0, 4.0, 5.0], "place_m": [1.0, 2.0]}},
        file="x.toml",
    ).model_copy(update={"options": {"flag": Axis([True, False]), "gain": 3.0}})
    assert axes_of(model) == {
        "speed": (1.0, 2.5),
        "inner.size_m": (3.0, 4.0, 5.0),
        "options.flag": (True, False),
    }
    assert axes_of(model, prefix="ride.", fields=("speed",)) == {"ride.speed": (1.0, 2.5)}
    found = expand(model)
    assert [tuple(settings.values()) for settings, _ in found] == list(
        product((1.0, 2.5), (3.0, 4.0, 5.0), (True, False))
    )
    for settings, concrete in found:
        assert axes_of(concrete) == {}
        assert concrete.speed == settings["speed"] and concrete.inner.size_m == settings["inner.size_m"]
        assert concrete.inner.place_m == (1.0, 2.0)
        assert concrete.options == {"flag": settings["options.flag"], "gain": 3.0}
    assert axes_of(model)  # expanding changes nothing


def test_a_model_without_axes_is_its_own_expansion() -> None:
    assert expand(Outer()) == [({}, Outer())]


def test_settings_replace_values() -> None:
    data = tomllib.loads(GOOD)
    for setting, value in [
        ("seed=7", ("seed",)),
        ("ride[0].speed_kmh=70", ("ride", 0, "speed_kmh")),
        ("ride.speed_kmh=[20, 70]", ("ride", 0, "speed_kmh")),
        ("ride.out.rest_s=3.5", ("ride", 0, "rest_s")),
        ("irregularity.spectrum=fra_5", ("irregularity", "spectrum")),
        ("estimator.ekf_uncompensated.options.compensated=true", ("estimator", 1, "options", "compensated")),
        ("score.metrics=['rms']", ("score", "metrics")),
        ("imu[0].position_m=[0, 0, 1]", ("imu", 0, "position_m")),
        ("title=a = b", ("title",)),
    ]:
        changed = override(data, [setting])
        place = changed
        for step in value:
            place = place[step]
        text = setting.split("=", 1)[1]
        expected = {"fra_5": "fra_5", "a = b": "a = b"}.get(text)
        assert place == (expected if expected is not None else tomllib.loads(f"v = {text}")["v"])
    assert data == tomllib.loads(GOOD)  # the raw data are not touched
    assert override(data, ["seed=7", "seed=8"])["seed"] == 8


def test_seed_argument_replaces_the_seed_and_is_told() -> None:
    scenario = load_scenario("quick_kinematic", seed=99)
    assert scenario.spec.seed == 99 and scenario.overrides == ("seed=99",)


def test_cells_are_the_product_of_axes_rides_imus_and_draws() -> None:
    text = GOOD.replace(
        "[[imu]]", '[[ride]]\nname = "back"\nstart_m = 590.0\nend_m = 10.0\nspeed_kmh = 20.0\n\n[[imu]]'
    )
    scenario = read_scenario(
        text,
        name="many",
        overrides=[
            "ride.out.speed_kmh=[20, 30, 50]",
            "irregularity.scale=[0.5, 1.0]",
            "odometry=['encoder', 'truth']",
            "monte_carlo.track_draws=2",
            "monte_carlo.sensor_draws=3",
        ],
    )
    listed = list(cells(scenario))
    rides = 2 * (3 + 1) * 2
    assert count(scenario) == (rides, rides * 2 * 2 * 3) == (rides, len(listed))
    assert [cell.number for cell in listed] == list(range(len(listed)))
    assert len({cell.ride_number for cell in listed}) == rides
    assert len({cell.case for cell in listed}) == 2 * (3 + 1) * 2 * 2
    # cells of one ride stand in a row, and cells of one case differ in nothing but draws
    numbers = [cell.ride_number for cell in listed]
    assert numbers == sorted(numbers)
    by_case: dict[int, set[str]] = {}
    for cell in listed:
        by_case.setdefault(cell.case, set()).add(repr((cell.settings, cell.ride, cell.imu)))
        assert cell.settings.get("ride.speed_kmh", 20.0) == cell.ride.speed_kmh
        assert cell.settings["irregularity.scale"] == cell.spec.irregularity.scale  # type: ignore[union-attr]
        assert cell.settings["odometry"] == cell.spec.odometry
    assert all(len(different) == 1 for different in by_case.values())


def test_estimator_variants_have_names_of_their_own() -> None:
    scenario = load_scenario(
        "quick_kinematic",
        overrides=[
            "estimator[0].options.rest_bias=[true, false]",
            "estimator[0].options.tuning=['recommended', 'paper_final']",
        ],
    )
    found = methods(scenario)
    assert [method.name for method in found] == [
        "ekf_compensated[rest_bias=True,tuning=recommended]",
        "ekf_compensated[rest_bias=True,tuning=paper_final]",
        "ekf_compensated[rest_bias=False,tuning=recommended]",
        "ekf_compensated[rest_bias=False,tuning=paper_final]",
        "ekf_uncompensated",
        "design_angles",
    ]
    assert [method.tuning for method in found][:3] == ["recommended", "paper_final", "recommended"]
    made = estimator_of(scenario, found[3])
    assert (made.tuning, made.rest_bias, made.compensated) == ("paper_final", False, True)  # type: ignore[attr-defined]


def test_seeds_belong_to_names() -> None:
    assert derived_seed(1, "track_draw", 0) == derived_seed(1, "track_draw", 0)
    names = [("track_draw", 0), ("track_draw", 1), ("track_draw", "0"), ("sensors_of_track_draw", 0)]
    assert len({derived_seed(root, *name) for root in (1, 2) for name in names}) == 8
    assert all(0 <= derived_seed(root, "x") < 2**63 for root in range(50))


def test_hash_covers_content_and_parts_but_not_comments() -> None:
    def hash_of(text: str, *settings: str) -> str:
        return judge_scenario(read_scenario(text, name="a", overrides=settings)).content_hash

    plain = hash_of(GOOD)
    assert hash_of("# a comment\n" + GOOD) == plain
    assert hash_of(GOOD, "seed=1") == plain
    assert (
        len(
            {
                plain,
                hash_of(GOOD, "seed=2"),
                hash_of(GOOD, "ride.speed_kmh=51"),
                hash_of(GOOD, "track=level_straight"),
            }
        )
        == 4
    )


def test_hash_changes_with_the_file_of_a_part(tmp_path) -> None:  # type: ignore[no-untyped-def]
    track = shipped("track")["smooth_curve"].read_text(encoding="utf-8")
    found = set()
    for cant in ("76.0", "75.0"):
        (tmp_path / "own.toml").write_text(track.replace("76.0", cant))
        scenario = read_scenario(GOOD.replace('"smooth_curve"', '"own.toml"'), name="a", folder=tmp_path)
        found.add(judge_scenario(scenario).content_hash)
    assert len(found) == 2


def test_own_parts_are_found_beside_the_scenario(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "parts").mkdir()
    for kind, name in (("track", "smooth_curve"), ("vehicle", "metro_irw_bogie"), ("imu", "ideal")):
        (tmp_path / "parts" / f"{name}.toml").write_bytes(shipped(kind)[name].read_bytes())
    text = GOOD
    for name in ("smooth_curve", "metro_irw_bogie", "ideal"):
        text = text.replace(f'"{name}"', f'"parts/{name}.toml"')
    (tmp_path / "mine.toml").write_text(text)
    scenario = load_scenario(tmp_path / "mine.toml")
    judge_scenario(scenario)
    assert Parts(scenario).track(next(cells(scenario))).name == "smooth_curve"


def test_warning_between_the_two_limits_of_lateral_acceleration() -> None:
    # 80 km/h over R300 with 76 mm cant: 22.22^2/300 - 9.81 * 76/1500 (nearly) = 1.15 m/s2.
    settings = ["ride.speed_kmh=80", "ride.acceleration_mps2=2.5", "ride.jerk_mps3=5.0"]
    (warning,) = judge_scenario(load_scenario("quick_kinematic", overrides=settings)).warnings
    expected = (80 / 3.6) ** 2 / 300 - 9.81 * 76 / 1500
    assert f"{expected:.2f} m/s2" in warning and "curve 3 R300" in warning
    with pytest.raises(InputError, match="cannot hold"):
        judge_scenario(load_scenario("quick_kinematic", overrides=[*settings, "ride.speed_kmh=89"]))
    # Too much cant counts as well: standing on it is no matter, running slowly is none either.
    slow = load_scenario("quick_kinematic", overrides=["ride.speed_kmh=5"])
    assert judge_scenario(slow).warnings == ()


def test_warning_where_the_speed_is_never_reached() -> None:
    (warning,) = judge_scenario(load_scenario("quick_kinematic", overrides=["ride.end_m=100.0"])).warnings
    assert "reaches" in warning and "of 50 km/h" in warning


def test_dwell_and_stops_count_in_the_plan() -> None:
    base = judge_scenario(load_scenario("quick_kinematic"))
    stop = judge_scenario(
        load_scenario("quick_kinematic", overrides=["ride.stops=[{position_m=300.0, dwell_s=20.0}]"])
    )
    assert stop.simulated_s > base.simulated_s + 20.0
    draws = judge_scenario(load_scenario("quick_kinematic", overrides=["monte_carlo.track_draws=3"]))
    assert draws.simulated_s == pytest.approx(3 * base.simulated_s) and draws.rides == 3


SENSORS = """
[encoder]
wheel = "front.left"
pulses_per_revolution = 100
quadrature = [false, true]
missed_rate = 1e-5
radius_error = 0.002

[[encoder.slip]]
start_s = 20.0
duration_s = 3.0
creepage = -0.1

[[encoder.slip]]
start_s = 30.0
duration_s = 1.0
creepage = 0.2
ramp_s = 0.5

[magnetometer]
x_axis_deg = 30.0
declination_deg = -1.0

[magnetometer.iron]
[magnetometer.traction]
supply = ["catenary", "third_rail"]
mass_t = 60.0
[magnetometer.steel]
spacing_m = 30.0
"""


def test_encoder_and_magnetometer_say_in_text_what_their_specifications_are() -> None:
    text = GOOD[: GOOD.index("[encoder]")] + SENSORS + GOOD[GOOD.index("[[estimator]]") :]
    scenario = read_scenario(text, name="sensors", overrides=["monte_carlo.track_draws=2"])
    parts = judge_scenario(scenario).parts
    listed = [parts.resolve(cell) for cell in cells(scenario)]
    assert len(listed) == 2 * 2 * 2 * 2 * 2  # quadrature, supply, grade, two draws each
    first = listed[0]
    assert first.cell.settings["magnetometer.traction.supply"] == "catenary"
    assert first.encoder == EncoderSpec(
        "front.left",
        pulses_per_revolution=100,
        missed_rate=1e-5,
        radius_error=0.002,
        slip=(Slip(20.0, 3.0, -0.1), Slip(30.0, 1.0, 0.2, ramp_s=0.5)),
    )
    assert first.magnetometer == MagnetometerSpec(
        field=EarthField(declination_rad=radians(-1.0), x_axis_rad=radians(30.0)),
        iron=VehicleIron(),
        traction=Traction(mass_kg=60e3),
        steel=Steel(track_seed=first.ride.track_seed, spacing_m=30.0),
    )
    # Steel is the track's: the same for both sensor draws, another for another track.
    seeds = {(one.cell.track_draw, one.magnetometer.steel.track_seed) for one in listed}  # type: ignore[union-attr]
    assert len(seeds) == 2
    assert {one.encoder.counts_per_revolution for one in listed} == {100, 400}  # type: ignore[union-attr]


def test_an_empty_magnetometer_table_is_a_clean_field() -> None:
    for text, expected in ((GOOD, None), (GOOD + "\n[magnetometer]\n", MagnetometerSpec())):
        scenario = read_scenario(text, name="mine")
        assert Parts(scenario).resolve(next(cells(scenario))).magnetometer == expected


def test_what_is_judged_is_what_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A campaign gets the nouns of a cell that the checks have had; draws of the sensors share them."""
    judged = []
    monkeypatch.setattr(
        check, "judge_ride", lambda resolved, **_: (judged.append(resolved), (1.0, [], None))[1]
    )
    scenario = load_scenario("quick_kinematic")
    parts = check.judge_scenario(scenario).parts
    first, second = (cell for cell in cells(scenario) if cell.case == 0)
    assert second.sensor_draw == 1 and parts.resolve(second).cell is second
    for name in ("ride", "mount", "grade", "encoder", "bands"):
        noun = getattr(judged[0], name)
        assert noun is getattr(parts.resolve(first), name) is getattr(parts.resolve(second), name)
    assert parts.ride(second) is judged[0].ride


def test_warnings_that_differ_by_numbers_are_told_once() -> None:
    plan = judge_scenario(
        load_scenario("track_relative", overrides=["ride.speed_kmh=[78.0, 80.0]", "monte_carlo.samples=1"])
    )
    (told,) = [one for one in plan.warnings if "uncompensated" in one]
    assert told.endswith("(and 3 more like it)") and "78 km/h" in told


@pytest.mark.parametrize("name", ["full", "D0", "D1", "D2", "D3"])
def test_no_band_of_ones_own_takes_the_name_of_another(name: str) -> None:
    with pytest.raises(InputError, match="name that is taken"):
        load_scenario("quick_kinematic", overrides=[f"geometry.own_bands={{{name}=[3.0, 30.0]}}"])
