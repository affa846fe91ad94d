"""Springs pass for a low-pass of the accelerometer: what clocks say beside that is believed if it is sure."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from simrail.recording.evidence.finding import LIKELY, Finding, Verdict, verdict_of
from simrail.recording.evidence.judge import _qualified

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
