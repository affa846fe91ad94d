"""The first section of a page with requirements: what stands first, and what a reader finds behind it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from simrail.report.campaign.verdicts import decision_chart, groups_of, overview, verdict_tiles
from simrail.report.tables.methods import MethodStyle
from simrail.report.words.verdicts import best_method, devices_words, verdict_sentence
from simrail.scoring.requirement import Requirement
from simrail.scoring.verdicts import DEVICE

WANTED = Requirement("roll", 0.1)


def style(name: str, *, uses_imu: bool = True) -> MethodStyle:
    return MethodStyle(name, name, "" if uses_imu else "no IMU", uses_imu, "", None, "#000000", "-")


STYLES = [style("good"), style("poor"), style("design", uses_imu=False)]


def verdicts(**of_imu: tuple[str, float]) -> pd.DataFrame:
    """Verdicts at two mounts: of the good method as told, of the poor one never enough."""
    rows = []
    for mount in ("axle", "body"):
        for imu, (verdict, share) in of_imu.items():
            common = {"requirement": WANTED.words, "number": 0, "vehicle": "car", "mount": mount, "imu": imu}
            common |= {"odometry": "truth", "map": "drawn", "vibration": "on", "tuning": "default"}
            common |= {"devices": 60, "tracks": 60, "effective": 60.0, "unit": "deg", "reason": ""}
            common |= {"low95": share - 0.05, "high95": min(share + 0.05, 1.0), "median": 0.05}
            for method, told, own in (
                ("good", verdict, share),
                ("poor", "not enough", 0.2),
                ("design", "enough", 1.0),
            ):
                rows.append(
                    common
                    | {
                        "estimator": method,
                        "verdict": told,
                        "share": own,
                        "passed": round(60 * own),
                        "at_share": 0.1,
                    }
                )
    return pd.DataFrame(rows)


TABLE = verdicts(fine=("enough", 1.0), coarse=("not enough", 0.5), other=("not enough draws", 0.93))


def test_the_sentence_is_of_the_method_under_test_that_is_best() -> None:
    """A baseline without an IMU, good as it may be, buys nobody an IMU."""
    own = TABLE[TABLE["mount"] == "axle"]
    best = best_method(own, STYLES)
    assert best is not None and best.name == "good"
    told = verdict_sentence(own, STYLES)
    assert told.endswith("on the axle with good: enough: fine; not enough: coarse; open: other.")
    assert devices_words(own) == "60 devices each, on 60 tracks"


def test_the_overview_has_a_cell_for_each_grade_and_mount() -> None:
    shown = overview(TABLE, STYLES)
    assert shown["mounts"] == ["axle", "body"]
    assert [span for _, span in shown["heads"]] == [2]
    assert shown["sentence"].endswith("1 of 3 on the axle, 1 of 3 on the body.")
    rows = dict(shown["rows"])
    assert [cell["percent"] for cell in rows["coarse"]] == ["50", "50"]
    assert {cell["mark"] for cell in rows["fine"]} == {"\u2713"}


def test_the_chart_has_a_stroke_for_each_device_and_the_limit() -> None:
    own = TABLE[TABLE["mount"] == "axle"]
    values = np.linspace(0.01, 0.2, 60)
    devices = pd.DataFrame(
        [
            {"imu": imu, "estimator": name, "value": value} | dict.fromkeys(DEVICE, 0)
            for imu in ("fine", "coarse", "other")
            for name in ("good", "poor")
            for value in values
        ]
    )
    svg = decision_chart(own, devices, WANTED, STYLES)
    assert "limit" in svg and "100 %" in svg and "50 %" in svg and "enough: fine" in svg
    assert decision_chart(own, devices.iloc[:0], WANTED, STYLES) == ""


@pytest.mark.parametrize("verdict", ["enough", "not enough"])
def test_a_verdict_can_fall(verdict: str) -> None:
    own = verdicts(one=(verdict, 0.97))
    assert f": {verdict}: one." in verdict_sentence(own[own["mount"] == "axle"], STYLES)


def test_the_tiles_say_how_many_are_enough_and_whether_no_imu_beats_them() -> None:
    enough, best, without = verdict_tiles(groups_of(TABLE), STYLES, [WANTED])
    assert (enough.value, enough.note) == ("1 of 3", "on the axle, with good")
    assert best.value == "0.100\u00b0" and "asked are 0.1\u00b0" in best.note
    assert without.value == "0.100\u00b0" and "beats" not in without.note
    better = TABLE.assign(at_share=TABLE["at_share"].where(TABLE["estimator"] != "design", 0.02))
    *_, without = verdict_tiles(groups_of(better), STYLES, [WANTED])
    assert without.note == "beats every IMU"
