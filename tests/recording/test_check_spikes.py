"""Single samples that no device behind a filter can have measured are told; blows that it can are not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import bessel, butter, lfilter

from simrail.core.columns import ACCEL, GYRO
from simrail.recording.check_spikes import FILTERED, spike_warnings
from simrail.recording.recording import Recording
from tests.shared.noisy_ride import COUNT, RATE, TIME, N, ride, way_of_speed

NEVER_STANDS = ride(way_of_speed(4.0 + 0.3 * TIME))
STANDS = ride(way_of_speed(np.clip(TIME - 20.0, 0.0, 10.0)))


def with_bandwidth(sound: Recording, share: float | None) -> Recording:
    bandwidth = None if share is None else share * RATE
    return replace(sound, imu_sheet=replace(sound.imu_sheet, bandwidth_hz=bandwidth))


def jumping(sound: Recording, name: str, places: list[int], size: float) -> Recording:
    values = sound.imu[name].to_numpy().copy()
    values[places] += size
    return replace(sound, imu=sound.imu.assign(**{name: values}))


@pytest.mark.parametrize("name", [GYRO[0], ACCEL[2]])
@pytest.mark.parametrize("count", [1, 7])
def test_single_samples_are_told_with_their_number_and_the_first(name: str, count: int) -> None:
    places = [500 + 37 * i for i in range(count)]
    sound = with_bandwidth(NEVER_STANDS, 0.2)
    assert spike_warnings(sound) == ()
    (told,) = spike_warnings(jumping(sound, name, places, -150.0 * N))
    axis, kind = name.split("_")[1].upper(), name.split("_")[0]
    number = f"a single sample of {axis} jumps" if count == 1 else f"7 single samples of {axis} jump "
    assert told.startswith(f"imu.{kind}: ") and number in told and "time_s = 5," in told


@pytest.mark.parametrize("order", [1, 2, 3, 4, 6])
@pytest.mark.parametrize("family", [butter, bessel])
def test_the_shortest_blow_behind_a_filter_is_none(order: int, family: Callable) -> None:
    """Of a filter in time, sampled 32 times as fast, at all moments between two samples."""
    fine, sound = 32, with_bandwidth(NEVER_STANDS, FILTERED)
    form = {"norm": "mag"} if family is bessel else {}
    values = sound.imu[ACCEL[0]].to_numpy().copy()
    for moment in range(fine):
        blow = np.zeros(40 * fine)
        blow[moment] = 1.0
        answer = lfilter(*family(order, FILTERED * 2.0 / fine, **form), blow)[::fine]
        values[100 * moment + 50 :][: len(answer)] += 200.0 * N * answer / np.abs(answer).max()
    assert spike_warnings(replace(sound, imu=sound.imu.assign(**{ACCEL[0]: values}))) == ()


def test_of_a_filter_that_nobody_knows_only_rests_tell() -> None:
    for at, count in ((500, 1), (3000, 0)):
        told = spike_warnings(jumping(with_bandwidth(STANDS, None), GYRO[1], [at], 150.0 * N))
        assert len(told) == count


def test_a_signal_that_shakes_so_throughout_has_none() -> None:
    """Every twentieth sample: that is the signal; and steps of ten samples have no way back."""
    sound = with_bandwidth(NEVER_STANDS, 0.2)
    assert spike_warnings(jumping(sound, ACCEL[0], list(range(10, COUNT - 10, 20)), 150.0 * N)) == ()
    assert spike_warnings(jumping(sound, ACCEL[0], list(range(1000, 1010)), 150.0 * N)) == ()
