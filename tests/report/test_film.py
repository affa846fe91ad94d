"""What a film holds: poses by an independent oracle, ranges, methods, faulty input; page and picture."""

import base64
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from simrail import InputError, load_scenario
from simrail.cli.main import call
from simrail.core.toml_files import load
from simrail.report.film import gif
from simrail.report.film.film import FRAME_HZ, Film, _film, _rows, film_of, scenario_of
from simrail.report.film.gif import GIF_HZ, pace, write_gif
from simrail.report.film.page import film_data, write_film
from simrail.report.film.shapes import boxes_of, discs_of, profile_lines
from simrail.ride.kinematic import kinematic_truth
from simrail.scoring.table import SCORE_COLUMNS
from simrail.track.design import Straight, TrackDesign
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

SHORT = ["ride.end_m=190.0", "ride.rest_s=1.0", "ride.final_rest_s=1.0", "monte_carlo.sensor_draws=1"]


@pytest.fixture(scope="module")
def film(own_cache: None) -> Film:
    return film_of(load_scenario("quick_kinematic", overrides=SHORT))


def unpacked(text: str, columns: int) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f4").reshape(-1, columns)


def test_poses_are_those_of_bodies_that_follow_the_rails(film):
    """The kinematic engine's bodies keep to the rails at their own place: the film must find them there."""
    for name, pose in film.poses.items():
        left_y, left_z, right_y, right_z = film.rails.rails(pose[:, 0]).T
        body = film.vehicle.body(name)
        roll = (left_z - right_z) / film.rails.design.rail_base_m
        lateral = 0.5 * (left_y + right_y) - body.position_m[2] * roll
        # First order in the roll; a place beside would be off by the irregularity, millimetres.
        np.testing.assert_allclose(pose[:, 1], lateral, atol=2e-6)
        np.testing.assert_allclose(pose[:, 2], body.position_m[2] + 0.5 * (left_z + right_z), atol=1e-5)
        np.testing.assert_allclose(pose[:, 3], roll, atol=1e-7)
        np.testing.assert_allclose(pose[:, 0] - film.reference_m, body.position_m[0], atol=2e-3)


def test_frames_are_uniform_and_wheels_roll(film):
    np.testing.assert_allclose(np.diff(film.time_s), 1.0 / FRAME_HZ, atol=1e-9)
    way = film.reference_m - film.reference_m[0]
    turned = next(iter(film.turns_rad.values()))
    np.testing.assert_allclose(turned * film.vehicle.wheels[0].radius_m, way, rtol=1e-3, atol=1e-3)


def test_page_carries_what_the_film_holds_and_fetches_nothing(film, tmp_path):
    page = write_film(tmp_path / "new" / "film.html", film)
    text = page.read_text(encoding="utf-8")
    assert not re.search(r"""(src|href)=|https?://(?!www\.w3\.org/)|@import|fetch\(""", text)
    assert page.stat().st_size < 5e6 * max(film.duration_s, 10.0) / 60.0
    data = film_data(film)
    for body in data["bodies"]:
        pose = unpacked(body["pose"], 6)
        pose_there = film.poses[body["name"]] - [data["origin_m"], 0, 0, 0, 0, 0]
        np.testing.assert_allclose(pose, pose_there, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(unpacked(data["attitude"]["true"], 2), film.true_rad, rtol=1e-6)
    rails = data["rails"]
    place = rails["from"] + data["origin_m"] + rails["step"] * np.arange(len(unpacked(rails["rows"], 4)))
    np.testing.assert_allclose(unpacked(rails["rows"], 4), film.rails.rails(place), atol=1e-9)


def test_range_is_where_the_vehicle_is_first(film, own_cache):
    scenario = load_scenario("quick_kinematic", overrides=SHORT)
    piece = film_of(scenario, from_m=150.0, to_m=60.0, method="design_angles")
    assert piece.reference_m.min() >= 60.0
    assert piece.reference_m.max() <= 150.0
    speed = 50.0 / 3.6
    # It drives at its full speed there: the frames at either end are within one frame of the places.
    assert piece.reference_m[0] - 60.0 < speed / FRAME_HZ
    assert 150.0 - piece.reference_m[-1] < speed / FRAME_HZ
    assert next(iter(piece.estimated_rad)) == "design_angles"
    at = round(piece.time_s[0] * FRAME_HZ)
    np.testing.assert_allclose(piece.time_s[0], film.time_s[at], atol=0.5 / FRAME_HZ)


def test_signals_of_the_imu_do_not_fold(own_cache):
    """A tone faster than the frames is averaged away, not shown as a slow one."""
    from simrail.report.film.film import _mean_at

    when = np.arange(0.0, 10.0, 0.001)
    slow = np.sin(2.0 * np.pi * 0.5 * when)
    signal = pd.Series(slow + np.sin(2.0 * np.pi * 251.0 * when), index=when)
    wanted = np.arange(0.1, 9.9, 1.0 / FRAME_HZ)
    # 251 Hz leaves at most 1/(pi f T) = 3 % in a mean over 40 ms; a sample each frame would leave all.
    np.testing.assert_allclose(_mean_at(signal, wanted), np.sin(np.pi * wanted), atol=0.05)


@pytest.mark.parametrize(
    ("options", "field", "limit"),
    [
        ({"from_m": -50.0}, "--from", "10.0 to 190.0 m"),
        ({"to_m": 900.0}, "--to", "10.0 to 190.0 m"),
        ({"from_m": float("nan")}, "--from", "finite"),
        ({"from_m": 100.0, "to_m": 101.0}, "--to", "10.0 to 190.0 m"),
        ({"method": "ekf"}, "--method", "one of ekf_compensated"),
        ({"cell": 9}, "--cell", "0 to 1"),
    ],
)
def test_faulty_input_is_one_line(own_cache, options, field, limit):
    scenario = load_scenario("quick_kinematic", overrides=SHORT)
    with pytest.raises(InputError) as caught:
        film_of(scenario, **options)
    assert caught.value.field == field
    assert limit in str(caught.value)
    assert "\n" not in str(caught.value)


def test_command_refuses_before_it_writes(here, capsys):
    assert call(["film", "quick_kinematic", "--out", "film.txt"]) == 2
    assert call(["film", "quick_kinematic", "--gif", "film.html"]) == 2
    assert call(["film", "quick_kinematic", "--gif", "a.gif", "--out", "a.html"]) == 2
    assert call(["film", "no_such"]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 4
    told = ("--out", "FILE.html"), ("--gif", "FILE.gif"), ("--out --gif", "one of"), ("no_such", "")
    assert all(field in line and limit in line for line, (field, limit) in zip(lines, told, strict=True))
    assert not list(here.iterdir())


def test_results_have_their_own_settings(here):
    folder = here / "results"
    folder.mkdir()
    (folder / "manifest.json").write_text("{}")
    with pytest.raises(InputError, match="settings that they were made with"):
        scenario_of(str(folder), overrides=["seed=2"])
    with pytest.raises(InputError, match="no finished results"):
        scenario_of(str(folder))
    own = load_scenario("quick_kinematic", overrides=["seed=7", "ride.speed_kmh=33.0"])
    manifest = {"scenario": "mine", "settings": ["ride.speed_kmh=33.0"], "seed": 7, "scenario_text": own.text}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    pd.DataFrame(columns=list(SCORE_COLUMNS)).to_parquet(folder / "scores.parquet")
    pd.DataFrame(columns=["cell", "case", "map", "vibration"]).to_parquet(folder / "cells.parquet")
    again = scenario_of(str(folder))
    assert (again.name, again.spec.seed) == ("mine", 7)
    assert again.spec.ride[0].speed_kmh == 33.0


def test_picture_for_slides(film, tmp_path):
    short = replace(
        film,
        time_s=film.time_s[:20],
        reference_m=film.reference_m[100:120],
        poses={name: pose[100:120] for name, pose in film.poses.items()},
        turns_rad={name: turn[100:120] for name, turn in film.turns_rad.items()},
        true_rad=film.true_rad[100:120],
        estimated_rad={name: values[100:120] for name, values in film.estimated_rad.items()},
    )
    path = write_gif(tmp_path / "film.gif", short)
    with Image.open(path) as picture:
        assert picture.n_frames == len(range(0, 20, round(pace(short) * FRAME_HZ / GIF_HZ)))
        assert picture.info["duration"] == 1000 / GIF_HZ
        first = np.asarray(picture.convert("RGB"), dtype=float)
        picture.seek(picture.n_frames - 1)
        assert np.mean(np.abs(np.asarray(picture.convert("RGB"), dtype=float) - first)) > 0.5


def test_shapes_are_made_of_the_model(film):
    vehicle = film.vehicle
    car = next(box for box in boxes_of(vehicle) if box.kind == "car")
    body = vehicle.body("body")
    long = np.ptp(car.corners[:, 0])
    # A uniform box: Iyy + Izz - Ixx = m L^2 / 6.
    roll, pitch, yaw = body.inertia_kgm2
    assert body.mass_kg * long**2 / 6.0 == pytest.approx(pitch + yaw - roll)
    floor = body.position_m[2] + car.corners[:, 2].min()
    assert floor > 2.0 * max(disc.radius_m for disc in discs_of(vehicle))
    wheel, rail, offset = profile_lines(vehicle)
    # Set down in the middle, the wheel just touches its rail: they meet within 0.2 mm, and nowhere deeper.
    gap = np.interp(rail[:, 0] - offset, wheel[:, 0], wheel[:, 1]) - rail[:, 1]
    assert abs(gap.min()) < 2e-4


def test_a_frame_is_beams_over_the_axle_boxes_with_transoms_between() -> None:
    vehicle = load(VehicleFile, "vehicle", "manchester_1").model("manchester_1")
    frame = vehicle.body("frame_front")
    boxes = [box for box in boxes_of(vehicle) if box.body == frame.name]
    corners = np.array([box.corners for box in boxes if box.kind == "frame"])
    assert len(corners) == len(boxes) == 14
    beams, transoms = corners[:12], corners[12:]
    inner = np.abs(beams[..., 1]).min()
    assert np.abs(transoms[..., 1]).max() == pytest.approx(inner)  # they end where the beams begin
    ends = np.sort(np.abs(beams[..., 0]).max(axis=1))
    assert np.diff(np.unique(ends.round(9))) == pytest.approx(ends[0])  # pieces without gaps between
    axles = np.array([box.corners for box in boxes_of(vehicle) if box.kind == "axle"])
    assert corners[..., 1].max() == pytest.approx(axles[..., 1].max())


def test_rows_of_a_range_hold_both_of_its_ends() -> None:
    """At 100 rows a second and 25 frames a second; 0.1 m a row, out and back."""
    place = np.concatenate([np.arange(0.0, 100.0, 0.1), np.arange(100.0, 0.0, -0.1)])
    track = SimpleNamespace(
        start_m=0.0, end_m=200.0, curvature=lambda s: np.where((s > 40.0) & (s < 60.0), -1e-3, 0.0)
    )
    time = np.arange(len(place)) / 100.0
    ride = SimpleNamespace(reference_position_m=place, time_s=time, rate_hz=100.0, track=track)
    assert _rows(ride, 19.95, 60.05) == range(200, 601, 4)  # type: ignore[arg-type]
    assert _rows(ride, 60.05, 19.95) == range(200, 601, 4)  # type: ignore[arg-type]
    assert _rows(ride, None, 60.05) == range(0, 601, 4)  # type: ignore[arg-type]
    assert _rows(ride, 79.95, None) == range(800, 1201, 4)  # type: ignore[arg-type]
    assert _rows(ride, None, None) == range(0, 2000, 4)  # type: ignore[arg-type]
    # Of a long ride the minute about its sharpest curve, which begins 24 s into it.
    ride.reference_position_m = np.arange(20_000) / 100.0
    ride.time_s = np.arange(20_000) / 100.0
    assert _rows(ride, None, None) == range(1604, 7605, 4)  # type: ignore[arg-type]
    track.curvature = lambda s: np.where(s > 190.0, 1e-3, 0.0)
    assert _rows(ride, None, None) == range(13_999, 20_000, 4)  # type: ignore[arg-type]


def test_what_is_farther_is_drawn_before_what_hides_it(film, monkeypatch):
    """Seen from behind: depth is the place along the track; car bodies come last, as glass."""
    drawn = []
    monkeypatch.setattr(gif, "_draw_box", lambda *given, glass=False: drawn.append((*given[2:4], glass)))
    monkeypatch.setattr(gif, "_draw_disc", lambda *given: drawn.append((*given[2:4], False)))
    camera = SimpleNamespace(depth=lambda places: places.T[0] if places.ndim == 2 else places[0])
    gif._draw_vehicle(film, None, camera, 50)
    depth = [
        gif._placed(pose, part.corners if hasattr(part, "corners") else np.array([part.middle_m]))[
            :, 0
        ].mean()
        for pose, part, glass in drawn
        if not glass
    ]
    glasses = [glass for _, _, glass in drawn]
    assert len(depth) > len(film.vehicle.wheels) and np.ptp(depth) > 1.0
    assert (np.diff(depth) <= 1e-9).all()
    assert glasses == sorted(glasses) and glasses[-1]


def test_everything_of_a_film_is_at_its_frames(monkeypatch):
    """Forces of every fifth row, wheels of each, attitudes by the IMU's times: each tells its time."""
    line = TrackDesign("line", 0.0, (Straight(200.0),))
    truth = kinematic_truth(line, SpeedProfile(50.0, 90.0, 10.0, rest_s=1.0))
    time = truth.time_s
    kept = np.column_stack([time[::5], 2.0 * time[::5]])
    truth = replace(truth, contacts={"w": kept}, contact_every=5, wheel_angles={"w": 3.0 * time})
    when = pd.Index(time[7:-9:4], name="time_s")
    told = pd.DataFrame({"roll_rad": 4.0 * when.to_numpy(), "pitch_rad": 5.0 * when.to_numpy()}, index=when)
    cell = SimpleNamespace(ride=SimpleNamespace(name="r"), imu=SimpleNamespace(grade="g.toml", name="n"))
    ride = SimpleNamespace(vehicle=SimpleNamespace(bodies=()), engine="compiled")
    parts = SimpleNamespace(
        resolve=lambda _: SimpleNamespace(ride=ride, mount=None), rails=lambda _: "the rails"
    )
    seen = SimpleNamespace(
        recording=SimpleNamespace(imu=told),
        estimates={"ekf": SimpleNamespace(states=0.5 * told), "speed": SimpleNamespace(states=told[[]])},
        motion=told,
    )
    monkeypatch.setattr("simrail.report.film.film._signals", lambda *_: ())
    monkeypatch.setattr("simrail.report.film.film._notes", lambda *_: ())
    made = _film(SimpleNamespace(name="s"), cell, parts, truth, seen, range(500, 1900, 40))
    frames = time[500:1900:40]
    np.testing.assert_array_equal(made.time_s, frames)
    np.testing.assert_array_equal(made.reference_m, truth.reference_position_m[500:1900:40])
    np.testing.assert_allclose(made.contacts["w"], np.column_stack([frames, 2.0 * frames]), atol=1e-12)
    np.testing.assert_allclose(made.turns_rad["w"], 3.0 * frames, atol=1e-12)
    np.testing.assert_allclose(made.true_rad, np.column_stack([4.0 * frames, 5.0 * frames]), atol=1e-12)
    assert list(made.estimated_rad) == ["ekf"] and made.imu == "g (n)"
    np.testing.assert_allclose(made.estimated_rad["ekf"], 0.5 * made.true_rad, atol=1e-12)
