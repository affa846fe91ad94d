"""The section on a campaign: its axes, its figures and tables against the scores, and its size."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from simrail.campaign.cell import CellResult
from simrail.report.campaign import heat
from simrail.report.campaign.axes import campaign_axes, draws_of, finest, is_campaign
from simrail.report.campaign.figures import box_figure, curvature_figure, in_two
from simrail.report.campaign.heat import Side, heat_maps, rails_figures, short_number, side_of
from simrail.report.campaign.tables import TABLES, campaign_tables, write_tables
from simrail.report.figures import canvas
from simrail.report.figures.canvas import NARROW_IN, WIDE_IN, drawn
from simrail.report.pages.page import write_report
from simrail.report.tables.methods import MethodStyle, method_styles
from simrail.scenario.scenario import Scenario, load_scenario, read_scenario
from simrail.scoring.statistics import compare
from simrail.scoring.table import INTEGER_COLUMNS, SCORE_COLUMNS, as_score_table
from simrail.track.bands import BANDS

Scores = tuple[pd.DataFrame, pd.DataFrame]
"""Score table and table of cells."""

Frames = dict[str, pd.DataFrame]

SCENARIO = """
title = "A campaign made up: speeds, directions, irregularity and grades"
seed = 1
track = "test_line"
vehicle = "none"
engine = "kinematic"
[encoder]
wheel = "wheel"
[monte_carlo]
track_draws = 10
sensor_draws = 20
[irregularity]
spectrum = "erri_b176_low"
scale = [0.5, 1.0, 2.0]
[[ride]]
name = "out"
start_m = 10.0
end_m = 560.0
speed_kmh = [20.0, 40.0, 70.0]
reverse = [false, true]
[[imu]]
name = "axle"
grade = ["ideal", "tactical", "industrial", "consumer"]
body = "body"
position_m = [0.0, 0.0, 0.6]
[[estimator]]
name = "ekf_compensated"
method = "AttitudeEkf"
[[estimator]]
name = "ekf_uncompensated"
method = "AttitudeEkf"
[estimator.options]
compensated = false
[[estimator]]
name = "vqf"
method = "Vqf"
[[estimator]]
name = "design_angles"
method = "DesignAngles"
"""

SPEEDS = (20.0, 40.0, 70.0)
SCALES = (0.5, 1.0, 2.0)
GRADES = ("ideal", "tactical", "industrial", "consumer")
METHODS = ("ekf_compensated", "ekf_uncompensated", "vqf", "design_angles")
CURVES = ("curve:curve 3 R300", "curve:curve 7 R-150", "curve:curve 11 R800")
RADIUS = {CURVES[0]: 300.0, CURVES[1]: 150.0, CURVES[2]: 800.0}
WAYS = ["irregularity.scale", "ride.speed_kmh", "ride.reverse"]
CELL_COLUMNS = ["case", *WAYS, "track_draw", "imu", "sensor_draw"]
FIGURES = [
    *(("roll", "rms", window) for window in ("whole", "straight", "transition", "curve", *CURVES)),
    *(("pitch", "rms", window) for window in ("whole", "curve")),
    ("yaw_debiased", "rms", "whole"),
    ("roll", "max", "whole"),
    ("roll", "nees", "whole"),
    ("roll", "coverage95", "whole"),
    ("roll", "us_per_sample", "whole"),
]


def campaign(
    *, tracks: int = 10, sensors: int = 20, seed: int = 1, methods: tuple[str, ...] = METHODS
) -> Scores:
    """Scores and cells: 3 speeds x 2 directions x 3 irregularities x 4 grades x draws.

    The roll error of a method that is not compensated grows with v^2/R, that of a grade with its
    noise, all errors with the irregularity; tracks and sensors add a spread of their own.
    """
    rng = np.random.default_rng(seed)
    worlds = list(product(SCALES, SPEEDS, (False, True)))
    cells = pd.DataFrame(
        [
            (w * len(GRADES) + g, scale, speed, back, t, grade, s)
            for w, (scale, speed, back) in enumerate(worlds)
            for t in range(tracks)
            for g, grade in enumerate(GRADES)
            for s in range(sensors)
        ],
        columns=CELL_COLUMNS,
    )
    cells.insert(0, "cell", np.arange(len(cells)))
    cells["imu.grade"] = cells["imu"]
    cells["sample"] = 0
    cells["speed_kmh"] = cells["ride.speed_kmh"]
    cells["direction"] = np.where(cells["ride.reverse"], "backward", "forward")
    fixed = {"ride": "out", "vehicle": "none", "mount": "axle", "odometry": "encoder", "map": "exact"}
    fixed["vibration"] = "off"
    for name, value in (fixed | {"track": "test_line", "engine": "kinematic"}).items():
        cells[name] = value
    n, rows = len(cells), len(methods) * len(FIGURES)
    noise = cells["imu"].map(dict(zip(GRADES, (0.0, 0.02, 0.06, 0.2), strict=True))).to_numpy()
    track = rng.normal(size=(len(SCALES) * 6 * tracks)).repeat(len(GRADES) * sensors)
    rough = 0.05 * cells["irregularity.scale"].to_numpy() * np.exp(0.15 * track)
    push = (cells["ride.speed_kmh"].to_numpy() / 3.6) ** 2 / 9.81
    values = np.empty((n, len(methods), len(FIGURES)))
    for m, method in enumerate(methods):
        for f, (quantity, metric, window) in enumerate(FIGURES):
            draw = np.exp(0.1 * rng.normal(size=n))
            error = np.hypot(rough * (3.0 if method == "design_angles" else 1.0), noise * draw)
            if method in ("ekf_uncompensated", "vqf") and "straight" not in window:
                gain = 0.3 if method == "vqf" else 1.0
                error = np.hypot(error, gain * np.rad2deg(push / RADIUS.get(window, 400.0)) * 0.5)
            special = {"nees": 0.9 * draw, "coverage95": 1.0 - 0.05 * draw, "us_per_sample": 0.5 * draw}
            scale = {"max": 3.5}.get(metric, 1.0) * {"pitch": 0.6}.get(quantity, 1.0)
            values[:, m, f] = special.get(metric, scale * error)
    repeated = {
        name: pd.Categorical(cells[name].repeat(rows))
        if name not in INTEGER_COLUMNS
        else cells[name].repeat(rows).to_numpy()
        for name in (
            "cell",
            "ride",
            "vehicle",
            "mount",
            "imu",
            "odometry",
            "map",
            "vibration",
            "track_draw",
            "sensor_draw",
        )
    }
    units = {"nees": "1", "coverage95": "1", "us_per_sample": "us"}
    columns = repeated | {
        "scenario": "test",
        "tuning": "default",
        "estimator": np.tile(np.repeat(methods, len(FIGURES)), n),
        "quantity": np.tile([quantity for quantity, _, _ in FIGURES], n * len(methods)),
        "metric": np.tile([metric for _, metric, _ in FIGURES], n * len(methods)),
        "window": np.tile([window for _, _, window in FIGURES], n * len(methods)),
        "unit": np.tile([units.get(metric, "deg") for _, metric, _ in FIGURES], n * len(methods)),
        "band": "full",
        "reference": "truth",
        "value": values.ravel(),
        "n_samples": 1000,
        "status": "ok",
    }
    return as_score_table(pd.DataFrame(columns)[list(SCORE_COLUMNS)]), cells


MANIFEST = {"command": "simrail run made_up --set 'seed=2'", "seed": 2}


@pytest.fixture(scope="module")
def made_up() -> Scenario:
    return read_scenario(SCENARIO, name="made_up")


@pytest.fixture(scope="module")
def styles(made_up: Scenario) -> list[MethodStyle]:
    return list(method_styles(made_up).values())


@pytest.fixture(scope="module")
def small() -> Scores:
    return campaign(tracks=3, sensors=4)


@pytest.fixture(scope="module")
def tables(small: Scores, styles: list[MethodStyle]) -> Frames:
    scores, cells = small
    return campaign_tables(scores, cells, campaign_axes(cells), styles, command=MANIFEST["command"])  # type: ignore[arg-type]


def roll(small: Scores, window: str = "whole") -> pd.DataFrame:
    """Roll rms, by plain pandas."""
    scores, cells = small
    rows = scores[(scores["quantity"] == "roll") & (scores["metric"] == "rms") & (scores["window"] == window)]
    return rows.merge(cells.drop(columns=["imu", "track_draw", "sensor_draw", "ride", "vehicle"]), on="cell")


@pytest.mark.long
def test_every_axis_is_told_once_and_in_order(small: Scores) -> None:
    found = campaign_axes(small[1])
    assert [axis.column for axis in found] == ["speed_kmh", "direction", "imu", "irregularity.scale"]
    assert found[0].values == SPEEDS and found[0].words == ("20", "40", "70")
    assert found[1].values == ("forward", "backward") and found[2].values == GRADES


def test_scenarios_without_lists_have_no_such_section() -> None:
    assert not is_campaign(load_scenario("go20a"))  # a list of grades is no campaign
    assert not is_campaign(load_scenario("metro_table3"))
    for setting in (
        "ride.speed_kmh=[20.0, 30.0]",
        "irregularity.scale=[0.5, 1.0]",
        "imu.roll_deg=[0.0, 5.0]",
    ):
        assert is_campaign(load_scenario("go20a", overrides=[setting]))


@pytest.fixture(scope="module")
def with_exact(small: Scores) -> Scores:
    """The same cells with a map that errs, and as many with an exact one, a tenth of the error."""
    scores, cells = small
    more = len(cells)
    exact = cells.assign(**{"cell": cells["cell"] + more, "case": cells["case"] + 1000, "map.exact": True})
    erring = cells.assign(**{"map": "drawn", "map.exact": False})
    of_exact = scores.assign(cell=scores["cell"] + more, value=0.1 * scores["value"])
    of_erring = scores.assign(map="drawn")
    parts = [part.astype({"map": str}) for part in (of_exact, of_erring)]
    return as_score_table(pd.concat(parts, ignore_index=True)), pd.concat([exact, erring], ignore_index=True)


@pytest.mark.long
def test_an_exact_map_is_an_axis_and_no_part_of_any_other_mean(
    small: Scores, with_exact: Scores, tables: Frames, styles: list[MethodStyle]
) -> None:
    scores, cells = with_exact
    axes = campaign_axes(cells)
    assert [axis.column for axis in axes] == [
        "speed_kmh",
        "direction",
        "imu",
        "irregularity.scale",
        "map",
    ]
    assert axes[-1].words == ("the map errs", "exact (ablation)")
    both = campaign_tables(scores, cells, axes, styles, command=MANIFEST["command"])  # type: ignore[arg-type]
    for name in ("methods", "pairs", "consistency"):
        pd.testing.assert_frame_equal(both[name], tables[name])
    assert both["worst"]["rms_roll_deg"].tolist() == tables["worst"]["rms_roll_deg"].tolist()
    assert "map" not in both["worst"]
    along = both["axes"]
    others = along[along["axis"] != "map"].reset_index(drop=True)
    pd.testing.assert_frame_equal(others, tables["axes"])
    means = along[along["axis"] == "map"].set_index(["method", "value"])["mean"]
    for method in METHODS:
        assert means[method, "exact (ablation)"] == pytest.approx(0.1 * means[method, "the map errs"])


@pytest.mark.long
def test_heat_maps_show_the_means(small: Scores, styles: list[MethodStyle]) -> None:
    scores, cells = small
    axes = {axis.column: axis for axis in campaign_axes(cells)}
    across, down = side_of(axes["speed_kmh"], axes["direction"]), side_of(axes["imu"])
    draws = draws_of(scores, cells, list(axes.values()))
    draws = {"one": draws[draws["estimator"] == styles[1].name]}
    svg = heat_maps(draws, across, down, unit="\u00b0", what="heat")
    rows = roll(small)
    rows = rows[rows["estimator"] == styles[1].name]
    for grade in GRADES:
        for speed in SPEEDS:
            for way in ("forward", "backward"):
                at = (rows["imu"] == grade) & (rows["speed_kmh"] == speed) & (rows["direction"] == way)
                assert f">{rows.loc[at, 'value'].mean():.2f}</text>" in svg
    assert "20 \u2192" in svg and "70 \u2190" in svg


@pytest.mark.parametrize("width", [WIDE_IN, NARROW_IN])
@pytest.mark.parametrize("rows", [1, 9])
def test_words_and_numbers_of_a_map_do_not_run_together(
    width: float, rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a phone they did: numbers of neighbours, words below, and the decades of a low bar of colours."""
    figures: list[Any] = []
    monkeypatch.setattr(heat, "to_svg", lambda figure, **more: figures.append(figure) or "")
    monkeypatch.setattr(canvas, "width_in", lambda: width)
    monkeypatch.setattr(heat, "width_in", lambda: width)
    across = Side("mount", [(c,) for c in "abcde"], [f"axle_noise_{c}" for c in "abcde"], ["mount"])
    down = Side("method", [(r,) for r in range(rows)], [f"smoother cml {r}" for r in range(rows)], ["method"])
    sizes = 10.0 ** np.linspace(-2.7, 0.4, 5)
    draws = pd.DataFrame(
        [
            {"method": r, "mount": c, "value": size}
            for r in range(rows)
            for c, size in zip("abcde", sizes, strict=True)
        ]
    )
    heat_maps({"roll": draws, "pitch": draws}, across, down, unit="mm", what="heat")
    (figure,) = figures
    pen = FigureCanvasAgg(figure).get_renderer()
    figure.draw(pen)
    whole = figure.bbox
    for axis in figure.axes:
        numbers = [text for text in axis.texts if text.get_text()]
        below = [text for text in axis.get_xticklabels() if text.get_text()]
        beside = [text for text in axis.get_yticklabels() if text.get_text()]
        for words in (numbers, below, beside):
            boxes = [text.get_window_extent(pen) for text in words]
            assert not any(one.overlaps(two) for one, two in combinations(boxes, 2)), words
            assert all(whole.x0 <= box.x0 and whole.y0 <= box.y0 and box.x1 <= whole.x1 for box in boxes)


@pytest.mark.long
def test_an_axis_that_follows_from_another_has_no_map(small: Scores) -> None:
    """Each place has its own grade here, and two places share one."""
    _, cells = small
    place = cells["imu"].map({"ideal": "a", "tactical": "b", "industrial": "c", "consumer": "d"})
    coarse = cells["imu"].map({"ideal": "x", "tactical": "x", "industrial": "y", "consumer": "z"})
    cells = cells.assign(**{"mount": place, "imu": coarse, "imu.grade": coarse})
    axes = campaign_axes(cells)
    assert [a.column for a in axes] == ["speed_kmh", "direction", "imu", "irregularity.scale", "mount"]
    fine = [axis.column for axis in finest(axes, cells)]
    assert fine == ["speed_kmh", "direction", "irregularity.scale", "mount"]


@pytest.mark.long
def test_rails_are_mapped_in_the_band_that_counts(small: Scores, styles: list[MethodStyle]) -> None:
    scores, cells = small
    axes = campaign_axes(cells)
    assert rails_figures(scores, cells, axes, styles, band="D1", known=BANDS) == []
    rows = scores[(scores["quantity"] == "roll") & (scores["metric"] == "rms")]
    rows = rows[(rows["window"] == "whole") & (rows["estimator"] == styles[0].name)]
    parts = [scores]
    for band, factor in (("full", 3.0), ("D1", 1.0)):
        for quantity in ("vertical_profile", "cross_level", "alignment"):
            own = {"quantity": quantity, "metric": "sd", "band": band, "unit": "mm"}
            parts.append(rows.assign(value=factor * rows["value"], **own))
    scores = as_score_table(pd.concat([part.astype({"quantity": str}) for part in parts]))
    made = rails_figures(scores, cells, axes, styles, band="D1", known=BANDS)
    captions = [caption for caption, _ in made]
    assert ["speed and direction" in captions[0], "IMU" in captions[1]] == [True, True]
    assert len(made) == 3 and all("in wavelengths of 3\u201325 m (D1)" in caption for caption in captions)
    assert captions[0].endswith("mean over draws and ways to ride; IMU tactical.")
    assert "tactical" not in captions[1], "IMUs are never averaged over: one is held, or all are shown"
    plain = roll(small)
    plain = plain[plain["imu"] == "tactical"]
    for speed in SPEEDS:
        at = (plain["speed_kmh"] == speed) & (plain["direction"] == "forward")
        mean = plain.loc[at & (plain["estimator"] == styles[0].name), "value"].mean()
        assert made[0][1].count(f">{short_number(mean)}</text>") >= 3
    assert styles[1].label not in made[0][1], "a method that says nothing of rails has no row"


def test_long_names_are_told_in_two_lines() -> None:
    assert in_two("lord_3dm_gx4_25_noise_added") == "lord_3dm_gx4_\n25_noise_added"
    assert in_two("axle_ideal") == "axle_ideal" and in_two("a" * 30) == "a" * 30


@pytest.mark.long
def test_boxes_and_curvature_are_drawn(small: Scores, styles: list[MethodStyle], example: object) -> None:
    scores, cells = small
    axes = campaign_axes(cells)
    svg = box_figure(draws_of(scores, cells, axes), styles, axes, what="boxes")
    for word in ("consumer", "backward", "speed, km/h", "irregularity, times its spectrum"):
        assert word in svg
    one: CellResult = example()  # type: ignore[operator]
    svg = curvature_figure([one], styles, words=["20 km/h"], what="curvature")
    assert "curvature, 1/km" in svg and "20 km/h" in svg
    long = "forward \u00b7 lord_3dm_gx4_25 \u00b7 two_axle_wagon"
    wide, narrow = drawn("c", lambda: curvature_figure([one], styles, words=[long], what="c")).split(
        'class="narrow"'
    )
    assert f">{long}</text>" in wide
    assert ">two_axle_wagon</text>" in narrow, "on a phone a long title has a second line"
    straight = replace(one, motion=one.motion.assign(position_m=20.0))
    assert curvature_figure([straight], styles, words=["x"], what="curvature") == ""


@pytest.mark.long
def test_methods_have_the_mean_over_all_rides_of_an_imu(small: Scores, tables: Frames) -> None:
    """Never over several IMUs: what somebody chooses is not averaged."""
    rows = tables["methods"].query("quantity == 'roll' and window == 'whole'")
    plain = roll(small).merge(small[1][["cell", "imu"]], on="cell", suffixes=("", "_of_cell"))
    assert len(rows) == 4 * 4 and set(rows["of"]) == set(small[1]["imu"])
    for row in rows.to_dict("records"):
        own = (plain["estimator"] == row["method"]) & (plain["imu"].astype(str) == row["of"])
        values = plain.loc[own, "value"]
        assert row["mean"] == pytest.approx(values.mean())
        assert row["low95"] < row["mean"] < row["high95"] and row["tracks"] == 3
        assert row["draws"] == len(values) == 3 * 2 * 3 * 3 * 4
    # Spread within cases, not between them: speeds make 0.2 to 2.8 degrees of the uncompensated filter.
    spread = rows.set_index("method").loc["ekf_uncompensated"]
    assert (spread["sd_sensor"] < 0.1).all() and (spread["sd_track"] < 0.1).all()


@pytest.mark.long
def test_pairs_compare_the_same_recordings(small: Scores, tables: Frames) -> None:
    whole = roll(small).pivot_table(index="cell", columns="estimator", values="value", observed=True)
    tracks, imus = (small[1].set_index("cell")[name] for name in ("track_draw", "imu"))
    assert [(row["of"], row["method"], row["against"]) for row in tables["pairs"].to_dict("records")] == [
        (imu, "ekf_compensated", other)
        for imu in imus.unique()
        for other in ("ekf_uncompensated", "design_angles", "vqf")
    ]
    for row in tables["pairs"].to_dict("records"):
        plain = whole[imus.loc[whole.index] == row["of"]]
        found = compare(plain[row["method"]], plain[row["against"]], tracks.loc[plain.index])
        assert row["difference"] == pytest.approx(found.difference.value)
        assert row["difference_low95"] == pytest.approx(found.difference.low)
        assert row["win_rate"] == found.win_rate.value and row["pairs"] == len(plain)


@pytest.mark.long
def test_worst_cells_are_the_worst_and_say_how_to_make_them_again(small: Scores, tables: Frames) -> None:
    cells, plain = small[1], roll(small)
    ours = plain[plain["estimator"] == "ekf_compensated"].sort_values("value", ascending=False)
    assert tables["worst"]["cell"].tolist() == ours["cell"].head(1).tolist(), "one of each method"
    assert set(tables["worst"]["method"]) == {"ekf_compensated"}  # baselines have no worst cells
    for row in tables["worst"].to_dict("records"):
        cell = cells[cells["cell"] == row["cell"]].iloc[0]
        assert row["IMU"] == cell["imu"] and row["speed, km/h"] == f"{cell['speed_kmh']:g}"
        assert row["command"] == f"simrail run made_up --set 'seed=2' --cell {row['cell']}"


@pytest.mark.long
def test_tables_are_written_as_csv_and_latex(tables: Frames, tmp_path: Path) -> None:
    write_tables(tmp_path, tables)
    assert set(tables) == {"methods", "axes", "pairs", "consistency", "worst"}
    for name, frame in tables.items():
        read = pd.read_csv(tmp_path / TABLES / f"{name}.csv")
        assert list(read.columns) == list(frame.columns) and len(read) == len(frame)
        for column in frame.columns:
            if frame[column].dtype == np.float64:
                assert read[column].to_numpy() == pytest.approx(
                    frame[column].to_numpy(), rel=1e-5, nan_ok=True
                )
        text = (tmp_path / TABLES / f"{name}.tex").read_text(encoding="utf-8")
        body = text[text.index(r"\midrule") : text.index(r"\bottomrule")]
        rows = [line for line in body.splitlines()[1:] if line.strip()]
        assert len(rows) == len(frame)
        assert all(line.rstrip().endswith(r"\\") for line in rows)
        assert all(len(re.findall(r"(?<!\\)&", line)) == len(frame.columns) - 1 for line in rows)
        assert not re.search(r"(?<!\\)_", text)  # an underscore by itself is an error in LaTeX


def page_of(
    made_up: Scenario,
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    folder: Path,
    manifest: Mapping[str, Any] = MANIFEST,
) -> str:
    path = folder / "report.html"
    write_report(path, scenario=made_up, scores=scores, cells=cells, examples=[], manifest=manifest)
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def small_page(made_up: Scenario, small: Scores, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of `small`, by a command that sets it beside another run."""
    folder = tmp_path_factory.mktemp("small")
    manifest = {**MANIFEST, "command": "simrail run made_up.toml --beside results/other"}
    page_of(made_up, *small, folder, manifest)
    return folder / "report.html"


@pytest.mark.long
def test_the_page_has_the_section_and_its_tables(small_page: Path) -> None:
    page = small_page.read_text(encoding="utf-8")
    for words in (
        'id="campaign"',
        "864 cells over",
        "Attitude, consumer",
        "Attitude, tactical",
        "Pairs of methods",
        "Consistency",
        "Worst cell of each method",
        "R \u2212150",
        "--cell ",
        "R +300",
    ):
        assert words in page, words
    assert {path.suffix for path in (small_page.parent / TABLES).iterdir()} == {".csv", ".tex"}
    assert "nan" not in re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL).lower().split()


@pytest.mark.long
def test_a_cell_is_made_again_without_what_stands_beside(small_page: Path) -> None:
    """`simrail run` refuses both together."""
    page = small_page.read_text(encoding="utf-8")
    assert "<code>simrail run made_up.toml --cell " in page and "--beside results/other --cell" not in page
    assert "<pre>simrail run made_up.toml --beside results/other</pre>" in page


@pytest.mark.long
def test_intervals_say_whether_they_are_over_tracks(
    made_up: Scenario, small_page: Path, tmp_path: Path
) -> None:
    of_one = page_of(made_up, *campaign(tracks=1, sensors=3), tmp_path)
    for page, tracks in ((small_page.read_text(encoding="utf-8"), 3), (of_one, 1)):
        assert ("from resampled tracks" in page) is (tracks > 1)
        assert ("with one track only" in page) is (tracks == 1)


@pytest.mark.long
def test_methods_that_fail_leave_the_rest_standing(made_up: Scenario, small: Scores, tmp_path: Path) -> None:
    scores, cells = small
    broken = (scores["estimator"] == "vqf").to_numpy() | (scores["cell"] < 30).to_numpy()
    scores = scores.assign(
        value=scores["value"].mask(broken),
        status=pd.Categorical(
            np.where(broken, "LinAlgError: singular", "ok"), categories=["ok", "LinAlgError: singular"]
        ),
    )
    page = page_of(made_up, scores, cells, tmp_path)
    assert "LinAlgError: singular" in page and 'id="campaign"' in page


@pytest.mark.slow
def test_a_million_rows_are_read_and_shown_within_twenty_seconds(made_up: Scenario, tmp_path: Path) -> None:
    """Processor time, since the machine is shared."""
    scores, cells = campaign(tracks=10, sensors=25)
    assert len(scores) > 1_000_000 and set(scores["estimator"]) == set(METHODS)
    scores.to_parquet(tmp_path / "scores.parquet")
    cells.to_parquet(tmp_path / "cells.parquet")
    begun = time.process_time()
    read = pd.read_parquet(tmp_path / "scores.parquet"), pd.read_parquet(tmp_path / "cells.parquet")
    page = page_of(made_up, *read, tmp_path)
    assert time.process_time() - begun < 20.0
    assert len(page) < 2_000_000, "however large the campaign is"
