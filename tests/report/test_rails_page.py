"""A short ride on a 1:10 track on the page: rails first, in the band that it can show, over what there is."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from simrail.campaign.campaign import run_campaign
from simrail.campaign.cell import CellResult
from simrail.estimation.estimate import Estimate
from simrail.report.figures.canvas import fitting_columns, legend_above, look, panels
from simrail.report.figures.geometry import lines_of, rails_figure, stretch_of, stretch_words
from simrail.report.figures.track import profile_figure, profile_words
from simrail.report.pages.answer import MOST_METHODS, answer_sentence, answer_tiles, drawn_methods
from simrail.report.pages.explorer import stored_rides
from simrail.report.pages.page import write_report
from simrail.report.pages.rides import shown_styles
from simrail.report.pages.section import PageData
from simrail.report.papers.gonzalez_2023.parts import PAPER
from simrail.report.papers.gonzalez_2023.section import FULL_SIZE, SCALED, peak_of, section
from simrail.report.tables.geometry import (
    JUDGED,
    band_words,
    geometry_table,
    judged_band,
    overview_table,
    waves_words,
)
from simrail.report.tables.methods import MethodStyle, attitude_methods, method_styles
from simrail.report.tables.pivot import Case, Mean, cases
from simrail.report.words.findings import alike, findings, one_of_each
from simrail.report.words.geometry_findings import geometry_findings
from simrail.report.words.sentences import significant, unbroken
from simrail.results import describe
from simrail.scenario.build import bands_by_name
from simrail.scenario.scenario import Scenario, read_scenario
from simrail.track.bands import BANDS, Band, margin_m
from simrail.track.design import Curve, Straight, TrackDesign, Transition

pytestmark = pytest.mark.long

Rides = Callable[..., CellResult]
Tables = Callable[..., tuple[pd.DataFrame, pd.DataFrame]]

TEXT = """
title = "Rails of a model"
paper = "gonzalez_2023"
seed = 3
track = "scale_track"
vehicle = "scale_vehicle"
engine = "kinematic"
odometry = "truth"
[irregularity]
spectrum = "erri_b176_high"
wavelengths_m = [0.6, 7.0]
fade_m = 3.0
scale = 2.0
[[ride]]
name = "out"
start_m = 1.0
end_m = 89.0
speed_kmh = 3.6
rest_s = 5.0
[[imu]]
name = "body"
grade = ["lord_3dm_gx4_25", "ideal"]
body = "body"
position_m = [0.0, 0.0, 0.05]
[rail_sensor]
[geometry]
bands = ["D1"]
own_bands = { paper = [0.3, 7.0] }
twist_base_m = 0.3
[[estimator]]
name = "smoother"
stands_for = "hand"
method = "TrajectorySmoother"
[estimator.options]
geometry_step_m = 0.05
[[estimator]]
name = "camera_free"
method = "TrajectorySmoother"
[estimator.options]
geometry_step_m = 0.05
rail_sensor = false
[[estimator]]
name = "design_angles"
method = "DesignAngles"
[[estimator]]
name = "zero_track"
stands_for = "zero"
method = "ZeroTrack"
[estimator.options]
step_m = 0.05
"""
START_M, END_M = 1.0, 89.0


class Ran:
    """A scenario that was run, and what the page is made of."""

    def __init__(self, scenario: Scenario, result: Any, page: str) -> None:
        self.scenario, self.page = scenario, page
        self.cases = cases(result.scores, result.cells)
        self.styles = list(method_styles(scenario).values())
        self.example: CellResult = result.examples[0]
        self.known = bands_by_name(scenario.spec)
        self.data = PageData(scenario, result.scores, result.cells, result.examples, {})
        (paper,) = section(self.data)
        self.paper = paper.data


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setattr("simrail.ride.cache.cache_folder", lambda: folder)
        scenario = read_scenario(TEXT, name="model")
        result = run_campaign(scenario, workers=1)
        path = tmp_path_factory.mktemp("page") / "report.html"
        write_report(
            path,
            scenario=scenario,
            scores=result.scores,
            cells=result.cells,
            examples=result.examples,
            manifest=describe(scenario, result),
        )
        return Ran(scenario, result, path.read_text(encoding="utf-8"))


# ---- the band that counts ----------------------------------------------------------------------


def planted(*bands: str) -> Case:
    """A case with figures in some bands."""
    table = pd.DataFrame({"quantity": "alignment", "band": ["full", *bands], "draws": 2})
    return Case({}, table, {})


@pytest.mark.parametrize(
    ("bands", "judged"),
    [
        (("D1", "paper"), "D1"),
        (("D0", "paper"), "paper"),
        (("D0", "D2"), "D0"),
        (("paper",), "paper"),
        ((), "full"),
    ],
)
def test_one_rule_says_which_band_counts(bands: tuple[str, ...], judged: str) -> None:
    assert judged_band(planted(*bands)) == judged


def test_bands_are_told_with_their_wavelengths() -> None:
    own = {**BANDS, "paper": Band("paper", 0.3, 7.0)}
    assert band_words("paper", own) == "paper (0.3\u20137 m)" and band_words("paper") == "paper"
    assert waves_words("paper", own) == "in wavelengths of 0.3\u20137 m (paper)"
    assert band_words("full") == waves_words("full") == "unfiltered"


# ---- figures -----------------------------------------------------------------------------------


def places_of(svg: str) -> list[float]:
    """Labels of the x axis, which is the only one with numbers of this kind on a track of 90 m."""
    told = re.findall(r"<text[^>]*>(\u2212?\d+)</text>", svg.replace("\n", ""))
    return [float(text.replace("\u2212", "-")) for text in told]


@pytest.mark.parametrize("length_m", [20.0, 400.0, 1e3])
def test_a_stretch_is_within_the_ride_and_within_what_is_drawn(ran: Ran, length_m: float) -> None:
    low, high = stretch_of(ran.example, "smoother", band=None, length_m=length_m)
    assert START_M - 1e-9 <= low < high <= END_M + 1e-9
    assert high - low == pytest.approx(min(length_m, END_M - START_M), abs=0.2)
    assert 0.5 * (low + high) == pytest.approx(45.0, abs=0.2)
    low, high = stretch_of(ran.example, "smoother", band=SCALED, length_m=length_m)
    margin = margin_m(SCALED.edges_m("alignment"))
    assert START_M + margin - 1e-9 <= low and high <= END_M - margin + 1e-9
    assert high - low == pytest.approx(min(length_m, END_M - START_M - 2.0 * margin), abs=0.2)


def test_an_estimate_of_the_first_metres_only_is_drawn_there(ran: Ran) -> None:
    estimate = ran.example.estimates["smoother"]
    assert estimate.geometry is not None
    short = replace(estimate, geometry=estimate.geometry[estimate.geometry.index < 21.0])
    low, high = stretch_of(replace(ran.example, estimates={"a": short}), "a", band=None, length_m=10.0)
    assert low == pytest.approx(6.0, abs=0.2) and high == pytest.approx(16.0, abs=0.2)


def test_captions_say_how_long_a_stretch_is(ran: Ran) -> None:
    assert stretch_words(ran.example, (1.0, 89.0)) == "all 88 m of the ride"
    assert stretch_words(ran.example, (20.0, 55.0)) == "35 m in the middle of the ride"


def test_no_figure_of_rails_leaves_the_track(ran: Ran) -> None:
    views, _ = stored_rides(ran.page)
    titles = [panel.title for panel in views[0].panels if panel.axis == "rails"]
    assert titles[:3] == [f"{words} in paper" for words in ("vertical profile", "cross-level", "alignment")]
    assert titles[3:] == ["vertical profile", "cross-level", "alignment"], "and unfiltered"
    for view in views:
        places = view.axes["rails"][0]
        assert np.nanmin(places) > -0.1 and 85.0 < np.nanmax(places) < 90.1
    drawings = ran.paper["drawings"]
    assert len(drawings) == 2
    for _, svg in drawings:
        places = places_of(str(svg))
        assert max(places) > 30.0
        assert min(places) > -20.0 and max(places) < 90.0
    assert "60 m in the middle of the ride out" in drawings[0][0]
    assert "0.3\u20137 m" in ran.page, "the panels of the bands tell wavelengths"


def test_the_truth_of_rails_lies_within_the_numbers_that_the_page_keeps(ran: Ran) -> None:
    """Extremes of the bins are those of the rails, and the page's numbers are theirs."""
    views, _ = stored_rides(ran.page)
    (panel,) = [one for one in views[0].panels if one.title == "alignment"]
    true = next(one.y for one in panel.series if one.key == "truth")
    assert true is not None
    _, known, _, _ = lines_of(ran.example, "smoother", "alignment", None)
    assert [true.min(), true.max()] == pytest.approx([known.min(), known.max()], rel=1e-6)


def test_a_stretch_that_is_too_long_would_be_seen(ran: Ran) -> None:
    """The check above can fail: a figure over more than the track has labels beyond it."""
    svg = rails_figure(
        ran.example, ran.styles[:1], band=None, limits=(-450.0, 550.0), with_interval=False, what="x"
    )
    assert max(places_of(svg)) > 90.0


def test_a_level_line_without_cant_has_no_panels_of_them() -> None:
    bare = TrackDesign(
        name="bare",
        start_m=0.0,
        elements=(Straight(50.0), Transition(20.0), Curve(50.0, 300.0, 0.0)),
        source="made up",
        synthetic=True,
    )
    assert profile_figure(bare).count("height, m") == profile_figure(bare).count("cant, mm") == 0
    assert profile_words(bare) == (
        "Design curvature (positive to the left) over distance. The line is level and has no cant."
    )
    canted = replace(bare, elements=(Straight(50.0), Transition(20.0), Curve(50.0, 300.0, 0.07)))
    assert profile_figure(canted).count("cant, mm") == 1 and "height, m" not in profile_figure(canted)
    assert profile_words(canted).endswith("over distance. The line is level.")


@pytest.mark.parametrize("count", [1, 3, 11, 30])
def test_a_legend_fits_its_width(count: int) -> None:
    labels = [f"smoother of kind {i}" for i in range(count)]
    columns = fitting_columns(labels, 10.0)
    assert 1 <= columns <= count
    size_in = 8.8 / 72.0
    assert columns == 1 or columns * size_in * (0.6 * 17 + 4.2) <= 10.0
    assert fitting_columns(["a", "b"], 10.0) == 2 and fitting_columns(["a" * 200, "b"], 10.0) == 1


def test_a_drawn_legend_ends_within_the_figure() -> None:
    with look():
        figure, (axis,) = panels([1.0])
        for i in range(12):
            axis.plot([0.0, 1.0], [0.0, i], label=f"smoother of the kind {i}")
        legend_above(axis)
        FigureCanvasAgg(figure).draw()
        drawn = axis.get_legend()
        assert drawn is not None
        assert drawn.get_window_extent().x1 <= figure.bbox.x1
        assert drawn.get_window_extent().width > 0.6 * figure.bbox.width, "no narrower than it must be"


# ---- tiles, tables and sentences ---------------------------------------------------------------


def test_the_answer_is_of_the_rails_and_beside_no_imu(ran: Ran) -> None:
    case, question = ran.cases[0], ran.data.question
    assert question is not None and question.of_rails
    best, without, second = answer_tiles(question)
    sds = {
        name: case.get(name, JUDGED[0], "sd", band="paper").value
        for name in ("smoother", "camera_free", "zero_track")
    }
    least = min(sds, key=lambda name: sds[name])
    assert best.note.startswith(least.replace("_", " "))
    assert float(best.value.split()[0]) == pytest.approx(sds[least], rel=6e-3)
    assert without.title == "no IMU at all" and without.note.startswith("zero track")
    assert float(without.value.split()[0]) == pytest.approx(sds["zero_track"], rel=6e-3)
    assert second.title == "the next best"
    said = answer_sentence(question)
    assert (
        "vertical profile in paper (0.3\u20137 m), sd" in said
        and f"no IMU at all has {without.value}" in said
    )
    # Where no IMU at all errs less, the sentence says so, and the tile.
    worse = question.draws["value"].where(question.draws["estimator"] != "zero_track", 0.01)
    lost = replace(question, draws=question.draws.assign(value=worse))
    assert answer_sentence(lost).endswith("beaten by no IMU at all, 0.0100 mm.")
    assert answer_tiles(lost)[1].note == "zero track: beats it"
    # Without such a method nothing stands for it.
    alone = replace(question, methods=[one for one in question.methods if one.uses_imu])
    assert answer_sentence(alone).endswith("no method without an IMU was run beside it.")


def test_the_chart_of_the_answer_always_has_the_method_that_is_best(ran: Ran) -> None:
    """It had the first six of a scenario's order: the one that its sentence named was not among them."""
    question = ran.data.question
    assert question is not None
    best, place = question.ranked[0], question.methods.index(question.ranked[0])
    worse = [replace(best, name=f"m{i}", label=f"method {i}") for i in range(MOST_METHODS)]
    own = question.draws[question.draws["estimator"] == best.name]
    more = [own.assign(estimator=one.name, value=own["value"] * (i + 2)) for i, one in enumerate(worse)]
    many = replace(
        question,
        methods=[*question.methods[:place], *worse, *question.methods[place:]],
        draws=pd.concat([*more, question.draws]),
    )
    drawn = drawn_methods(many)
    assert len(drawn) == MOST_METHODS and best in drawn and worse[-1] not in drawn
    assert drawn == [one for one in many.methods if one in drawn], "in the scenario's order"


def test_rails_as_designed_have_no_attitude_of_their_own(ran: Ran) -> None:
    assert [s.name for s in attitude_methods(ran.styles)] == ["smoother", "camera_free", "design_angles"]
    only_zero = [s for s in ran.styles if s.name != "design_angles"]
    assert [s.name for s in attitude_methods(only_zero)][-1] == "zero_track"
    attitude = ran.page[ran.page.index("Against the truth") : ran.page.index("Errors of the rails</summary>")]
    assert "design angles" in attitude and "zero track" not in attitude


def test_methods_are_told_apart_by_their_colours(ran: Ran) -> None:
    assert len({style.colour for style in ran.styles if style.uses_imu}) == 2


def test_tables_are_of_the_band_that_counts(ran: Ran) -> None:
    table = geometry_table(ran.cases[0], ran.styles, known=ran.known)
    assert table is not None
    assert table.columns == ["unfiltered", "paper (0.3\u20137 m)", "unfiltered", "paper", "interval, %"]
    by_label = {row.label: row for row in table.rows}
    most = ran.cases[0].get("smoother", "alignment", "max", band="paper").value
    assert by_label["alignment: smoother"].cells[3].text == f"{most:.2f}"
    assert by_label["gauge: camera free"].cells[0].text == "not observable"
    assert "gauge: zero track" not in by_label and by_label["gauge: smoother"].cells[1].mark == "best"
    overview = overview_table(ran.cases, ran.styles, known=ran.known)
    assert overview is not None and all("paper (0.3\u20137 m)" in row.label for row in overview.rows)
    found = ran.cases[0].get("smoother", "alignment", "sd", band="paper").value
    assert overview.rows[0].cells[4].text == f"{found:.3f}"


def test_sentences_are_of_the_band_that_counts_and_of_every_method(ran: Ran) -> None:
    said = geometry_findings(ran.cases[0], ran.styles, ran.cases, known=ran.known)
    first = said[0].text
    assert first.startswith(
        "In wavelengths of 0.3\u20137 m (paper), the vertical profile of smoother is off by"
    )
    free = ran.cases[0].get("camera_free", "vertical_profile", "sd", band="paper").value
    assert float(first.partition("That of camera free is off by ")[2].split()[0]) == pytest.approx(
        free, rel=6e-3
    )
    assert sum("95 % interval" in one.text for one in said) == 1
    goals = geometry_findings(
        ran.cases[0], ran.styles, ran.cases, goals_mm={"vertical_profile": 1e-6}, known=ran.known
    )
    assert not any("Asked were" in one.text for one in goals), "what is asked is asked of D1"


def test_intervals_are_told_of_the_band_that_counts_where_there_are_any() -> None:
    one = MethodStyle("ours", "ours", "", True, "", None, "#000000", "-")
    found = {("ours", "vertical_profile", "full", "truth", "whole", "sd"): Mean(0.4, 0.0, 2)}
    found["ours", "alignment", "full", "truth", "whole", "coverage95"] = Mean(0.5, 0.0, 2)
    case = Case(
        {"imu": "ideal", "odometry": "truth", "map": "exact", "vibration": "off"}, planted("D1").table, found
    )
    text = "The 95 % interval of ours, of the unfiltered rails, holds the true alignment in 50 %: too small."
    assert text in [said.text for said in geometry_findings(case, [one], [])]
    found["ours", "alignment", "D1", "truth", "whole", "coverage95"] = Mean(0.95, 0.0, 2)
    text = "in wavelengths of 3\u201325 m (D1), holds the true alignment in 95 %: about right."
    assert any(said.text.endswith(text) for said in geometry_findings(case, [one], []))


def test_a_goal_is_asked_of_d1_alone() -> None:
    found = {
        ("ours", "alignment", band, "truth", "whole", "sd"): Mean(0.4, 0.0, 2) for band in ("D1", "paper")
    }
    found["ours", "vertical_profile", "full", "truth", "whole", "sd"] = Mean(0.4, 0.0, 2)
    one = MethodStyle("ours", "ours", "", True, "", None, "#000000", "-")
    labels = {"imu": "ideal", "odometry": "truth", "map": "exact", "vibration": "off"}
    for bands, is_asked in ((("D1", "paper"), True), (("paper",), False)):
        case = Case(labels, planted(*bands).table, found)
        said = geometry_findings(case, [one], [], goals_mm={"alignment": 0.3})
        assert any("Asked were 0.3 mm: missed by 0.100 mm" in f.text for f in said) is is_asked


def test_the_page_has_every_sentence_once_and_rails_before_the_attitude(ran: Ran) -> None:
    said = re.findall(r'<li class="(?:good|bad|note)">(.*?)</li>', ran.page)
    assert len(said) == len(set(said))
    order = [
        ran.page.index(words)
        for words in (
            "rror of the vertical profile in paper",
            "Rails over distance",
            "Errors over distance",
            "What the scores say",
            "the vertical profile of smoother is off by",
            "The attitudes of smoother and camera free differ by less than 1\u00a0%",
            'id="explorer"',
        )
    ]
    assert order == sorted(order)
    assert "smoother and 1 alike" in ran.page
    assert "The track here is 1:10 as well." in ran.page
    assert "1 ride, 1 IMU in 2 grades" in ran.page
    assert re.search(r"0\.\d+\u00a0mm", ran.page) and not re.search(r"is off by 0\.\d+ mm", ran.page)


def test_the_words_of_the_page_are_told_once_with_the_bands_of_the_scenario(ran: Ran) -> None:
    words = ran.page.partition('id="words">')[2].partition("</details>")[0]
    told = re.findall(r"<tr><td>(.*?)</td><td>(.*?)</td></tr>", words)
    assert len({name for name, _ in told}) == len(told)
    by_name = dict(told)
    base = ran.scenario.spec.geometry.twist_base_m
    assert f"over a base of {base:g} m" in by_name["twist"]
    assert by_name["paper"].startswith("Wavelengths of 0.3 to 7 m; a band of this scenario")
    standard = [name for name in ("D0", "D1", "D2", "D3") if name in by_name]
    assert standard == [*ran.scenario.spec.geometry.bands]
    assert all("EN 13848-1" in by_name[name] for name in standard)


def test_one_line_stands_for_all_that_are_alike(ran: Ran) -> None:
    labels = [style.label for style in one_of_each(ran.cases[0], ran.styles)]
    assert labels == ["smoother and 1 alike", "design angles", "zero track"]


def test_few_methods_are_kept_of_each_ride_and_the_rest_counted(
    ran: Ran, monkeypatch: pytest.MonkeyPatch
) -> None:
    def kept() -> list[str]:
        styles = shown_styles(ran.styles, attitude=ran.styles, question=ran.data.question, case=ran.cases[0])
        return [style.name for style in styles if not style.baseline]

    assert kept() == ["smoother"], "the other is alike to it"
    assert "more methods under test are in the tables only" not in ran.page
    monkeypatch.setattr("simrail.report.pages.rides.one_of_each", lambda _, styles: styles)
    assert kept() == ["smoother", "camera_free"]
    monkeypatch.setattr("simrail.report.pages.rides.MOST_TESTED", 1)
    assert len(kept()) == 1


def test_only_what_is_drawn_beside_the_paper_has_a_colour_in_its_table(ran: Ran) -> None:
    colours = {row.label: row.colour for row in ran.paper["tables"].rows if "printed" not in row.label}
    assert colours["set by hand"] == PAPER.parts["hand"].colour and colours["no IMU"] == ""


def test_methods_are_alike_only_if_every_figure_is(
    scenario: Scenario,
    example: Rides,
    tables: Tables,
) -> None:
    one = example()
    states = one.estimates["ekf_compensated"].states
    styles = list(method_styles(scenario).values())
    styles = [*styles, *(replace(styles[0], name=name, label=name, twin="") for name in ("b", "c", "d"))]
    for factor, groups in ((1.005, [["ekf_compensated", "b"], ["c"], ["d"]]), (1.02, [["ekf_compensated"]])):
        error = np.deg2rad(0.1) * (factor - 1.0)
        other = {
            "b": states.assign(roll_rad=states["roll_rad"] + error),
            "c": states.assign(yaw_rad=states["yaw_rad"] + 0.1 * np.sin(states.index.to_numpy())),
            "d": states.assign(roll_sd_rad=1e-6),
        }
        estimates = one.estimates | {k: Estimate(states=v, mount="axle") for k, v in other.items()}
        case = cases(*tables(replace(one, estimates=estimates)))[0]
        found = [[style.name for style in group] for group in alike(case, styles)]
        assert found[: len(groups)] == groups
        text = "\n".join(finding.text for finding in findings(case, styles))
        assert ("what is said of EKF compensated holds of both" in text) is (factor < 1.01)
        assert ("beats b in" in text or "beats over" in text) is False or factor > 1.01


def test_many_methods_are_told_together(scenario: Scenario, example: Rides, tables: Tables) -> None:
    one = example()
    style = method_styles(scenario)["ekf_compensated"]
    design = method_styles(scenario)["design_angles"]
    names = ["m1", "m2", "m3", "m4"]
    estimates = {"design_angles": one.estimates["design_angles"]}
    for k, name in enumerate(names):
        states = one.estimates["ekf_compensated"].states
        size = np.deg2rad(0.1 * (k + 1))
        states = states.assign(
            roll_rad=one.motion["roll_rad"] + size, roll_sd_rad=np.deg2rad(0.04 if k else 0.1)
        )
        estimates[name] = Estimate(states=states, mount="axle")
    case = cases(*tables(replace(one, estimates=estimates)))[0]
    styles = [*(replace(style, name=name, label=name, twin="") for name in names), design]
    text = "\n".join(finding.text for finding in findings(case, styles))
    # The design angles are off by 0.25 deg in roll, and exact in pitch.
    assert "In roll, 'design angles only', which uses no IMU, beats m3 and m4 over the whole ride" in text
    assert "In pitch, 'design angles only', which uses no IMU, beats m1, m2, m3 and m4 over" in text
    assert "is too small with m2 (0 % inside), m3 (0 % inside) and m4 (0 % inside)." in text
    assert "is larger than need be with m1 (100 % inside)." in text
    assert text.count("95 % interval") == 2


def test_numbers_and_units_stay_together() -> None:
    assert unbroken("off by 0.4 mm in 95 % of 3 methods") == "off by 0.4\u00a0mm in 95\u00a0% of 3 methods"
    assert (
        unbroken("floor -5.1 to (-2), 13848-1 of 2026-11-30, 1e-3")
        == "floor \u22125.1 to (\u22122), 13848-1 of 2026-11-30, 1e-3"
    )


# ---- the peak ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("band", "first_m"), [(SCALED, 2.0), (FULL_SIZE, 20.0)])
def test_the_first_metres_grow_with_the_track(ran: Ran, band: Band, first_m: float) -> None:
    """A peak counts if it stands within a share of the ride's start, the same at either size."""
    estimate, style = ran.example.estimates["smoother"], ran.styles[0]
    assert estimate.geometry is not None and ran.example.rails is not None
    place = estimate.geometry.index.to_numpy()
    true = ran.example.rails.irregularities(place)["alignment_m"].to_numpy()
    for at, counts in ((0.9 * first_m, True), (1.1 * first_m, False)):
        wrong = true + 1e-3 * (np.abs(place - START_M - at) < 0.06)
        geometry = estimate.geometry.assign(alignment_m=wrong)
        changed = replace(ran.example, estimates={"smoother": replace(estimate, geometry=geometry)})
        peak = peak_of(changed, style, band)
        assert peak.first_m == pytest.approx(first_m)
        assert (peak.largest_mm > 0.5) is counts and (peak.rest_sd_mm > 1e-3) is not counts


def test_the_claim_names_the_first_metres_of_the_model(ran: Ran) -> None:
    assert "over the first 2\u00a0m, against an sd of" in ran.page


def test_a_twin_without_figures_is_left_out(ran: Ran) -> None:
    """The method may have failed with the ideal IMU alone; the page is drawn, and says nothing of it."""
    real = replace(ran.cases[0], labels={**ran.cases[0].labels, "odometry": "encoder"})
    ideal = replace(ran.cases[1], labels={**ran.cases[1].labels, "odometry": "encoder"})
    assert ideal.labels["imu"] == "ideal" != real.labels["imu"]
    told = geometry_findings(real, ran.styles, [real, ideal], known=ran.known)
    assert any("mm with an ideal IMU" in finding.text for finding in told)
    elsewhere = replace(ideal, labels={**ideal.labels, "ride": "another"})
    told = geometry_findings(real, ran.styles, [real, elsewhere], known=ran.known)
    assert told and not any("with an ideal IMU" in finding.text for finding in told)
    lost = Case(ideal.labels, ideal.table, {})
    told = geometry_findings(real, ran.styles, [real, lost], known=ran.known)
    assert told and not any("with an ideal IMU" in finding.text for finding in told)


def test_a_drawn_interval_in_a_band_is_by_draws_where_there_are_some(ran: Ran) -> None:
    """Draws of metres reach far beyond the rails, whose unfiltered interval is of millimetres."""
    estimate = ran.example.estimates["smoother"]
    assert estimate.geometry is not None
    shape = (20, len(estimate.geometry), 4)
    drawn = replace(estimate, geometry_draws=np.random.default_rng(1).standard_normal(shape))
    reach = []
    for one in (estimate, drawn):
        example = replace(ran.example, estimates={"smoother": one})
        svg = rails_figure(
            example, ran.styles[:1], band=SCALED, limits=(30.0, 50.0), with_interval=True, what="x"
        )
        reach.append(max(places_of(svg)))
    assert reach[0] < 90.0 and reach[1] > 200.0


def test_of_many_others_the_best_and_the_worst_are_told(ran: Ran) -> None:
    """The method under test three times over, with errors of one, four and two times its own."""
    case, first = ran.cases[0], ran.styles[0]
    found, styles = dict(case.scores), [first]
    for name, factor in (("like", 1.0), ("bad", 4.0), ("poor", 2.0)):
        styles.append(replace(first, name=name, label=name))
        for key, figure in case.scores.items():
            if key[0] == first.name:
                found[(name, *key[1:])] = figure._replace(value=factor * figure.value)
    told = geometry_findings(replace(case, scores=found), styles, [], known=ran.known)
    own = case.get(first.name, JUDGED[0], "sd", band="paper").value
    assert (
        f"Of the 3 other methods, that of like is off the least, by {significant(own)} mm, "
        f"and that of bad the most, by {significant(4.0 * own)} mm."
    ) in told[0].text


def times(case: Case, name: str, factor: float) -> Case:
    """A case in which every figure of a method is so many times as large."""
    scores = {
        key: figure._replace(value=factor * figure.value) if key[0] == name else figure
        for key, figure in case.scores.items()
    }
    return replace(case, scores=scores)


@pytest.mark.parametrize(("factor", "tone"), [(1e-3, "good"), (1e3, "bad")])
def test_a_method_that_loses_to_no_imu_is_told_in_red(ran: Ran, factor: float, tone: str) -> None:
    told = geometry_findings(times(ran.cases[0], "smoother", factor), ran.styles, [], known=ran.known)
    of_smoother = [finding for finding in told if "of smoother is off by" in finding.text]
    assert len(of_smoother) == len(JUDGED) and {finding.tone for finding in of_smoother} == {tone}


@pytest.mark.parametrize(("factor", "loses"), [(1e-3, False), (1e3, True)])
def test_another_method_that_loses_to_no_imu_is_named(ran: Ran, factor: float, loses: bool) -> None:
    told = geometry_findings(times(ran.cases[0], "camera_free", factor), ran.styles, [], known=ran.known)
    assert any(finding.text.startswith("No IMU at all beats camera free") for finding in told) is loses
