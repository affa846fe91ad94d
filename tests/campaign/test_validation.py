"""The validation campaign: what it holds, and its reduced form against the table that is kept of it."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.campaign import run_campaign
from simrail.scenario.cells import count, first_cells
from simrail.scenario.scenario import load_scenario

pytestmark = pytest.mark.usefixtures("own_cache")

RELATIVE = 1e-4
"""What other releases of compilers and libraries may change: their rounding, some 1e-16, grows in contact
and filters to less than 1e-9, and imufusion counts in single precision, 1e-7. A method that changes shows."""

ABSOLUTE = 1e-6
"""Degrees; below it nobody cares."""

TWO = [
    "ride.speed_kmh=40.0",
    "ride.reverse=true",
    "irregularity.scale=1.0",
    "monte_carlo.track_draws=1",
    "monte_carlo.sensor_draws=1",
    "imu.grade=['ideal', 'consumer']",
]
"""Settings that leave two cells: one ride, backward, with two of the four grades."""


@pytest.fixture(scope="module")
def made() -> ModuleType:
    path = Path(__file__).parents[2] / "results" / "reference" / "make.py"
    spec = importlib.util.spec_from_file_location("reference_make", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def differing(found: pd.DataFrame, kept: pd.DataFrame, made: ModuleType) -> pd.DataFrame:
    """Rows of a run that the kept table lacks, or whose figures differ by more than is allowed."""
    both = found.merge(kept, on=made.KEYS, how="left", suffixes=("", "_kept"), indicator=True)
    bad = both["_merge"] != "both"
    for name in made.FIGURES:
        new, old = both[name].to_numpy(), both[f"{name}_kept"].to_numpy()
        bad |= ~np.isclose(new, old, rtol=RELATIVE, atol=ABSOLUTE, equal_nan=True)
    return both[bad]


def test_the_campaign_has_the_axes_that_it_claims() -> None:
    scenario = load_scenario("validation")
    assert count(scenario) == (3 * 2 * 3 * 10, 3 * 2 * 3 * 4 * 10 * 20)
    listed = list(first_cells(scenario))
    assert len(listed) == 3 * 2 * 3 * 4
    assert (
        len({cell.ride.speed_kmh for cell in listed}) == len({cell.ride.start_m for cell in listed}) + 1 == 3
    )
    assert len({cell.imu.grade for cell in listed}) == 4
    assert scenario.spec.score.windows and scenario.spec.score.metrics  # it says what it keeps
    quick = load_scenario("validation_quick")
    assert [part.name for part in quick.spec.estimator] == [part.name for part in scenario.spec.estimator]
    assert {cell.imu.grade for cell in first_cells(quick)} == {cell.imu.grade for cell in listed}


def test_the_kept_table_is_whole(made: ModuleType) -> None:
    kept = pd.read_csv(made.TABLE)
    scenario = load_scenario(made.SCENARIO)
    methods = [part.name for part in scenario.spec.estimator]
    assert list(kept.columns) == [*made.KEYS, *made.FIGURES]
    assert len(kept) == count(scenario)[1] * len(methods) and not kept[made.KEYS].duplicated().any()
    assert set(kept["estimator"]) == set(methods)
    for name in ("roll", "roll_in_curves", "pitch", "yaw_debiased"):
        assert np.isfinite(kept[name]).all()


def test_two_cells_are_those_of_the_kept_table(made: ModuleType) -> None:
    kept = pd.read_csv(made.TABLE)
    result = run_campaign(load_scenario(made.SCENARIO, overrides=TWO))
    assert len(result.cells) == 2 and not result.failures
    # Lists of one value are no axes, hence no columns.
    cells = result.cells.assign(**{"irregularity.scale": 1.0, "direction": "backward"})
    found = made.table_of(replace(result, cells=cells))
    assert len(found) == 2 * 9
    different = differing(found, kept, made)
    assert different.empty, different.to_string()
    # A method that changed by a thousandth is seen, and so is another draw.
    assert len(differing(found.assign(roll=found["roll"] * 1.001), kept, made)) == len(found)
    assert len(differing(found.assign(sensor_draw=1), kept, made)) > 0.8 * len(found)


@pytest.mark.slow
def test_every_cell_is_that_of_the_kept_table(made: ModuleType) -> None:
    kept = pd.read_csv(made.TABLE)
    found = made.table_of(run_campaign(load_scenario(made.SCENARIO)))
    different = differing(found, kept, made)
    assert len(found) == len(kept) and different.empty, different.to_string()
