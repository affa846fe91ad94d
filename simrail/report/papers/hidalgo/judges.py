"""Whether what Hidalgo et al. say holds in our scores: a function for each kind of claim."""

from collections.abc import Mapping, Sequence

from simrail.report.papers.claim import Judgement
from simrail.report.papers.hidalgo.places import PAPER, Places
from simrail.scoring.bootstrap import Interval

LIMIT = PAPER.limits


def found(seen: Places, parts: Sequence[str]) -> Judgement:
    """The error is small against the profile itself, which is the error of no IMU."""
    part, nothing = parts
    shares = {name: seen.mean(part, name).value / seen.mean(nothing, name).value for name in seen.names}
    return max(shares.values()) <= 1.0 / LIMIT["found_factor"], {"shares": shares}


def lower(seen: Places, parts: Sequence[str]) -> Judgement:
    """The first part's error is lower than the second's in every place, beyond chance."""
    changes = seen.changes(*parts)
    lost = {place: one for place, one in changes.items() if not one.high < 0.0}
    return not lost, {"changes": changes, "lost": lost}


def no_better(seen: Places, parts: Sequence[str]) -> Judgement:
    """The first part's error is nowhere lower than the second's, beyond chance."""
    changes = seen.changes(*parts)
    better = [place for place, one in changes.items() if one.high < 0.0]
    return not better, {"changes": changes, "better": better}


def no_worse(seen: Places, parts: Sequence[str]) -> Judgement:
    """The first part's error is nowhere larger than the second's by so much that it matters."""
    changes = seen.changes(*parts)
    worse = [place for place, one in changes.items() if not one.value <= LIMIT["matters_percent"]]
    return not worse, {"changes": changes, "worse": worse}


def notes(seen: Places) -> list[str]:
    """What the paper's errata cost, and where our own smoother stands."""
    effects: dict[str, Mapping[str, Interval]] = {}
    for part, beside in (("zeros", "gyro"), ("printed", "zeros"), ("newest", "gyro")):
        if seen.has(part) and seen.has(beside):
            effects[PAPER.words[part]] = seen.changes(part, beside)
    told = [PAPER.written(PAPER.words["misprints"], effects=effects)] if effects else []
    told.append(PAPER.written(PAPER.words["sign"]))
    if seen.has("own") and seen.has("gyro"):
        changes = seen.changes("own", "gyro")
        lost = {place: one for place, one in changes.items() if one.low > 0.0}
        told.append(PAPER.written(PAPER.words["own"], changes=changes, lost=lost))
    return told
