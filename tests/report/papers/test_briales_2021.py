"""The section beside Briales et al. 2021: its scenario, its figures, and every verdict both ways."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.campaign import run_campaign
from simrail.campaign.result import CampaignResult
from simrail.core.errors import InputError
from simrail.report.pages.page import write_report
from simrail.report.pages.section import PageData
from simrail.report.papers.briales_2021 import judges
from simrail.report.papers.briales_2021.figures import spread_of
from simrail.report.papers.briales_2021.judges import TIME_CONSTANTS_S, Evidence
from simrail.report.papers.briales_2021.rides import GENERAL_PURPOSE, PAPER, Rides, ablated_rides, rides_of
from simrail.report.papers.briales_2021.section import cost_paragraph, section
from simrail.report.papers.claim import Claim, judged, with_ablation
from simrail.report.tables.pivot import Case, Mean, cases
from simrail.report.words.ablations import WORDS
from simrail.report.words.sentences import degrees
from simrail.results import describe
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells, methods
from simrail.scenario.scenario import Scenario, load_scenario, read_scenario
from simrail.scoring.ablations import ABLATIONS, MAP, VIBRATION, Ablation, without_ablations

pytestmark = pytest.mark.long

MEAN_KMH = {"go20A": 21.0, "go20B": 18.0, "back20A": -21.0, "back20B": -21.0, "go70": 42.0, "back70": -31.5}
"""Table 2 of the paper."""


# ---- the scenario ------------------------------------------------------------------------------


def test_mean_speeds_are_those_of_table_2() -> None:
    found = {}
    scenario = load_scenario("metro_table3", overrides=["monte_carlo.sensor_draws=1"])
    parts = Parts(scenario)
    for cell in cells(scenario):
        profile = parts.ride(cell).profile
        t = np.linspace(0.0, profile.duration_s, 200_001)
        position, speed, _ = profile.motion(t)
        moving = np.flatnonzero(np.abs(speed) > 1e-6)
        took = t[moving[-1]] - t[moving[0]]
        found[cell.ride.name] = 3.6 * (position[-1] - position[0]) / took
    assert found == pytest.approx(MEAN_KMH, rel=0.02)


def test_stations_lie_where_the_chords_put_them() -> None:
    stops = {stop.position_m for ride in load_scenario("metro_table3").spec.ride for stop in ride.stops}
    montequinto, europa = sorted(stops)
    assert montequinto - 40.0 == pytest.approx(492.0, abs=5.0)
    assert europa - montequinto == pytest.approx(521.0, abs=5.0)


def test_every_part_is_played_by_one_method() -> None:
    ran = methods(load_scenario("metro_table3"))
    names = PAPER.names(ran)
    own = [method for method in ran if method.part.method == "TrackRelativeSmoother"]
    assert sorted(names) == sorted(PAPER.parts) and len(names) + len(own) == len(ran)


def test_an_unknown_paper_is_refused() -> None:
    with pytest.raises(InputError, match=r"paper.*briales_2021"):
        load_scenario("metro_table3", overrides=["paper='briales_2020'"])


def test_time_constants_follow_from_the_printed_settings() -> None:
    # EQUATIONS 2.3 gives them rounded.
    assert pytest.approx({"per_step": 0.19, "intensity": 3.0}, rel=0.04) == TIME_CONSTANTS_S


# ---- verdicts, from planted scores -------------------------------------------------------------

RMS = {  # roll, pitch, yaw of a world in which the paper is right
    **{
        part: tuple(mean for mean, _ in PAPER.printed[row])
        for part, row in (
            ("vqf_magnetometer", "commercial"),
            ("gda_paper", "madgwick"),
            ("ekf_per_step", "ekf"),
        )
    },
    "vqf": (0.4, 0.5, 20.0),
    "imufusion": (0.4, 0.5, 0.3),
    "sabatini": (0.6, 0.5, 0.2),
    "yuan": (0.3, 0.8, 0.2),
    "gda_uncompensated": (0.5, 0.5, 0.2),
    "gda": (0.1, 0.1, 0.2),
    "ekf": (0.1, 0.1, 0.2),
    "ekf_intensity": (0.2, 0.1, 8.3),
    "design": (0.07, 0.1, 0.1),
}
SPREAD = {"gda_paper": 0.1, "ekf_per_step": 0.3, "ekf": 0.05, "gda": 0.06}

Change = Callable[[str, str, str], float]
"""(part, ride, quantity) to a factor."""


def planted(change: Change = lambda part, ride, quantity: 1.0, *, without: tuple[str, ...] = ()) -> Rides:
    """Scores of the six rides; the EKF with the paper's settings fails on backward rides."""
    found_cases = []
    for ride, kmh in MEAN_KMH.items():
        found = {}
        for part, values in RMS.items():
            for quantity, value in zip(("roll", "pitch", "yaw"), values, strict=True):
                for window in ("whole", "cropped", "curve"):
                    fails = part == "ekf_per_step" and window == "curve" and kmh < 0.0
                    size = value * change(part, ride, quantity) * (2.0 if fails else 1.0)
                    for reference in ("truth", "design"):
                        found[part, quantity, "full", reference, window, "rms"] = Mean(size, 0.0, 2)
        labels = {
            "ride": ride,
            "direction": "forward" if kmh > 0 else "backward",
            "speed_kmh": "70" if "70" in ride else "20",
        }
        found_cases.append(Case(labels, pd.DataFrame({"draws": [2]}), found))
    return Rides(found_cases, {part: part for part in RMS if part not in without})


def verdicts(rides: Rides, spread: dict[str, float] = SPREAD) -> dict[str, Claim]:
    """All claims by key."""
    claims = judged(PAPER, Evidence(rides, spread, 13.0), judges, has=rides.has)
    return {claim.key: claim for claim in claims}


def test_all_claims_hold_where_the_paper_is_right() -> None:
    assert {claim.verdict for claim in verdicts(planted()).values()} == {"reproduced"}


def only(part: str, quantity: str, factor: float, *, rides: str = "") -> Change:
    """Change one figure, on rides whose name holds a word."""
    return lambda p, r, q: factor if (p, q) == (part, quantity) and rides in r else 1.0


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("commercial_yaw", only("vqf_magnetometer", "yaw", 0.1)),
        ("sabatini", only("sabatini", "yaw", 10.0)),
        ("sabatini", only("sabatini", "roll", 0.2)),
        ("yuan", only("yuan", "pitch", 0.5)),
        ("yuan", only("yuan", "roll", 3.0)),
        ("compensation", only("gda_uncompensated", "roll", 0.25, rides="back70")),
        ("compensation", only("ekf", "roll", 5.0, rides="go20A")),
        ("general_purpose", only("yuan", "roll", 0.3, rides="back20B")),
        ("gda_slightly_better", only("gda_paper", "roll", 1.3)),
        ("gda_slightly_better", only("ekf_per_step", "pitch", 0.3)),
        ("gda_slightly_better", only("ekf_per_step", "roll", 1.8)),
        ("same_yaw", only("ekf_per_step", "yaw", 1.1)),
        ("yaw_size", only("gda_paper", "yaw", 0.3)),
        ("size_commercial", only("vqf_magnetometer", "roll", 2.1)),
        ("size_madgwick", only("gda_paper", "pitch", 0.45)),
        ("size_ekf", only("ekf_per_step", "yaw", 2.1)),
        ("backward_gda", only("gda_paper", "roll", 1.3, rides="back")),
        ("backward_ekf", only("ekf_per_step", "roll", 0.5, rides="back")),
    ],
)
def test_each_verdict_can_fall(key: str, change: Change) -> None:
    claim = verdicts(planted(change))[key]
    assert claim.verdict == "not reproduced" and claim.words == "Does not reproduce."


def test_repeatability_can_fall() -> None:
    assert verdicts(planted(), {**SPREAD, "ekf_per_step": 0.11})["repeatability"].verdict == "not reproduced"


def test_what_was_not_run_is_not_judged() -> None:
    found = verdicts(planted(without=("yuan", "ekf_per_step")), {"gda_paper": 0.1})
    unasked = {key for key, claim in found.items() if claim.verdict == "not asked"}
    assert unasked == {"yuan", "gda_slightly_better", "same_yaw", "size_ekf", "backward_ekf", "repeatability"}
    assert "after Yuan" in found["yuan"].ours


def test_a_method_that_failed_on_a_ride_is_not_judged() -> None:
    found = verdicts(planted(only("gda_paper", "roll", np.nan, rides="back70")))
    unasked = {key for key, claim in found.items() if claim.verdict == "not asked"}
    assert unasked == {"gda_slightly_better", "same_yaw", "yaw_size", "size_madgwick", "backward_gda"}


def test_without_scores_there_is_no_section() -> None:
    scenario, result = campaign(FAST)
    assert section(PageData(scenario, result.scores.iloc[:0], result.cells, [], {})) == []


def test_the_figures_of_a_sentence_are_looked_up() -> None:
    claim = verdicts(planted(only("vqf_magnetometer", "yaw", 0.5)))["commercial_yaw"]
    assert "26.2\u00b0" in claim.ours and claim.printed == "52.4\u00b0 \u00b1 37.3\u00b0"


# ---- rides -------------------------------------------------------------------------------------


def some_rides(names: tuple[str, ...], draws: int) -> Scenario:
    """The scenario with some of its rides, fewer draws, without the ideal IMU and without our own method."""
    text = load_scenario("metro_table3").text
    head, *parts = re.split(r"(?m)^(?=\[\[ride\]\]|\[\[imu\]\]|\[magnetometer|\[\[estimator\]\])", text)
    parts = [part for part in parts if "TrackRelativeSmoother" not in part]
    others = ("[[imu]]", "[magnetometer", "[[estimator]]")
    wanted = [f'name = "{name}"' for name in names]
    kept = [part for part in parts if part.startswith(others) or any(name in part for name in wanted)]
    kept = [part for part in kept if '"ideal"' not in part]
    return read_scenario(
        head + "".join(kept), name="metro_table3", overrides=[f"monte_carlo.sensor_draws={draws}"]
    )


def campaign(names: tuple[str, ...], draws: int = 1) -> tuple[Scenario, CampaignResult]:
    """Run it, once for the same words."""
    return _run(names, draws)


@lru_cache
def _run(names: tuple[str, ...], draws: int) -> tuple[Scenario, CampaignResult]:
    scenario = some_rides(names, draws)
    return scenario, run_campaign(scenario)


def view_of(names: tuple[str, ...], draws: int = 1) -> SimpleNamespace:
    """What the section of a campaign shows."""
    return _view(names, draws)


@lru_cache
def _view(names: tuple[str, ...], draws: int) -> SimpleNamespace:
    scenario, result = campaign(names, draws)
    (made,) = section(PageData(scenario, result.scores, result.cells, result.examples, {}))
    return SimpleNamespace(**made.data)


FAST = ("go70", "back70")


def test_nothing_fails() -> None:
    assert campaign(FAST)[1].failures == []


def test_table_3_is_the_mean_over_the_rides() -> None:
    """Of what a train has; each ablation has a table of its own."""
    scores, view = without_ablations(campaign(FAST)[1].scores), view_of(FAST)
    chosen = scores[(scores["metric"] == "rms") & (scores["window"] == "cropped")]
    for reference, table, first in (("design", view.design, 3), ("truth", view.truth, 0)):
        row = next(row for row in table.rows if row.label == PAPER.label("gda_paper"))
        for i, quantity in enumerate(("roll", "pitch", "yaw")):
            rows = chosen[
                (chosen["estimator"] == "gda_paper")
                & (chosen["quantity"] == quantity)
                & (chosen["reference"] == reference)
            ]
            per_ride = rows.groupby("ride", observed=True)["value"].mean()
            assert len(per_ride) == 2
            assert float(row.cells[first + i].text) == pytest.approx(per_ride.mean(), abs=5.1e-4)
            assert float(row.cells[first + i].spread) == pytest.approx(per_ride.std(), abs=5.1e-4)
    printed = next(row for row in view.design.rows if row.label == PAPER.label("gda_paper")).cells[:3]
    assert [cell.text for cell in printed] == ["0.226", "0.284", "8.25"]


def test_figures_that_need_more_rides_are_left_out() -> None:
    view = view_of(FAST)
    assert len(view.repeats) == 1  # no two slow or two forward rides: Figs. 15 to 20 are left out
    drawings = [view.each_ride, view.attitude, view.compensation, *(svg for *_, svg in view.repeats)]
    assert all(svg.startswith('<div class="wide"><svg') for svg in drawings), "for desks and for phones"


def test_the_section_stands_on_the_page(tmp_path: Path, no_pictures_of_rides: None) -> None:
    scenario, result = campaign(FAST)
    write_report(
        tmp_path / "report.html",
        scenario=scenario,
        scores=result.scores,
        cells=result.cells,
        examples=result.examples[:1],
        manifest=describe(scenario, result),
    )
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    (head,) = re.findall(r'<details class="part" id="paper"><summary><h2>(.*?)</h2>', text)
    (made,) = section(PageData(scenario, result.scores, result.cells, result.examples[:1], {}))
    asked = [claim for claim in made.data["all_claims"] if claim.verdict != "not asked"]
    same = sum(claim.verdict == "reproduced" for claim in asked)
    assert 0 < same < len(asked)
    assert head == f"Beside Briales et al. 2021: {same} of {len(asked)} claims reproduced"
    assert "8.25" in text and "Does not reproduce." in text and "track acceleration" in text


def test_claims_on_the_fast_rides() -> None:
    found = {claim.key: claim for claim in view_of(FAST).all_claims}
    reproduces = {"sabatini", "general_purpose", "same_yaw", "backward_gda", "repeatability"}
    assert {key for key in reproduces if found[key].verdict != "reproduced"} == set()
    # A step of the GDA is as long whatever it goes by: on an axle that shakes it hardly follows what it
    # feels, so that the uncompensated one errs less in curves. Without vibration compensation pays.
    assert found["compensation"].verdict == "not reproduced"
    assert dict(found["compensation"].ablated)["Without vibration (ablation)"].startswith("Reproduces.")
    assert found["backward_ekf"].verdict == "not reproduced"


def test_spread_of_planted_errors() -> None:
    examples = campaign(FAST)[1].examples
    shifted = []
    for example, shift_deg in zip(examples, (0.3, -0.1), strict=True):
        states = example.motion[["roll_rad"]] + np.radians(shift_deg)
        estimate = replace(example.estimates["design_angles"], states=states)
        shifted.append(replace(example, estimates={"planted": estimate}))
    assert spread_of(shifted, "planted") == pytest.approx(np.std([0.3, -0.1], ddof=1), rel=1e-9)


def ratio_of(
    scores: pd.DataFrame, ride: str, method: str, ours: str, *, vibration: str
) -> tuple[float, float]:
    """Roll error in curves of one method over another's: the ratio of the means, and its standard error."""
    chosen = scores[
        (scores["quantity"] == "roll")
        & (scores["window"] == "curve")
        & (scores["metric"] == "rms")
        & (scores["reference"] == "truth")
        & (scores["ride"] == ride)
        & (scores["map"] == "drawn")
        & (scores["vibration"] == vibration)
    ]
    a, b = (chosen.loc[chosen["estimator"] == name, "value"].to_numpy() for name in (method, ours))
    ratio = a.mean() / b.mean()
    # By the delta method, the two paired by their draws.
    return float(ratio), float((a - ratio * b).std(ddof=1) / np.sqrt(len(a)) / b.mean())


@pytest.mark.parametrize("ablation", ABLATIONS)
def test_an_ablation_stands_beside_in_a_table_and_a_paragraph(ablation: Ablation) -> None:
    scores, view = campaign(FAST)[1].scores, view_of(FAST)
    scores = without_ablations(scores, but=ablation)
    whole = scores[
        (scores["metric"] == "rms") & (scores["window"] == "whole") & (scores["reference"] == "truth")
    ]
    means = (
        whole.groupby(["estimator", "quantity", ablation.column, "ride"], observed=True)["value"]
        .mean()
        .groupby(["estimator", "quantity", ablation.column], observed=True)
        .mean()
    )
    sides, names = (ablation.own, ablation.ablated), PAPER.names(methods(campaign(FAST)[0]))
    told = {title: (words, table) for title, words, table in view.ablations}
    words, table = told[WORDS[ablation].cost]
    for row in table.rows:
        name = next(names[part] for part, role in PAPER.parts.items() if role.label == row.label)
        shown = [means[name, q, side] for q in ("roll", "pitch", "yaw") for side in sides]
        assert [float(cell.text) for cell in row.cells] == pytest.approx(shown, abs=5.1e-4)
    assert len(table.rows) == len(PAPER.parts)
    design = [means["design_angles", "roll", side] for side in sides]
    sizes = " instead of ".join(degrees(value) for value in design)
    assert re.search(f"Design angles only[a-zA-Z, ]*, in roll: {sizes}.", words)
    if ablation == MAP:
        assert design[0] > design[1], "who takes the roll from the map takes its errors"
    assert all(example.cell[ablation.column] == ablation.own for example in campaign(FAST)[1].examples)


def test_claims_say_what_ablations_make_of_them() -> None:
    view = view_of(FAST)
    told = [claim.ablated for claim in view.all_claims if claim.ablated]
    assert {phrase for one in told for phrase, _ in one} == {
        f"{words.phrase} (ablation)" for words in WORDS.values()
    }
    assert not any(claim.ablated for claim in view.all_claims if claim.verdict == "not asked")


def as_cases(rides: Rides, known: str) -> Rides:
    """Rides by a map."""
    return replace(rides, cases=[replace(one, labels=one.labels | {"map": known}) for one in rides.cases])


def test_what_the_map_costs_is_told_of_the_method_that_loses_the_most() -> None:
    """Each figure from planted scores; the paper's own words on its map stand before them."""
    erring = as_cases(planted(only("gda", "roll", 3.0)), "drawn")
    exact = as_cases(planted(only("ekf_printed", "roll", 1.0)), "exact")
    told = cost_paragraph(erring, exact, MAP)
    assert "known in advance (abstract, section 5.1)" in told
    assert f"in roll {PAPER.label('gda')}, 0.300\u00b0 instead of 0.100\u00b0" in told
    assert "in pitch none loses more than 1 %" in told and "in yaw none loses" in told
    assert "Design angles only, in roll: 0.0700\u00b0 instead of 0.0700\u00b0" in told
    assert "an ablation" in cost_paragraph(exact, None, MAP) and "not asked" in cost_paragraph(
        exact, None, MAP
    )
    assert "not told" in cost_paragraph(erring, None, MAP)


def test_a_claim_says_what_an_exact_map_makes_of_it() -> None:
    """The verdict where it is another, figures where they differ, nothing where they do not."""
    own = verdicts(planted(only("yuan", "pitch", 0.5)))
    twins = list(verdicts(planted(), {}).values())
    found = {c.key: c for c in with_ablation(list(own.values()), twins, MAP)}
    assert found["yuan"].verdict == "not reproduced"
    ((phrase, figures),) = found["yuan"].ablated
    assert phrase == "With an exact map (ablation)" and figures.startswith("Reproduces. In curves")
    assert found["sabatini"].ablated == () and found["repeatability"].ablated == ()
    slightly = only("yuan", "pitch", 1.1)
    (other,) = with_ablation([own["yuan"]], [verdicts(planted(slightly))["yuan"]], MAP)
    assert other.ablated[0][1].startswith("Reproduces.")
    both = with_ablation([verdicts(planted())["yuan"]], [verdicts(planted(slightly))["yuan"]], MAP)
    assert both[0].ablated[0][1].startswith("In curves")
    (more,) = with_ablation(both, [own["yuan"]], VIBRATION)
    assert [phrase for phrase, _ in more.ablated] == [
        "With an exact map (ablation)",
        "Without vibration (ablation)",
    ]


def test_rides_with_the_map_that_errs_are_judged_and_their_twins_found() -> None:
    def one(ride: str, known: str, imu: str = "real") -> Case:
        labels = {"ride": ride, "imu": imu, "map": known, "vibration": "on"}
        return Case(labels, pd.DataFrame(), {})

    every = [one("a", "exact"), one("a", "drawn", "ideal"), one("a", "drawn"), one("b", "drawn")]
    rides = rides_of(every, [])
    assert rides.cases == [every[2], every[3]]
    assert ablated_rides(rides, every, MAP) is None, "b was not run with an exact map"
    beside = ablated_rides(rides_of(every[:3], []), every, MAP)
    assert beside is not None and beside.cases == [every[0]]
    assert rides_of(every[:1], []).cases == [every[0]]


@pytest.mark.slow
def test_claims_on_all_rides() -> None:
    # Ten draws: the accelerometer's bias, which differs between draws, is the floor of every roll error.
    names = tuple(MEAN_KMH)
    view = view_of(names, 10)
    found = {claim.key: claim for claim in view.all_claims}
    # The sizes of Table 3 lie near their limit and are not asserted: they change with every draw.
    holds = {
        key: claim.verdict == "reproduced" for key, claim in found.items() if not key.startswith("size_")
    }
    # What vibration does to the GDA takes two of the claims.
    fallen = {"yuan", "backward_ekf", "compensation", "gda_slightly_better"}
    silent = {
        key: dict(claim.ablated).get("Without vibration (ablation)", "") for key, claim in found.items()
    }
    assert all(silent[key].startswith("Reproduces.") for key in ("compensation", "gda_slightly_better"))
    assert holds == {key: key not in fallen for key in holds}
    assert found["size_commercial"].verdict == "not reproduced"
    assert len(view.repeats) == 4
    scenario, result = campaign(names, 10)
    rides = rides_of(cases(result.scores, result.cells), methods(scenario))
    for case in rides.cases:
        limit = 4.0 if "70" in case.labels["ride"] else 3.0
        for part in GENERAL_PURPOSE:
            for ours in ("ekf", "gda"):
                ride, names = case.labels["ride"], rides.names
                # Without vibration: on an axle that shakes an uncompensated GDA hardly feels the curves.
                times, error = ratio_of(result.scores, ride, names[part], names[ours], vibration="off")
                # Ten draws of a bias do not settle a factor of 4.2: only what chance does not explain counts.
                assert times + 2.0 * error > limit, (ride, part, ours)
    for part in ("ekf", "gda"):
        for go, back in (("go20A", "back20A"), ("go70", "back70")):
            errors = [rides.one(c, part, "roll") for c in rides.cases if c.labels["ride"] in (go, back)]
            assert abs(errors[0] - errors[1]) < 0.03
