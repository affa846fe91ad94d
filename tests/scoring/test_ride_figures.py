"""Figures of the ride itself, from truths whose forces and motion are known."""

from dataclasses import replace

import numpy as np
import pytest

import simrail
from simrail.core.columns import CONTACT
from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.scoring.ride_comfort import W_B, W_D, sperling
from simrail.scoring.ride_figures import score_ride_comfort, score_running_safety
from simrail.track.design import TrackDesign
from simrail.track.elements import Curve, Straight, Transition
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

RATE_HZ = 500.0
TRACK = TrackDesign(
    name="curve",
    start_m=0.0,
    elements=(
        Straight(150.0),
        Transition(40.0),
        Curve(100.0, 400.0, 0.05),
        Transition(40.0),
        Straight(250.0),
    ),
)
MOUNT = Mount("floor", "body", (0.0, 0.0, 1.0))


@pytest.fixture(scope="module")
def wagon():
    """A vehicle with two axles, ``front`` and ``rear``, and its static wheel load."""
    model = load(VehicleFile, "vehicle", "two_axle_wagon").model("two_axle_wagon")
    return model, float(model.wheel_load_n(9.81)[0])


def swinging(frequency_hz, amplitude_mps2):
    """A channel whose second derivative by time is a sine that begins at rest."""
    w = 2.0 * np.pi * frequency_hz

    def channel(t, _s, _v, _a):
        size = amplitude_mps2 / w**2
        return (
            size * (w * t - np.sin(w * t)),
            size * w * (1.0 - np.cos(w * t)),
            amplitude_mps2 * np.sin(w * t),
        )

    return channel


def ride(wagon, *, reverse=False, **contact):
    """A ride over `TRACK`; ``contact`` gives (Q, Y) of a wheel as functions of its place, over Q0."""
    model, static = wagon
    ends = (570.0, 10.0) if reverse else (10.0, 570.0)
    profile = SpeedProfile(*ends, 15.0, 3.0, 10.0, rest_s=1.0, final_rest_s=1.0)
    moved = kinematic_truth(TRACK, profile, rate_hz=RATE_HZ)
    offsets = {
        wheel.name: model.bodies[model.body_names.index(wheel.axle)].position_m[0] for wheel in model.wheels
    }
    contacts = {}
    for name, offset in offsets.items():
        place = moved.reference_position_m + offset
        load_n, lateral_n = contact.get(name.replace(".", "_"), (lambda s: 1.0 + 0.0 * s, lambda s: 0.0 * s))
        table = np.zeros((len(place), len(CONTACT)))
        table[:, CONTACT.index("position_m")] = place
        table[:, CONTACT.index("wheel_load_n")] = static * load_n(place)
        table[:, CONTACT.index("guiding_force_n")] = static * lateral_n(place)
        contacts[name] = table
    wheel_angles = dict.fromkeys(offsets, moved.wheel_angles["wheel"])
    return replace(moved, wheel_angles=wheel_angles, contacts=contacts, contact_every=1)


def value(table, quantity, metric="max", window="whole"):
    rows = table[(table["quantity"] == quantity) & (table["metric"] == metric) & (table["window"] == window)]
    assert rows["status"].tolist() == ["ok"]
    return float(rows["value"].iloc[0])


@pytest.mark.parametrize("reverse", [False, True])
def test_the_worst_wheel_in_each_window(wagon, reverse):
    """One wheel is pressed sideways in the curve only: its axle's own place counts, not the vehicle's."""
    model, static = wagon
    names = [wheel.name.replace(".", "_") for wheel in model.wheels]

    def in_curve(size):
        return lambda s: size * ((s > 195.0) & (s < 285.0))

    pressed = {
        names[0]: (lambda s: 1.0 + in_curve(0.25)(s), in_curve(0.5)),
        names[1]: (lambda s: 1.0 - in_curve(0.4)(s), in_curve(-0.1)),
    }
    truth = ride(wagon, reverse=reverse, **pressed)
    table = score_running_safety(truth, model)
    kilonewtons = static / 1e3
    assert value(table, "derailment_quotient", window="curve") == pytest.approx(0.5 / 1.25, rel=1e-3)
    assert value(table, "sum_y", window="curve") == pytest.approx(0.4 * kilonewtons, rel=1e-3)
    limit = 10.0 + 2.0 * kilonewtons / 3.0
    assert value(table, "sum_y_relative", window="curve") == pytest.approx(
        0.4 * kilonewtons / limit, rel=1e-3
    )
    assert 0.5 <= value(table, "guiding_force", window="curve") / kilonewtons < 0.5 + 0.04
    # A step overshoots in a low-pass: by 8 % of it at most, as a Butterworth filter of fourth order does.
    assert 1.25 <= value(table, "wheel_load", window="curve") / kilonewtons < 1.25 + 0.02
    assert 0.4 <= value(table, "wheel_unloading", window="curve") < 0.4 + 0.032
    for quantity in ("derailment_quotient", "sum_y", "wheel_unloading"):
        assert abs(value(table, quantity, window="straight")) < 1e-6
    wagons = score_running_safety(truth, model, factor=0.85, windows=["curve"])
    assert value(wagons, "sum_y_relative", window="curve") == pytest.approx(
        0.4 * kilonewtons / limit / 0.85, rel=1e-3
    )
    assert set(wagons["window"]) == {"curve"}
    frame = simrail.running_safety(truth, model)
    assert frame.index.tolist() == [wheel.name for wheel in model.wheels]
    assert frame["least_load"].iloc[1] == pytest.approx(0.6, abs=0.032)
    assert frame["derailment_quotient"].iloc[0] == pytest.approx(0.4, rel=1e-3)
    assert frame["sum_y_n"].iloc[0] == frame["sum_y_n"].iloc[1] == pytest.approx(0.4 * static, rel=1e-3)
    assert frame["sum_y_n"].iloc[2] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_force_counts_by_its_size_whichever_way_it_pushes(wagon, side):
    """A wheel pressed to either side by half its load in the curve, and all others by nothing."""
    model, static = wagon
    name = model.wheels[0].name.replace(".", "_")
    pressed = {name: (lambda s: 1.0 + 0.0 * s, lambda s: side * 0.5 * ((s > 195.0) & (s < 285.0)))}
    table = score_running_safety(ride(wagon, **pressed), model, windows=["curve"])
    for quantity, unit in (
        ("guiding_force", static / 1e3),
        ("sum_y", static / 1e3),
        ("derailment_quotient", 1.0),
    ):
        assert 0.5 <= value(table, quantity, window="curve") / unit * (1.0 + 1e-3) < 0.5 + 0.04


def test_the_percentile_leaves_the_rarest_out(wagon):
    """A blow over 0.6 m in 560 m: the greatest window has it, the percentile of 99.85 % nearly not."""
    model, _ = wagon
    first = model.wheels[0].name.replace(".", "_")
    blow = {first: (lambda s: 1.0 + 0.0 * s, lambda s: 0.5 * (np.abs(s - 100.0) < 0.3))}
    table = score_running_safety(ride(wagon, **blow), model)
    assert value(table, "derailment_quotient") == pytest.approx(0.5 * 0.6 / 2.0, rel=0.02)
    assert value(table, "derailment_quotient", "p9985") < value(table, "derailment_quotient")


def test_a_ride_that_kept_no_forces_is_refused(wagon):
    model, _ = wagon
    bare = replace(ride(wagon), contacts={})
    with pytest.raises(InputError, match="kept no forces"):
        simrail.running_safety(bare, model)


def test_comfort_of_a_swinging_body():
    """A body that shakes at 2 Hz sideways and 5 Hz up and down, felt where an IMU sits."""
    track = TrackDesign(name="straight", start_m=0.0, elements=(Straight(1000.0),))
    profile = SpeedProfile(10.0, 990.0, 20.0, 1.0, 0.5, rest_s=1.0, final_rest_s=1.0)
    channels = {"lateral": swinging(2.0, 0.2), "vertical": swinging(5.0, 0.4)}
    truth = kinematic_truth(track, profile, rate_hz=RATE_HZ, channels=channels)
    comfort = simrail.ride_comfort(truth, MOUNT)
    gain_y, gain_z = (abs(w.response(np.array([f]))[0]) for w, f in ((W_D, 2.0), (W_B, 5.0)))
    assert comfort.mean.a_y_mps2 == pytest.approx(0.2 * gain_y / np.sqrt(2.0), rel=5e-3)
    assert comfort.mean.a_z_mps2 == pytest.approx(0.4 * gain_z / np.sqrt(2.0), rel=5e-3)
    time = np.arange(0.0, 60.0, 1.0 / RATE_HZ)
    expected = sperling(0.4 * np.sin(2.0 * np.pi * 5.0 * time), RATE_HZ, "vertical")
    assert comfort.sperling_vertical == pytest.approx(expected, rel=2e-3)
    expected = sperling(0.2 * np.sin(2.0 * np.pi * 2.0 * time), RATE_HZ, "lateral")
    assert comfort.sperling_lateral == pytest.approx(expected, rel=2e-3)
    table = score_ride_comfort(truth, MOUNT)
    assert value(table, "comfort_nmv", "p95") == comfort.mean.n_mv
    assert value(table, "sperling_lateral", "rms") == comfort.sperling_lateral
    assert table["n_samples"].tolist() == [comfort.mean.periods] * 3


def test_a_ride_that_is_too_short_for_comfort_says_so():
    profile = SpeedProfile(10.0, 14.0, 2.0, 3.0, 10.0, rest_s=1.0, final_rest_s=1.0)
    table = score_ride_comfort(kinematic_truth(TRACK, profile, rate_hz=RATE_HZ), MOUNT)
    assert table["status"].tolist() == ["the vehicle does not run for one period of 5 s"] * 3
    assert table["value"].isna().all()
