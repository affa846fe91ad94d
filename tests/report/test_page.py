"""The report: one self-contained page that says what the scores say."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.cell import CellResult
from simrail.core.columns import ACCEL, GYRO, IMU
from simrail.estimation.estimate import Estimate
from simrail.report.pages.explorer import stored_rides
from simrail.report.pages.page import _failures, write_report
from simrail.report.words.sentences import axis_words
from simrail.scenario.scenario import Scenario
from simrail.scoring.table import LABEL_COLUMNS, concat_scores, failed_figures, labelled

Rides = Callable[..., CellResult]
Tables = Callable[..., tuple[pd.DataFrame, pd.DataFrame]]


@pytest.fixture(scope="module")
def page(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory, example: Rides, tables: Tables) -> str:
    return written(
        scenario, tmp_path_factory.mktemp("page"), [example(), example(backward=True, name="back")], tables
    )


def written(scenario: Scenario, folder: Path, examples: list[CellResult], tables: Tables) -> str:
    scores, cells = tables(*examples)
    path = folder / "report.html"
    manifest = {"command": "simrail run test", "seed": 1, "started_utc": "2026-01-02T03:04:05"}
    write_report(path, scenario=scenario, scores=scores, cells=cells, examples=examples, manifest=manifest)
    return path.read_text(encoding="utf-8")


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
    assert "@import" not in page and "<link" not in page
    # What explores the rides: its numbers, and the page's own script, which fetches nothing either.
    assert re.findall(r"<script[^>]*>", page) == ['<script type="application/json" id="rides">', "<script>"]
    assert not re.search(r"fetch\(|XMLHttpRequest|import\(|https?://(?!www\.w3\.org)", page)
    assert checker.wanted <= set(checker.ids)
    anchors = re.findall(r'<a href="#([^"]*)">', page[: page.index("<main>")])
    assert anchors == ["answer", "scores", "explorer", "track", "odometry", "words", "parts", "cite", "again"]
    assert all(checker.ids.count(name) == 1 for name in anchors)


def test_text_of_a_person_is_escaped(page: str) -> None:
    assert "A &lt;test&gt; ride" in page and "<test>" not in page


def test_page_holds_every_part(page: str) -> None:
    for part in (
        "best with an IMU",
        "no IMU at all",
        "Errors over distance",
        "What the scores say",
        "Against the truth",
        "Against the design angles",
        "Consistency and time",
        "Plan, turned",
        "curvature",
        "Parts and sources",
        "simrail run test",
    ):
        assert part in page, part
    # The answer, errors over distance, plan and profile: each for a desk and for a phone.
    assert page.count('<svg viewBox="0') == 2 * 4
    assert "nan" not in re.sub(r"<(style|script).*?</\1>", "", page, flags=re.DOTALL).lower().split()


def test_what_a_paper_has_is_told_on_its_own_page_only(page: str) -> None:
    assert "as Fig" not in page


def test_direction_of_travel_is_stated(page: str) -> None:
    (forward, back), _ = stored_rides(page)
    assert forward.travel == 1 and any("towards increasing distance" in fact for fact in forward.facts)
    assert back.travel == -1 and any("towards decreasing distance" in fact for fact in back.facts)


def test_drawings_say_the_headline_number_and_follow_dark_mode(page: str) -> None:
    alt = re.search(r'data-name="answer">\s*<div class="wide"><svg[^>]*aria-label="([^"]*)"', page)
    assert alt is not None and "EKF compensated, 0.1" in alt[1]
    svg = page[alt.start() : page.index("</svg>", alt.start())]
    assert "var(--ink)" in svg and "#1b2430" not in svg
    assert "prefers-color-scheme: dark" in page


def test_what_is_synthetic_is_called_so(page: str) -> None:
    assert re.search(r"Synthetic, not measured: .*track", page)
    assert "made up for this test" in page


def test_baselines_are_marked(page: str) -> None:
    table = page[page.index('id="scores"') :]
    pattern = r'<tr( class="baseline")?><th class="name"><i[^>]*></i>([^<]*)'
    marked = {label for mark, label in re.findall(pattern, table) if mark}
    assert marked == {"plain filter", "VQF", "design angles"}


def test_the_page_is_the_same_when_written_twice(
    scenario: Scenario,
    page: str,
    tmp_path: Path,
    example: Rides,
    tables: Tables,
) -> None:
    again = written(scenario, tmp_path, [example(), example(backward=True, name="back")], tables)
    assert again == page


def test_failures_are_on_the_page_and_do_not_stop_it(
    scenario: Scenario,
    tmp_path: Path,
    example: Rides,
    tables: Tables,
) -> None:
    one = example()
    states = one.estimates["ekf_compensated"].states.copy()
    states.iloc[500:, :3] = np.nan
    one.estimates["ekf_compensated"] = Estimate(states=states, mount="axle")
    del one.estimates["vqf"]
    scores, cells = tables(one)
    labels = {name: scores[name].iloc[0] for name in LABEL_COLUMNS if name != "estimator"}
    failed = labelled([(failed_figures("LinAlgError: singular matrix"), labels | {"estimator": "vqf"})])
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
    scenario: Scenario,
    tmp_path: Path,
    example: Rides,
    tables: Tables,
) -> None:
    one = example(rate=1430.0)
    assert len(one.motion) > 100_000
    scores, cells = tables(one, draws=1)
    begun = time.process_time()
    path = tmp_path / "report.html"
    write_report(path, scenario=scenario, scores=scores, cells=cells, examples=[one], manifest={})
    assert time.process_time() - begun < 6.0
    assert path.stat().st_size < 500_000  # 0.41 MB


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


def test_columns_used_by_the_figures_are_the_vocabulary() -> None:
    assert set(GYRO) | set(ACCEL) == set(IMU)


def test_what_failed_is_counted_in_figures_by_method_imu_and_kind_of_fault() -> None:
    """Two figures of one cell are two; how many samples of a window a fault hit parts no kinds."""
    nan = "not finite in {} of 900 samples"
    rows = [
        ("ekf", "lord", 0, nan.format(3)),
        ("ekf", "lord", 0, nan.format(17)),
        ("ekf", "lord", 1, nan.format(900)),
        ("ekf", "ideal", 2, nan.format(3)),
        ("gda", "lord", 0, "time limit"),
        ("gda", "lord", 0, "ok"),
    ]
    scores = pd.DataFrame(rows, columns=["estimator", "imu", "cell", "status"])
    (section,) = _failures(SimpleNamespace(scores=scores))  # type: ignore[arg-type]
    assert sorted(section.data["failures"]) == [
        ("ekf", "ideal", 1, "not finite"),
        ("ekf", "lord", 3, "not finite"),
        ("gda", "lord", 1, "time limit"),
    ]
    assert _failures(SimpleNamespace(scores=scores[scores["status"] == "ok"])) == []  # type: ignore[arg-type]
