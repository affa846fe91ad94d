"""``[second_imu]`` of a scenario: recorded with each IMU, its clock a draw, and judged before a run."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.cell import record_cell
from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.recording.recording import Recording
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, read_scenario

QUICK = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
SHORT = ["ride.end_m=60.0", "ride.rest_s=3.0"]

SECOND = """
[second_imu]
body = "frame"
position_m = [-7.0, 0.0, 0.4]
"""


def read(second: str = SECOND, *changes: str) -> Scenario:
    return read_scenario(QUICK + second, name="quick", overrides=[*SHORT, *changes])


def recordings(scenario: Scenario) -> list[Recording]:
    parts, listed = Parts(scenario), list(cells(scenario))
    truth = simulate(parts.ride(listed[0]))
    return [record_cell(cell, truth, parts) for cell in listed]


def test_it_is_recorded_with_each_imu_and_changes_nothing_else() -> None:
    with_two, alone = recordings(read()), recordings(read(""))
    assert [one.imu_sheet.grade for one in with_two] == ["lord_3dm_gx4_25"] * 2 + ["ideal"] * 2
    for one, other in zip(with_two, alone, strict=True):
        pd.testing.assert_frame_equal(one.imu, other.imu, check_exact=True)
        assert other.second_imu is None and other.second_imu_sheet is None
        assert one.second_imu is not None and one.second_imu_sheet is not None
        assert one.second_imu_sheet.imu.grade == one.imu_sheet.grade  # that beside it
        assert one.second_imu_sheet.mount_body == "frame"
        assert 5.0 < one.second_imu_sheet.spacing_m < 10.0
        assert list(one.second_imu) == list(one.imu)
        # Noise of its own: over the same rest hardly a sample is alike.
        if one.imu_sheet.grade != "ideal":
            first, second = (f.to_numpy()[100:600, 0] for f in (one.imu, one.second_imu))
            assert abs(np.corrcoef(first, second)[0, 1]) < 0.2  # 4 / sqrt(500)


def test_the_spacing_that_is_told_errs_as_a_tape_does() -> None:
    """By a draw of what its sd says: 15 cm of a spacing that is known to nobody better."""
    told = SECOND + "clock_offset_sd_s = 0.05\nspacing_sd_m = "
    made = [recordings(read(f"{told}{sd}\n")) for sd in (1e-9, 0.15)]
    exact, vague = ([one.second_imu_sheet.spacing_m for one in of_sd] for of_sd in made)  # type: ignore[union-attr]
    off = np.array(vague) - np.array(exact)
    assert np.ptp(exact) < 1e-6 and (np.abs(off) > 1e-3).all() and (np.abs(off) < 0.6).all()
    assert off[0] != off[1]
    # Not the draw of the clock.
    ahead = np.array([one.second_imu.index[0] - one.imu.index[0] for one in made[1]])  # type: ignore[union-attr]
    assert (np.abs(off / 0.15 - ahead / 0.05) > 1e-3).all()


def test_the_clock_offset_is_drawn_or_told() -> None:
    drawn = [one.second_imu.index[0] - one.imu.index[0] for one in recordings(read())]  # type: ignore[union-attr]
    assert drawn[0] != drawn[1] and max(map(abs, drawn)) < 0.1
    assert drawn[:2] == drawn[2:]  # the same draw of another grade
    told = recordings(read(SECOND + "clock_offset_s = -0.25\n"))
    for one in told:
        assert one.second_imu is not None
        assert one.second_imu.index[0] - one.imu.index[0] == pytest.approx(-0.25, abs=1e-12)


@pytest.mark.parametrize(
    ("changed", "field", "words"),
    [
        (SECOND.replace('"frame"', '"tender"'), "second_imu.body", "no such body"),
        (SECOND.replace("-7.0", "-2.0"), "second_imu.spacing_m", "too near to the first IMU"),
        (SECOND + 'name = "axle"\n', "second_imu.name", "is the name of an"),
        (SECOND + 'grade = "tactical_104"\n', "second_imu.grade", "grade"),
        (SECOND + "clock_offset_sd_s = 0.0\n", "second_imu.clock_offset_sd_s", "is out of range"),
        (SECOND + "offset_s = 1.0\n", "second_imu.offset_s", "unknown key"),
    ],
    ids=["body", "near", "name", "grade", "range", "key"],
)
def test_what_cannot_be_is_one_line(changed: str, field: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        judge_scenario(read(changed))
    assert field in str(caught.value) and "\n" not in str(caught.value)


def test_rates_that_differ_are_refused(tmp_path) -> None:
    slow = shipped("imu")["lord_3dm_gx4_25"].read_text(encoding="utf-8").replace("250.0", "125.0", 1)
    (tmp_path / "slow.toml").write_text(slow, encoding="utf-8")
    text = QUICK + SECOND + 'grade = "./slow.toml"\n'
    scenario = read_scenario(text, name="quick", folder=tmp_path, overrides=SHORT)
    with pytest.raises(InputError, match="another rate than the first IMU") as caught:
        judge_scenario(scenario)
    assert "125 Hz" in str(caught.value) and "250 Hz" in str(caught.value)


def test_a_receiver_is_recorded_hidden_by_place_and_asked_for() -> None:
    text = "\n[gnss]\nrate_hz = 2.0\nreacquire_s = 0.0\n[[gnss.outage]]\nfrom_m = 20.0\nto_m = 40.0\n"
    one, *_ = recordings(read(text))
    assert one.gnss is not None and one.gnss_sheet is not None
    place = one.gnss["position_m"]
    assert place.isna().any() and one.gnss_sheet.rate_hz == 2.0
    method = (
        '\n[[estimator]]\nname = "own"\nmethod = "TrackRelativeSmoother"\n[estimator.options]\ngnss = true\n'
    )
    judge_scenario(read(text + method))
    with pytest.raises(InputError, match="no gnss") as caught:
        judge_scenario(read(method))
    assert "[gnss]" in str(caught.value) and "gnss = false" in str(caught.value)
    with pytest.raises(InputError, match="no length") as caught:
        judge_scenario(read(text.replace("to_m = 40.0", "to_m = 20.0")))
    assert "gnss.outage[0].to_m" in str(caught.value)


def test_a_method_that_needs_it_is_refused_without() -> None:
    method = '\n[[estimator]]\nname = "delay"\nmethod = "BogieDelayOdometry"\n'
    with pytest.raises(InputError, match="no second imu") as caught:
        judge_scenario(read(method))
    assert "[second_imu]" in str(caught.value)
    judge_scenario(read(SECOND + method))
