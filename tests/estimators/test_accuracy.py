"""What compensation is for: roll in curves, on irregular rails, with the paper's IMU and an encoder.

Plain tests let the kinematic engine move the axle along the rails: the truth is exact and the ride cheap.
The slow test judges the simulated bogie, with the limits that the project promises.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from simrail.estimators.attitude.ekf import AttitudeEkf
from simrail.estimators.attitude.gda import AttitudeGda

from simrail.estimation.estimate import Estimator
from simrail.track.design import CURVE

ESTIMATORS: dict[tuple[str, bool], Estimator] = {
    ("ekf", True): AttitudeEkf(),
    ("ekf", False): AttitudeEkf(compensated=False),
    ("gda", True): AttitudeGda(),
    ("gda", False): AttitudeGda(compensated=False),
}
PROMISED = {70.0: 4.0, 20.0: 3.0}


def roll_errors_in_curves(
    speed_kmh: float, direction: int, *, draws: int, record: Callable, motion: Callable
) -> dict[tuple[str, bool], float]:
    """Mean over draws of the rms roll error against the truth, deg, by method and compensation."""
    errors: dict[tuple[str, bool], list[float]] = {key: [] for key in ESTIMATORS}
    for draw in range(draws):
        recording = record(speed_kmh, direction, draw)
        true = motion(speed_kmh, direction).loc[recording.imu.index]
        in_curve = recording.track.kind(true["position_m"].to_numpy()) == CURVE
        for key, estimator in ESTIMATORS.items():
            error = (estimator.estimate(recording).states["roll_rad"] - true["roll_rad"]).to_numpy()
            errors[key].append(np.degrees(np.sqrt(np.mean(error[in_curve] ** 2))))
    return {key: float(np.mean(values)) for key, values in errors.items()}


def judge(speed_kmh: float, draws: int, record: Callable, motion: Callable) -> None:
    """Uncompensated over compensated as promised, each way, and both ways alike."""
    forward, backward = (
        roll_errors_in_curves(speed_kmh, direction, draws=draws, record=record, motion=motion)
        for direction in (1, -1)
    )
    for method in ("ekf", "gda"):
        for way in (forward, backward):
            assert way[method, False] / way[method, True] > PROMISED[speed_kmh], (method, forward, backward)
        assert abs(forward[method, True] - backward[method, True]) < 0.03, (method, forward, backward)


def test_compensation_pays_at_70(line_recording: Callable, line_true_motion: Callable) -> None:
    judge(70.0, 2, line_recording, line_true_motion)


@pytest.mark.slow
@pytest.mark.parametrize("speed_kmh", list(PROMISED))
def test_compensation_pays_on_the_simulated_bogie(
    speed_kmh: float, bogie_recording: Callable, bogie_true_motion: Callable
) -> None:
    judge(speed_kmh, 20, bogie_recording, bogie_true_motion)


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
