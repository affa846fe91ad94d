"""``[map]`` of a scenario: what the train knows is drawn, what happens is not."""

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.cell import record_cell
from simrail.core.errors import InputError
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells, count, first_cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, read_scenario
from simrail.track.map_errors import MapErrors

TEXT = """
title = "map"
seed = 1
track = "condequinto_olivar"
vehicle = "metro_irw_bogie"
engine = "kinematic"
[monte_carlo]
track_draws = 2
map_draws = 3
sensor_draws = 2
{table}
[[ride]]
name = "r"
start_m = 10.0
end_m = 60.0
speed_kmh = 20.0
rest_s = 1.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 0.6]
[encoder]
wheel = "trailing.left"
pulses_per_revolution = 1024
rate_hz = 250.0
[[estimator]]
name = "design"
method = "DesignAngles"
"""


def scenario(table: str) -> Scenario:
    return read_scenario(TEXT.replace("{table}", table), name="map")


def listed(table: str) -> tuple[list[Cell], Parts]:
    read = scenario(table)
    return list(cells(read)), Parts(read)


def test_maps_are_drawn_for_each_draw_of_the_track_and_an_exact_one_once() -> None:
    read = scenario("[map]\nexact = [false, true]")
    all_cells = list(cells(read))
    assert count(read) == (2, len(all_cells)) == (2, 2 * (3 * 2 + 2))
    assert [cell.number for cell in all_cells] == list(range(len(all_cells)))
    parts = Parts(read)
    maps = {
        (cell.track_draw, cell.map_draw, cell.map_label): parts.resolve(cell).track_map for cell in all_cells
    }
    drawn = {key: value for key, value in maps.items() if key[2] == "drawn"}
    assert len(drawn) == len({repr(value) for value in drawn.values()}) == 6
    assert all(value is None for key, value in maps.items() if key[2] == "exact")
    assert [cell.number for cell in first_cells(read)] == [0, 6]


def test_one_thing_is_taken_away_at_a_time() -> None:
    """Of two lists of ablations no cell has both; beside an ablation throughout a list keeps its own."""
    table = (
        "[map]\nexact = [false, true]\n[vibration]\noff = [false, true]\nwheels.amplitude_um = [30.0, 60.0]"
    )
    read = scenario(table)
    all_cells = list(cells(read))
    labels = [(cell.map_label, cell.vibration_label) for cell in all_cells]
    assert set(labels) == {("drawn", "on"), ("exact", "on"), ("drawn", "off")}
    tracks, wheels, maps, sensors = 2, 2, 3, 2
    assert labels.count(("exact", "on")) == tracks * wheels * sensors
    assert labels.count(("drawn", "off")) == labels.count(("drawn", "on")) == tracks * wheels * maps * sensors
    assert count(read) == (2 * tracks * wheels, len(all_cells))
    assert [cell.number for cell in all_cells] == list(range(len(all_cells)))
    firsts = list(first_cells(read))
    assert len(firsts) == len({cell.case for cell in all_cells}) == 3 * wheels
    by_number = {cell.number: cell for cell in all_cells}
    assert all(by_number[one.number].settings == one.settings for one in firsts)
    for table, silent in (
        ("[map]\nexact = true\n[vibration]\noff = [false, true]", ("exact", "off")),
        ("[map]\nexact = [false, true]\n[vibration]\noff = true", ("exact", "off")),
    ):
        read = scenario(table)
        labels = [(cell.map_label, cell.vibration_label) for cell in cells(read)]
        assert silent in labels and count(read)[1] == len(labels)


def test_a_map_is_the_same_whatever_is_asked_first() -> None:
    one, parts = listed("[map]")
    two, others = listed("[map]")
    maps = [parts.resolve(cell).track_map for cell in one]
    assert maps == [others.resolve(cell).track_map for cell in reversed(two)][::-1]


def test_a_map_draw_changes_no_signal() -> None:
    with_map, parts = listed("[map]")
    without, others = listed("")
    truth = simulate(parts.ride(with_map[0]))
    exact = record_cell(without[0], truth, others)
    for number in (0, 2, 4):
        cell = with_map[number]
        assert (cell.track_draw, cell.sensor_draw) == (0, 0)
        recording = record_cell(cell, truth, parts)
        pd.testing.assert_frame_equal(recording.imu, exact.imu, check_exact=True)
        pd.testing.assert_frame_equal(recording.encoder, exact.encoder, check_exact=True)
        assert recording.track != exact.track == truth.track
        assert recording.map_errors.cant_sd_m == 0.003
        assert exact.map_errors.cant_sd_m == 0.0


def test_an_exact_map_is_the_design_to_the_bit() -> None:
    stated, parts = listed("[map]\nexact = true")
    without, others = listed("")
    truth = simulate(parts.ride(stated[0]))
    one, two = record_cell(stated[0], truth, parts), record_cell(without[0], truth, others)
    assert one.track == two.track == truth.track
    np.testing.assert_array_equal(one.odometry, two.odometry)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("[map]\ncant_sd_mm = -1.0", "map.cant_sd_mm"),
        ("[map]\nradius_sd_percent = 100.0", "map.radius_sd_percent"),
        ("[map]\nradius = 1.0", "map.radius"),
        ('[map]\n[[map.defect]]\nkind = "sunk"\nat_m = 3.0', "map.defect"),
        ('[map]\n[[map.defect]]\nkind = "coarse_curve"\nat_m = 3.0', "at_m"),
        ("[map]\nchainage_offset_sd_m = 200.0", "chainage_offset_sd_m"),
    ],
)
def test_a_map_that_cannot_be_is_one_message(table: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as raised:
        judge_scenario(scenario(table))
    assert "\n" not in str(raised.value)


def test_the_defaults_of_a_scenario_are_those_of_the_sizes() -> None:
    spec = scenario("[map]").spec
    assert spec.map is not None and spec.map.errors() == MapErrors()
