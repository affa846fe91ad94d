"""What a map that errs, or vibration, costs: cases with the ablation beside them, and what a page shows."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from simrail.campaign.cell import CellResult
from simrail.cli.ablation_tables import print_costs
from simrail.report.campaign.axes import campaign_axes
from simrail.report.pages.page import write_report
from simrail.report.pages.section import PageData
from simrail.report.tables.ablations import cost_tables, pairs_of
from simrail.report.tables.methods import MethodStyle, method_styles
from simrail.report.tables.pivot import Case, Mean, ablated, first_cases
from simrail.report.words.ablations import state_words
from simrail.report.words.findings import findings
from simrail.report.words.sentences import axis_words
from simrail.scenario.scenario import Scenario
from simrail.scoring.ablations import COLUMNS, MAP, VIBRATION, ablation_count, without_ablations

Rides = Callable[..., CellResult]
Tables = Callable[..., tuple[pd.DataFrame, pd.DataFrame]]


def case(errors: dict[str, float], **labels: str) -> Case:
    """A case with one error of all angles by method."""
    said = {"ride": "go", "vehicle": "v", "mount": "axle", "imu": "real", "odometry": "matched"}
    said |= {"map": "drawn", "vibration": "on", "case": "0"} | labels
    found = {
        (name, angle, "full", "truth", "whole", "rms"): Mean(size, 0.0, 2)
        for name, size in errors.items()
        for angle in ("roll", "pitch", "yaw_debiased")
    }
    columns = {"quantity": "roll", "band": "full", "window": "whole", "draws": 2, "failed": 0}
    return Case(said, pd.DataFrame([{"estimator": name, **columns} for name in errors or ["none"]]), found)


def exact(errors: dict[str, float], **labels: str) -> Case:
    return case(errors, **{"map": "exact", "map.exact": "True", "case": "1"} | labels)


def silent(errors: dict[str, float], **labels: str) -> Case:
    return case(errors, **{"vibration": "off", "vibration.off": "True", "case": "2"} | labels)


@pytest.fixture(scope="module")
def styles(scenario: Scenario) -> list[MethodStyle]:
    return list(method_styles(scenario).values())


def test_a_twin_differs_in_its_map_only() -> None:
    own, twin = case({}, **{"map.exact": "False"}), exact({})
    others = [exact({}, **{name: "other"}) for name in ("ride", "vehicle", "mount", "imu", "odometry")]
    assert ablated(own, [*others, own, twin], MAP) is twin
    assert ablated(own, [*others, own], MAP) is None
    assert ablated(twin, [own, twin, exact({})], MAP) is None
    assert ablated(case({}, **{"ride.speed_kmh": "20.0"}), [twin], MAP) is None


def test_first_are_the_maps_that_trains_have_and_an_exact_one_where_there_is_no_other() -> None:
    own, twin = case({}), exact({})
    assert first_cases([twin, own]) == [own] and first_cases([twin]) == [twin]
    cells = pd.DataFrame({"map": ["exact", "drawn"], "cell": [0, 1]})
    assert without_ablations(cells)["cell"].tolist() == [1]
    assert without_ablations(cells[:1])["cell"].tolist() == [0]
    assert without_ablations(cells[["cell"]])["cell"].tolist() == [0, 1]


def test_a_twin_differs_in_one_ablation_and_first_are_cases_without_any() -> None:
    """All four of two ablations: what a train has comes first, and is compared with one of them at a time."""
    own, still, both = case({}), silent({}), silent({}, **{"map": "exact", "map.exact": "True"})
    every = [both, still, exact({}), own]
    assert first_cases(every) == [own]
    assert ablated(own, every, VIBRATION) is still and ablated(every[2], every, VIBRATION) is both
    assert ablated(still, every, VIBRATION) is None and ablated(still, every, MAP) is both
    assert [[pair for group in pairs_of(every, one) for pair in group.pairs] for one in (MAP, VIBRATION)] == [
        [(own, every[2])],
        [(own, still)],
    ]
    # A scenario whose map is exact throughout still has its silence beside it.
    assert first_cases([both, every[2]]) == [every[2]]
    assert [ablation_count(one.labels) for one in every] == [2, 1, 1, 0]


def test_rows_of_one_ablation_are_kept_where_it_is_what_is_compared() -> None:
    cells = pd.DataFrame(
        {"cell": range(4), "map": ["drawn", "exact"] * 2, "vibration": ["on"] * 2 + ["off"] * 2}
    )
    assert without_ablations(cells)["cell"].tolist() == [0]
    assert without_ablations(cells, but=MAP)["cell"].tolist() == [0, 1]
    assert without_ablations(cells, but=VIBRATION)["cell"].tolist() == [0, 2]
    assert without_ablations(cells[2:])["cell"].tolist() == [2], "what all rows are is no ablation beside"


def test_a_sentence_names_what_silence_changes_the_most(styles: list[MethodStyle]) -> None:
    own, still = case({"ekf_compensated": 0.3}), silent({"ekf_compensated": 0.2})
    (told,) = [f.text for f in findings(own, styles, others=[own, still]) if "Without vibration" in f.text]
    assert told.count("(0.200\u00b0 instead of 0.300\u00b0 rms)") == 3 and "an ablation" in told


def test_titles_say_what_the_train_knows_and_what_shakes_it() -> None:
    assert state_words(case({}).labels) == "a map with errors \u00b7 with vibration"
    assert state_words(silent({}).labels, comma=", ") == "a map with errors, without vibration (ablation)"
    assert axis_words("vibration.off", True) == "without vibration (ablation)"
    assert axis_words("map.exact", "False") == "a map with errors"


def test_costs_are_means_over_the_same_rides(styles: list[MethodStyle]) -> None:
    all_cases = [
        case({"ekf_compensated": 0.3, "design_angles": 0.2}),
        exact({"ekf_compensated": 0.1, "design_angles": 0.1}),
        case({"ekf_compensated": 0.5, "design_angles": 0.4}, ride="back"),
        # A method without a figure with one of the maps has no part in the means of either.
        exact({"ekf_compensated": 0.2, "design_angles": np.nan}, ride="back"),
        case({"ekf_compensated": 9.0}, ride="alone"),
        case({"ekf_compensated": 0.7}, imu="ideal"),
        exact({"ekf_compensated": 0.6}, imu="ideal"),
    ]
    real, ideal = pairs_of(all_cases, MAP)
    assert real.title == "IMU axle (real) \u00b7 odometry matched" and "(ideal)" in ideal.title
    assert real.cost("ekf_compensated", "roll", "rms") == pytest.approx((0.4, 0.15))
    assert real.cost("design_angles", "roll", "rms") == pytest.approx((0.2, 0.1))
    assert ideal.cost("ekf_compensated", "pitch", "rms") == pytest.approx((0.7, 0.6))
    (table,) = cost_tables(real, styles, styles)
    assert table.columns == ["the map errs", "exact"] * 3
    assert [cell.text for cell in table.rows[0].cells] == ["0.400", "0.150"] * 3
    assert [row.label for row in table.rows] == ["EKF compensated", "design angles"]


def test_rails_are_compared_in_the_band_that_counts(styles: list[MethodStyle]) -> None:
    def rails(one: Case, size: float) -> Case:
        name = styles[0].name
        found = {
            (name, quantity, "D1", "truth", "whole", "sd"): Mean(size, 0.0, 2)
            for quantity in ("vertical_profile", "cross_level", "alignment")
        }
        rows = [(q, "D1", 2) for q in ("vertical_profile", "cross_level", "alignment")]
        return replace(one, scores=found, table=pd.DataFrame(rows, columns=["quantity", "band", "draws"]))

    (group,) = pairs_of([rails(case({}), 0.5), rails(exact({}), 0.25)], MAP)
    (table,) = cost_tables(group, styles, styles)
    assert table.groups[0] == ("vertical profile sd, D1, mm", 2)
    assert [cell.text for cell in table.rows[0].cells] == ["0.500", "0.250"] * 3


def test_a_sentence_names_what_an_exact_map_changes_the_most(styles: list[MethodStyle]) -> None:
    own = case({"ekf_compensated": 0.3, "vqf": 0.4, "design_angles": 0.2})
    twin = exact({"ekf_compensated": 0.29, "vqf": 0.4, "design_angles": 0.1})
    (told,) = [f.text for f in findings(own, styles, others=[own, twin]) if "exact map" in f.text]
    assert told.count("design angles (0.100\u00b0 instead of 0.200\u00b0 rms)") == 3
    for cases in ([own], [own, exact({}, ride="back")]):
        assert not any("exact map" in f.text for f in findings(own, styles, others=cases))
    assert not any("exact map" in f.text for f in findings(twin, styles, others=[own, twin]))


def test_an_ideal_imu_is_looked_for_with_the_same_map(styles: list[MethodStyle]) -> None:
    own = case({"ekf_compensated": 0.3})
    ideal, other = case({"ekf_compensated": 0.2}, imu="ideal"), exact({"ekf_compensated": 0.1}, imu="ideal")
    told = [f.text for f in findings(own, styles, others=[other, own, ideal])]
    assert any("EKF compensated 0.200\u00b0 instead of 0.300\u00b0" in text for text in told)


def test_the_axis_of_vibration_is_told_once_and_in_words() -> None:
    both = {"cell": [0, 1], "case": [0, 1], "vibration": ["off", "on"], "vibration.off": [True, False]}
    (axis,) = campaign_axes(pd.DataFrame(both))
    assert (axis.column, axis.title) == ("vibration", "vibration")
    assert axis.words == ("on", "off (ablation)") and axis.values == ("on", "off")


def test_the_axis_of_the_map_is_told_once_and_in_words() -> None:
    cells = pd.DataFrame(
        {
            "cell": [0, 1],
            "case": [0, 1],
            "map": ["exact", "drawn"],
            "map.exact": [True, False],
            "ride": ["go", "go"],
        }
    )
    (axis,) = campaign_axes(cells)
    assert (axis.column, axis.title) == ("map", "map")
    assert axis.words == ("the map errs", "exact (ablation)") and axis.values == ("drawn", "exact")


def test_the_command_line_sets_the_maps_side_by_side(styles: list[MethodStyle]) -> None:
    console = Console(width=80, record=True, file=StringIO())
    print_costs(console, [case({"ekf_compensated": 0.3}), exact({"ekf_compensated": 0.1})], styles)
    lines = console.export_text().splitlines()
    assert lines[0] == "What the map costs: IMU axle (real) \u00b7 odometry matched"
    row = next(line.split() for line in lines if line.split()[:1] == ["ekf_compensated"])
    assert row[1:] == ["0.300", "0.100"] * 3
    console = Console(width=80, record=True, file=StringIO())
    print_costs(console, [silent({"ekf_compensated": 0.2}), case({"ekf_compensated": 0.3})], styles)
    text = console.export_text()
    assert text.startswith("What vibration costs: ") and "What the map costs" not in text
    row = next(line.split() for line in text.splitlines() if line.split()[:1] == ["ekf_compensated"])
    assert row[1:] == ["0.300", "0.200"] * 3 and "with: shaken" in text
    console = Console(width=80, record=True, file=StringIO())
    print_costs(console, [exact({"ekf_compensated": 0.1})], styles)
    assert console.export_text() == ""


# ---- the page ----------------------------------------------------------------------------------


def with_map(ride: CellResult, known: str, *, roll_deg: float) -> CellResult:
    """A ride by a map, whose EKF errs by so much in roll."""
    estimates = dict(ride.estimates)
    states = estimates["ekf_compensated"].states.copy()
    states["roll_rad"] = ride.motion["roll_rad"] + np.deg2rad(roll_deg)
    estimates["ekf_compensated"] = replace(estimates["ekf_compensated"], states=states)
    return replace(ride, cell=ride.cell | {"map": known}, estimates=estimates)


@pytest.fixture(scope="module")
def both(scenario: Scenario, example: Rides, tables: Tables) -> PageData:
    """The exact map first, as a list may have it."""
    ride = example()
    rides = [with_map(ride, "exact", roll_deg=0.0321), with_map(ride, "drawn", roll_deg=0.4567)]
    scores, _ = tables(*rides)
    cells = scores[["cell", "ride", "vehicle", "mount", "imu", "odometry", *COLUMNS]].drop_duplicates("cell")
    cells = cells.assign(**{"map.exact": cells["map"] == "exact"}).reset_index(drop=True)
    return PageData(scenario, scores, cells, rides[1:], {})


def test_cases_with_an_exact_map_come_last_and_have_no_tables_of_their_own(both: PageData) -> None:
    assert [one.labels["map"] for one in both.cases] == ["drawn", "exact"]
    assert [one.labels["map"] for one in both.shown_cases] == ["drawn"]
    assert "map.exact" not in both.cases[0].axes


def test_the_page_shows_the_map_that_errs_and_the_exact_one_in_one_table(
    both: PageData, tmp_path: Path, no_pictures_of_rides: None
) -> None:
    sizes, texts = [], []
    for data in (both, replace(both, scores=both.scores[both.scores["map"] == "drawn"])):
        write_report(
            tmp_path / "report.html",
            scenario=data.scenario,
            scores=data.scores,
            cells=data.cells,
            examples=data.examples,
            manifest={},
        )
        text = (tmp_path / "report.html").read_text(encoding="utf-8")
        sizes.append(len(text))
        texts.append(text)
    parts = dict(
        re.findall(
            r'(?s)<(?:h2|details class="part") id="([\w-]+)">(.*?)(?=<h2 id|<details class="part"|</main>|$)',
            texts[0],
        )
    )
    costs = parts["map-costs"]
    assert "What the map costs" in costs and "0.457" in costs and "0.032" in costs
    tables_of_cases = parts["scores"].partition("Angles in degrees")[2]
    assert "0.457" in tables_of_cases and "0.032" not in tables_of_cases
    assert "a map with errors" in tables_of_cases and "exact map" not in tables_of_cases
    assert 'id="map-costs"' not in texts[1] and 'id="vibration-costs"' not in texts[0]
    assert sizes[0] < 1.25 * sizes[1], "an ablation beside it does not double a page"
