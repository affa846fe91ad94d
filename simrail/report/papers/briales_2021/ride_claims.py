"""What the paper says of sizes, directions and repeatability, asked of our rides."""

from __future__ import annotations

import numpy as np

from simrail.report.papers.briales_2021.claim import (
    FAILS_BACKWARD_FACTOR,
    REPEATS_FACTOR,
    SAME_DIRECTION_DEG,
    SIZE_FACTOR,
    cropped,
)
from simrail.report.papers.briales_2021.printed import QUANTITIES, TABLE_3
from simrail.report.papers.briales_2021.rides import PARTS, Rides
from simrail.report.papers.claim import Claim
from simrail.report.tables.pivot import Figures
from simrail.report.words.sentences import degrees, significant


def ride_claims(rides: Rides, *, spread: dict[str, float], wrong_sign_deg: float) -> list[Claim]:
    """All of them, in the order of the paper.

    Parameters
    ----------
    rides : Rides
        The scores.
    spread : dict of str to float
        By part: how much the roll error at one place differs between rides, degrees.
    wrong_sign_deg : float
        Apparent roll that a compensation of the wrong sign would leave in the sharpest curve of the
        fastest backward ride.
    """
    return [
        *(_size(rides, row, part) for row, part in _SIZES.items()),
        _backward_gda(rides),
        _backward_ekf(rides, wrong_sign_deg),
        _repeatability(rides, spread),
    ]


_SIZES = {"commercial": "vqf_magnetometer", "madgwick": "gda_paper", "ekf": "ekf_per_step"}
_ROW_NAMES = {
    "commercial": "Commercial IMU",
    "madgwick": "Madgwick",
    "ekf": "EKF with compensated accelerations",
}
_SIZE_CAUSES = {
    "roll": "roll contains irregularities, the axle's motion and the accelerometer's bias",
    "pitch": "pitch contains the odometry's error of acceleration",
    "yaw": "yaw is the gyro's bias, drawn here within its data sheet, run up over the ride",
}
"""What the error of an angle is made of that the paper does not publish of its own rides."""

_STAND_IN = (
    "the sensor's own filter is not published, and a filter for people and hand-held things stands in for it"
)


def _size(rides: Rides, row: str, part: str) -> Claim:
    key = f"size_{row}"
    printed = TABLE_3[row]
    said = (
        f"Table 3, {_ROW_NAMES[row]}: "
        + ", ".join(f"{q} {p.mean:g}\u00b0" for q, p in zip(QUANTITIES, printed, strict=True))
        + " rms."
    )
    if not rides.has(part):
        return Claim(key, said, None, f"Not run on every ride: {PARTS[part][0]}.")
    own = [cropped(rides, part, q) for q in QUANTITIES]
    factors = {q: o / p.mean for q, o, p in zip(QUANTITIES, own, printed, strict=True)}
    off = [q for q, factor in factors.items() if not 1.0 / SIZE_FACTOR <= factor <= SIZE_FACTOR]
    listed = ", ".join(f"{q} {degrees(o)}" for q, o in zip(QUANTITIES, own, strict=True))
    found = f"Ours, {PARTS[part][0]}: {listed} (holds within a factor of {SIZE_FACTOR:g})."
    cause = ""
    if off:
        named = ", ".join(f"{q} ({factors[q]:.2f} times)" for q in off)
        why = [_STAND_IN] if row == "commercial" else [_SIZE_CAUSES[q] for q in off]
        cause = f"Off: {named}. What is not the same: {'; '.join(why)}."
    return Claim(key, said, not off, found, cause)


def _backward_gda(rides: Rides) -> Claim:
    said = "Section 7.3, Fig. 17: with GDA, roll on backward rides is as good as on forward ones."
    pairs = _pairs(rides)
    if not pairs or not rides.has("gda_paper"):
        return Claim(
            "backward_gda", said, None, "Not run: forward and backward rides with the paper's settings."
        )
    apart = {part: _apart(rides, part, pairs) for part in rides.present(("gda_paper", "gda"))}
    listed = "; ".join(f"{PARTS[part][0]} {degrees(value)}" for part, value in apart.items())
    found = (
        "Roll errors against the truth, backward and forward, whole rides of one speed, differ by at "
        f"most: {listed} (holds for the paper's settings if at most {SAME_DIRECTION_DEG:g}\u00b0)."
    )
    return Claim("backward_gda", said, apart["gda_paper"] <= SAME_DIRECTION_DEG, found)


def _backward_ekf(rides: Rides, wrong_sign_deg: float) -> Claim:
    said = "Sections 7.3, 7.5, Figs. 18 and 22: the EKF fails on backward rides, worst in curves of back70."
    pairs = _pairs(rides)
    if not pairs or not rides.has("ekf_per_step"):
        return Claim(
            "backward_ekf", said, None, "Not run: forward and backward rides with the paper's settings."
        )
    parts = rides.present(("ekf_per_step", "ekf_intensity", "ekf"))
    ratios = {
        part: max(_in_curves(rides, part, back) / _in_curves(rides, part, go) for go, back in pairs)
        for part in parts
    }
    listed = "; ".join(
        f"{PARTS[part][0]} {ratio:.2f}, whole rides apart by {degrees(_apart(rides, part, pairs))}"
        for part, ratio in ratios.items()
    )
    fails = ratios["ekf_per_step"] >= FAILS_BACKWARD_FACTOR
    found = (
        f"Backward over forward roll error in curves, at most: {listed} (holds if the EKF with the paper's "
        f"settings, Q per step, has {FAILS_BACKWARD_FACTOR:g})."
    )
    cause = ""
    if not fails and wrong_sign_deg > 0.0:  # NaN without a backward ride to look at
        cause = (
            "The filter has no way to tell directions apart: V changes sign, V\u00b2k does not. A "
            "compensation of the wrong sign, as from a curvature taken in the direction of travel, would "
            f"leave {degrees(wrong_sign_deg)} of roll in the sharpest curve of our fastest backward ride: "
            "a sign is the likelier cause of theirs."
        )
    return Claim("backward_ekf", said, fails, found, cause)


def _apart(rides: Rides, part: str, pairs: list[tuple[list[Figures], list[Figures]]]) -> float:
    """Largest difference between the roll errors of backward and forward rides of a class of speed."""
    return max(
        abs(_average(rides, part, back, "whole") - _average(rides, part, go, "whole")) for go, back in pairs
    )


def _pairs(rides: Rides) -> list[tuple[list[Figures], list[Figures]]]:
    found = [
        (rides.where(forward=True, fast=fast), rides.where(forward=False, fast=fast))
        for fast in (False, True)
    ]
    return [pair for pair in found if pair[0] and pair[1]]


def _in_curves(rides: Rides, part: str, group: list[Figures]) -> float:
    return _average(rides, part, group, "curve")


def _average(rides: Rides, part: str, group: list[Figures], window: str) -> float:
    return float(np.mean([rides.one(case, part, "roll", window=window) for case in group]))


def _repeatability(rides: Rides, spread: dict[str, float]) -> Claim:
    said = "Sections 7.2 to 7.5, Figs. 15 to 22: roll repeats well with GDA, and badly with the EKF."
    if "gda_paper" not in spread or "ekf_per_step" not in spread:
        return Claim("repeatability", said, None, "Not run: several rides with the paper's settings.")
    listed = "; ".join(f"{PARTS[part][0]} {degrees(value)}" for part, value in spread.items())
    ratio = spread["ekf_per_step"] / spread["gda_paper"]
    found = (
        "Spread of the roll error between the rides at the same place, rms along the line, first draw: "
        f"{listed}. The EKF with the paper's settings spreads {significant(ratio)} times as much as the "
        f"GDA (holds if {REPEATS_FACTOR:g} times)."
    )
    cause = ""
    if "ekf" in spread and "gda" in spread and spread["ekf"] <= spread["gda"]:
        cause = (
            "That is a matter of the settings: with the recommended ones the EKF repeats better than the GDA."
        )
    return Claim("repeatability", said, ratio >= REPEATS_FACTOR, found, cause)
