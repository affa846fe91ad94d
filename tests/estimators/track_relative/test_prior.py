"""What is known before a ride: stationary where it should be, by the sheets, nothing of what is left out."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np
import pytest
import twins.track_relative as twin
from scipy.linalg import solve_continuous_lyapunov
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.full_rate import Waviness
from simrail.estimators.track_relative.noise import (
    AXLE,
    BODY,
    FRAME,
    JOINTED,
    LONE,
    MODEL_BODY,
    MOST_DAMPING,
    SLOW_M,
    WAGON,
    Motion,
    at_scale,
    model_body,
    motion_of,
)
from simrail.estimators.track_relative.prior import PARTS, first_state, heading_sd, noise_of, start_of

from simrail.core.errors import InputError
from simrail.recording.sheets.vehicle_sheet import SheetBody, Support, VehicleSheet

TRUCK = VehicleSheet(
    (
        SheetBody("front axle", 2.0),
        SheetBody("rear axle", -2.0),
        SheetBody("frame", 0.0, (Support("rear axle", -2.0), Support("front axle", 2.0))),
        SheetBody("car", 0.0, (Support("frame", 0.0), Support("other frame", -12.0))),
        SheetBody("tender", 30.0, (Support("tender axle", -2.0), Support("other axle", 2.0))),
        SheetBody("tender axle", 28.0),
    )
)


def test_the_class_of_a_mount_is_that_of_the_drawing(rough: Callable) -> None:
    drawn = replace(rough(), vehicle_sheet=TRUCK)
    classes = {"front axle": AXLE, "frame": FRAME, "car": BODY, "tender": WAGON, "not drawn": WAGON}
    for body, motion in classes.items():
        assert motion_of(replace(drawn, mount_body=body)) is motion
    assert motion_of(rough()) is WAGON


def test_a_body_on_one_bogie_or_between_others_is_jointed(rough: Callable) -> None:
    """One on two bogies is not, nor one on axles, nor one that hangs on no other."""
    train = VehicleSheet(
        (
            *(SheetBody(f"axle {i}", x) for i, x in enumerate((6.0, 4.0, -14.0, -16.0))),
            SheetBody("bogie", 5.0, (Support("axle 1", -1.0), Support("axle 0", 1.0))),
            SheetBody("last bogie", -15.0, (Support("axle 3", -1.0), Support("axle 2", 1.0))),
            SheetBody("end", 5.5, (Support("bogie", -0.5),)),
            SheetBody("between", -5.0, (Support("other end", -4.0), Support("end", 4.0))),
            SheetBody("other end", -15.0, (Support("last bogie", 0.0),)),
            SheetBody("coach", -5.0, (Support("last bogie", -10.0), Support("bogie", 10.0))),
        )
    )
    classes = {"end": JOINTED, "between": JOINTED, "coach": BODY, "bogie": FRAME, "axle 0": AXLE}
    for body, motion in classes.items():
        assert motion_of(replace(rough(), vehicle_sheet=train, mount_body=body)) is motion, body
    alone = VehicleSheet(train.bodies[:7])
    assert motion_of(replace(rough(), vehicle_sheet=alone, mount_body="end")) is LONE


def test_cant_along_the_line_is_correlated_as_the_sheet_says(rough: Callable) -> None:
    """By 1/e over its length: that of a Matern 3/2 process, by its own matrix exponential."""
    recording = rough()
    along = twin.processes(noise_of(recording, AXLE))[at.PAIRS.index(at.CANT_ALONG)]
    f, _ = twin.moved(along.generator, along.p, recording.map_errors.cant_along_length_m)
    assert (f @ along.p)[0, 0] / along.p[0, 0] == pytest.approx(math.exp(-1.0), rel=1e-9)


@pytest.mark.parametrize("name", ["roll_sd", "gyro", "pitch_length", "damping", "y_length"])
def test_a_motion_out_of_range_is_refused(name: str) -> None:
    for value in (
        -1.0,
        math.nan,
        math.inf,
        *([0.0] if name in ("pitch_length", "damping", "y_length") else []),
    ):
        with pytest.raises(InputError, match=name) as caught:
            Motion(**{name: value})
        assert caught.value.field == name


@pytest.mark.parametrize("motion", [AXLE, BODY], ids=["by distance", "by time"])
def test_the_body_begins_as_it_stays(rough: Callable, motion: Motion) -> None:
    """The start's covariance of each process is the stationary one of its differential equation."""
    recording = rough()
    noise = noise_of(recording, motion)
    _, p = start_of(recording, motion, noise)
    for process in twin.processes(noise):
        rows = slice(process.first, process.first + len(process.p))
        if process.first != at.CANT_ALONG:
            np.testing.assert_allclose(p[rows, rows], process.p, rtol=1e-9, atol=1e-9 * process.p.max())
        across = p[rows].copy()
        across[:, rows] = 0.0
        if process.first == at.ROLL and noise.sway_hz == 0.0:
            across[:, at.ROLL_SLOW] = 0.0
        assert not across.any()
    along = p[at.CANT_ALONG, at.CANT_ALONG]
    assert math.sqrt(along) == pytest.approx(5e-4 / recording.track.rail_base_m)
    assert np.array_equal(p[:, : at.STATES], p[:, : at.STATES].T)


def test_the_slow_roll_begins_as_on_a_way_without_beginning(rough: Callable) -> None:
    """Stationary covariance of the Matern pair and of what follows it, by Lyapunov's equation."""
    recording = rough()
    noise = noise_of(recording, AXLE)
    _, p = start_of(recording, AXLE, noise)
    generator = np.zeros((3, 3))
    generator[:2, :2] = twin.matern_3_2(noise.length[0])
    generator[2, 0], generator[2, 2] = 1.0 / SLOW_M, -1.0 / SLOW_M
    drive = np.zeros((3, 3))
    drive[1, 1] = 4.0 * (math.sqrt(3.0) / noise.length[0]) ** 3 * noise.sd[0] ** 2
    wanted = solve_continuous_lyapunov(generator, -drive)
    rows = [at.ROLL, at.ROLL_RATE, at.ROLL_SLOW]
    np.testing.assert_allclose(p[np.ix_(rows, rows)], wanted, rtol=1e-9, atol=1e-9 * wanted.max())
    swaying = start_of(recording, BODY, noise_of(recording, BODY))[1]
    assert not swaying[at.ROLL_SLOW].any()


def test_sizes_are_those_of_the_sheets(rough: Callable) -> None:
    """A bound b of a sheet is taken for uniform: b/sqrt(3). The map's cant is over the rails' distance.

    A bias has wandered before the ride as it does in it. A cubic that leaves its chord by p has a slope
    of 1.5 sqrt(3) p at zero. Local gravity is known to 1 mm/s2.
    """
    recording = rough()
    more = {"gyro_nonlinearity": 1e-3, "accel_nonlinearity": 2e-3}
    more |= {"gyro_random_walk_radpspsqrts": 3e-6, "accel_random_walk_mps2psqrts": 2e-4}
    recording = replace(recording, imu_sheet=replace(recording.imu_sheet, **more))
    sheet, base = recording.imu_sheet, recording.track.rail_base_m
    noise = noise_of(recording, AXLE)
    sd = np.sqrt(np.diag(start_of(recording, AXLE, noise)[1]))
    turn = sheet.package_misalignment_rad / math.sqrt(3.0)
    scale = math.hypot(sheet.gyro_scale_error, 1.5e-3 * math.sqrt(3.0)) / math.sqrt(3.0)
    force = math.hypot(sheet.accel_scale_error, 3e-3 * math.sqrt(3.0)) / math.sqrt(3.0)
    first, wandered = sheet.gyro_turn_on_bias_radps / math.sqrt(3.0), sheet.gyro_bias_instability_radps
    assert sd[at.GYRO_BIAS[0]] == pytest.approx(math.hypot(first, wandered))
    first, wandered = sheet.accel_turn_on_bias_mps2 / math.sqrt(3.0), sheet.accel_bias_instability_mps2
    bias = math.hypot(first, wandered)
    # What is across gravity feels it by the turn of the package, what is along it by its scale.
    across = [math.hypot(bias, 9.81 * turn)] * 2
    np.testing.assert_allclose(sd[list(at.ACCEL_BIAS)], [*across, math.hypot(bias, 9.81 * force, 1e-3)])
    np.testing.assert_allclose(sd[list(at.GYRO_OF_Z)], [turn, turn, scale])
    np.testing.assert_allclose(sd[list(at.ACCEL_OF_X)], [force, turn, turn])
    np.testing.assert_allclose(sd[list(at.ACCEL_OF_Y)], [turn, force, turn])
    assert sd[at.CANT] == pytest.approx(0.004 / base)
    assert sd[at.CURVE] == 0.01
    assert sd[at.EVEN] == sd[at.ODD] == 0.3
    assert sd[at.SLOPE] == recording.map_errors.gradient_sd
    assert sd[at.SCALE] == pytest.approx(recording.encoder_sheet.radius_relative_sd)
    assert noise.gyro_walk == pytest.approx(2.0 * sheet.gyro_bias_instability_radps**2 / 300.0 + 9e-12)
    assert noise.accel_walk == pytest.approx(2.0 * sheet.accel_bias_instability_mps2**2 / 300.0 + 4e-8)


@pytest.mark.parametrize("part", PARTS)
def test_what_is_left_out_is_known_and_stays(rough: Callable, part: str) -> None:
    recording = rough()
    noise = noise_of(recording, BODY, [part])
    _, p = start_of(recording, BODY, noise, [part])
    left = list(PARTS[part])
    assert not p[left].any() and not p[:, left].any()
    with_all = np.diag(start_of(recording, BODY, noise_of(recording, BODY))[1])
    others = [i for i in range(at.STATES) if i not in left and with_all[i] > 0.0]
    assert (np.diag(p)[others] > 0.0).all()
    driven = {
        "cant_along": noise.sd[3], "lag": noise.lag_walk, "gyro_bias": noise.gyro_walk,
        "accel_bias": noise.accel_walk, "slope": noise.forgotten_sd[0], "curve": noise.forgotten_sd[1],
        "cant": noise.forgotten_sd[2], "joints": noise.forgotten_sd[3:].max(),
    }  # fmt: skip
    assert all((size == 0.0) == (name == part) for name, size in driven.items())


def test_the_heading_is_as_sure_as_the_curves_before(rough: Callable) -> None:
    """The angle of each curve with its transitions errs by the relative error of its radius."""
    recording = rough()
    yaw = recording.track.frame(np.array([10.0, 215.0, 500.0])).yaw_rad
    angles = np.diff(yaw)
    assert np.abs(angles).min() > 0.3
    for place, passed in ((50.0, 0), (215.0, 1), (500.0, 2)):
        wanted = math.hypot(1e-3, 0.01 * math.hypot(*angles[:passed]))
        found = heading_sd(replace(recording, start_position_m=place))
        assert found == pytest.approx(wanted, rel=0.01)


def test_a_mount_is_carried_inside_a_curve_by_the_versine(rough: Callable) -> None:
    """Over a chord of half length c the middle lies c^2/(2 R) inside the arc: that much per curvature."""
    drawn = replace(rough(), vehicle_sheet=TRUCK, mount_body="frame", mount_position_m=(0.5, 0.0, 1.0))
    x = first_state(drawn, FRAME)
    radius, half = 300.0, 2.0
    arc = lambda u: radius - math.sqrt(radius**2 - u**2)  # noqa: E731
    assert x[at.Y_BEND] / radius == pytest.approx(arc(half) - arc(0.5), rel=1e-3)
    assert x[at.S] == drawn.start_position_m


def test_a_model_of_a_scale_keeps_angles_and_its_own_metres() -> None:
    """By their units: metres by the scale, square metres by its square, angles and times not at all."""
    whole, model = JOINTED, at_scale(JOINTED, 0.1)
    of_metres = {
        "y_sd",
        "z_sd",
        "y_tilt_sd",
        *(f"{one}_length" for one in ("roll", "pitch", "yaw", "y", "z")),
    }
    for name, value in vars(whole).items():
        power = 1 if name in of_metres else 2 if name == "y_bend_sd" else 0
        assert getattr(model, name) == pytest.approx(0.1**power * value, rel=1e-12), name


def test_a_waviness_of_a_scale_keeps_angles_and_its_own_metres() -> None:
    """At a tenth: every length and height a tenth, none left out."""
    sizes = Waviness(1e-3, (2.0, 3.0), 2e-3, (4.0,), 3e-3, (5.0, 6.0, 7.0), 4e-3, (40.0, 8.0))
    for name, value in asdict(sizes.at_scale(0.1)).items():
        scale = 1.0 if name in ("roll_sd", "pitch_sd") else 0.1
        assert value == pytest.approx(np.multiply(scale, getattr(sizes, name))), name


def test_a_body_of_a_model_sways_as_fast_as_its_scale_and_moves_more() -> None:
    """By the root of the scale; a damping stays one of a body that sways."""
    model = model_body(BODY, 0.01)
    assert model.sway_hz == pytest.approx(10.0 * BODY.sway_hz)
    assert model.roll_sd == pytest.approx(MODEL_BODY["roll_sd"] * BODY.roll_sd)
    assert model.rocking == model.heaving == 0.0
    assert model_body(replace(BODY, damping=0.9), 0.01).damping == MOST_DAMPING
