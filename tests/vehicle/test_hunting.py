"""The quick answer whether a vehicle hunts below a speed, against the whole search and closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from simrail.core.toml_files import load
from simrail.track.design import Straight, TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import CHANNELS, lay
from simrail.vehicle import hunting
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.contact.wheelset import conicity
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.hunting import conicity_of, critical_below, mean_widening_m, on_gauge
from simrail.vehicle.linear import running_vehicle
from simrail.vehicle.speed_profile import SpeedProfile
from simrail.vehicle.stability import critical_speed, root_locus


@pytest.fixture(autouse=True)
def own_answers(tmp_path, monkeypatch):
    monkeypatch.setattr(hunting, "cache_folder", lambda: tmp_path)
    return tmp_path


def model_of(name):
    return load(VehicleFile, "vehicle", name).model(name)


def test_it_is_the_critical_speed_of_the_whole_search():
    """The suspended wheelset; `tests/vehicle/test_linear.py` holds the search to its closed form."""
    model = model_of("suspended_wheelset")
    vehicle = running_vehicle(model)
    whole = critical_speed(vehicle, root_locus(vehicle, np.linspace(40.0, 110.0, 8))).speed_mps
    assert whole is not None
    assert critical_below(model, 100.0) == pytest.approx(whole, abs=0.05)
    assert critical_below(model, whole - 0.2) is None
    assert critical_below(model, whole + 0.2) == pytest.approx(whole, abs=0.05)


def test_nothing_is_searched_twice(monkeypatch):
    model, asked = model_of("two_axle_wagon"), []
    search = hunting._search

    def counted(*arguments):
        asked.append(arguments[1:3])
        return search(*arguments)

    monkeypatch.setattr(hunting, "_search", counted)
    assert critical_below(model, 40.0) is None
    assert critical_below(model, 30.0) is None
    assert len(asked) == 1
    critical = critical_below(model, 80.0)
    assert critical is not None and 40.0 < critical < 80.0
    assert critical_below(model, 50.0) is None and critical_below(model, 70.0) == critical
    assert asked == [(0.0, 40.0), (40.0, 80.0)]


def test_another_vehicle_or_gauge_has_another_answer(own_answers):
    model = model_of("two_axle_wagon")
    for one in (model, on_gauge(model, 0.002), replace(model, name="other")):
        critical_below(one, 20.0)
    assert len(list((own_answers / "critical_speeds").iterdir())) == 3


def test_a_tighter_gauge_has_more_conicity():
    """S1002 on 60E1: each millimetre of gauge brings the flange roots nearer to the rails."""
    model = model_of("two_axle_wagon")
    assert on_gauge(model, 0.4e-3) is model
    tight, wide = on_gauge(model, -0.0034), on_gauge(model, 0.0034)
    assert tight.wheel_rail.gauge_m == pytest.approx(model.wheel_rail.gauge_m - 0.003)
    assert conicity_of(tight) > 1.2 * conicity_of(wide)
    assert conicity_of(model) == conicity(contacts_of(model).tables[0], 0.003)
    assert conicity_of(model_of("metro_irw_bogie")) is None
    assert conicity_of(model_of("suspended_wheelset")) is None


def test_the_mean_gauge_is_that_of_the_laid_rails():
    laid = lay(TrackDesign("level", 0.0, (Straight(100.0),)), Irregularity("none", (1.5, 100.0), 0.0), seed=0)
    table = laid.table.copy()
    table[:, CHANNELS.index("y_left"), 3] += 4e-3
    table[:, CHANNELS.index("y_right"), 3] += 1e-3
    laid = replace(laid, table=table)
    for ends in ((10.0, 90.0), (90.0, 10.0)):
        assert mean_widening_m(laid, SpeedProfile(*ends, 5.0)) == pytest.approx(3e-3, abs=1e-12)
