"""``passes`` of a scenario: which rides are fused, and what they share."""

from itertools import groupby

import pytest

from simrail.core.errors import InputError
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells, count, first_cells, rides_of
from simrail.scenario.scenario import Scenario, read_scenario

TEXT = """
title = "passes"
seed = 1
track = "condequinto_olivar"
vehicle = "metro_irw_bogie"
engine = "kinematic"
passes = [1, 2, 5]
[monte_carlo]
track_draws = 3
map_draws = 2
sensor_draws = 2
[map]
exact = [false, true]
[[ride]]
name = "slow"
start_m = 10.0
end_m = 60.0
speed_kmh = [20.0, 30.0]
reverse = [false, true]
[[ride]]
name = "fast"
start_m = 10.0
end_m = 60.0
speed_kmh = 40.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 0.6]
[[imu]]
name = "frame"
grade = "lord_3dm_gx4_25"
sensor_draws = 1
body = "frame"
position_m = [0.0, 0.0, 0.6]
[encoder]
wheel = "trailing.left"
pulses_per_revolution = 1024
rate_hz = 250.0
[[estimator]]
name = "smoother"
method = "TrackRelativeSmoother"
"""


def scenario(text: str = TEXT) -> Scenario:
    return read_scenario(text, name="passes")


def recordings_of(cell: Cell) -> list[tuple[object, ...]]:
    return [(one.ride_number, one.map_draw, one.sensor_draw, one.imu.name) for one in cell.passes]


def test_a_cell_is_so_many_rides_and_each_number_of_passes_is_a_case() -> None:
    read = scenario()
    listed = list(cells(read))
    # 3 track draws x (drawn map twice, exact once) x (axle twice, frame once) x 3 numbers of passes; 5 rides.
    assert count(read) == (15, len(listed)) == (15, 3 * (2 + 1) * (2 + 1) * 3)
    assert [cell.number for cell in listed] == list(range(len(listed)))
    assert {len(cell.passes) for cell in listed} == {1, 2, 5}
    assert all(cell.settings["passes"] == len(cell.passes) for cell in listed)
    assert not any(name.startswith("ride.") for cell in listed for name in cell.settings)
    cases = {(cell.case, cell.imu.name, cell.map_label, len(cell.passes)) for cell in listed}
    assert len(cases) == len({case for case, *_ in cases}) == 2 * 2 * 3
    rides = {one.ride_number for cell in listed for one in cell.passes}
    assert rides == set(range(15))


def test_fewer_passes_are_the_first_of_more_and_their_order_is_of_the_track_draw() -> None:
    listed = list(cells(scenario()))
    orders = set()
    for _, group in groupby(listed, key=lambda cell: (cell.ride_number, cell.case // 3, cell.sensor_draw)):
        one, two, five = list(group)[:3]
        assert one.passes == five.passes[:1] and two.passes == five.passes[:2]
    for draw in range(3):
        of_draw = [cell for cell in listed if cell.track_draw == draw and len(cell.passes) == 5]
        order = {
            tuple((one.ride.name, one.ride.speed_kmh, one.ride.start_m) for one in c.passes) for c in of_draw
        }
        assert len(order) == 1  # the same for every sensor, map and draw of these
        assert len(set(*order)) == 5
        orders |= order
    assert len(orders) > 1


def test_passes_share_rails_and_map_and_have_a_device_each() -> None:
    parts = Parts(scenario())
    most = [cell for cell in cells(parts.scenario) if len(cell.passes) == 5]
    for cell in most[:1]:
        assert len({one.ride_seed for one in cell.passes}) == 1
        assert len({id(parts.track(one)) for one in cell.passes}) == 1
        assert len({repr(parts.track_map(one)) for one in cell.passes}) == 1
        assert parts.rails(cell).design is parts.rails(cell.passes[-1]).design
    # No two recordings of an IMU over a track draw share a draw of the sensors and a ride.
    for draw in range(3):
        for name in ("axle", "frame"):
            of = [
                c
                for c in most
                if (c.track_draw, c.imu.name, c.map_draw, c.map_label) == (draw, name, 0, "drawn")
            ]
            devices = [one.sensor_draw for cell in of for one in cell.passes]
            assert len(devices) == len(set(devices)) == 5 * (2 if name == "axle" else 1)


def test_a_pass_is_the_ride_that_it_would_be_alone() -> None:
    parts = Parts(scenario())
    alone = {cell.ride_number: cell for cell in first_cells(parts.scenario)}
    five = next(cell for cell in cells(parts.scenario) if len(cell.passes) == 5)
    assert five.track_draw == 0
    for one in five.passes:
        assert parts.resolve(one).ride == parts.ride(alone[one.ride_number])
    assert parts.ride(five) == parts.ride(five.passes[0])
    assert rides_of([five.passes[0]]) == [five.passes[0]]
    assert rides_of(list(cells(parts.scenario))[:3]) == list(five.passes)


def test_what_a_cell_is_resolved_to_is_its_own() -> None:
    """Cells and their passes are told apart, though both have numbers of cases."""
    parts = Parts(scenario())
    for cell in cells(parts.scenario):
        if cell.track_draw == cell.map_draw == 0:
            for one in (cell, *cell.passes):
                resolved = parts.resolve(one)
                assert resolved.mount.name == one.imu.name and resolved.ride is parts.ride(one)
                assert (resolved.track_map is None) == (one.map_label == "exact")


def test_one_number_is_no_list_and_none_leaves_the_scenario_as_it_was() -> None:
    four = list(cells(scenario(TEXT.replace("[1, 2, 5]", "4"))))
    assert {len(cell.passes) for cell in four} == {4} and four[0].settings["passes"] == 4
    without = list(cells(scenario(TEXT.replace("passes = [1, 2, 5]\n", ""))))
    assert not any(cell.passes for cell in without) and len({cell.case for cell in without}) == 5 * 2 * 2


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("0", ["passes", "found 0", ">= 1", "remedy"]),
        ("[1, -2]", ["passes", "found -2", ">= 1", "remedy"]),
        ("2.5", ["passes", "found 2.5", "whole number"]),
        ("'two'", ["passes", "found 'two'", "whole number", "remedy"]),
        ("[]", ["passes", "empty list", "at least one"]),
        ("[2, 2]", ["passes", "twice"]),
        ("[1, 6]", ["passes", "more passes than", "found 6", "1 to 5", "remedy", "ride.speed_kmh"]),
        ("{ choice = [1, 2] }", ["passes", "found 'choice'", "whole number", "remedy"]),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(value: str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        scenario(TEXT.replace("[1, 2, 5]", value))
    message = str(caught.value)
    assert message.startswith("passes.toml: ") and "\n" not in message
    assert all(word in message for word in words), message
