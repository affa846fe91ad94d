"""The table of `simrail run which_imu`: whole in itself, as README prints it, as its cells give it again."""

from __future__ import annotations

import importlib.util
import math
import re
from pathlib import Path
from types import ModuleType

import pandas as pd
import pytest

from simrail.scenario.requirements import requirements_of
from simrail.scenario.scenario import load_scenario
from simrail.scoring.share import decide, wilson

ROOT = Path(__file__).parents[1]
REFERENCE = ROOT / "results" / "reference"


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return pd.read_csv(REFERENCE / "which_imu.csv")


def share_in(readme: str, words: str) -> float:
    """The share of devices that README has before these words."""
    (percent,) = re.findall(rf"([\d.]+) %\s+of\s+the\s+{words}", readme)
    return float(percent) / 100.0


def test_readme_prints_what_the_table_says(table: pd.DataFrame) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    roll = table[table["requirement"].str.startswith("roll") & (table["mount"] == "axle")]
    ekf = roll[roll["estimator"] == "ekf"].set_index("imu")["share"]
    assert share_in(readme, "consumer devices") == pytest.approx(ekf["consumer"], abs=5e-3)
    assert share_in(readme, "LORD's") == pytest.approx(ekf["lord_3dm_gx4_25"], abs=5e-3)
    assert "every grade passes" in " ".join(readme.split())
    ours = table[table["requirement"].str.startswith("roll") & (table["estimator"] == "track_relative")]
    assert (ours["passed"] == ours["devices"]).all() and set(ours["verdict"]) == {"enough"}


def test_each_row_follows_from_its_own_counts(table: pd.DataFrame) -> None:
    spec = load_scenario("which_imu").spec
    asked = {wanted.words: wanted for wanted in requirements_of(spec)}
    assert set(table["requirement"]) == set(asked)
    grades = {(imu.name, grade) for imu in spec.imu for grade in imu.grade}
    for _, own in table.groupby(["requirement", "estimator"]):
        assert set(zip(own["mount"], own["imu"], strict=True)) == grades and len(own) == len(grades)
    for row in table.itertuples():
        wanted = asked[row.requirement]
        assert row.devices == spec.monte_carlo.track_draws == row.tracks
        low, high = wilson(row.passed, row.devices)
        assert row.share == pytest.approx(row.passed / row.devices, rel=1e-3)
        assert (row.low95, row.high95) == pytest.approx((low, high), rel=1e-3, abs=1e-9)
        assert row.verdict == decide(row.passed, row.devices, wanted.share, chance=wanted.chance)
        # By definition: so many are below, and so many more are not. The quantile is that of a device.
        assert (row.median <= wanted.limit) == (
            2 * row.passed >= row.devices
        ) or 2 * row.passed == row.devices
        quantile_of = math.ceil(wanted.share * (row.devices - 1))
        assert (row.at_share <= wanted.limit) == (row.passed > quantile_of)


def which_imu() -> ModuleType:
    spec = importlib.util.spec_from_file_location("which_imu", REFERENCE / "which_imu.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_cells_of_the_table_have_the_figures_that_they_had() -> None:
    """Run by themselves; where they have changed, the table is of another time: run the scenario again."""
    module = which_imu()
    kept = pd.read_csv(module.CELLS)
    found = module.sample_figures()
    keys = ["cell", "mount", "imu", "estimator", "quantity", "unit"]
    assert found[keys].astype(str).equals(kept[keys].astype(str))
    # Another processor rounds otherwise, which wheel and rail make more of.
    pd.testing.assert_series_equal(found["value"], kept["value"], rtol=1e-6)
