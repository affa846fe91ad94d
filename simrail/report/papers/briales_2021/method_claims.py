"""What the paper says of the methods beside each other, asked of our scores.

Where a claim does not reproduce, the cause is one that the scores show: another reading of a setting, a bias
that is not taken off, another filter's rest detection.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from simrail.report.papers.briales_2021.claim import (
    FAILS_DEG,
    HELPS_FACTOR,
    SAME_YAW,
    SAME_YAW_DEG,
    SIZE_FACTOR,
    cropped,
    near,
)
from simrail.report.papers.briales_2021.printed import QUANTITIES, TABLE_3, TIME_CONSTANTS_S
from simrail.report.papers.briales_2021.rides import GENERAL_PURPOSE, PARTS, Rides, is_fast
from simrail.report.papers.claim import Claim
from simrail.report.tables.pivot import Figures
from simrail.report.words.sentences import degrees


def _asked(
    rides: Rides, key: str, said: str, parts: Sequence[str], judge: Callable[[Rides], tuple[bool, str, str]]
) -> Claim:
    if not rides.has(*parts):
        missing = ", ".join(PARTS[part][0] for part in parts if not rides.has(part))
        return Claim(key, said, None, f"Not run on every ride: {missing}.")
    return Claim(key, said, *judge(rides))


def _yuan(rides: Rides) -> tuple[bool, str, str]:
    roll = [rides.mean(part, "roll", window="curve")[0] for part in ("sabatini", "yuan")]
    pitch = [rides.mean(part, "pitch")[0] for part in ("sabatini", "yuan")]
    found = (
        f"In curves the roll error goes from {degrees(roll[0])} (gravity only) to {degrees(roll[1])}, over "
        f"the whole ride the pitch error from {degrees(pitch[0])} to {degrees(pitch[1])} rms, mean over "
        "the rides (holds if roll falls and pitch rises)."
    )
    cause = ""
    if not pitch[1] > pitch[0]:
        cause = (
            "Pitch: a force that braking or traction makes longer is doubted as well, so less of it "
            "enters; our reading of the weight, R + k (|z| - g)\u00b2, is not necessarily theirs."
        )
    return roll[1] < roll[0] and pitch[1] > pitch[0], found, cause


def _sabatini(rides: Rides) -> tuple[bool, str, str]:
    own, best = (rides.mean(part, "yaw")[0] for part in ("sabatini", "ekf"))
    roll = [rides.mean(part, "roll", window="curve")[0] for part in ("sabatini", "ekf")]
    found = (
        f"Yaw {degrees(own)} against {degrees(best)} rms with compensation; roll in curves "
        f"{degrees(roll[0])} against {degrees(roll[1])} (holds if yaw is the same within "
        f"{SAME_YAW_DEG:g}\u00b0 or {100 * SAME_YAW:.0f} % and roll at least {HELPS_FACTOR:g} times as "
        "wrong)."
    )
    return near(own, best) and roll[0] >= HELPS_FACTOR * roll[1], found, ""


def _commercial_yaw(rides: Rides) -> tuple[bool, str, str]:
    yaw, sd = rides.mean("vqf_magnetometer", "yaw", window="cropped", reference="design")
    found = (
        f"{degrees(yaw)} \u00b1 {degrees(sd)} rms over the rides against {TABLE_3['commercial'][2]} (holds "
        f"if more than {FAILS_DEG:g}\u00b0)."
    )
    return yaw > FAILS_DEG, found, _without_magnetometer(rides)


def _without_magnetometer(rides: Rides) -> str:
    if not rides.has("vqf", "imufusion"):
        return ""
    vqf, fusion = (cropped(rides, part, "yaw") for part in ("vqf", "imufusion"))
    text = f"Iron and steel are not all of it: without magnetometer the same filter errs by {degrees(vqf)}"
    if fusion < vqf:
        text += (
            f", and imufusion, which learns no gyro bias on the way, by {degrees(fusion)}. VQF learns one "
            "from slow curves that it takes for a rest, and from fast ones where the force is not "
            "gravity's"
        )
    return text + "."


def _compensation(rides: Rides) -> tuple[bool, str, str]:
    ratios: dict[bool, list[float]] = {False: [], True: []}
    for case in rides.cases:
        for own, twin in (("ekf", "sabatini"), ("gda", "gda_uncompensated")):
            values = [rides.one(case, part, "roll", window="curve") for part in (twin, own)]
            ratios[is_fast(case.labels)].append(values[0] / values[1])
    named = {False: "at 20 km/h", True: "at 70 km/h"}
    parts = [f"{min(r):.1f} to {max(r):.1f} times {named[fast]}" for fast, r in ratios.items() if r]
    found = (
        f"Compensation reduces the roll error in curves {' and '.join(parts)}, EKF and GDA, against the "
        f"truth (holds if at least {HELPS_FACTOR:g} times on every ride)."
    )
    every = [ratio for r in ratios.values() for ratio in r]
    return min(every) >= HELPS_FACTOR, found, ""


def _general_purpose(rides: Rides) -> tuple[bool, str, str]:
    others = rides.present(GENERAL_PURPOSE)
    whole = {(c.labels["ride"], p): _advantage(rides, c, p, "whole") for c in rides.cases for p in others}
    lost = [f"{PARTS[part][0]} on {ride}" for (ride, part), ratio in whole.items() if not ratio > 1.0]
    parts = []
    for fast, named in ((False, "20 km/h"), (True, "70 km/h")):
        group = [case for case in rides.cases if is_fast(case.labels) == fast]
        if group:
            least = min(_advantage(rides, case, part, "curve") for case in group for part in others)
            parts.append(f"{least:.1f} times at {named}")
    found = (
        f"The closest of {len(others)} general-purpose methods has {min(whole.values()):.1f} times the "
        "roll error of the worse of the compensated EKF and GDA, over whole rides against the truth; in "
        f"curves {' and '.join(parts)} (holds if above 1 on every whole ride)."
    )
    return not lost, found, f"Better than a compensated filter: {'; '.join(lost)}." if lost else ""


def _advantage(rides: Rides, case: Figures, part: str, window: str) -> float:
    """Roll error of a method over that of the worse of the compensated EKF and GDA."""
    worse = max(rides.one(case, own, "roll", window=window) for own in ("ekf", "gda"))
    return rides.one(case, part, "roll", window=window) / worse


def _gda_ekf(rides: Rides) -> tuple[bool, str, str]:
    values = {
        (part, q): cropped(rides, part, q) for part in ("gda_paper", "ekf_per_step") for q in QUANTITIES[:2]
    }
    roll = values["ekf_per_step", "roll"] / values["gda_paper", "roll"]
    pitch = values["ekf_per_step", "pitch"] / values["gda_paper", "pitch"]
    printed = [TABLE_3["ekf"][i].mean / TABLE_3["madgwick"][i].mean for i in range(2)]
    found = (
        f"With the paper's settings, its Q read per step, the EKF has {roll:.2f} times the GDA's error in "
        f"roll ({degrees(values['ekf_per_step', 'roll'])} against {degrees(values['gda_paper', 'roll'])}; "
        f"the paper: {printed[0]:.2f}) and {pitch:.2f} times in pitch (the paper: {printed[1]:.2f}); holds "
        f"if above 1 in both and at most {SIZE_FACTOR:g} in roll."
    )
    cause = ""
    if rides.has("ekf_intensity", "ekf", "gda"):
        intensity = cropped(rides, "ekf_intensity", "roll")
        own, other = (cropped(rides, part, "roll") for part in ("ekf", "gda"))
        taus = TIME_CONSTANTS_S
        cause = (
            f"With the same Q read as an intensity (time constant {taus['intensity']:.1f} s instead of "
            f"{taus['per_step']:.2f} s) the EKF has {degrees(intensity)}, and with settings that follow "
            f"from the data sheet {degrees(own)} against {degrees(other)} of the GDA."
        )
        if own < other:
            cause += " So it is a matter of the settings."
    return roll > 1.0 and pitch > 1.0 and roll <= SIZE_FACTOR, found, cause


def _same_yaw(rides: Rides) -> tuple[bool, str, str]:
    yaw = [cropped(rides, part, "yaw") for part in ("gda_paper", "ekf_per_step")]
    found = (
        f"{degrees(yaw[0])} (GDA) and {degrees(yaw[1])} (EKF) rms (holds within {SAME_YAW_DEG:g}\u00b0 or "
        f"{100 * SAME_YAW:.0f} %; the paper: {TABLE_3['madgwick'][2].mean}\u00b0 and "
        f"{TABLE_3['ekf'][2].mean}\u00b0)."
    )
    return near(*yaw), found, ""


def _yaw_size(rides: Rides) -> tuple[bool, str, str]:
    yaw, printed = cropped(rides, "gda_paper", "yaw"), TABLE_3["madgwick"][2]
    found = (
        f"{degrees(yaw)} rms without a bias taken off (holds within one standard deviation of the paper's "
        f"{printed})."
    )
    cause = ""
    if rides.has("gda"):
        cause = (
            "It is a figure of the gyro's bias, not of the methods: with the bias taken off at rests, yaw "
            f"errs by {degrees(cropped(rides, 'gda', 'yaw'))}."
        )
    return abs(yaw - printed.mean) <= printed.sd, found, cause


_CLAIMS: tuple[tuple[str, str, tuple[str, ...], Callable[[Rides], tuple[bool, str, str]]], ...] = (
    (
        "commercial_yaw",
        "Section 2, Figs. 1 and 12: the commercial AHRS, which uses its magnetometer, fails in yaw.",
        ("vqf_magnetometer",),
        _commercial_yaw,
    ),
    (
        "sabatini",
        "Section 2, Fig. 2: an EKF that takes all acceleration for gravity has a good yaw and the same "
        "faults in roll.",
        ("sabatini", "ekf"),
        _sabatini,
    ),
    (
        "yuan",
        "Section 2, Fig. 3: doubting the accelerometer when it moves, after Yuan, improves roll in curves "
        "but makes pitch worse.",
        ("yuan", "sabatini"),
        _yuan,
    ),
    (
        "compensation",
        "Section 7.1, Figs. 13 and 14: compensation makes roll in curves accurate.",
        ("ekf", "sabatini", "gda", "gda_uncompensated"),
        _compensation,
    ),
    (
        "general_purpose",
        "Sections 7.5 and 9: the compensated methods beat general-purpose ones in roll.",
        ("ekf", "gda"),
        _general_purpose,
    ),
    (
        "gda_slightly_better",
        "Section 7.1, Fig. 12: Madgwick's GDA is slightly better than the EKF in roll, and better in pitch.",
        ("gda_paper", "ekf_per_step"),
        _gda_ekf,
    ),
    (
        "same_yaw",
        "Section 7.1, Fig. 11: yaw is the same for GDA and EKF.",
        ("gda_paper", "ekf_per_step"),
        _same_yaw,
    ),
    (
        "yaw_size",
        f"Table 3: yaw of GDA and EKF drifts by {TABLE_3['madgwick'][2].mean}\u00b0 rms.",
        ("gda_paper",),
        _yaw_size,
    ),
)


def method_claims(rides: Rides) -> list[Claim]:
    """What the paper says of the methods beside each other, in its order."""
    return [_asked(rides, key, said, parts, judge) for key, said, parts, judge in _CLAIMS]
