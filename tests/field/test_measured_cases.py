"""Irregularity as a measuring car exports it: laid as it is, with what it holds and does not hold told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, read_scenario

CASE = Path(__file__).parent / "cases" / "34-measured-irregularity"
RIDE = (CASE / "ride.toml").read_text(encoding="utf-8")
BY_NAME = 'spectrum = "./TG_run12.csv"'
EXPORT = pd.read_csv(CASE / "TG_run12.csv", sep=";", decimal=",")


def scenario(text: str = RIDE, folder: Path = CASE) -> Scenario:
    return read_scenario(text, name="ride", folder=folder)


def laid(given: Scenario, s: np.ndarray) -> pd.DataFrame:
    parts = Parts(given)
    return parts.rails(next(cells(given))).irregularities(s)


def test_the_file_is_laid_as_the_deviation_of_the_rails() -> None:
    # Behind the fade of 40 m at either end of the 150 m that the file has.
    inside = (EXPORT["Meter"] > 41.0) & (EXPORT["Meter"] < 109.0)
    rows = EXPORT[inside]
    found = laid(scenario(), rows["Meter"].to_numpy())
    mm = {
        "alignment_m": 0.5 * (rows["AL_L_D1 [mm]"] + rows["AL_R_D1 [mm]"]),
        "vertical_profile_m": 0.5 * (rows["LL_L_D1 [mm]"] + rows["LL_R_D1 [mm]"]),
        "cross_level_m": rows["CrossLevel [mm]"],
        "gauge_m": rows["Gauge [mm]"] - 1435.0,
    }
    assert set(mm) == set(IRREGULARITY)
    for name, values in mm.items():
        np.testing.assert_allclose(found[name], 1e-3 * values, atol=1e-9)
    assert not laid(scenario(), np.linspace(152.0, 590.0, 50)).abs().to_numpy().max() > 1e-12


def test_what_it_holds_is_told() -> None:
    notes = "\n".join(judge_scenario(scenario()).notes)
    for words in (
        "LL_L_D1 [mm] is left level",
        "columns not used: Twist3m [mm/m], Speed [km/h]",
        "1435 mm are taken off",
        "lies from 0 to 149.75 m, samples 0.25 m apart",
        "it holds waves of D1, 3 to 25 m: others are not in these rails, and nothing is claimed of them",
    ):
        assert words in notes


def test_a_table_of_its_own_says_place_and_band() -> None:
    table = '[irregularity.measured]\nfile = "./TG_run12.csv"\nstart_m = 200.0\npartial = true\n'
    text = RIDE.replace(BY_NAME, "").replace("[[ride]]", table + "band = [5.0, 20.0]\n[[ride]]", 1)
    at_200 = laid(scenario(text), np.array([260.0]))["cross_level_m"].iloc[0]
    assert at_200 == pytest.approx(1e-3 * EXPORT.loc[EXPORT["Meter"] == 60.0, "CrossLevel [mm]"].iloc[0])
    assert "it holds waves of 5 to 20 m" in "\n".join(judge_scenario(scenario(text)).notes)


@pytest.mark.parametrize(
    ("name", "names"),
    [
        ("words", ["Position [m]", "Longitudinal Level Left (mm)", "longitudinal_level_right (mm)"]),
        ("suffixes", ["distance_m", "left_profile_mm", "right_profile_mm"]),
        ("letters", ["Chainage [km]", "LL L [mm]", "LL R [mm]"]),
    ],
)
def test_names_that_other_exports_have(tmp_path: Path, name: str, names: list[str]) -> None:
    scale = 1e-3 if "[km]" in names[0] else 1.0
    columns = [EXPORT["Meter"] * scale, EXPORT["LL_L_D1 [mm]"], EXPORT["LL_R_D1 [mm]"]]
    frame = pd.DataFrame(dict(zip(names, columns, strict=True)))
    frame.to_csv(tmp_path / "TG_run12.csv", index=False)
    s = np.arange(45.0, 100.0, 0.5)
    other, own = laid(scenario(folder=tmp_path), s), laid(scenario(), s)
    np.testing.assert_allclose(other["vertical_profile_m"], own["vertical_profile_m"], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (RIDE.replace("TG_run12", "TG_run13"), "no such file"),
        (RIDE.replace("[irregularity]", '[irregularity]\nfile = "x.csv"'), "[irregularity.measured] file"),
        (
            RIDE.replace(
                "[[ride]]",
                '[irregularity.measured]\nfile = "TG_run12.csv"\nband = [9.0, 3.0]\n[[ride]]',
                1,
            ),
            "is not (shortest, longest)",
        ),
        (
            RIDE.replace("[[ride]]", '[irregularity.measured]\nfile = "TG_run12.csv"\n[[ride]]', 1),
            "keep one of them",
        ),
        (RIDE.replace("wavelengths_m = [1.5", "wavelengths_m = [0.9"), "too far apart for the shortest"),
    ],
)
def test_one_message_says_what_is_wrong(text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        judge_scenario(scenario(text))
    assert says in str(caught.value)


def test_a_file_without_known_names_asks_for_columns(tmp_path: Path) -> None:
    (tmp_path / "TG_run12.csv").write_text("a,b\n1,2\n2,3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"columns: no place or no quantity is known by its name"):
        judge_scenario(scenario(folder=tmp_path))
