"""The section beside Hidalgo et al.: every verdict both ways, from planted scores, and its intervals."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from simrail.core.seeds import stream
from simrail.report.papers.claim import Claim, judged
from simrail.report.papers.hidalgo import judges
from simrail.report.papers.hidalgo.places import PAPER, Places, places_of
from simrail.report.papers.hidalgo.section import section
from simrail.scenario.cells import methods
from simrail.scenario.scenario import load_scenario

MEANS = {  # error in D1, mm, of a world in which the paper is right
    "gyro": 0.25,
    "no_gyro": 0.35,
    "deviation": 0.25,
    "newest": 0.30,
    "zeros": 0.25,
    "printed": 0.25,
    "own": 0.20,
    "zero": 0.90,
}

Change = Callable[[str, str], float]
"""(place, part) to a factor."""


def planted(
    change: Change = lambda place, part: 1.0, *, draws: int = 20
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Score table and cells: rails that are rough or smooth for all methods, and some chance for each."""
    rng = stream(1, "planted")
    scores, cells, cell = [], [], 0
    for vehicle, mount in (("two_axle_wagon", "axle"), ("metro_irw_bogie", "carried")):
        for draw in range(draws):
            rails = np.exp(0.3 * rng.standard_normal())
            for direction in ("forward", "backward"):
                cells.append({"cell": cell, "direction": direction, "sample": draw})
                for part, mean in MEANS.items():
                    place = f"{vehicle.replace('_', ' ')}, {mount}"
                    value = mean * rails * change(place, part) * np.exp(0.03 * rng.standard_normal())
                    for band, metric, size in (
                        ("D1", "sd", 1.0),
                        ("D2", "sd", 3.0),
                        ("full", "coverage95", 1.0),
                    ):
                        scores.append(
                            {
                                "cell": cell,
                                "vehicle": vehicle,
                                "mount": mount,
                                "imu": "lord_3dm_gx4_25",
                                "track_draw": 0,
                                "estimator": f"m_{part}",
                                "quantity": "vertical_profile",
                                "band": band,
                                "window": "whole",
                                "metric": metric,
                                "value": size * value,
                                "status": "ok",
                            }
                        )
                cell += 1
    return pd.DataFrame(scores), pd.DataFrame(cells)


NAMES = {part: f"m_{part}" for part in MEANS}
WAGON, BOGIE = "two axle wagon, axle", "metro irw bogie, carried"


def seen(change: Change = lambda place, part: 1.0, *, without: str = "", draws: int = 20) -> Places:
    names = {part: name for part, name in NAMES.items() if part != without}
    places = places_of(*planted(change, draws=draws), names)
    assert places is not None
    return places


def verdicts(places: Places) -> dict[str, Claim]:
    return {claim.key: claim for claim in judged(PAPER, places, judges, has=places.has)}


def only(part: str, factor: float, where: str = "") -> Change:
    """Change the error of one part, in one place or in all."""
    return lambda place, name: factor if name == part and where in place else 1.0


@lru_cache
def right() -> dict[str, Claim]:
    return verdicts(seen())


def test_all_claims_hold_where_the_paper_is_right() -> None:
    assert {key: claim.verdict for key, claim in right().items()} == dict.fromkeys(right(), "reproduced")


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("found", only("zero", 0.5, WAGON)),
        ("gyro", only("gyro", 1.45, WAGON)),
        ("gyro", only("no_gyro", 0.7, BOGIE)),
        ("chord", only("deviation", 0.9, WAGON)),
        ("zeros", only("zeros", 1.2, BOGIE)),
        ("delay", only("printed", 1.2, BOGIE)),
    ],
)
def test_each_claim_falls_alone(key: str, change: Change) -> None:
    fallen = {name for name, claim in verdicts(seen(change)).items() if claim.verdict == "not reproduced"}
    assert key in fallen
    # What changes the paper's filter changes what is set beside it.
    beside = {"chord", "gyro"} if key in ("found", "gyro") else set()
    assert fallen <= {key} | beside


def test_a_gain_that_chance_explains_is_none() -> None:
    """A gyro that changes nothing: the interval holds 0, and the words say where."""
    claim = verdicts(seen(only("no_gyro", 0.25 / 0.35, WAGON)))["gyro"]
    assert claim.verdict == "not reproduced"
    assert "cannot be told to help" in claim.cause and WAGON in claim.cause and BOGIE not in claim.cause
    harm = verdicts(seen(only("no_gyro", 0.5, WAGON)))["gyro"]
    assert "does harm" in harm.cause


def test_changes_are_paired_and_clustered() -> None:
    """The rails differ by 30 % from draw to draw, the methods by 3 %: pairs know the gain to a per cent."""
    places = seen()
    change = places.changes("gyro", "no_gyro")[WAGON]
    exact = 100.0 * (0.25 / 0.35 - 1.0)
    assert change.low < exact < change.high
    # Two rides of chance sqrt(2) 3 % in each of 20 draws.
    assert 0.5 * (change.high - change.low) < 3.0 * 71.4 * 0.03 / np.sqrt(20.0)
    unpaired = places.mean("gyro", WAGON)
    assert unpaired.high - unpaired.low > 0.1 * unpaired.value


def test_what_was_not_run_is_not_asked() -> None:
    claims = verdicts(seen(without="deviation"))
    assert claims["chord"].verdict == "not asked"
    assert claims["gyro"].verdict == "reproduced"
    assert places_of(*planted(), {}) is None


def test_notes_tell_what_errata_cost_and_where_ours_does_not_win() -> None:
    told = " ".join(judges.notes(seen(only("own", 2.0, WAGON))))
    assert "does not win everywhere" in told and f"in {WAGON} its error is" in told
    assert f"in {BOGIE} its error is" not in told
    wins = " ".join(judges.notes(seen()))
    assert "does not win" not in wins
    assert re.search(rf"changes by -(19|20|21) % .* in {WAGON}; -(19|20|21) % .* in {BOGIE}\.", wins)
    assert re.search(rf"newest|oldest node.*{WAGON} \+(19|20|21) %", wins)  # 0.30 / 0.25


def test_the_section_has_a_row_for_every_part() -> None:
    scores, cells = planted()
    played = [
        SimpleNamespace(name=name, part=SimpleNamespace(stands_for=part)) for part, name in NAMES.items()
    ]
    (made,) = section(SimpleNamespace(scores=scores, cells=cells, methods=played, styles=[], examples=[]))
    table = made.data["table"]
    assert [row.label for row in table.rows] == [role.label for role in PAPER.parts.values()]
    assert [words for words, _ in table.groups] == [WAGON, BOGIE] and made.data["draws"] == 20
    gyro = table.rows[0].cells[0]
    low, high = map(float, gyro.spread.split(" to "))
    assert low < float(gyro.text) < high


def test_an_ideal_device_claims_nothing() -> None:
    scores, cells = planted()
    assert places_of(scores.assign(imu="ideal"), cells, NAMES) is None


def test_the_scenario_plays_every_part() -> None:
    scenario = load_scenario("vertical_profile")
    assert scenario.spec.paper == "hidalgo"
    assert set(PAPER.names(methods(scenario))) == set(PAPER.parts)
    assert scenario.spec.monte_carlo.samples >= 20
