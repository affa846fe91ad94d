"""Whether what Briales et al. 2021 say holds in our scores: a function for each claim of ``paper.toml``."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simrail.report.papers.briales_2021.rides import GENERAL_PURPOSE, PAPER, QUANTITIES, Rides
from simrail.report.papers.claim import Judgement
from simrail.report.tables.pivot import Case

LIMIT = PAPER.limits

_Q, _R, _STEP_S = (PAPER.figures[name][0] for name in ("final_q", "final_r", "step_s"))
TIME_CONSTANTS_S = {
    "per_step": _STEP_S / 9.81 * (_R / _Q) ** 0.5,
    "intensity": _STEP_S / 9.81 * (_R / (_Q * _STEP_S)) ** 0.5,
}
"""Time constants with which gravity corrects roll and pitch, by the reading of Q (EQUATIONS 2.3)."""


@dataclass(frozen=True)
class Evidence:
    """What the claims are judged by.

    Attributes
    ----------
    rides : Rides
        The scores.
    spread : mapping of str to float
        By part: how much the roll error at one place differs between rides, degrees.
    wrong_sign_deg : float
        Apparent roll that a compensation of the wrong sign would leave in the sharpest curve of the
        fastest backward ride; NaN without one.
    """

    rides: Rides
    spread: Mapping[str, float]
    wrong_sign_deg: float


def _same(one: float, other: float) -> bool:
    """Whether two yaw errors are the same."""
    share = 0.01 * LIMIT["same_yaw_percent"] * max(one, other)
    return abs(one - other) <= max(share, LIMIT["same_yaw_deg"])


def commercial_yaw(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Yaw of the commercial sensor fails."""
    rides = seen.rides
    yaw, sd = rides.mean(parts[0], "yaw", window="cropped", reference="design")
    others = ("vqf", "imufusion") if rides.has("vqf", "imufusion") else ()
    beside = {part: rides.as_printed(part, "yaw") for part in others}
    return yaw > LIMIT["fails_deg"], {"yaw": yaw, "sd": sd, **beside}


def sabatini(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Gravity alone is good in yaw, and wrong in roll."""
    yaw = [seen.rides.mean(part, "yaw")[0] for part in parts]
    roll = [seen.rides.mean(part, "roll", window="curve")[0] for part in parts]
    holds = _same(*yaw) and roll[0] >= LIMIT["helps_factor"] * roll[1]
    return holds, {"yaw": yaw, "roll": roll}


def yuan(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Doubt helps roll and hurts pitch."""
    roll = [seen.rides.mean(part, "roll", window="curve")[0] for part in parts]
    pitch = [seen.rides.mean(part, "pitch")[0] for part in parts]
    return roll[0] < roll[1] and pitch[0] > pitch[1], {"roll": roll, "pitch": pitch}


def compensation(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Compensation helps roll in curves; parts are methods, each before its uncompensated twin."""
    by_speed: dict[str, list[float]] = {}
    for kmh, cases in seen.rides.by_speed().items():
        for case in cases:
            roll = [seen.rides.one(case, part, "roll", window="curve") for part in parts]
            by_speed.setdefault(kmh, []).extend((roll[1] / roll[0], roll[3] / roll[2]))
    least = min(ratio for ratios in by_speed.values() for ratio in ratios)
    return least >= LIMIT["helps_factor"], {"by_speed": by_speed}


def general_purpose(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Compensated methods beat general-purpose ones in roll."""
    rides = seen.rides

    def advantage(case: Case, part: str, window: str) -> float:
        """Roll error of a method over that of the worse of the compensated EKF and GDA."""
        worse = max(rides.one(case, own, "roll", window=window) for own in parts)
        return rides.one(case, part, "roll", window=window) / worse

    others = rides.present(GENERAL_PURPOSE)
    whole = {
        (part, case.labels["ride"]): advantage(case, part, "whole") for case in rides.cases for part in others
    }
    curves = {
        kmh: min(advantage(case, part, "curve") for case in cases for part in others)
        for kmh, cases in rides.by_speed().items()
    }
    lost = [where for where, ratio in whole.items() if not ratio > 1.0]
    return not lost, {"count": len(others), "least": min(whole.values()), "by_speed": curves, "lost": lost}


def gda_slightly_better(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """GDA is slightly better than the EKF."""
    rides = seen.rides
    roll, pitch = ([rides.as_printed(part, q) for part in parts] for q in ("roll", "pitch"))
    ratio = {"roll": roll[1] / roll[0], "pitch": pitch[1] / pitch[0]}
    holds = min(ratio.values()) > 1.0 and ratio["roll"] <= LIMIT["size_factor"]
    settings = {"intensity": "ekf_intensity", "ekf": "ekf", "gda": "gda"}
    known = rides.has(*settings.values())
    beside = {name: rides.as_printed(part, "roll") for name, part in settings.items() if known}
    return holds, {"roll": roll, "ratio": ratio, "tau_s": TIME_CONSTANTS_S, **beside}


def same_yaw(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Yaw is the same for both."""
    yaw = [seen.rides.as_printed(part, "yaw") for part in parts]
    return _same(*yaw), {"yaw": yaw}


def yaw_size(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Yaw drifts as much as printed."""
    yaw, (mean, sd) = seen.rides.as_printed(parts[0], "yaw"), PAPER.printed["madgwick"][2]
    beside = {"gda": seen.rides.as_printed("gda", "yaw")} if seen.rides.has("gda") else {}
    return abs(yaw - mean) <= sd, {"yaw": yaw, **beside}


def size(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """A row of Table 3 has the size of ours."""
    (part,) = parts
    printed = PAPER.printed[PAPER.parts[part].row]
    own = {quantity: seen.rides.as_printed(part, quantity) for quantity in QUANTITIES}
    ratio = {quantity: own[quantity] / mean for quantity, (mean, _) in zip(QUANTITIES, printed, strict=True)}
    factor = LIMIT["size_factor"]
    off = {quantity: value for quantity, value in ratio.items() if not 1.0 / factor <= value <= factor}
    return not off, {"part": part, "own": own, "off": off}


def _directions(rides: Rides) -> list[tuple[list[Case], list[Case]]]:
    """Forward and backward rides of each class of speed that has both."""
    pairs = [
        tuple(
            [case for case in cases if case.labels["direction"] == direction]
            for direction in ("forward", "backward")
        )
        for cases in rides.by_speed().values()
    ]
    return [(go, back) for go, back in pairs if go and back]


def _roll(rides: Rides, part: str, group: Sequence[Case], window: str) -> float:
    return float(np.mean([rides.one(case, part, "roll", window=window) for case in group]))


def _apart(rides: Rides, part: str) -> float:
    """Largest difference between the roll errors of backward and forward rides of a class of speed."""
    return max(
        abs(_roll(rides, part, back, "whole") - _roll(rides, part, go, "whole"))
        for go, back in _directions(rides)
    )


def backward_gda(seen: Evidence, parts: Sequence[str]) -> Judgement | None:
    """GDA is as good backward as forward."""
    if not _directions(seen.rides):
        return None
    apart = {part: _apart(seen.rides, part) for part in seen.rides.present((*parts, "gda"))}
    return apart[parts[0]] <= LIMIT["same_direction_deg"], {"apart": apart}


def backward_ekf(seen: Evidence, parts: Sequence[str]) -> Judgement | None:
    """The EKF fails backward."""
    rides, pairs = seen.rides, _directions(seen.rides)
    if not pairs:
        return None
    shown = rides.present((*parts, "ekf_intensity", "ekf"))
    ratios = {
        part: max(_roll(rides, part, back, "curve") / _roll(rides, part, go, "curve") for go, back in pairs)
        for part in shown
    }
    fails = ratios[parts[0]] >= LIMIT["fails_backward_factor"]
    apart = {part: _apart(rides, part) for part in shown}
    beside = {"holds_its_way": not fails, "wrong_sign_deg": seen.wrong_sign_deg}
    return fails, {"ratios": ratios, "apart": apart, **beside}


def repeatability(seen: Evidence, _: Sequence[str]) -> Judgement | None:
    """Roll repeats well with GDA, badly with the EKF."""
    spread = seen.spread
    if not {"gda_paper", "ekf_per_step"} <= set(spread):
        return None
    ratio = spread["ekf_per_step"] / spread["gda_paper"]
    return ratio >= LIMIT["repeats_factor"], {"spread": spread, "ratio": ratio}
