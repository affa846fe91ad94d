"""Whether what Gonzalez-Carbajal et al. 2023 say holds in our scores: a function for each kind of claim."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from simrail.estimators.tuning.file import Tuning
from simrail.report.papers.claim import Judgement
from simrail.report.papers.gonzalez_2023.parts import COLUMNS, FILTERED, PAPER, Rows, column_words
from simrail.report.papers.gonzalez_2023.tunings import EDGES
from simrail.report.tables.geometry import JUDGED, QUANTITIES

LIMIT = PAPER.limits

POSITIONS = ("lateral_position_m2", "vertical_position_m2")
"""Variances of the virtual positions, which are constants and no measurements."""


class Peak(NamedTuple):
    """Unfiltered alignment error: largest over the first metres of a ride, and sd over the rest, mm."""

    first_m: float
    largest_mm: float
    rest_sd_mm: float


@dataclass(frozen=True)
class Evidence:
    """What the claims are judged by.

    Attributes
    ----------
    rows : Rows
        The scores.
    coverage : sequence of float
        Share of the track inside the interval of `Rows.main`, %, in the order of `COLUMNS`; empty if unknown.
    peak : Peak, optional
        The start of the ride beside its rest, of `Rows.main`.
    tuning : Tuning, optional
        That of CML, with what the search knows.
    """

    rows: Rows
    coverage: Sequence[float] = ()
    peak: Peak | None = None
    tuning: Tuning | None = None


def constraint(seen: Evidence, _: Sequence[str]) -> Judgement | None:
    """The paper's constraint keeps CML from trusting the virtual positions without end."""
    tuning = seen.tuning
    if tuning is None or tuning.status is None or tuning.search is None:
        return None
    space = tuning.search.space
    if space.constrained != ("y",) or space.position_m2 is not None:
        return None
    names = (*POSITIONS, "accel_y_m2ps4", "accel_z_m2ps4")
    variances = {name: (getattr(tuning.hyperparameters, name), tuning.status[name]) for name in names}
    at_edge = [name for name in POSITIONS if tuning.status[name] in EDGES]
    return not at_edge, {"box": space.box, "variances": variances, "at_edge": at_edge}


def alike(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Some tunings are about as accurate."""
    by_quantity = {
        QUANTITIES[quantity]: [seen.rows.get(part, quantity, "sd", filtered=True).value for part in parts]
        for quantity in FILTERED
    }
    worst = max(max(sds) / min(sds) for sds in by_quantity.values())
    return worst <= LIMIT["same_factor"], {"parts": parts, "by_quantity": by_quantity, "worst": worst}


def peak(seen: Evidence, _: Sequence[str]) -> Judgement | None:
    """The alignment has a peak in the first metres."""
    start = seen.peak
    if start is None or not (start.largest_mm > 0.0 and start.rest_sd_mm > 0.0):
        return None
    holds = start.largest_mm > LIMIT["peak_factor"] * start.rest_sd_mm
    return holds, {"part": seen.rows.main, **start._asdict()}


def intervals(seen: Evidence, _: Sequence[str]) -> Judgement | None:
    """Intervals are too narrow for cross-level, too wide for the others."""
    coverage = seen.coverage
    if len(coverage) != len(COLUMNS):
        return None
    wide_enough = [
        word
        for word, share in zip(("unfiltered", "filtered"), coverage[:2], strict=True)
        if share >= LIMIT["too_narrow"]
    ]
    wide = min(coverage[2:]) > LIMIT["too_wide"]
    inside = dict(zip(column_words(" "), coverage, strict=True))
    values = {"part": seen.rows.main, "inside": inside, "wide_enough": wide_enough, "wide": wide}
    return not wide_enough and wide, values


def errata_note(rows: Rows) -> str:
    """What the misprints of the equations cost; "" if it was not run."""
    if not rows.has("hand", "printed"):
        return ""
    changes = {
        f"{QUANTITIES[quantity]} {'filtered' if filtered else 'unfiltered'}": [
            rows.get(part, quantity, "sd", filtered=filtered).value for part in ("printed", "hand")
        ]
        for quantity in JUDGED
        for filtered in (False, True)
    }
    worst = max(1.0, *(printed / own for printed, own in changes.values()))
    return PAPER.written(PAPER.words["misprints"], changes=changes, worst=worst)
