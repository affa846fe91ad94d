"""Which of our methods stand for which of the paper's, and in which of our cases they are looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simrail.report.tables.pivot import Figure, Figures
from simrail.scenario.cells import Method
from simrail.scenario.tables import NOISE

PARTS: dict[str, str] = {
    "cml": "CML",
    "kom": "KOM",
    "kom_start": "KOM on part 1",
    "kom_end": "KOM on part 2",
    "cml_noise": "CML, noise added",
    "kom_rides": "KOM on several rides",
    "cml_held": "CML, virtual positions held",
    "hand": "set by hand",
    "blind": "by hand, no sight of the rails",
    "filter": "by hand, filter alone",
    "printed": "by hand, misprints kept",
    "zero": "no IMU",
}
"""Parts that a method can play, in the order of the table. The first five have rows in the paper."""

COLOURS: dict[str, str] = {
    "cml": "#0072B2",
    "kom": "#D55E00",
    "kom_start": "#E69F00",
    "kom_end": "#CC79A7",
    "cml_noise": "#000000",
    "cml_held": "#56B4E9",
    "hand": "#009E73",
}
"""Of the parts, which are all the same smoother: Okabe and Ito's. Fig. A2 is without KOM."""


def part_of(method: Method) -> str:
    """Part that a method plays, as the scenario says (``stands_for``); "" if none."""
    said = method.part.stands_for
    return said if said in PARTS else ""


@dataclass(frozen=True)
class Rows:
    """Figures by the part that a method plays.

    Attributes
    ----------
    case : Figures
        The case that is looked at.
    noisy : Figures or None
        The same with noise added to the IMU.
    names : dict of str to str
        The scenario's name of the method that plays a part.
    band : str
        Band that stands for the paper's filter.
    """

    case: Figures
    noisy: Figures | None
    names: dict[str, str]
    band: str

    def get(self, part: str, quantity: str, metric: str, *, filtered: bool) -> Figure:
        """One figure; NaN and no draws if it was not run."""
        case = self.noisy if part == "cml_noise" else self.case
        name = self.names.get(self.played_by(part), "")
        if case is None:
            return Figure(float("nan"), float("nan"), 0)
        return case.get(name, quantity, metric, band=self.band if filtered else "full")

    def played_by(self, part: str) -> str:
        """Part whose method plays a part: on noisy signals CML, unless a method was tuned on them."""
        return "cml" if part == "cml_noise" and part not in self.names else part

    def has(self, *parts: str) -> bool:
        """Whether all parts were run."""
        return all(
            bool(np.isfinite(self.get(part, "cross_level", "sd", filtered=True).value)) for part in parts
        )

    @property
    def main(self) -> str:
        """The part that figures are drawn of: the paper's own tuning where it was run."""
        return next((part for part in ("cml", "kom", "hand") if self.has(part)), "")


def rows_of(all_cases: Sequence[Figures], methods: Sequence[Method], *, band: str) -> Rows | None:
    """Find the first case of a real IMU with rail geometry; None if there is none."""
    names: dict[str, str] = {}
    for method in methods:
        names.setdefault(part_of(method), method.name)
    names.pop("", None)
    real = [case for case in all_cases if case.labels["imu"] != "ideal"]
    plain = [case for case in real if not _is_noisy(case)]
    for case in [*plain, *all_cases]:
        if any(case.get(name, "cross_level", "sd").draws for name in names.values()):
            same = ("ride", "odometry", "vehicle")
            noisy = (c for c in real if _is_noisy(c) and all(c.labels[k] == case.labels[k] for k in same))
            return Rows(case, next(noisy, None), names, band)
    return None


def _is_noisy(case: Figures) -> bool:
    return NOISE in case.labels["imu"] or NOISE in case.labels["mount"]
