"""What bodies do that looks like clocks: springs are a low-pass, a place ahead of the middle comes first."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from simrail.recording.evidence.finding import LIKELY, Finding, Verdict, verdict_of
from simrail.recording.evidence.judge import _qualified
from simrail.recording.evidence.slack import clock_slack

SDS = {"sound": 1.0, "likely wrong": 4.0, "surely wrong": 9.0}


def finding(key: str, sds: float) -> Finding:
    return Finding(key, key, sds, 1.0, 0.0, "s", "all", verdict_of(sds), "is late", "encoder.time_offset_s")


def beside(free: tuple[str, ...], off: float) -> SimpleNamespace:
    return SimpleNamespace(free=free, off=lambda _name: off)


@pytest.mark.parametrize("sds", SDS.values())
@pytest.mark.parametrize("key", ["offset", "drift", "gyro_offset", "wheel", "gyro"])
@pytest.mark.parametrize(
    ("free", "off", "springs"),
    [
        (("slow_accel",), 0.7 * LIKELY, True),
        (("accel_gain", "slow_gyro"), 0.7 * LIKELY, True),
        (("slow_accel",), 1.3 * LIKELY, False),
        (("accel_gain",), 0.7 * LIKELY, False),
        ((), 0.0, False),
    ],
)
def test_a_likely_clock_beside_springs_could_not_be_judged(
    free: tuple[str, ...], off: float, springs: bool, key: str, sds: float
) -> None:
    of_clock = key in ("offset", "drift", "gyro_offset")
    before = finding(key, sds)
    told = _qualified(before, beside(free, off), SimpleNamespace(drift=0.0))  # type: ignore[arg-type]
    wanted: Verdict = before.verdict
    if springs and of_clock and wanted == "likely wrong":
        wanted = "could not be judged"
        assert "springs" in told.why and not told.setting
    else:
        assert told == before
    assert told.verdict == wanted


@pytest.mark.parametrize("ahead_m", [0.0, 5.0, -9.5])
def test_a_gyro_may_be_late_by_half_its_way_from_the_middle_of_the_body(ahead_m: float) -> None:
    """By hand, at 20 m/s and 250 Hz."""
    recording = SimpleNamespace(
        mount_position_m=(ahead_m, 0.0, 1.0), imu_sheet=SimpleNamespace(rate_hz=250.0)
    )
    ride = SimpleNamespace(recording=recording, way=SimpleNamespace(speed_mps=np.array([0.0, -20.0, 12.0])))
    parts = (0.1, 0.7 / 20.0, 0.5 * ahead_m / 20.0, 0.002)
    assert clock_slack(ride) == pytest.approx(math.sqrt(sum(part**2 for part in parts)))  # type: ignore[arg-type]
