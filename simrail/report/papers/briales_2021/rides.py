"""Which of our methods stand for which of the paper's, and access to their figures ride by ride."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from simrail.report.tables.pivot import Figures
from simrail.scenario.cells import Method

PARTS: dict[str, tuple[str, str]] = {
    "vqf_magnetometer": ("commercial AHRS: VQF with magnetometer", "commercial"),
    "vqf": ("commercial AHRS: VQF without", "commercial"),
    "imufusion": ("commercial AHRS: imufusion without", "commercial"),
    "sabatini": ("EKF with gravity only, after Sabatini", ""),
    "yuan": ("EKF that doubts long or short forces, after Yuan", ""),
    "gda_uncompensated": ("GDA uncompensated", ""),
    "gda_paper": ("GDA, the paper's settings", "madgwick"),
    "gda": ("GDA, recommended settings", "madgwick"),
    "gda_printed": ("GDA, compensation as printed", ""),
    "ekf_per_step": ("EKF, the paper's settings, Q per step", "ekf"),
    "ekf_intensity": ("EKF, the paper's settings, Q an intensity", "ekf"),
    "ekf": ("EKF, recommended settings", "ekf"),
    "ekf_printed": ("EKF, compensation as printed", ""),
    "design": ("design angles only", ""),
}
"""Parts that a method can play: its label, and the row of `TABLE_3` that it stands beside."""

GENERAL_PURPOSE = ("vqf_magnetometer", "vqf", "imufusion", "sabatini", "yuan", "gda_uncompensated")
"""Parts that do not know the track."""


def part_of(method: Method) -> str:
    """Part that a method plays, as the scenario says (``stands_for``); "" if none."""
    said = method.part.stands_for
    return said if said in PARTS else ""


@dataclass(frozen=True)
class Rides:
    """Figures of all rides by the part that a method plays.

    Attributes
    ----------
    cases : list of Figures
        One per ride.
    names : dict of str to str
        The scenario's name of the method that plays a part.
    """

    cases: list[Figures]
    names: dict[str, str]

    def has(self, *parts: str) -> bool:
        """Whether all parts were run and have a roll error on every ride: only then they are judged."""
        return bool(self.cases) and all(
            part in self.names and bool(np.isfinite(self.each(part, "roll")).all()) for part in parts
        )

    def present(self, parts: Sequence[str]) -> list[str]:
        """Those of some parts that can be judged."""
        return [part for part in parts if self.has(part)]

    def each(
        self, part: str, quantity: str, *, window: str = "whole", reference: str = "truth"
    ) -> list[float]:
        """Rms of each ride, mean over its draws; NaN where there is none. Degrees."""
        return [self.one(case, part, quantity, window=window, reference=reference) for case in self.cases]

    def one(
        self, case: Figures, part: str, quantity: str, *, window: str = "whole", reference: str = "truth"
    ) -> float:
        """Rms on one ride, mean over its draws."""
        return case.get(self.names.get(part, ""), quantity, "rms", window=window, reference=reference).value

    def mean(
        self, part: str, quantity: str, *, window: str = "whole", reference: str = "truth"
    ) -> tuple[float, float]:
        """Mean and standard deviation over the rides of the rms, as the paper's Table 3 has it."""
        values = np.array(self.each(part, quantity, window=window, reference=reference))
        values = values[np.isfinite(values)]
        if not len(values):
            return float("nan"), float("nan")
        return float(values.mean()), float(values.std(ddof=1)) if len(values) > 1 else float("nan")

    def where(self, *, forward: bool, fast: bool) -> list[Figures]:
        """Rides of one direction and one class of speed."""
        direction = "forward" if forward else "backward"
        return [
            case
            for case in self.cases
            if case.labels["direction"] == direction and is_fast(case.labels) == fast
        ]


FAST_KMH = 45.0
"""Cruise speed that parts the paper's rides at 20 km/h from those at 70 km/h."""


def is_fast(labels: dict[str, Any]) -> bool:
    """Whether a ride is one of the fast ones."""
    return float(labels["speed_kmh"]) > FAST_KMH


def rides_of(all_cases: Sequence[Figures], methods: Sequence[Method]) -> Rides:
    """Gather the first case of every ride, an ideal IMU last, and the parts that the methods play."""
    first: dict[str, Figures] = {}
    for case in sorted(all_cases, key=lambda case: case.labels["imu"] == "ideal"):
        first.setdefault(case.labels["ride"], case)
    names: dict[str, str] = {}
    for method in methods:
        names.setdefault(part_of(method), method.name)
    names.pop("", None)
    return Rides(list(first.values()), names)
