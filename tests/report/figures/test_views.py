"""What a page shows of a ride over distance: values of a ride in the units that their panels name."""

from __future__ import annotations

import base64
import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ATTITUDE, IMU
from simrail.report.figures.views import (
    LEAST_BINS,
    MOST_BINS,
    MOST_NUMBERS,
    View,
    _at,
    _numbers,
    _packed,
    as_data,
    bins_for,
    from_data,
    ride_view,
)
from simrail.report.tables.methods import MethodStyle
from simrail.track.design import Straight, TrackDesign

COUNT = 101


def style(name: str) -> MethodStyle:
    return MethodStyle(name, f"the {name}", "", True, "", None, "#123456", "-", "filter", False)


@pytest.fixture(scope="module")
def view() -> View:
    """100 m at 10 m/s, 2 deg to the left, on a straight; a method that errs by 0.5 deg, and drifts."""
    time = pd.Index(np.arange(COUNT) / 10.0, name="time_s")
    place = 50.0 + np.arange(COUNT, dtype=float)
    motion = pd.DataFrame({"position_m": place, "speed_mps": -10.0}, index=time)
    motion[ATTITUDE[0]], motion[ATTITUDE[1]], motion[ATTITUDE[2]] = np.radians(2.0), 0.0, 0.1
    found = motion[list(ATTITUDE)].copy()
    found[ATTITUDE[0]] += np.radians(0.5)
    found[ATTITUDE[2]] += np.radians(0.3) + np.radians(0.01) * np.arange(COUNT)
    imu = pd.DataFrame({name: (i + 1.0) for i, name in enumerate(IMU)}, index=time)
    odometry = pd.DataFrame({"position_m": place + 0.7, "position_sd_m": 0.5}, index=time)
    odometry["speed_mps"], odometry["acceleration_mps2"] = -10.0, 0.0
    example = SimpleNamespace(
        motion=motion,
        estimates={"ekf": SimpleNamespace(states=found, geometry=None)},
        recording=SimpleNamespace(imu=imu, odometry=odometry, odometry_source="encoder"),
        line=TrackDesign("line", 0.0, (Straight(200.0),)),
        contacts={},
        rails=None,
    )
    return ride_view(
        example,  # type: ignore[arg-type]
        [style("ekf")],
        picks={"ride": "a", "imu": "b"},
        facts=["one", "two"],
        bins=10,
    )


def test_every_panel_is_in_its_unit(view: View) -> None:
    panels = {panel.title: panel for panel in view.panels}
    (speed,) = panels["speed"].series
    assert panels["speed"].unit == "km/h" and speed.y == pytest.approx(36.0)
    for i, axis in enumerate("XYZ"):
        rate, force = panels[f"rate {axis}"], panels[f"acceleration {axis}"]
        assert (rate.unit, force.unit) == ("\u00b0/s", "m/s\u00b2")
        assert rate.series[0].mean == pytest.approx(np.degrees(i + 1.0))
        assert force.series[0].mean == pytest.approx(i + 4.0)
    (error,) = panels["roll error"].series
    assert panels["roll error"].unit == "\u00b0" and error.y == pytest.approx(0.5)
    (drift,) = panels["yaw drift"].series
    assert drift.y is not None and drift.y[[0, -1]] == pytest.approx([0.0, 1.0])
    design, true, own = panels["roll"].series
    assert [series.key for series in (design, true, own)] == ["design", "truth", "ekf"]
    assert design.y == pytest.approx(0.0) and true.y == pytest.approx(2.0) and own.y == pytest.approx(2.5)


def test_the_odometrys_error_stands_in_its_95_percent_band(view: View) -> None:
    (panel,) = (panel for panel in view.panels if "odometry" in panel.title)
    band, error = panel.series
    assert panel.unit == "m" and error.y == pytest.approx(0.7)
    assert band.low == pytest.approx(-0.98) and band.high == pytest.approx(0.98)


def test_a_page_gives_back_what_it_was_given(view: View) -> None:
    again = from_data(json.loads(json.dumps(as_data(view))))
    assert (again.picks, again.title, list(again.facts)) == (view.picks, "a \u00b7 b", ["one", "two"])
    assert (again.travel, again.along, again.places) == (view.travel, view.along, view.places)
    for one, other in zip(view.panels, again.panels, strict=True):
        assert (one.group, one.title, one.unit, one.axis) == (
            other.group,
            other.title,
            other.unit,
            other.axis,
        )
        for before, after in zip(one.series, other.series, strict=True):
            assert before.key == after.key
            for name in ("y", "low", "high", "mean"):
                a, b = getattr(before, name), getattr(after, name)
                assert (a is None) == (b is None)
                if a is not None:
                    assert_within_half_a_step(b, a)
    for name, (x, x2) in view.axes.items():
        assert_within_half_a_step(again.axes[name][0], x)
        assert_within_half_a_step(again.axes[name][1], x2)


def assert_within_half_a_step(found, wanted):
    """Of 65,534 steps over the range, which a panel shows with some hundred pixels."""
    step = (wanted.max() - wanted.min()) / 65_534
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=0.5001 * step)


def test_gaps_constants_and_spikes_are_given_back() -> None:
    gaps = np.array([np.nan, -3.0, 5.0, np.inf, 1.0])
    np.testing.assert_allclose(_numbers(_packed(gaps)), [np.nan, -3.0, 5.0, np.nan, 1.0], atol=8.0 / 65_534)
    np.testing.assert_array_equal(_numbers(_packed(np.full(3, 0.1))), [0.1, 0.1, 0.1])
    assert np.isnan(_numbers(_packed(np.full(2, np.nan)))).all()
    # The ends are met exactly: a spike is as high as it was.
    ends = _numbers(_packed(np.array([0.3, 1234.5, 0.2])))
    assert ends[1] == pytest.approx(1234.5, rel=1e-12) and ends[2] == 0.2


def test_a_page_of_a_former_version_is_read() -> None:
    text = base64.b64encode(np.array([1.0, np.nan, 2.5], dtype="<f4").tobytes()).decode()
    np.testing.assert_array_equal(_numbers(text), [1.0, np.nan, 2.5])


def test_beyond_what_a_method_found_there_is_nothing() -> None:
    place = np.array([10.0, 20.0, 30.0])
    found = _at(np.array([5.0, 10.0, 15.0, 30.0, 31.0]), place, np.array([1.0, 3.0, 7.0]))
    np.testing.assert_array_equal(found, [np.nan, 1.0, 2.0, 7.0, np.nan])


@pytest.mark.parametrize(("recordings", "methods", "mappers"), [(1, 5, 2), (4, 3, 0), (12, 8, 1)])
def test_all_views_of_a_page_keep_to_their_size(recordings: int, methods: int, mappers: int) -> None:
    """The first has twice the bins; a bin more for each would be too much."""
    bins = bins_for(recordings, methods, mappers)
    each = 10 * methods + 20 * mappers + 50
    assert (recordings + 1) * each * bins <= MOST_NUMBERS or bins == LEAST_BINS
    assert (recordings + 1) * each * (bins + 1) > MOST_NUMBERS or bins == MOST_BINS // 2
