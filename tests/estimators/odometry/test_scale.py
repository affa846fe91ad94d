"""What is in metres of a full-size line, on a model track; full size keeps its numbers to the bit."""

from types import SimpleNamespace
from typing import Any

import pytest
from simrail.estimators.odometry.curve_matched import CurveMatchedOdometry
from simrail.estimators.odometry.pointing import ON_BOGIES
from simrail.estimators.odometry.scale import scale_of
from simrail.estimators.track_relative.model import STANDS_MPS, stands_mps


def on_base(base_m: float) -> Any:
    return SimpleNamespace(track=SimpleNamespace(rail_base_m=base_m))


@pytest.mark.parametrize(
    ("base_m", "scale"), [(1.5, 1.0), (1.06, 1.0), (1.74, 1.0), (0.15, 0.1), (0.1335, 0.089)]
)
def test_gauges_of_full_size_are_one_scale(base_m: float, scale: float) -> None:
    assert scale_of(on_base(base_m)) == pytest.approx(scale, rel=1e-12)


def test_full_size_keeps_its_numbers() -> None:
    assert CurveMatchedOdometry().at_scale(1.0) == CurveMatchedOdometry()
    assert ON_BOGIES.at_scale(1.0) is ON_BOGIES
    assert stands_mps(on_base(1.5)) == STANDS_MPS


def test_lengths_of_a_model_are_shorter_and_its_angles_are_not() -> None:
    model, full = CurveMatchedOdometry().at_scale(0.1), CurveMatchedOdometry()
    assert model.start_sd_m == pytest.approx(0.1 * full.start_sd_m)
    assert model.tread_length_m == pytest.approx(0.1 * full.tread_length_m)
    assert (model.tread_sd, model.flange_sd) == (full.tread_sd, full.flange_sd)
    pointing = ON_BOGIES.at_scale(0.1)
    assert pointing.lag_sd_m == pytest.approx(0.1 * ON_BOGIES.lag_sd_m)
    assert pointing.turn_sd_rad == ON_BOGIES.turn_sd_rad
    # 1 m/s of a 1:10 car is 3.2 m/s of a full-size one: it does not stand.
    assert stands_mps(on_base(0.15)) == pytest.approx(0.316, abs=1e-3)
