"""Odometries over all cells: pooled figures against plain numbers, clusters, and tables that can be read."""

from __future__ import annotations

from io import StringIO
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from scipy import stats

from simrail.cli.ablation_tables import print_odometries
from simrail.report.campaign.odometry import odometry_draws, odometry_frames, page_tables, row_words
from simrail.scoring.table import SCORE_COLUMNS, as_score_table

Scores = tuple[pd.DataFrame, pd.DataFrame]

TRACKS, MAPS, SPEEDS, WAYS = 2, 2, (20.0, 60.0), ("forward", "backward")
VEHICLES, MOUNTS = ("car", "two_axle_wagon_of_a_long_name"), ("axle", "body")
FIGURES = (
    ("position", "rms", "m"),
    ("position", "p95", "m"),
    ("speed", "rms", "m/s"),
    ("position", "coverage95", "1"),
    ("speed", "coverage95", "1"),
)


def campaign(*, exact: bool = True, mounts: tuple[str, ...] = MOUNTS, odometry: str = "matched") -> Scores:
    """Scores of an odometry whose every figure is another: 2 tracks x 2 maps, and each track's exact one."""
    rng = np.random.default_rng(5)
    maps = [("drawn", m) for m in range(MAPS)] + [("exact", 0)] * exact
    rows, cells = [], []
    grid = product(VEHICLES, mounts, SPEEDS, WAYS, range(TRACKS), maps)
    for number, (vehicle, mount, speed, way, track, (known, draw)) in enumerate(grid):
        labels: dict[str, Any] = {
            "cell": number,
            "scenario": "test",
            "ride": "line",
            "vehicle": vehicle,
            "mount": mount,
            "imu": "lord_3dm_gx4_25",
            "odometry": odometry,
            "map": known,
            "vibration": "on",
            "tuning": "default",
            "track_draw": track,
            "sensor_draw": 0,
        }
        cells.append(labels | {"map_draw": draw, "speed_kmh": speed, "direction": way, "case": number})
        size = (0.3 if known == "drawn" else 0.1) * (2.0 if mount == "body" else 1.0)
        for quantity, metric, unit in FIGURES:
            share = 0.9 + 0.01 * track + 0.02 * draw + 0.005 * rng.random()
            value = share if metric == "coverage95" else size * (1.0 + rng.random())
            for window, estimator in product(("whole", "moving"), (f"odometry:{odometry}", "design_angles")):
                where = {"band": "full", "reference": "truth", "window": window, "status": "ok"}
                figure = {"quantity": quantity, "metric": metric, "unit": unit, "n_samples": 9}
                other = value if (window, estimator[0]) == ("whole", "o") else 77.0
                rows.append(labels | figure | where | {"estimator": estimator, "value": other})
    return as_score_table(pd.DataFrame(rows)[list(SCORE_COLUMNS)]), pd.DataFrame(cells)


@pytest.fixture(scope="module")
def made() -> Scores:
    return campaign()


def values(made: Scores, quantity: str, metric: str, **labels: object) -> pd.DataFrame:
    """Figures over whole rides with their draws, by plain pandas."""
    scores, cells = made
    rows = scores[(scores["quantity"] == quantity) & (scores["metric"] == metric)]
    rows = rows[(rows["window"] == "whole") & (rows["estimator"] == "odometry:matched")]
    rows = rows[["cell", "value"]].merge(cells, on="cell")
    for name, value in labels.items():
        rows = rows[rows[name] == value]
    return rows


def test_a_row_per_vehicle_mount_and_map_is_pooled_over_the_rides(made: Scores) -> None:
    frame = odometry_frames(*made)["odometry"]
    assert list(frame[["vehicle", "mount", "map"]].itertuples(index=False, name=None)) == [
        *product(VEHICLES, MOUNTS, ("drawn", "exact"))
    ]
    for row in frame.to_dict("records"):
        own = {name: row[name] for name in ("vehicle", "mount", "map")}
        rms = values(made, "position", "rms", **own)["value"]
        assert row["position_rms_m"] == pytest.approx(np.sqrt((rms**2).mean()))
        assert row["position_p95_m"] == pytest.approx(values(made, "position", "p95", **own)["value"].mean())
        speed = values(made, "speed", "rms", **own)["value"]
        assert row["speed_rms_mps"] == pytest.approx(np.sqrt((speed**2).mean()))
        assert row["recordings"] == len(rms) == 4 * TRACKS * (MAPS if row["map"] == "drawn" else 1)
        assert row["clusters"] == TRACKS * (MAPS if row["map"] == "drawn" else 1)


@pytest.mark.parametrize("quantity", ["position", "speed"])
def test_coverage_is_known_as_well_as_draws_of_track_and_map_say(made: Scores, quantity: str) -> None:
    """Four clusters of as many rides each: Student's t of their means."""
    row = odometry_frames(*made)["odometry"].iloc[0]
    own = values(made, quantity, "coverage95", vehicle="car", mount="axle", map="drawn")
    means = own.groupby(["track_draw", "map_draw"])["value"].mean()
    reach = stats.t(3).ppf(0.975) * means.std(ddof=1) / np.sqrt(4)
    assert row[f"{quantity}_coverage"] == pytest.approx(own["value"].mean())
    assert row[f"{quantity}_coverage_low95"] == pytest.approx(means.mean() - reach)
    assert row[f"{quantity}_coverage_high95"] == pytest.approx(min(means.mean() + reach, 1.0))


def test_one_draw_alone_has_no_interval(made: Scores) -> None:
    scores, cells = made
    kept = cells[cells["track_draw"] == 0]
    row = odometry_frames(scores[scores["cell"].isin(kept["cell"])], kept)["odometry"].iloc[1]
    assert row["map"] == "exact" and row["clusters"] == 1 and row["recordings"] == 4
    assert np.isfinite(row["position_coverage"]) and np.isnan(row["position_coverage_low95"])


def test_classes_of_rides_are_pooled_over_the_vehicles(made: Scores) -> None:
    frame = odometry_frames(*made)["odometry_classes"]
    assert len(frame) == len(MOUNTS) * 2 * (1 + len(SPEEDS) * len(WAYS))
    (slow,) = frame[
        (frame["mount"] == "body")
        & (frame["speed_kmh"] == 20.0)
        & (frame["direction"] == "backward")
        & (frame["map"] == "drawn")
    ].to_dict("records")
    own = values(
        made, "position", "coverage95", mount="body", speed_kmh=20.0, direction="backward", map="drawn"
    )
    assert slow["position_coverage"] == pytest.approx(own["value"].mean())
    assert slow["recordings"] == len(own) == len(VEHICLES) * TRACKS * MAPS
    every = frame[(frame["mount"] == "axle") & (frame["speed_kmh"] == "all") & (frame["map"] == "exact")]
    assert every["recordings"].tolist() == [len(VEHICLES) * len(SPEEDS) * len(WAYS) * TRACKS]


def test_only_where_mounts_or_maps_differ_and_the_position_is_not_the_true_one() -> None:
    assert odometry_frames(*campaign(exact=False, mounts=("axle",))) == {}
    assert "odometry" in odometry_frames(*campaign(exact=False))
    assert "odometry" in odometry_frames(*campaign(mounts=("axle",)))
    assert odometry_draws(*campaign(odometry="truth")).empty
    assert odometry_frames(*campaign(odometry="truth")) == {}


def test_what_a_scenario_does_not_score_is_left_open(made: Scores) -> None:
    scores, cells = made
    frame = odometry_frames(scores[scores["metric"] == "rms"], cells)["odometry"]
    assert frame["position_rms_m"].notna().all()
    assert frame[["position_p95_m", "position_coverage", "speed_coverage"]].isna().all(axis=None)


def test_the_tables_of_the_page_name_the_map_in_every_row(made: Scores) -> None:
    shown = page_tables(odometry_frames(*made))
    assert [title for title, _ in shown] == [
        "matched, over all rides",
        "matched, by class of ride, over all vehicles",
    ]
    for _, table in shown:
        assert sum(span for _, span in table.groups) == len(table.columns) == 6
        for row in table.rows:
            assert row.label.endswith(("the map errs", "exact (ablation)")) and len(row.cells) == 6
    first = shown[0][1].rows[0]
    assert first.label == "car \u00b7 axle \u00b7 the map errs"
    rms = values(made, "position", "rms", vehicle="car", mount="axle", map="drawn")["value"]
    assert first.cells[0].text == f"{np.sqrt((rms**2).mean()):.3f}" and first.cells[5].text == "16"


@pytest.mark.parametrize("width", [80, 200])
def test_the_command_line_shows_them_in_80_columns(width: int) -> None:
    frames = odometry_frames(*campaign())
    frames = {name: frame.replace(VEHICLES[1], "metro_irw_bogie") for name, frame in frames.items()}
    console = Console(width=width, record=True, file=StringIO())
    print_odometries(console, frames)
    text = console.export_text()
    tables = [line for line in text.splitlines() if not line.startswith("whole rides")]
    assert "\u2026" not in text and max(len(line.rstrip()) for line in tables[:-3]) <= 80
    rows = [line.split() for line in text.splitlines()]
    assert sum(row[-7:-6] == ["exact"] or "exact" in row for row in rows) >= 4
    errs = next(row for row in rows if row[:3] == ["car", "axle", "errs"])
    rms = odometry_frames(*campaign())["odometry"]["position_rms_m"].iloc[0]
    assert errs[3] == f"{rms:.3f}" and errs[-1] == "16"


def test_a_row_of_ones_own_sheet_is_called_by_its_file() -> None:
    assert row_words("imu", "/somewhere/far/away/my_imu.toml") == "my_imu.toml"
    assert row_words("imu", "lord_3dm_gx4_25") == "lord_3dm_gx4_25"
