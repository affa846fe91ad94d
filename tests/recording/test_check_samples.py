"""Samples that are none of their device are told by their place; sound ones and wrong units are not."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.recording.check_samples import Bounds, Channel, check_samples, markers

RATE = 100.0
SHEET = Bounds(range=50.0, noise=0.01, sheet="mine")
G = 9.80665


def ride(seed: int = 1, noise: float = 0.1, count: int = 3000) -> np.ndarray:
    """Accelerometer (n, 3) of a ride that sways: noise ten times that of two counts of 0.01."""
    draw = np.random.default_rng(seed)
    time = np.arange(count) / RATE
    moving = time > 5.0
    sway = moving * 0.8 * np.sin(2.0 * np.pi * 0.7 * time)
    values = np.column_stack([0.3 * sway, sway, 9.81 + 0.5 * sway])
    return np.round(values + noise * draw.standard_normal(values.shape), 2)


def judged(values: np.ndarray, bounds: Bounds = SHEET, unit: str = "m/s2", si: float = 1.0) -> None:
    channels = tuple(Channel(name, values[:, i], unit, si) for i, name in enumerate(("ax", "ay", "az")))
    time = np.arange(len(values)) / RATE
    check_samples(channels, "accel", bounds, time=time, where=lambda sample: f"line {sample + 2}")


@pytest.mark.parametrize("seed", range(5))
def test_a_sound_ride_passes(seed: int) -> None:
    judged(ride(seed))
    judged(ride(seed), Bounds(None, 0.0, "none"))


def test_a_perfect_sensor_that_rests_and_moves_passes() -> None:
    time = np.arange(5000) / RATE
    values = np.column_stack([0.0 * time, np.where(time > 40.0, 0.5 * np.sin(time), 0.0), 9.81 + 0.0 * time])
    judged(values, Bounds(None, 0.0, "ideal"))


def test_clipping_and_blows_pass() -> None:
    """An axle: blows of 60 that ring, which its range of 50 clips."""
    values = ride(noise=3.0)
    for begin in (500, 900, 1700, 2500):
        ring = 60.0 * np.cos(1.1 * np.arange(8)) * 0.7 ** np.arange(8)
        values[begin : begin + 8, 2] += ring
    judged(np.clip(values, -50.0, 50.0))


@pytest.mark.parametrize(
    ("marker", "words"),
    [
        (-156.9, ("beyond the range", "50 m/s2")),
        (-9999.0, ("beyond the range",)),
        (50.0, ("stands alone",)),
        (-50.0, ("stands alone",)),
        (40.0, ("stands alone", "largest of all others")),
    ],
)
@pytest.mark.parametrize("rows", [[1000], [0], [2999], [700, 1200, 2100]])
def test_markers_are_named_by_line_value_and_limit(
    marker: float, words: tuple[str, ...], rows: list[int]
) -> None:
    values = ride()
    values[rows, 1] = marker
    with pytest.raises(InputError) as raised:
        judged(values)
    said = str(raised.value)
    for word in (*words, "ay", f"line {rows[0] + 2} ", f"{marker:.6g} m/s2", "no measurement"):
        assert word in said
    assert "look like" not in said
    assert (f"and {len(rows) - 1} more" in said) == (len(rows) > 1)


def test_a_block_of_markers_and_two_kinds_of_them_are_all_counted() -> None:
    values = ride()
    values[1000:1100, 0] = -9999.0
    values[2000, 0] = 32767.0
    with pytest.raises(InputError, match="and 100 more such samples"):
        judged(values)


@pytest.mark.parametrize("marker", [32767.0, -32768.0, 999.0, -9999.0])
def test_markers_in_the_numbers_of_the_file_are_known_without_a_range(marker: float) -> None:
    """Counts of 1/2048 g: the largest count is 16 g, which stands 3 times apart from a rough ride."""
    count = G / 2048.0
    values = ride(noise=1.0 if abs(marker) > 10000 else 0.02) - [0.0, 0.0, 9.81]
    values[1500, 0] = marker * count
    with pytest.raises(InputError, match="line 1502 "):
        judged(values, Bounds(None, 0.0, "none"), unit="LSB", si=count)


def test_a_wrong_unit_is_left_to_those_who_judge_units() -> None:
    """In mg where m/s2 is claimed, every sample is beyond the range."""
    judged(ride() / G * 1000.0)
    rough = ride(noise=3.0) * 9.81
    assert (np.abs(rough) > 50.0).any()
    judged(rough)


def test_zeros_on_all_axes_are_no_measurement() -> None:
    values = ride()
    values[[1200, 1300]] = 0.0
    with pytest.raises(InputError) as raised:
        judged(values)
    said = str(raised.value)
    assert (
        "ax, ay, az" in said and "line 1202 " in said and "and 1 more" in said and "zero on all axes" in said
    )


def test_a_perfect_gyro_between_two_kinks_is_no_marker() -> None:
    """Curves of a tram without transitions: zeros for seconds; but one sample of zeros in a curve is none."""
    rate = np.where(np.arange(3000) // 500 % 2 == 1, 0.3, 0.0)
    values = np.column_stack([0.0 * rate, 0.0 * rate, rate])

    def gyro(values: np.ndarray) -> None:
        channels = tuple(Channel(name, values[:, i], "rad/s", 1.0) for i, name in enumerate("xyz"))
        check_samples(channels, "gyro", Bounds(5.0, 0.0, "ideal"), time=np.arange(3000.0), where=str)

    gyro(values)
    values[700] = 0.0
    with pytest.raises(InputError, match="zero on all axes in 700 "):
        gyro(values)


def test_a_stuck_axis_is_named_with_its_time() -> None:
    values = ride()
    values[1000:1300, 1] = values[1000, 1]
    with pytest.raises(InputError) as raised:
        judged(values)
    said = str(raised.value)
    assert "ay" in said and "line 1002 (time_s = 10) to time_s = 12.99" in said and "stuck" in said
    # Without noise in the sheet nobody knows; and decimals coarser than the noise hide it, and are told.
    judged(values, Bounds(50.0, 0.0, "mine"))
    with pytest.raises(InputError, match="has steps of 1 m/s2"):
        judged(np.round(values, 0), SHEET)


def test_a_computed_ride_without_noise_is_not_stuck() -> None:
    """Whatever its sheet says: at rest, and on an axis about which it does not turn."""
    time = np.arange(3000) / RATE
    values = np.column_stack(
        [0.0 * time, 0.5 * np.sin(0.3 * np.maximum(time - 10.0, 0.0)), 9.81 + 0.0 * time]
    )
    judged(values, SHEET)


def test_all_axes_frozen_at_once_are_stuck() -> None:
    values = ride()
    values[1000:1300] = values[1000]
    with pytest.raises(InputError, match=r"ax: repeats one number from line 1002"):
        judged(values)


def test_an_axis_that_never_moves_is_stuck() -> None:
    values = ride()
    values[:, 0] = 0.13
    with pytest.raises(InputError, match="ax: repeats one number from line 2 "):
        judged(values)


def test_too_few_samples_are_not_judged() -> None:
    assert not markers(np.array([0.0, 100.0]), still=0.1).any()
