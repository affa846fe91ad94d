"""Which of our methods stand for which of the paper's, and in which of our cases they are looked at.

Beside our own, in which case of another run: that of the track at its other size.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simrail.campaign.stored_results import StoredResults
from simrail.report.papers.claim import read_paper
from simrail.report.tables.geometry import QUANTITIES
from simrail.report.tables.pivot import (
    NOTHING,
    Case,
    Mean,
    ablated,
    cases,
    first_cases,
)
from simrail.report.words.ablations import state_words
from simrail.report.words.verdicts import imu_words
from simrail.scenario.cells import Method, methods
from simrail.scenario.imu_tables import NOISE
from simrail.scoring.ablations import COLUMNS as TAKEN_AWAY
from simrail.scoring.ablations import Ablation

PAPER = read_paper("gonzalez_2023")

COLUMNS = (
    ("cross_level", False),
    ("cross_level", True),
    ("alignment", True),
    ("vertical_profile", True),
)
"""Quantities of its Tables 1 and 2, and whether they are filtered."""

FILTERED = tuple(quantity for quantity, filtered in COLUMNS if filtered)

MODEL, FULL = "1:10", "full size"
"""What the two sizes of a track are called."""

LONGEST_OF_MODEL_M = 10.0
"""Longest wave of the scenario's own band below which it is taken for one of the 1:10 track."""


def column_words(comma: str = ", ") -> list[str]:
    """`COLUMNS` in words: ``cross-level, filtered``."""
    return [f"{QUANTITIES[q]}{comma}{'filtered' if filtered else 'unfiltered'}" for q, filtered in COLUMNS]


@dataclass(frozen=True)
class Rows:
    """Case by the part that a method plays.

    Attributes
    ----------
    case : Case
        The case that is looked at.
    noisy : Case or None
        The same with noise added to the IMU.
    names : dict of str to str
        The scenario's name of the method that plays a part.
    band : str
        Band that stands for the paper's filter.
    """

    case: Case
    noisy: Case | None
    names: dict[str, str]
    band: str

    def get(self, part: str, quantity: str, metric: str, *, filtered: bool) -> Mean:
        """One figure; NaN and no draws if it was not run."""
        case = self.noisy if part == "cml_noise" else self.case
        name = self.names.get(self.played_by(part), "")
        if case is None:
            return NOTHING
        return case.get(name, quantity, metric, band=self.band if filtered else "full")

    def attitude(self, part: str, angle: str) -> Mean:
        """Rms error of an angle over the whole ride, degrees; NaN and no draws if it was not run."""
        case = self.noisy if part == "cml_noise" else self.case
        return NOTHING if case is None else case.get(self.names.get(self.played_by(part), ""), angle, "rms")

    def played_by(self, part: str) -> str:
        """Part whose method plays a part: on noisy signals CML, unless a method was tuned on them."""
        return "cml" if part == "cml_noise" and part not in self.names else part

    def has(self, *parts: str) -> bool:
        """Whether all parts were run."""
        return all(
            bool(np.isfinite(self.get(part, "cross_level", "sd", filtered=True).value)) for part in parts
        )

    @property
    def where(self) -> str:
        """Which case is looked at, in words."""
        labels = self.case.labels
        return (
            f"ride {labels['ride']}, IMU {imu_words(labels)}, odometry {labels['odometry']}, "
            f"{state_words(labels, comma=', ')}"
        )

    @property
    def main(self) -> str:
        """The part that figures are drawn of: the paper's own tuning where it was run."""
        return next((part for part in ("cml", "kom", "hand") if self.has(part)), "")


def rows_of(all_cases: Sequence[Case], ran: Sequence[Method], *, band: str) -> Rows | None:
    """Find the first case of a real IMU with rail geometry; None if there is none.

    Of what a train has, where any case is.
    """
    names = PAPER.names(ran)
    all_cases = first_cases(all_cases)
    real = [case for case in all_cases if case.labels["imu"] != "ideal"]
    plain = [case for case in real if not _is_noisy(case)]
    for case in [*plain, *all_cases]:
        if any(case.get(name, "cross_level", "sd").draws for name in names.values()):
            same = ("ride", "odometry", "vehicle", *TAKEN_AWAY)
            noisy = (c for c in real if _is_noisy(c) and all(c.labels[k] == case.labels[k] for k in same))
            return Rows(case, next(noisy, None), names, band)
    return None


def ablated_rows(rows: Rows, all_cases: Sequence[Case], ablation: Ablation) -> Rows | None:
    """The same with an ablation; None if that was not run."""
    case = ablated(rows.case, all_cases, ablation)
    noisy = None if rows.noisy is None else ablated(rows.noisy, all_cases, ablation)
    return None if case is None else replace(rows, case=case, noisy=noisy)


def _is_noisy(case: Case) -> bool:
    return NOISE in case.labels["imu"] or NOISE in case.labels["mount"]


@dataclass(frozen=True)
class OtherSize:
    """Rows of another run.

    Attributes
    ----------
    name, started : str
        Its scenario, and its date.
    size : str
        `MODEL` or `FULL`, with what tells it from ours if that is of the same size.
    rows : Rows
        Its figures.
    """

    name: str
    started: str
    size: str
    rows: Rows


def other_size(former: StoredResults, *, band: str) -> OtherSize | None:
    """Rows of former results in the band of that name; None if they have no rail geometry."""
    scenario = former.scenario()
    rows = rows_of(cases(former.scores, former.cells), methods(scenario), band=band)
    if rows is None:
        return None
    _, longest_m = scenario.spec.geometry.own_bands.get(band, (0.0, np.inf))
    started = str(former.manifest.get("started_utc", "an unknown day"))[:10]
    return OtherSize(scenario.name, started, size_of(longest_m), rows)


def size_of(longest_m: float) -> str:
    """`MODEL` or `FULL`, by the longest wave of the scenario's own band."""
    return MODEL if longest_m < LONGEST_OF_MODEL_M else FULL
