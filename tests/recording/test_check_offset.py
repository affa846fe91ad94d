"""A gyro that shows at rest more than its sheet allows is told, whatever took it there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrail.core.columns import GYRO
from simrail.recording.check_offset import EARTH_RADPS, SETTLES_RAD, offset_warnings
from simrail.recording.recording import Recording
from tests.shared.noisy_ride import RATE, TIME, ride, way_of_speed

BIAS = 1e-3
STARTS_S = 15.0


def shown(offset: float, axis: int = 2, bias: float = BIAS) -> Recording:
    """Stands for 15 s, then goes; a gyro of a hundredth of the noise, with an offset on one axis."""
    sound = ride(way_of_speed(np.clip(TIME - STARTS_S, 0.0, 10.0)))
    sheet = replace(sound.imu_sheet, gyro_turn_on_bias_radps=bias, gyro_noise_radpsqrts=1e-5)
    gyro = {name: 0.01 * sound.imu[name] + offset * (name == GYRO[axis]) for name in GYRO}
    return replace(sound, imu=sound.imu.assign(**gyro), imu_sheet=sheet)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_offset_is_told_from_where_its_sheet_and_a_body_that_settles_end(axis: int) -> None:
    """By hand: the bias of the sheet, the Earth, .01 rad over a rest of 13 to 15 s; noise of 2e-6 rad/s."""
    least, most = (BIAS + EARTH_RADPS + SETTLES_RAD / lasts for lasts in (STARTS_S, STARTS_S - 2.0))
    assert offset_warnings(shown(0.97 * least, axis)) == ()
    (told,) = offset_warnings(shown(-1.03 * most, axis))
    assert f"imu.gyro: {'XYZ'[axis]} shows -0.11 deg/s at rest" in told and "0.057 deg/s at most" in told


def test_a_mean_that_was_taken_off_is_told_by_what_is_left_at_rest() -> None:
    """A curve of .05 rad/s for 10 of 40 s."""
    whole = shown(0.0)
    turned = whole.imu[GYRO[2]] + 0.05 * ((TIME > 20.0) & (TIME < 30.0))
    assert offset_warnings(replace(whole, imu=whole.imu.assign(**{GYRO[2]: turned}))) == ()
    cut = whole.imu.assign(**{GYRO[2]: turned - turned.mean()})
    (told,) = offset_warnings(replace(whole, imu=cut))
    assert "Z shows -0.7" in told and "mean of the ride" in told


def test_a_sheet_without_a_bias_and_a_ride_without_a_rest_say_nothing() -> None:
    assert offset_warnings(shown(0.05, bias=0.0)) == ()
    moving = replace(shown(0.05), encoder=ride(way_of_speed(4.0 + 0.3 * TIME)).encoder)
    assert len(moving.imu) > RATE * STARTS_S and offset_warnings(moving) == ()
