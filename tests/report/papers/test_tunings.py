"""A search's own ride beside others: which ride it is, and what is said of errors there and elsewhere."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest
from simrail.estimators.tuning.file import Tuning

from simrail.core.toml_files import shipped
from simrail.report.papers.gonzalez_2023.parts import Rows
from simrail.report.papers.gonzalez_2023.tunings import own_ride_note, searched_on, silence_note
from simrail.report.tables.pivot import Case, Mean
from simrail.scenario.scenario import Scenario, load_scenario

FIRST = {"ride": "out", "mount": "body", "track_draw": 0, "sensor_draw": 0}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load_scenario("scale_track")


def shipped_tuning(name: str) -> Tuning:
    return Tuning.from_file(shipped("scenario")["scale_track"].parent / "tunings" / f"{name}.toml")


def test_the_own_ride_is_told_by_the_command(scenario: Scenario) -> None:
    one, four = shipped_tuning("scale_track_kom"), shipped_tuning("scale_track_kom_rides")
    assert searched_on(one, scenario, FIRST)
    assert not searched_on(four, scenario, FIRST)
    for other in ({"ride": "back"}, {"mount": "body_noise"}, {"track_draw": 1}, {"sensor_draw": 1}):
        assert not searched_on(one, scenario, FIRST | other), other
    assert not searched_on(one, load_scenario("scale_track", seed=2), FIRST)
    assert not searched_on(one, load_scenario("scale_track", overrides=["irregularity.scale=1.0"]), FIRST)
    assert not searched_on(one, replace(scenario, name="mine"), FIRST)
    assert not searched_on(shipped_tuning("scale_by_hand"), scenario, FIRST)


def in_silence(tuning: Tuning) -> Tuning:
    """The tuning as a search without vibration would say of itself."""
    assert tuning.search is not None
    said = f"{tuning.search.command} --set vibration.off=true --set vibration.section_gain.on=false"
    return replace(tuning, search=replace(tuning.search, command=said))


def test_a_search_with_ablations_was_on_the_ride_with_them() -> None:
    """Tunings of the metro were searched with an exact map; what a train has, beside it, is no own ride."""
    metro = load_scenario("metro_geometry")
    assert metro.folder is not None
    tuning = Tuning.from_file(metro.folder / "tunings" / "metro_geometry_cml.toml")
    own = {"ride": "go70", "mount": "axle", "track_draw": 0, "map_draw": 0, "sensor_draw": 0}
    own |= {"map": "exact", "vibration": "on"}
    assert searched_on(tuning, metro, own)
    assert not searched_on(tuning, metro, own | {"map": "drawn"})
    assert not searched_on(tuning, metro, own | {"vibration": "off"})
    alone = load_scenario("metro_geometry", overrides=["map.exact=true"])
    assert searched_on(tuning, alone, own)
    assert not searched_on(tuning, load_scenario("metro_geometry", overrides=["map.cant_sd_mm=8.0"]), own)
    # In silence: its rails have no sections either, which is a setting of the scenario and no ablation.
    rails, still = ["vibration.section_gain.on=false"], own | {"vibration": "off"}
    assert searched_on(in_silence(tuning), load_scenario("metro_geometry", overrides=rails), still)
    assert not searched_on(in_silence(tuning), load_scenario("metro_geometry", overrides=rails), own)
    assert not searched_on(in_silence(tuning), metro, still)


def test_a_search_in_silence_is_told() -> None:
    shaken = shipped_tuning("metro_geometry_cml")
    still = in_silence(shaken)
    assert "Searched on rides without vibration: CML." in silence_note({"cml": still, "kom": shaken})
    assert silence_note({"kom": shaken}) == ""


def rows(sds: dict[str, float], *, draws: int = 20, tracks: int = 4) -> Rows:
    found = {
        (part, quantity, "paper", "truth", "whole", "sd"): Mean(sd, 0.1, draws)
        for part, sd in sds.items()
        for quantity in ("cross_level", "alignment", "vertical_profile")
    }
    case = Case({}, pd.DataFrame({"track_draws": [tracks]}), found)
    return Rows(case, None, {part: part for part in sds}, "paper")


def test_what_is_said_follows_the_larger_ratio() -> None:
    said = own_ride_note(rows({"kom": 2.0, "cml": 0.5}), {"kom": [2.0, 0.4, 1.0], "cml": [0.5, 0.5, 0.4]})
    assert "KOM, alignment 0.400 there and 2.00 mm on the mean" in said
    assert "CML, vertical profile 0.400 there and 0.500 mm" in said
    assert "mean of 20 draws over 4 lays" in said and "up to 5.0 times as large" in said
    said = own_ride_note(rows({"cml": 0.5}), {"cml": [0.5, 0.5, 0.4]})
    assert "None was fitted" in said and "more than 1.2 times" in said
    said = own_ride_note(rows({"kom": 2.0}, draws=2, tracks=1), {"kom": [2.0, 0.4, 1.0]})
    assert "2 draws over 1 lay of" in said and "same rails" in said and "fitted to its" not in said


def test_nothing_is_said_of_one_draw_or_of_what_was_not_run() -> None:
    assert own_ride_note(rows({"kom": 2.0}), {}) == ""
    assert own_ride_note(rows({"kom": 2.0}, draws=1), {"kom": [1.0, 1.0, 1.0]}) == ""
    assert own_ride_note(rows({"kom": 2.0}), {"kom": [1.0, float("nan"), 1.0]}) == ""
