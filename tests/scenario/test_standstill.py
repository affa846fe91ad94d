"""Rides that do not move, the Earth's rotation and temperature in a scenario; one sensor more."""

import json
import tomllib

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ACCEL, GYRO, VELOCITY
from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import load_scenario, read_scenario
from simrail.sensors.imu import EARTH_RATE_RADPS
from simrail.sensors.measure import measure

STANDSTILL = shipped("scenario")["standstill"].read_text(encoding="utf-8")
QUICK = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
SHORT = ["ride.rest_s=20.0"]


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def recordings(scenario):
    """Recording of each cell, by the name of its IMU."""
    parts, truths = Parts(scenario), {}
    found = {}
    for cell in cells(scenario):
        if cell.ride_number not in truths:
            truths[cell.ride_number] = simulate(parts.ride(cell))
        resolved = parts.resolve(cell)
        found[cell.imu.name, cell.imu.grade] = measure(
            truths[cell.ride_number],
            name=cell.ride.name,
            mount=resolved.mount,
            grade=resolved.grade,
            encoder=resolved.encoder,
            odometry="truth" if cell.spec.encoder is None else None,
            seed=cell.sensor_seed,
            draw=cell.sensor_draw,
            earth_rate=resolved.earth_rate,
            temperature=resolved.temperature,
        )
    return found


def test_an_hour_at_rest_with_six_imus_is_fine():
    scenario = load_scenario("standstill")
    plan = judge_scenario(scenario)
    assert plan.simulated_s == 3600.0
    assert not plan.warnings
    grades = {cell.imu.grade for cell in cells(scenario)}
    assert grades == {
        "lord_3dm_gx4_25",
        "ideal",
        "consumer",
        "industrial",
        "tactical",
        "navigation",
    }


def test_nothing_moves_and_gravity_is_felt():
    found = recordings(load_scenario("standstill", overrides=SHORT))
    assert len(found) == 6
    ideal = found["ideal", "ideal"].imu
    assert len(ideal) == 20 * 250 + 1
    assert (ideal[list(GYRO)] == 0.0).all(axis=None)
    np.testing.assert_array_equal(ideal[list(ACCEL)], np.tile([0.0, 0.0, 9.81], (len(ideal), 1)))
    assert found["lord", "lord_3dm_gx4_25"].imu["gyro_x_radps"].std() > 1e-3
    names = [name for name, _ in found]
    for i, one in enumerate(names[1:], 1):
        for other in names[i + 1 :]:
            a, b = (next(r.imu for key, r in found.items() if key[0] == n) for n in (one, other))
            if one != "ideal":
                assert (a != b).mean().min() > 0.9


def test_the_earth_turns_at_the_latitude_of_the_scenario():
    latitude, x_axis = np.radians(37.34), np.radians(160.0)
    text = STANDSTILL + "\n[earth]\nlatitude_deg = 37.34\nx_axis_deg = 160.0\n"
    turning = recordings(read_scenario(text, name="standstill", overrides=SHORT))
    still = recordings(load_scenario("standstill", overrides=SHORT))
    # X points 160 deg from east towards north; its share of the northward rate is sin(160 deg).
    level = EARTH_RATE_RADPS * np.cos(latitude)
    expected = [level * np.sin(x_axis), level * np.cos(x_axis), EARTH_RATE_RADPS * np.sin(latitude)]
    felt = turning["ideal", "ideal"].imu
    np.testing.assert_allclose(felt[list(GYRO)], np.tile(expected, (len(felt), 1)), atol=1e-18)
    assert np.degrees(np.linalg.norm(expected)) * 3600.0 == pytest.approx(15.04, abs=0.01)
    # A navigation grade finds it in 20 s: N sqrt(1/20) = 0.03 deg/h, bias 0.01 deg/h.
    mean = turning["navigation", "navigation"].imu[list(GYRO)].mean() - expected
    assert np.degrees(np.abs(mean)).max() * 3600.0 < 0.15
    force = turning["ideal", "ideal"].imu[list(ACCEL)]
    pd.testing.assert_frame_equal(force, still["ideal", "ideal"].imu[list(ACCEL)], check_exact=True)


def test_earth_and_temperature_are_axes_and_stand_in_the_manifest(tmp_path):
    from simrail.results import run

    first, *_, last = STANDSTILL.split("[[imu]]")
    text = "[[imu]]".join([first, last]) + "\n[earth]\nlatitude_deg = [0.0, 60.0]\n"
    plain = tmp_path / "plain.toml"
    plain.write_text("[[imu]]".join([first, last]), encoding="utf-8")
    text += "[temperature]\nstart_c = 5.0\nambient_c = 30.0\n"
    overrides = [*SHORT, "ride.rest_s=2.0"]
    file = tmp_path / "turning.toml"
    file.write_text(text, encoding="utf-8")
    results = run(str(file), out=tmp_path / "out", overrides=overrides)
    assert not results.campaign.failures
    assert set(results.campaign.cells["earth.latitude_deg"]) == {0.0, 60.0}
    assert set(results.campaign.cells["direction"]) == {"standing"}
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["earth"]["latitude_deg"] == [0.0, 60.0]
    assert manifest["temperature"]["ambient_c"] == 30.0
    report = (tmp_path / "out" / "report.html").read_text()
    assert "latitude" in report
    assert run(str(plain), out=tmp_path / "plain", overrides=overrides).manifest["earth"] == "at rest"


def test_temperature_of_the_scenario_reaches_the_sensor(tmp_path):
    warm = tmp_path / "warm.toml"
    warm.write_text(
        'title = "warm"\nsource = "made up"\nrate_hz = 250.0\ngyro_bias_temperature_degpspk = 0.01\n'
    )
    text = QUICK.replace('["lord_3dm_gx4_25", "ideal"]', '"./warm.toml"')
    text += "\n[temperature]\nstart_c = 25.0\nambient_c = 65.0\ntime_constant_s = 10.0\n"
    settings = ["ride.end_m=40.0", "monte_carlo.sensor_draws=1"]
    found = recordings(read_scenario(text, name="warm", folder=tmp_path, overrides=settings))
    (recording,) = found.values()
    bias = recording.imu["gyro_x_radps"].iloc[: 5 * 250]
    t = bias.index.to_numpy()
    warmth = 40.0 * (1.0 - np.exp(-t / 10.0))
    ratio = bias.to_numpy()[100:] / warmth[100:]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    assert 0.0 < abs(ratio[0]) <= np.radians(0.01)


def test_an_imu_more_changes_no_other_bit_by_bit():
    settings = ["ride.end_m=60.0", "monte_carlo.sensor_draws=1", 'imu.axle.grade="lord_3dm_gx4_25"']
    alone = recordings(read_scenario(QUICK, name="quick", overrides=settings))
    extra = '\n[[imu]]\nname = "second"\ngrade = "consumer"\nbody = "front"\nposition_m = [0.0, 0.0, 0.6]\n'
    together = recordings(
        read_scenario(QUICK.replace("[encoder]", extra + "[encoder]"), name="quick", overrides=settings)
    )
    (name,) = alone
    assert len(together) == 2
    pd.testing.assert_frame_equal(alone[name].imu, together[name].imu, check_exact=True)
    pd.testing.assert_frame_equal(alone[name].encoder, together[name].encoder, check_exact=True)


def test_a_standing_vehicle_of_the_compiled_engine_stands():
    from simrail.ride.truth import Mount

    scenario = load_scenario("standstill", overrides=["ride.rest_s=2.0", 'engine="compiled"'])
    cell = next(iter(cells(scenario)))
    truth = simulate(Parts(scenario).ride(cell))
    motion = truth.motion(Mount("m", "axle", (0.0, 0.0, 0.45)))
    assert len(motion) == 2 * 250 + 1
    assert np.abs(motion[list(VELOCITY)].to_numpy()).max() < 1e-6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("rest_s = 3600.0", "rest_s = 3600.0\nspeed_kmh = 20.0"), ["ride[0]", "end_m is missing"]),
        (("rest_s = 3600.0", "rest_s = 3600.0\nend_m = 90.0"), ["ride[0]", "speed_kmh is missing"]),
        (
            ("final_rest_s = 0.0", "final_rest_s = 0.0\nstops = [{position_m = 60.0, dwell_s = 3.0}]"),
            ["ride[0]", "no stops"],
        ),
        (("rest_s = 3600.0\n", "rest_s = 0.0\n"), ["rest_s", "no time"]),
        (
            ("truth_rate_hz = 250.0", "truth_rate_hz = 300.0"),
            ["truth_rate_hz", "1000 Hz divided", "try"],
        ),
        (("truth_rate_hz = 250.0", "truth_rate_hz = 100.0"), ["imu[0].grade", "rate_hz", "250.0", "100 Hz"]),
        (
            ('grade = "consumer"', 'grade = "xsens_mti_300"'),
            ["imu[2].grade.bandwidth_hz", "< 125 Hz"],
        ),
        (("[[estimator]]", "[earth]\nlatitude_deg = 91.0\n[[estimator]]"), ["earth.latitude_deg", "<= 90"]),
        (("[[estimator]]", "[earth]\nlatitude = 45.0\n[[estimator]]"), ["earth.latitude", "latitude_deg?"]),
        (
            ("[[estimator]]", '[encoder]\nwheel = "axle.left"\nradius = "calibrated"\n[[estimator]]'),
            ["encoder.radius", "standstill", "drawing"],
        ),
    ],
)
def test_faults_are_refused_by_name(change, words):
    assert change[0] in STANDSTILL
    text = STANDSTILL.replace(*change, 1)
    tomllib.loads(text)
    with pytest.raises(InputError) as caught:
        judge_scenario(read_scenario(text, name="standstill"))
    for word in words:
        assert word in str(caught.value)
