"""The report: one self-contained page that says what the scores say, also when they do not flatter."""

from __future__ import annotations

import re
import time
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.columns import ACCEL, ATTITUDE, GYRO, IMU, ODOMETRY, ODOMETRY_SD
from simrail.estimate import Estimate
from simrail.example import CellResult
from simrail.recording import ImuSheet, Recording
from simrail.report import write_report
from simrail.report.decimate import Bins
from simrail.report.findings import findings, significant
from simrail.report.methods import method_styles
from simrail.report.page import axis_words
from simrail.report.pivot import Figures, cases, of_cell
from simrail.report.tables import error_table
from simrail.scenario.cells import methods
from simrail.scenario.scenario import Scenario, read_scenario
from simrail.score import reference_of, score, score_odometry
from simrail.score_table import concat_scores, failed_figures, labelled
from simrail.track.design import Curve, Straight, TrackDesign, Transition

SCENARIO = """
title = "A <test> ride"
seed = 1
track = "test_line"
vehicle = "none"
engine = "kinematic"
sensor_draws = 2
[[ride]]
name = "go"
start_m = 10.0
end_m = 560.0
speed_kmh = 40.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "body"
position_m = [0.0, 0.0, 0.6]
[[estimator]]
name = "ekf_compensated"
method = "AttitudeEkf"
[[estimator]]
name = "plain_filter"
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

TRACK = TrackDesign(
    name="test_line",
    start_m=0.0,
    elements=(
        Straight(150.0),
        Transition(50.0),
        Curve(100.0, 300.0, 0.07),
        Transition(50.0),
        Straight(250.0),
    ),
    source="made up for this test",
    synthetic=True,
)

# Constant errors in degrees (roll, pitch, yaw) of each method, so that every figure is known beforehand.
ERRORS = {
    "ekf_compensated": (0.1, 0.2, 0.3),
    "plain_filter": (0.5, 0.6, 0.3),
    "vqf": (0.4, 0.6, 0.3),
}
IRREGULARITY_DEG = 0.25


def example(*, backward: bool = False, rate: float = 50.0, name: str = "go") -> CellResult:
    """A ride at constant speed after a rest; the body rolls +-0.25 deg against the track in a square wave."""
    n = int(70.0 * rate)
    t = np.arange(n) / rate
    run = np.clip(t - 10.0, 0.0, 50.0) * 11.0
    s = 560.0 - run if backward else 10.0 + run
    v = np.where((t > 10.0) & (t < 60.0), -11.0 if backward else 11.0, 0.0)
    frame = TRACK.frame(s)
    wave = np.deg2rad(IRREGULARITY_DEG) * np.sign(np.sin(0.5 * s))
    columns = {
        "roll_rad": frame.roll_rad + wave,
        "pitch_rad": frame.pitch_rad,
        "yaw_rad": frame.yaw_rad,
        "position_m": s,
        "speed_mps": v,
        "acceleration_mps2": 0.0 * t,
    }
    motion = pd.DataFrame(columns, index=pd.Index(t, name="time_s"))
    imu = pd.DataFrame(0.01 * np.sin(np.outer(t, np.arange(1, 7))), index=motion.index, columns=list(IMU))
    odometry = motion[list(ODOMETRY)].copy()
    odometry["position_m"] += 0.5
    odometry[list(ODOMETRY_SD)] = 1.0
    recording = Recording(
        name=name,
        imu=imu,
        imu_sheet=ImuSheet("lord_3dm_gx4_25", rate, 0.01, *([1e-3] * 6)),
        mount="axle",
        mount_body="body",
        mount_position_m=(0.0, 0.0, 0.6),
        track=TRACK,
        encoder=None,
        encoder_sheet=None,
        start_position_m=float(s[0]),
        odometry=odometry,
        odometry_source="encoder",
    )
    estimates = {}
    for method, errors in ERRORS.items():
        states = motion[list(ATTITUDE)] + np.deg2rad(errors)
        states["roll_sd_rad"] = np.deg2rad(0.1)
        estimates[method] = Estimate(states=states, mount="axle")
    design = np.column_stack((frame.roll_rad, frame.pitch_rad, frame.yaw_rad))
    states = pd.DataFrame(design, index=motion.index, columns=list(ATTITUDE))
    estimates["design_angles"] = Estimate(states=states, mount="axle")
    cell: dict[str, object] = {
        "cell": 0,
        "ride": name,
        "vehicle": "none",
        "mount": "axle",
        "imu": "lord_3dm_gx4_25",
        "odometry": "encoder",
    }
    return CellResult(cell, recording, motion, estimates)


def tables(*examples: CellResult, draws: int = 2, spread: float = 0.0) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scores and cells of some rides; draws differ by a factor 1 +- spread."""
    parts, cells, number = [], [], 0
    for one in examples:
        reference = reference_of(one.motion, one.recording)
        for draw in range(draws):
            labels = {key: value for key, value in one.cell.items() if key != "cell"}
            labels |= {
                "cell": number,
                "scenario": "test",
                "tuning": "default",
                "track_draw": 0,
                "sensor_draw": draw,
            }
            cells.append(
                {"cell": number, "ride": one.cell["ride"], "imu": one.cell["imu"], "vehicle": "none"}
            )
            number += 1
            for name, estimate in one.estimates.items():
                figures = score(estimate, reference, one.recording, us_per_sample=0.2)
                figures["value"] *= 1.0 + spread * (2 * draw - 1)
                parts.append(labelled(figures, labels | {"estimator": name}))
            figures = score_odometry(one.recording, reference)
            parts.append(labelled(figures, labels | {"estimator": "odometry:encoder"}))
    return concat_scores(parts), pd.DataFrame(cells)


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return read_scenario(SCENARIO, name="test")


@pytest.fixture(scope="module")
def page(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> str:
    return written(
        scenario, tmp_path_factory.mktemp("page"), [example(), example(backward=True, name="back")]
    )


def written(scenario: Scenario, folder: Path, examples: list[CellResult]) -> str:
    scores, cells = tables(*examples)
    path = folder / "report.html"
    manifest = {"command": "simrail run test", "seed": 1, "started_utc": "2026-01-02T03:04:05"}
    write_report(path, scenario=scenario, scores=scores, cells=cells, examples=examples, manifest=manifest)
    return path.read_text(encoding="utf-8")


def case_of(scores: pd.DataFrame, cells: pd.DataFrame) -> Figures:
    return cases(scores, cells)[0]


def said(scenario: Scenario, scores: pd.DataFrame, cells: pd.DataFrame) -> str:
    styles = list(method_styles(methods(scenario)).values())
    return "\n".join(finding.text for finding in findings(case_of(scores, cells), styles))


# ---- the page --------------------------------------------------------------------------------------


class Checker(HTMLParser):
    """Gathers ids, references and sources, and checks that tags are closed in order."""

    VOID = frozenset({"meta", "br", "img", "link", "hr", "input"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.wanted: set[str] = set()
        self.sources: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attrs:
            text = value or ""
            if name == "id":
                self.ids.append(text)
            if name in ("src", "href", "xlink:href"):
                (self.wanted.add(text[1:]) if text.startswith("#") else self.sources.append(text))
            self.wanted.update(re.findall(r"url\(#([^)]+)\)", text))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag


def test_page_is_well_formed_and_self_contained(page: str) -> None:
    checker = Checker()
    checker.feed(page)
    assert checker.open == []
    assert checker.sources == [], "nothing may be fetched"
    assert "<script" not in page and "@import" not in page and "<link" not in page
    assert checker.wanted <= set(checker.ids)
    sections = [name for name in checker.ids if not re.fullmatch(r"[a-z]?[0-9a-f]{8,}", name)]
    anchors = [name for name in sections if name in {"track", "scores", "odometry", "parts", "again"}]
    assert len(anchors) == len(set(anchors)) == 5


def test_text_of_a_person_is_escaped(page: str) -> None:
    assert "A &lt;test&gt; ride" in page and "<test>" not in page


def test_page_holds_every_part(page: str) -> None:
    for part in (
        "Plan, turned",
        "curvature",
        "True speed",
        "What the IMU recorded",
        "Attitude over distance",
        "with and without compensation",
        "Errors over distance",
        "Position error",
        "Against the truth",
        "Against the design angles",
        "Consistency and time",
        "Parts and sources",
        "simrail run test",
    ):
        assert part in page, part
    assert page.count("<svg") == 2 * 8 + 2
    assert "nan" not in re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL).lower().split()


def test_direction_of_travel_is_stated(page: str) -> None:
    forward, back = page.split('id="ride-back')
    assert (
        "towards increasing distance" in forward
        and "travel \u2192" in forward
        and "\u2190 travel" not in forward
    )
    assert "towards decreasing distance" in back and "\u2190 travel" in back


def test_what_is_synthetic_is_called_so(page: str) -> None:
    assert re.search(r"Synthetic, not measured: .*track", page)
    assert "made up for this test" in page


def test_baselines_are_marked(page: str) -> None:
    table = page[page.index('id="scores"') :]
    pattern = r'<tr( class="baseline")?><th class="name"><i[^>]*></i>([^<]*)'
    marked = {label for mark, label in re.findall(pattern, table) if mark}
    assert marked == {"plain filter", "VQF", "design angles"}


def test_the_page_is_the_same_when_written_twice(scenario: Scenario, page: str, tmp_path: Path) -> None:
    again = written(scenario, tmp_path, [example(), example(backward=True, name="back")])
    assert again == page


def test_failures_are_on_the_page_and_do_not_stop_it(scenario: Scenario, tmp_path: Path) -> None:
    one = example()
    states = one.estimates["ekf_compensated"].states.copy()
    states.iloc[500:, :3] = np.nan
    one.estimates["ekf_compensated"] = Estimate(states=states, mount="axle")
    del one.estimates["vqf"]
    scores, cells = tables(one)
    labels = {name: scores[name].iloc[0] for name in scores.columns[:11]}
    failed = labelled(failed_figures("LinAlgError: singular matrix"), labels | {"estimator": "vqf"})
    path = tmp_path / "report.html"
    write_report(
        path,
        scenario=scenario,
        scores=concat_scores([scores, failed]),
        cells=cells,
        examples=[one],
        manifest={},
    )
    text = path.read_text(encoding="utf-8")
    assert "LinAlgError: singular matrix" in text
    assert "estimate not finite" in text
    assert ">nan<" not in text


def test_a_hundred_thousand_samples_are_drawn_in_seconds_and_kilobytes(
    scenario: Scenario, tmp_path: Path
) -> None:
    one = example(rate=1430.0)
    assert len(one.motion) > 100_000
    scores, cells = tables(one, draws=1)
    begun = time.process_time()
    path = tmp_path / "report.html"
    write_report(path, scenario=scenario, scores=scores, cells=cells, examples=[one], manifest={})
    assert time.process_time() - begun < 6.0
    assert path.stat().st_size < 1_500_000


# ---- what it says -----------------------------------------------------------------------------------


def test_sentences_are_looked_up_in_the_scores(scenario: Scenario) -> None:
    text = said(scenario, *tables(example()))
    sizes = "from 0.500\u00b0 rms without to 0.100\u00b0 with it: 5.0 times less"
    assert f"In curves, compensation takes the roll error of EKF {sizes}" in text
    # Design: roll off by the square wave of 0.25 deg, pitch exact.
    assert (
        "'Design angles only', which uses no IMU, beats EKF compensated in pitch (0\u00b0 against 0.200\u00b0"
        in text
    )
    assert "beats EKF compensated in roll" not in text
    assert re.search(r"Of the baselines.*plain filter in roll \(0.250\u00b0 against 0.500\u00b0 rms\)", text)
    assert "VQF is worse than EKF compensated in roll: 0.400\u00b0 against 0.100\u00b0 rms" in text
    assert "No ideal IMU was run" in text
    assert "odometry 'encoder'; its position error is 0.500 m rms" in text


def test_sentences_turn_with_the_scores(scenario: Scenario) -> None:
    """Exchange the method with its uncompensated twin: the page must say that compensation hurts."""
    one = example()
    swapped = dict(one.estimates)
    swapped["ekf_compensated"], swapped["plain_filter"] = swapped["plain_filter"], swapped["ekf_compensated"]
    text = said(scenario, *tables(CellResult(one.cell, one.recording, one.motion, swapped)))
    assert "compensation does not reduce the roll error of EKF" in text and "times less" not in text
    assert "beats EKF compensated in roll (0.250\u00b0 against 0.500\u00b0 rms)" in text
    assert "VQF is better than EKF compensated" in text


def test_a_filter_that_is_never_beaten_is_said_to_be_so(scenario: Scenario) -> None:
    one = example()
    states = one.motion[list(ATTITUDE)]
    perfect = dict(one.estimates, ekf_compensated=Estimate(states=states, mount="axle"))
    text = said(scenario, *tables(CellResult(one.cell, one.recording, one.motion, perfect)))
    assert "EKF compensated: nowhere beaten by 'design angles only'" in text


def test_coverage_decides_what_is_said_of_the_standard_deviations(scenario: Scenario) -> None:
    one = example()
    for sd_deg, verdict in ((0.1, "larger than its errors"), (0.04, "are too small")):
        states = one.estimates["ekf_compensated"].states.assign(roll_sd_rad=np.deg2rad(sd_deg))
        estimates = dict(one.estimates, ekf_compensated=Estimate(states=states, mount="axle"))
        text = said(scenario, *tables(CellResult(one.cell, one.recording, one.motion, estimates)))
        assert verdict in text


def test_true_odometry_is_called_an_ablation(scenario: Scenario) -> None:
    one = example()
    scores, cells = tables(one)
    scores["estimator"] = scores["estimator"].cat.rename_categories({"odometry:encoder": "odometry:truth"})
    assert "ablation" in said(scenario, scores, cells)


def test_the_ideal_imu_tells_the_floor(scenario: Scenario) -> None:
    one = example()
    ideal = CellResult(one.cell | {"imu": "ideal"}, one.recording, one.motion, one.estimates)
    all_cases = cases(*tables(one, ideal))
    styles = list(method_styles(methods(scenario)).values())
    text = "\n".join(finding.text for finding in findings(all_cases[0], styles, others=all_cases))
    assert "With an ideal IMU" in text and "EKF compensated 0.100\u00b0 instead of 0.100\u00b0" in text


def test_roles_follow_from_the_scenario_not_from_names(scenario: Scenario) -> None:
    styles = method_styles(methods(scenario))
    assert {name: style.baseline for name, style in styles.items()} == {
        "ekf_compensated": "",
        "plain_filter": "uncompensated",
        "vqf": "general purpose",
        "design_angles": "no IMU",
    }
    assert styles["ekf_compensated"].twin == "plain_filter"
    assert len({(style.colour, style.stroke) for style in styles.values()}) == len(styles)


# ---- tables and pivots --------------------------------------------------------------------------------


def test_table_marks_the_best_method_and_every_loss(scenario: Scenario) -> None:
    styles = list(method_styles(methods(scenario)).values())
    table = error_table(case_of(*tables(example())), styles, reference="truth")
    column = table.columns.index("curve")
    marks = {row.label: row.cells[column] for row in table.rows}
    assert marks["EKF compensated"].mark == "best" and marks["EKF compensated"].text == "0.100"
    assert marks["plain filter"].mark == "worse" and marks["VQF"].mark == "worse"
    assert marks["design angles"].mark == "" and marks["design angles"].text == "0.250"
    design = error_table(case_of(*tables(example())), styles, reference="design")
    assert design.rows[3].cells[column].text == "0.000"
    assert sum(span for _, span in table.groups) == len(table.columns) == len(table.rows[0].cells)


def test_spread_over_draws_is_shown(scenario: Scenario) -> None:
    case = case_of(*tables(example(), spread=0.1))
    found = case.get("ekf_compensated", "roll", "rms")
    assert found.draws == 2
    assert found.value == pytest.approx(0.1)
    assert found.sd == pytest.approx(0.1 * np.sqrt(2) * 0.1)


def test_cases_are_found_by_their_labels() -> None:
    one, two = example(), example(backward=True, name="back")
    all_cases = cases(*tables(one, two))
    assert len(all_cases) == 2
    found = of_cell(all_cases, two.cell)
    assert found is not None and found.labels["ride"] == "back"
    assert of_cell(all_cases, {"ride": "elsewhere"}) is None
    assert all_cases[0].curves() == ["curve:curve 3 R300"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (0.21349, "0.213"),
        (2.1349, "2.13"),
        (123.4, "123"),
        (0.00012, "0.0001"),
        (0.0999999, "0.100"),
        (1e-9, "<0.0001"),
    ],
)
def test_numbers_have_three_significant_digits(value: float, text: str) -> None:
    assert significant(value) == text


# ---- decimation -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_decimation_keeps_every_peak_and_stays_inside_the_signal(sign: float) -> None:
    rng = np.random.default_rng(4)
    x = sign * np.concatenate([np.zeros(5000), np.linspace(0.0, 100.0, 50000), np.full(3000, 100.0)])
    y = rng.normal(size=len(x))
    y[[77, 20000, 57000]] = 50.0, -60.0, 70.0
    bins = Bins(x, bins=500)
    line_x, line_y = bins.line(y)
    assert len(line_x) == len(line_y) <= 1000
    assert {50.0, -60.0, 70.0} <= set(line_y)
    assert line_y.min() == y.min() and line_y.max() == y.max()
    found = bins.envelope(y)
    assert (found.low <= found.mean).all() and (found.mean <= found.high).all()
    assert np.average(found.mean, weights=bins.count) == pytest.approx(y.mean(), abs=1e-12)
    assert bins.count.sum() == len(x)


def test_decimation_of_a_ramp_is_the_ramp() -> None:
    for slope in (1.0, -1.0):
        x = np.linspace(0.0, 1.0, 10001)
        line_x, line_y = Bins(x, bins=100).line(slope * x)
        assert np.all(np.diff(slope * line_y) > 0.0), "no saw teeth"
        np.testing.assert_allclose(line_y, slope * line_x, atol=0.006)


def test_decimation_of_a_short_or_standing_signal() -> None:
    x, y = np.zeros(20), np.arange(20.0)
    bins = Bins(x)
    assert bins.line(y)[1].tolist() == [0.0, 19.0]
    few = Bins(np.arange(5.0))
    assert few.envelope(np.arange(5.0)).mean.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_columns_used_by_the_figures_are_the_vocabulary() -> None:
    assert set(GYRO) | set(ACCEL) == set(IMU)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("ride.speed_kmh", 20.0, "speed 20 km/h"),
        ("irregularity.spectrum", "erri_b176_low", "spectrum erri_b176_low"),
        ("encoder.pulses_per_revolution", 1024, "pulses per revolution 1024"),
        ("irregularity.fade_m", 40.0, "fade 40 m"),
    ],
)
def test_axes_are_said_as_people_say_them(name, value, words):
    assert axis_words(name, value) == words
