"""Extremes of wheel-rail forces, gathered row by row, against the same by other means."""

import numpy as np
import pytest

from simrail.core.toml_files import load
from simrail.ride.contact_extremes import ContactExtremes
from simrail.vehicle.contact.contact import CONTACT
from simrail.vehicle.engines import derailment
from simrail.vehicle.file import VehicleFile

RATE_HZ = 1000.0
FORCES = ("guiding_n", "load_n")


@pytest.fixture(scope="module")
def bogie():
    return load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie")


def told_of(place_m, load_n, guiding_n):
    """Rows (n, 4) of a bogie whose rear axle follows 1.8 m behind; a wheel without load has no force."""
    told = np.zeros(load_n.shape, CONTACT)
    told["position_m"] = place_m[:, None] - np.array([0.0, 0.0, 1.8, 1.8])
    told["load_n"], told["guiding_n"], told["normal_n"] = load_n, guiding_n, load_n
    return told


def ride(seed=3, *, seconds=8.0):
    """Stands for a second, runs at a changing speed, stands again, and turns back; forces are smooth."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    speed = np.where((time_s < 1.0) | (np.abs(time_s - 5.0) < 0.4), 0.0, 6.0 + 3.0 * np.sin(2.0 * time_s))
    place = 50.0 + np.cumsum(np.where(time_s < 5.0, speed, -speed)) / RATE_HZ
    waves = rng.uniform(1.0, 12.0, (4, 1, 6)), rng.uniform(0.0, 7.0, (4, 1, 6))
    noise = np.sin(2.0 * np.pi * time_s[None, :, None] * waves[0] + waves[1]).sum(axis=2).T / np.sqrt(3.0)
    load = 39e3 + 6e3 * noise
    guiding = 2e3 + 4e3 * np.roll(noise, 1, axis=1)
    return time_s, told_of(place, load, guiding)


def summary(bogie, time_s, told, pieces=1):
    extremes = ContactExtremes(bogie, rate_hz=RATE_HZ, gravity_mps2=9.81)
    for part in np.array_split(np.arange(len(time_s)), pieces):
        extremes.add(time_s[part], told[part])
    return extremes.summary(), extremes.warnings()


def sliding_means(told, wheel, values, ends_m=None):
    """Means over the 2 m of way before some places of it, by default each row, of the polyline of values."""
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(told["position_m"][:, wheel])))])
    if ends_m is None:
        ends_m = way[way >= 2.0]

    def at(place, after):
        share = (place - way[after - 1]) / (way[after] - way[after - 1])
        return (1.0 - share) * values[after - 1] + share * values[after]

    means = []
    for end in ends_m:
        first, last = np.searchsorted(way, end - 2.0, side="right"), np.searchsorted(way, end)
        x = np.concatenate([[end - 2.0], way[first:last], [end]])
        y = np.concatenate([[at(end - 2.0, first)], values[first:last], [at(end, last)]])
        means.append(np.trapezoid(y, x) / 2.0)
    return np.array(means)


def every_step(told):
    """Ends of the windows: each 0.1 m of way, from 2 m on."""
    way = np.abs(np.diff(told["position_m"][:, 0])).sum()
    return 0.1 * np.arange(20, int(way / 0.1 + 1e-9) + 1)


def test_extremes_of_the_rows_themselves(bogie):
    time_s, told = ride()
    said, _ = summary(bogie, time_s, told)
    static = bogie.wheel_load_n(9.81)
    load, summed = told["load_n"], told["guiding_n"].reshape(-1, 2, 2).sum(axis=2)
    row, wheel = np.unravel_index(load.argmax(), load.shape)
    assert said["greatest_q_n"] == {
        "value": load.max(),
        "name": bogie.wheel_names[wheel],
        "position_m": told["position_m"][row, wheel],
        "time_s": time_s[row],
    }
    assert said["smallest_q_over_q0"]["value"] == (load / static).min()
    assert said["greatest_q_over_q0"]["value"] == (load / static).max()
    row, axle = np.unravel_index(np.abs(summed).argmax(), summed.shape)
    assert said["greatest_sum_y_n"]["value"] == pytest.approx(np.abs(summed).max(), rel=1e-15)
    assert said["greatest_sum_y_n"]["name"] == bogie.axle_names[axle]
    assert said["share_of_time_a_wheel_carries_nothing"] == 0.0
    assert "longest_without_load_s" not in said


def test_wheels_that_press_against_each_other_leave_their_axle_the_rest(bogie):
    """Rails push with 8 kN to the right and 5 kN to the left, and leave 3 kN; behind, 1 and 2 to the left."""
    place = np.arange(1000) * 0.01
    told = told_of(place, np.full((1000, 4), 40e3), np.tile([-8e3, 5e3, 1e3, 2e3], (1000, 1)))
    said, _ = summary(bogie, np.arange(1000) / RATE_HZ, told)
    for name in ("greatest_sum_y_n", "greatest_sum_y_2m_n"):
        assert said[name]["value"] == pytest.approx(3e3, rel=1e-12)
    # The left wheel of the first axle presses its rail outward the most for its load: 8 in 40.
    assert said["greatest_y_over_q_2m"]["value"] == pytest.approx(0.2, rel=1e-12)
    assert said["greatest_y_over_q_2m"]["name"] == bogie.wheel_names[0]


def test_sliding_means_over_two_metres(bogie):
    """Every 0.1 m, by an integral of its own: rests and the way back included."""
    time_s, told = ride()
    said, _ = summary(bogie, time_s, told)
    side, ends = np.array([1.0, -1.0, 1.0, -1.0]), every_step(told)

    def quotients(wheel, ends_m):
        outward, load = (sliding_means(told, wheel, told[name][:, wheel], ends_m) for name in FORCES)
        return -side[wheel] * outward / load

    best = max(quotients(w, ends).max() for w in range(4))
    assert said["greatest_y_over_q_2m"]["value"] == pytest.approx(best, rel=1e-9)
    assert best < 0.97 * (-side * told["guiding_n"] / told["load_n"]).max()
    summed = told["guiding_n"].reshape(-1, 2, 2).sum(axis=2)
    best = max(np.abs(sliding_means(told, 2 * a, summed[:, a], ends)).max() for a in range(2))
    assert said["greatest_sum_y_2m_n"]["value"] == pytest.approx(best, rel=1e-9)
    # Between two of them a mean of v is off by (v(s) - v(s - 2 m)) / 2 m times half a step at the most.
    steepest = np.ptp(summed, axis=0).max() / 2.0
    at_rows = max(np.abs(sliding_means(told, 2 * a, summed[:, a])).max() for a in range(2))
    assert best <= at_rows + 0.05 * steepest and at_rows <= best + 0.05 * steepest


@pytest.mark.parametrize("in_the_air", [0.0, 0.5])
def test_y_over_q_is_that_of_a_derailments_message(bogie, in_the_air):
    """Y over Q, each in the mean: a wheel that rattles presses its rail as one that does not."""
    place = np.arange(1000) * 0.01
    told = told_of(place, np.full((1000, 4), 40e3), np.tile([-12e3, 0.0, 0.0, 0.0], (1000, 1)))
    for name in ("load_n", "guiding_n", "normal_n"):
        told[name][np.arange(1000) % 10 < 10 * in_the_air, 0] = 0.0
    said, _ = summary(bogie, np.arange(1000) / RATE_HZ, told)
    assert said["greatest_y_over_q_2m"]["value"] == pytest.approx(0.3, rel=1e-9)
    assert derailment._y_over_q(told[:, 0], 1) == pytest.approx(0.3, rel=1e-9)


def test_a_wheel_in_the_air_for_two_metres_has_no_quotient(bogie):
    place = np.arange(1000) * 0.01
    told = told_of(place, np.zeros((1000, 4)), np.zeros((1000, 4)))
    said, _ = summary(bogie, np.arange(1000) / RATE_HZ, told)
    assert "greatest_y_over_q_2m" not in said and said["greatest_sum_y_2m_n"]["value"] == 0.0


def test_rows_farther_apart_than_the_means(bogie):
    """0.37 m from row to row: three or four means in between, of the same polyline."""
    rng = np.random.default_rng(5)
    place = np.arange(200) * 0.37
    told = told_of(place, rng.uniform(30e3, 50e3, (200, 4)), rng.uniform(-9e3, 9e3, (200, 4)))
    said, _ = summary(bogie, np.arange(200) / RATE_HZ, told)
    summed = told["guiding_n"].reshape(-1, 2, 2).sum(axis=2)
    best = max(np.abs(sliding_means(told, 2 * a, summed[:, a], every_step(told))).max() for a in range(2))
    assert said["greatest_sum_y_2m_n"]["value"] == pytest.approx(best, rel=1e-9)


def test_pieces_give_the_same_as_the_whole(bogie):
    """Bit by bit, whatever the pieces: an engine puts out segments."""
    time_s, told = ride(seed=8)
    told[4000:4030, 2] = 0.0
    told["position_m"][4000:4030, 2] = told["position_m"][4000:4030, 3]
    whole = summary(bogie, time_s, told)
    assert summary(bogie, time_s, told, pieces=7) == whole
    assert summary(bogie, time_s, told, pieces=401) == whole


def test_a_wheel_in_the_air(bogie):
    """Two wheels, 7 and 12 rows of 1 ms, 4 of them together, and 9 more: 24 rows, 12 ms at most."""
    time_s, told = ride()
    for wheel, rows in ((1, slice(3000, 3007)), (3, slice(3003, 3015))):
        for name in ("load_n", "guiding_n", "normal_n"):
            told[name][rows, wheel] = 0.0
    # Once more, for 9 ms: that is no longer a stretch than the first.
    for name in ("load_n", "guiding_n", "normal_n"):
        told[name][6000:6009, 3] = 0.0
    for pieces in (1, 8, 533):
        said, warnings = summary(bogie, time_s, told, pieces)
        assert said["share_of_time_a_wheel_carries_nothing"] == 24 / len(time_s)
        longest = said["longest_without_load_s"]
        assert longest["value"] == pytest.approx(0.012)
        assert (longest["name"], longest["time_s"]) == ("rear.right", time_s[3014])
        assert said["smallest_q_over_q0"]["value"] == 0.0
        (line,) = warnings
        assert "rear.right was in the air for 12 ms" in line


@pytest.mark.parametrize(("rows", "times", "lines"), [(5, 2.9, 0), (6, 2.9, 1), (5, 3.1, 1), (6, 3.1, 2)])
def test_warnings_begin_at_three_times_the_load_and_at_5_ms(bogie, rows, times, lines):
    time_s, told = ride()
    for name in ("load_n", "guiding_n", "normal_n"):
        told[name][2000 : 2000 + rows, 0] = 0.0
    told["load_n"][2600, 2] = times * bogie.wheel_load_n(9.81)[2]
    assert len(summary(bogie, time_s, told)[1]) == lines


def test_y_over_q_is_positive_outward(bogie):
    """A left wheel is pushed to the right by a rail that it presses outward, a right wheel to the left."""
    place = np.arange(4000) * 0.01
    for guiding, expected in (([-4e3, 0, 0, 0], 0.1), ([0, 4e3, 0, 0], 0.1), ([4e3, -4e3, 0, 0], 0.0)):
        told = told_of(place, np.full((4000, 4), 40e3), np.tile(np.array(guiding, float), (4000, 1)))
        said, _ = summary(bogie, np.arange(4000) / RATE_HZ, told)
        assert said["greatest_y_over_q_2m"]["value"] == pytest.approx(expected, abs=1e-12)


def test_a_ride_of_less_than_two_metres_has_no_sliding_mean(bogie):
    place = np.linspace(10.0, 11.9, 500)
    told = told_of(place, np.full((500, 4), 40e3), np.full((500, 4), 1e3))
    said, _ = summary(bogie, np.arange(500) / RATE_HZ, told)
    assert "greatest_y_over_q_2m" not in said and "greatest_sum_y_2m_n" not in said
    assert said["greatest_sum_y_n"]["value"] == 2e3
