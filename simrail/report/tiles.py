"""The few numbers that a reader sees first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simrail.report.findings import degrees, significant
from simrail.report.methods import MethodStyle
from simrail.report.pivot import Figures


@dataclass(frozen=True)
class Tile:
    """A number with its meaning above and its context below."""

    title: str
    value: str
    note: str


def tiles(case: Figures, styles: Sequence[MethodStyle]) -> list[Tile]:
    """Roll error in curves of the best method, of its uncompensated twin, of the design angles; odometry."""
    window = "curve" if case.curves() else "whole"
    where = "in curves" if window == "curve" else "whole ride"

    def roll(name: str) -> float:
        return case.get(name, "roll", "rms", window=window).value

    result = []
    tested = [style for style in styles if not style.baseline and roll(style.name) > 0.0]
    if tested:
        best = min(tested, key=lambda style: roll(style.name))
        result.append(
            Tile(f"roll error {where}", degrees(roll(best.name)), f"rms, {best.label}, the best method")
        )
        if roll(best.twin) > 0.0:
            times = f"{roll(best.twin) / roll(best.name):.1f} times as much"
            result.append(Tile("the same, uncompensated", degrees(roll(best.twin)), times))
    for style in styles:
        if not style.uses_imu and roll(style.name) > 0.0:
            result.append(
                Tile(
                    "design angles only", degrees(roll(style.name)), f"rms roll error {where} without any IMU"
                )
            )
    for name in case.estimators():
        error = case.get(name, "position", "rms")
        if name.startswith("odometry:") and error.draws:
            result.append(
                Tile("position error", f"{significant(error.value)} m", f"rms, odometry '{name[9:]}'")
            )
    return result
