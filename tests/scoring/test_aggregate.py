"""The averaged table: every group has the interval and the spread of its own draws."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from simrail.scoring.aggregate import AGGREGATE_COLUMNS, aggregate, axis_columns
from simrail.scoring.bootstrap import interval
from simrail.scoring.table import NO_SAMPLES, UNOBSERVABLE, as_score_table, concat_scores, labelled

LABELS: dict[str, object] = {
    "scenario": "test",
    "ride": "out",
    "vehicle": "none",
    "mount": "axle",
    "imu": "ideal",
    "odometry": "encoder",
    "map": "exact",
    "vibration": "off",
    "tuning": "default",
}


def table(draws: dict[str, tuple[int, int]], *, seed: int = 1) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scores of some estimators with (tracks, sensors) draws, in random order, and their cells."""
    rng = np.random.default_rng(seed)
    parts, cells = [], []
    for name, (tracks, sensors) in draws.items():
        for track, sensor in np.ndindex(tracks, sensors):
            figure = pd.DataFrame(
                {
                    "quantity": ["roll"],
                    "band": ["full"],
                    "reference": ["truth"],
                    "window": ["whole"],
                    "metric": ["rms"],
                    "value": [5.0 + rng.normal()],
                    "unit": ["deg"],
                    "n_samples": [10],
                    "status": ["ok"],
                }
            )
            number = len(cells)
            draw: dict[str, object] = {"cell": number, "track_draw": track, "sensor_draw": sensor}
            parts.append(labelled([(as_score_table(figure), LABELS | draw | {"estimator": name})]))
            cells.append({"cell": number, "case": 0, "sample": 0})
    order = rng.permutation(len(parts))
    return concat_scores([parts[i] for i in order]), pd.DataFrame(cells)


def test_every_group_has_the_interval_of_its_own_draws() -> None:
    scores, cells = table(
        {"many": (8, 3), "few": (3, 4), "one_track": (1, 12), "alone": (1, 1), "plain": (9, 1)}
    )
    # One value is missing, as if its cell had failed.
    scores.loc[scores.index[5], "value"] = np.nan
    scores["status"] = scores["status"].cat.add_categories("broken")
    scores.loc[scores.index[5], "status"] = "broken"
    found = aggregate(scores, cells).set_index("estimator")
    assert [name for name in found.columns if name in AGGREGATE_COLUMNS] == list(AGGREGATE_COLUMNS)
    for name, rows in scores.groupby("estimator", observed=True):
        rows = rows.sort_values("cell")
        expected = interval(rows["value"], rows["track_draw"])
        row = found.loc[name]
        assert (row["value"], row["low95"], row["high95"]) == pytest.approx(
            (expected.value, expected.low, expected.high), nan_ok=True, rel=1e-9
        )
    assert np.isnan(found.loc["alone", "low95"]) and found["failed"].sum() == 1


def test_failed_draws_are_all_counted_and_only_they() -> None:
    """By estimator: whole tracks, several draws of one, none. What is left open or not there is none."""
    scores, cells = table(
        {"none": (3, 4), "some": (3, 4), "track": (3, 4), "all": (1, 3), "open": (2, 2), "none there": (1, 2)}
    )
    ok = scores["status"].astype(str)
    track, sensor = scores["track_draw"], scores["sensor_draw"]
    some = (track.eq(1) & sensor.lt(3)) | (track.eq(2) & sensor.eq(0))
    failed = scores["estimator"].eq("some") & some
    failed |= scores["estimator"].eq("track") & track.eq(0)
    failed |= scores["estimator"].eq("all")
    is_open = scores["estimator"].eq("open") & sensor.eq(1)
    empty = scores["estimator"].eq("none there")
    scores["status"] = ok.mask(failed, "broken").mask(is_open, UNOBSERVABLE).mask(empty, NO_SAMPLES)
    scores.loc[failed | is_open | empty, "value"] = np.nan
    found = aggregate(scores, cells).set_index("estimator")
    columns = ["draws", "failed", "track_draws"]
    assert found[columns].T.to_dict("list") == {
        "none": [12, 0, 3],
        "some": [8, 4, 3],
        "track": [8, 4, 2],
        "all": [0, 3, 0],
        "open": [2, 0, 2],
        "none there": [0, 0, 0],
    }
    assert found["value"].isna().to_dict() == {name: name in ("all", "none there") for name in found.index}
    for name in ("some", "track", "open"):
        mean = scores.loc[scores["estimator"] == name, "value"].mean()
        assert found.loc[name, "value"] == pytest.approx(mean, rel=1e-12)


def test_samples_are_clusters_of_their_own() -> None:
    scores, cells = table({"ekf": (6, 4)})
    cells["sample"] = cells["cell"] % 4  # each draw of the sensors as a sample: 24 tracks, one draw each
    row = aggregate(scores, cells).iloc[0]
    assert row["track_draws"] == row["draws"] == 24 and np.isnan(row["sd_sensor"])
    assert row["low95"] == pytest.approx(interval(scores["value"]).low, rel=0.2)


def test_the_order_of_the_rows_does_not_matter() -> None:
    scores, cells = table({"a": (6, 3), "b": (1, 9)})
    shuffled = scores.sample(frac=1.0, random_state=2).reset_index(drop=True)
    pd.testing.assert_frame_equal(aggregate(scores, cells), aggregate(shuffled, cells), check_exact=True)


def test_the_interval_of_a_share_ends_at_one() -> None:
    """Of six tracks one holds half of the time: twice the standard error above the mean would be 1.1."""
    scores, cells = table({"one": (6, 1)})
    scores["metric"] = "coverage95"
    scores["value"] = [1.0, 0.999, 0.998, 0.997, 0.996, 0.5]
    found = aggregate(scores, cells).iloc[0]
    assert found["value"] < found["high95"] == 1.0 and 0.0 <= found["low95"] < found["value"]


def test_the_two_levels_of_chance_are_pooled_from_tracks_of_unlike_many_draws() -> None:
    """Of 1, 3 and 2, 4, 6: squares of 2 and 8 over one and two degrees of freedom; means 2 and 4."""
    scores, cells = table({"one": (2, 3)})
    values = pd.Series([1.0, 3.0, np.nan, 2.0, 4.0, 6.0])
    scores["value"] = scores["cell"].map(values)
    scores["status"] = scores["status"].cat.add_categories("broken")
    scores.loc[scores["value"].isna(), "status"] = "broken"
    row = aggregate(scores, cells).iloc[0]
    assert row["sd_sensor"] == pytest.approx(np.sqrt(10.0 / 3.0), rel=1e-12)
    assert row["sd_track"] == pytest.approx(np.sqrt(2.0), rel=1e-12)
    assert (row["value"], row["draws"], row["track_draws"], row["failed"]) == (16.0 / 5.0, 5, 2, 1)


def test_what_differs_within_a_case_is_drawn_and_no_axis() -> None:
    """By two values already; a case that has none is alike throughout, too."""
    cells = pd.DataFrame({"cell": range(4), "case": [0, 0, 1, 1], "sample": [0, 1, 0, 1]})
    cells["speed_kmh"] = [20.0, 20.0, 40.0, 40.0]
    cells["irregularity.scale"] = [0.9, 1.1, 1.0, 1.0]
    cells["rail.friction"] = [np.nan, np.nan, 0.3, 0.3]
    cells["noise"] = [np.nan, 0.1, 0.1, 0.1]
    assert axis_columns(cells) == ["case", "speed_kmh", "rail.friction"]
