"""What changes within a ride is told with its size and its moment, and nothing else is blamed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from simrail.recording.evidence.devices import weigh_all
from simrail.recording.evidence.fit import fit, linear
from simrail.recording.evidence.midway import change_of
from simrail.recording.evidence.model import INDEX, THEN, ride_of, start_values
from simrail.recording.evidence.readings import expected, readings, slopes
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording
from tests.shared.planted_faults import counted_otherwise, midway, missing, offset, turned

BASE = Path(__file__).parents[1] / "field" / "cases" / "00-base"
HALF_S = 20.0
LONG = pytest.mark.long


@pytest.fixture(scope="module")
def sound() -> Recording:
    return read_signals(BASE)


@pytest.mark.parametrize(
    ("key", "plant", "size", "value", "slack"),
    [
        ("then_gyro_bias_x", midway(offset("gyro_x_radps")), 0.005, np.degrees(0.005), 0.02),
        *(
            pytest.param(*planted, marks=LONG)
            for planted in [
                ("then_gyro_bias_z", midway(offset("gyro_z_radps")), -0.005, np.degrees(-0.005), 0.02),
                ("then_accel_bias_x", midway(offset("accel_x_mps2")), 0.2, 0.2, 0.04),
                ("then_accel_bias_y", midway(offset("accel_y_mps2")), -0.2, -0.2, 0.02),
                ("then_pitch", midway(turned(1)), 10.0, 10.0, 0.3),
                ("then_yaw", midway(turned(2)), 10.0, 10.0, 2.0),
                ("then_yaw", midway(turned(2)), 45.0, 45.0, 3.0),
                ("then_roll", midway(turned(0)), 45.0, 45.0, 0.3),
                ("then_offset", missing, 2.0, -2.0, 0.15),
                ("then_yaw", midway(turned(2)), 3.0, 3.0, 1.0),
                ("then_offset", missing, 0.5, -0.5, 0.1),
                ("then_wheel", counted_otherwise, 0.5, 0.5, 0.05),
            ]
        ),
    ],
)
def test_a_change_is_told_with_its_size_and_its_moment(
    key: str,
    plant: Callable[[Recording, float], Recording],
    size: float,
    value: float,
    slack: float,
    sound: Recording,
) -> None:
    """The slack is some three sds of the fit; a wheel that counts otherwise jerks for two seconds."""
    evidence = weigh_all(plant(sound, size))
    assert [finding.key for finding in evidence.wrong] == [key]
    found = evidence.of(key)
    assert found.value == pytest.approx(value, abs=slack)
    assert found.verdict == ("likely wrong" if size in (3.0, 0.5) and key != "then_wheel" else "surely wrong")
    said = found.why.partition("time_s = ")[2].partition(" on ")[0]
    assert float(said) == pytest.approx(HALF_S, abs=2.0 if key == "then_wheel" else 1.0)
    assert "cut the recording" in found.remedy


@pytest.mark.long
@pytest.mark.parametrize("share", [0.5, 0.35, 0.65])
def test_a_counter_that_turns_its_sign_is_told_with_the_moment(share: float, sound: Recording) -> None:
    evidence = weigh_all(counted_otherwise(sound, -1.0, share))
    assert [finding.key for finding in evidence.wrong] == ["then_wheel"]
    found = evidence.of("then_wheel")
    assert found.value == pytest.approx(-1.0, abs=0.1)
    assert "the wheel counts backwards (-" in found.why and "reverse" in found.remedy
    said = found.why.partition("time_s = ")[2].partition(" on ")[0]
    assert float(said) == pytest.approx(40.0 * share, abs=1.0)


def test_of_a_ride_in_which_nothing_changes_nothing_is_said(sound: Recording) -> None:
    ride = ride_of(sound)
    assert ride is not None
    found = fit(ride, start_values())
    with threadpool_limits(1):
        assert change_of(ride, found, 0) is None
        assert change_of(ride, found, 2) is None  # nor where it is looked for by fits


def test_slopes_of_a_change_are_those_of_differences(sound: Recording) -> None:
    ride = ride_of(midway(turned(2))(sound, 10.0))
    assert ride is not None
    object.__setattr__(ride, "then", 31)
    x = start_values()
    for name, by in (
        ("then_yaw", 0.2),
        ("then_wheel", 0.1),
        ("then_offset", 0.1),
        ("then_gyro_bias_y", 0.01),
    ):
        x[INDEX[name]] = by
    near = linear(ride, x, np.ones((2, 5)), np.ones_like(ride.measured), tuple(THEN))
    found = slopes(ride, x, readings(ride, x), near.solved_for)
    for name in (*THEN, "wheel", "yaw", "offset"):
        more, less = x.copy(), x.copy()
        more[INDEX[name]] += 1e-4
        less[INDEX[name]] -= 1e-4
        differences = (expected(ride, more) - expected(ride, less)) / 2e-4
        worst = np.abs(found[:, :, INDEX[name]] - differences).max()
        # One-sided steps of 5 ms for a clock: a kink of the way within the step is seen by one of them.
        assert worst < (0.15 if "offset" in name else 0.01) * max(1.0, np.abs(differences).max()), name
