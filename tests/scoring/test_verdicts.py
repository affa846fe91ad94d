"""Verdicts of score tables that are made by hand."""

import numpy as np
import pandas as pd
import pytest

from simrail.scoring.requirement import Requirement
from simrail.scoring.share import ENOUGH, NOT_ENOUGH, NOT_JUDGED, UNDECIDED
from simrail.scoring.table import as_score_table, failed_figures, table_of
from simrail.scoring.verdicts import device_figures, imu_pairs, settled, verdict_table


def campaign(values: dict[str, np.ndarray], *, quantity: str = "roll") -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scores and cells of IMUs: values (devices, speeds) of one method's rms; NaN for a failure."""
    scores, cells = [], []
    for case, (imu, of_imu) in enumerate(values.items()):
        for draw, of_device in enumerate(of_imu):
            for k, value in enumerate(of_device):
                cell = len(cells)
                labels = {"cell": cell, "scenario": "toy", "ride": "line", "vehicle": "car", "mount": "axle"}
                labels |= {"imu": imu, "odometry": "truth", "map": "exact", "vibration": "off"}
                labels |= {"tuning": "default", "track_draw": 0, "sensor_draw": draw, "estimator": "one"}
                figure = (quantity, "full", "truth", "whole", "rms", value, "deg", 9, "ok")
                made = failed_figures("it broke") if np.isnan(value) else table_of([figure])
                scores.append(made.assign(**labels))
                cells.append(labels | {"case": 2 * case + k, "sample": 0, "speed_kmh": 20.0 + 20.0 * k})
    table = as_score_table(pd.concat([one.astype({"status": str}) for one in scores], ignore_index=True))
    return table, pd.DataFrame.from_records(cells)


WANTED = Requirement("roll", 0.1)


def test_a_device_must_meet_it_on_all_its_rides() -> None:
    """Each of 60 devices fails at one of two speeds: over each, one speed is enough, over all, none is."""
    values = np.column_stack([np.full(60, 0.2), np.full(60, 0.05)])
    scores, cells = campaign({"a": values})
    (row,) = verdict_table(scores, cells, [WANTED]).to_dict("records")
    assert (row["verdict"], row["devices"], row["passed"]) == (NOT_ENOUGH, 60, 0)
    each = verdict_table(scores, cells, [Requirement("roll", 0.1, over="each")]).set_index("speed_kmh")
    assert each["verdict"].to_dict() == {20.0: NOT_ENOUGH, 40.0: ENOUGH}


def test_rides_are_no_devices() -> None:
    """Thirty devices on two rides are thirty, whatever the number of recordings."""
    scores, cells = campaign({"a": np.full((30, 2), 0.05)})
    (row,) = verdict_table(scores, cells, [WANTED]).to_dict("records")
    assert (row["verdict"], row["devices"], row["tracks"]) == (UNDECIDED, 30, 1)


def test_a_device_that_is_just_at_the_limit_meets_it() -> None:
    values = np.array([[0.1], [np.nextafter(0.1, 1.0)], [0.05]])
    (row,) = verdict_table(*campaign({"a": values}), [WANTED]).to_dict("records")
    assert (row["devices"], row["passed"]) == (3, 2)


def test_a_failure_is_no_pass() -> None:
    values = np.full((60, 1), 0.05)
    values[:10] = np.nan
    scores, cells = campaign({"a": values})
    (row,) = verdict_table(scores, cells, [WANTED]).to_dict("records")
    assert (row["verdict"], row["passed"]) == (NOT_ENOUGH, 50)
    scores, cells = campaign({"a": values}, quantity="pitch")
    (row,) = verdict_table(scores, cells, [Requirement("pitch", 0.1)]).to_dict("records")
    assert row["passed"] == 50


def test_what_has_no_samples_is_not_judged() -> None:
    scores, cells = campaign({"a": np.full((3, 1), 0.05)})
    scores = scores.assign(value=np.nan, status="no samples")
    (row,) = verdict_table(scores, cells, [WANTED]).to_dict("records")
    assert (row["verdict"], row["reason"]) == (NOT_JUDGED, "no samples")


def test_the_figure_at_a_share_is_that_of_a_device() -> None:
    """Where the share ends between two of them it is the larger one's: none lies between."""
    values = np.arange(1.0, 11.0)[::-1, None]
    (row,) = verdict_table(*campaign({"a": values}), [Requirement("roll", 20.0, share=0.9)]).to_dict(
        "records"
    )
    assert (row["at_share"], row["median"]) == (10.0, 5.5)


def test_below_at_share_are_so_many_devices() -> None:
    values = np.linspace(0.001, 0.1, 100)[:, None]
    scores, cells = campaign({"a": values})
    (row,) = verdict_table(scores, cells, [WANTED]).to_dict("records")
    assert np.mean(values <= row["at_share"]) == pytest.approx(0.96, abs=0.011)
    assert row["median"] == pytest.approx(0.0505, rel=1e-3)


def test_only_groups_without_an_open_verdict_are_settled() -> None:
    rows = {"good": np.full((60, 1), 0.05), "open": np.full((30, 1), 0.05), "bad": np.full((60, 1), 0.5)}
    table = verdict_table(*campaign(rows), [WANTED])
    assert settled(table) == {("car", "axle", "good"), ("car", "axle", "bad")}


def test_the_worst_ride_is_the_figure_of_a_device() -> None:
    values = np.array([[0.01, 0.03], [0.04, 0.02]])
    devices = device_figures(*campaign({"a": values}), WANTED)
    assert devices["value"].tolist() == [0.03, 0.04]


def test_two_imus_are_compared_ride_by_ride() -> None:
    """Rails differ by much, the IMUs on them by 0.01: verdicts are alike, and the pair is told apart."""
    rails = np.linspace(0.02, 0.08, 30)[:, None]
    own = 0.002 * np.sin(np.arange(30.0))[:, None]
    scores, cells = campaign({"a": rails + 0.01 + own, "b": rails, "c": rails[::-1]})
    scores, cells = (table.assign(track_draw=table["sensor_draw"]) for table in (scores, cells))
    assert set(verdict_table(scores, cells, [WANTED])["verdict"]) == {UNDECIDED}
    pairs = imu_pairs(scores, cells, [WANTED]).set_index(["first", "second"])
    assert list(pairs.index) == [("a", "b"), ("a", "c"), ("b", "c")]
    row = pairs.loc[("a", "b")]
    assert row["difference"] == pytest.approx(0.01, abs=1e-3)
    assert 0.0 < row["low95"] < row["difference"] < row["high95"]
    assert (row["won"], row["pairs"], row["unit"]) == (0, 30, "deg")
    assert pairs.loc[("b", "c"), "low95"] < 0.0 < pairs.loc[("b", "c"), "high95"]
    assert pairs.loc[("b", "c"), "won"] == 15


def test_a_device_that_fails_is_in_no_pair() -> None:
    broken = np.full((4, 1), 0.05)
    broken[0] = np.nan
    (row,) = imu_pairs(*campaign({"a": broken, "b": np.full((4, 1), 0.04)}), [WANTED]).to_dict("records")
    assert (row["won"], row["pairs"]) == (0, 3)


def test_a_verdict_says_first_of_which_requirement_it_is() -> None:
    scores, cells = campaign({"a": np.full((3, 1), 0.05)})
    table = verdict_table(scores, cells, [WANTED, Requirement("roll", 0.01)])
    assert list(table.columns[:2]) == ["requirement", "number"]
    assert table["number"].tolist() == [0, 1]
