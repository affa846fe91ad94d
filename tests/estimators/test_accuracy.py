"""What compensation is for: roll in curves, on irregular rails, with the paper's IMU and an encoder.

The kinematic engine moves the axle along the rails exactly, so the truth is exact and the ride is cheap.
The limits are those that the project promises for the simulated bogie.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimators.attitude_ekf import AttitudeEkf
from estimators.attitude_gda import AttitudeGda
from simrail.estimate import Estimator
from simrail.track.design import CURVE

METHODS: dict[str, Callable[[bool], Estimator]] = {
    "ekf": lambda compensated: AttitudeEkf(compensated=compensated),
    "gda": lambda compensated: AttitudeGda(compensated=compensated),
}
PROMISED = {70.0: 4.0, 20.0: 3.0}


def roll_error_in_curves(
    estimator: Estimator, *, speed_kmh: float, direction: int, draws: int, record: Callable, motion: Callable
) -> float:
    """Mean over draws of the rms roll error against the truth, deg."""
    errors = []
    for draw in range(draws):
        recording = record(speed_kmh, direction, draw)
        true = motion(speed_kmh, direction).loc[recording.imu.index]
        in_curve = recording.track.kind(true["position_m"].to_numpy()) == CURVE
        error = (estimator.estimate(recording).states["roll_rad"] - true["roll_rad"]).to_numpy()
        errors.append(np.degrees(np.sqrt(np.mean(error[in_curve] ** 2))))
    return float(np.mean(errors))


def judge(method: str, speed_kmh: float, draws: int, record: Callable, motion: Callable) -> None:
    compensated: dict[int, float] = {}
    for direction in (1, -1):

        def rms(with_track: bool, direction: int = direction) -> float:
            return roll_error_in_curves(
                METHODS[method](with_track),
                speed_kmh=speed_kmh,
                direction=direction,
                draws=draws,
                record=record,
                motion=motion,
            )

        compensated[direction] = rms(True)
        assert rms(False) / compensated[direction] > PROMISED[speed_kmh]
    assert abs(compensated[1] - compensated[-1]) < 0.03


@pytest.mark.parametrize("method", list(METHODS))
def test_compensation_pays_at_70(method: str, line_recording: Callable, line_true_motion: Callable) -> None:
    judge(method, 70.0, 2, line_recording, line_true_motion)


@pytest.mark.slow
@pytest.mark.parametrize("speed_kmh", list(PROMISED))
@pytest.mark.parametrize("method", list(METHODS))
def test_compensation_pays_over_20_draws(
    method: str, speed_kmh: float, line_recording: Callable, line_true_motion: Callable
) -> None:
    judge(method, speed_kmh, 20, line_recording, line_true_motion)


def test_stated_sd_covers_the_error_in_roll(line_recording: Callable, line_true_motion: Callable) -> None:
    """Over draws the roll error of the whole ride is within 1.96 stated sds for most of the time.

    The accelerometer's bias is uniform and one per draw, so that its largest value, 1.73 sds, is inside.
    """
    inside = []
    for draw in range(4):
        recording = line_recording(70.0, 1, draw)
        true = line_true_motion(70.0, 1).loc[recording.imu.index]
        states = AttitudeEkf().estimate(recording).states
        inside.append(np.mean(np.abs(states["roll_rad"] - true["roll_rad"]) < 1.96 * states["roll_sd_rad"]))
    assert 0.8 < np.mean(inside) <= 1.0
