"""Which of our methods stand for which of the paper's, and access to their figures ride by ride."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from simrail.report.papers.claim import read_paper
from simrail.report.tables.pivot import Case, ablated, first_cases
from simrail.scenario.cells import Method
from simrail.scoring.ablations import Ablation

PAPER = read_paper("briales_2021")

QUANTITIES = ("roll", "pitch", "yaw")

GENERAL_PURPOSE = ("vqf_magnetometer", "vqf", "imufusion", "sabatini", "yuan", "gda_uncompensated")
"""Parts that do not know the track."""


@dataclass(frozen=True)
class Rides:
    """Case of all rides by the part that a method plays.

    Attributes
    ----------
    cases : list of Case
        One per ride.
    names : dict of str to str
        The scenario's name of the method that plays a part.
    """

    cases: list[Case]
    names: dict[str, str]

    def has(self, *parts: str) -> bool:
        """Whether all parts were run and have a roll error on every ride: only then they are judged."""
        return bool(self.cases) and all(
            part in self.names and all(np.isfinite(self.one(case, part, "roll")) for case in self.cases)
            for part in parts
        )

    def present(self, parts: Sequence[str]) -> list[str]:
        """Those of some parts that can be judged."""
        return [part for part in parts if self.has(part)]

    def one(
        self, case: Case, part: str, quantity: str, *, window: str = "whole", reference: str = "truth"
    ) -> float:
        """Rms on one ride, mean over its draws, degrees; NaN where there is none."""
        return case.get(self.names.get(part, ""), quantity, "rms", window=window, reference=reference).value

    def mean(
        self, part: str, quantity: str, *, window: str = "whole", reference: str = "truth"
    ) -> tuple[float, float]:
        """Mean and standard deviation over the rides of the rms, as the paper's Table 3 has it."""
        rms = pd.Series([self.one(c, part, quantity, window=window, reference=reference) for c in self.cases])
        return float(rms.mean()), float(rms.std())

    def as_printed(self, part: str, quantity: str) -> float:
        """Mean over the rides as in Table 3: against the design angles, cropped."""
        return self.mean(part, quantity, window="cropped", reference="design")[0]

    def by_speed(self) -> dict[str, list[Case]]:
        """Rides by their class of speed, km/h; a class without any is left out."""
        groups: dict[str, list[Case]] = {}
        for case in sorted(self.cases, key=lambda case: is_fast(case.labels)):
            groups.setdefault("70" if is_fast(case.labels) else "20", []).append(case)
        return groups


FAST_KMH = 45.0
"""Cruise speed that parts the paper's rides at 20 km/h from those at 70 km/h."""


def is_fast(labels: dict[str, Any]) -> bool:
    """Whether a ride is one of the fast ones."""
    return float(labels["speed_kmh"]) > FAST_KMH


def rides_of(all_cases: Sequence[Case], methods: Sequence[Method]) -> Rides:
    """Gather the first case of every ride, an ideal IMU last, and the parts that the methods play.

    Of what a train has, where any case is.
    """
    first: dict[str, Case] = {}
    for case in sorted(first_cases(all_cases), key=lambda case: case.labels["imu"] == "ideal"):
        first.setdefault(case.labels["ride"], case)
    return Rides(list(first.values()), PAPER.names(methods))


def ablated_rides(rides: Rides, all_cases: Sequence[Case], ablation: Ablation) -> Rides | None:
    """The same rides with an ablation; None if one of them was not run so."""
    twins = [ablated(case, all_cases, ablation) for case in rides.cases]
    known = [case for case in twins if case is not None]
    return Rides(known, rides.names) if known and len(known) == len(twins) else None
