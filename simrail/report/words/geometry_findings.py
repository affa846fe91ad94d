"""What the scores say of the rails, in sentences: looked up in the scores, whether they flatter or not."""

from collections.abc import Mapping, Sequence

import numpy as np

from simrail.report.tables.geometry import (
    BAND,
    JUDGED,
    QUANTITIES,
    baseline_of,
    behind_baseline,
    is_zero,
    judged_band,
    main_of,
    mappers,
    sd_of,
    waves_words,
)
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case
from simrail.report.words.sentences import Finding, interval_verdict, listed, significant
from simrail.scoring.table import FULL
from simrail.track.bands import BANDS, Band

MOST_OTHERS = 2
"""So many other methods are told one by one beside the first; of more, the best and the worst."""


def geometry_findings(
    case: Case,
    styles: Sequence[MethodStyle],
    others: Sequence[Case],
    *,
    goals_mm: Mapping[str, float] | None = None,
    known: Mapping[str, Band] = BANDS,
) -> list[Finding]:
    """What the scores say of the rails in the band that the case is judged in: `judged_band`.

    The first method is told beside no IMU and beside the other methods, and what its error is of.

    Parameters
    ----------
    case, styles : Case, sequence of MethodStyle
        The case and the scenario's methods.
    others : sequence of Case
        All cases: those with the true position and an ideal IMU say what the error is of.
    goals_mm : mapping of str to float, optional
        By quantity: what its error in `BAND` is asked to be at most, sd; nothing is asked in other bands.
    known : mapping of str to Band
        Bands whose wavelengths are told.
    """
    floor, main, band = baseline_of(case, styles), main_of(case, styles), judged_band(case)
    if main is None:
        return []
    where = waves_words(band, known)
    where = where[:1].upper() + where[1:]
    result = []
    for quantity in JUDGED:
        own, words = sd_of(case, main, quantity, band=band), QUANTITIES[quantity]
        if not own > 0.0:
            continue
        text = f"{where}, the {words} of {main.label} is off by {significant(own)} mm (sd)"
        tone = "note"
        if floor:
            zero = sd_of(case, floor, quantity, band=band)
            tone = "good" if own < zero else "bad"
            text += f"; that of no IMU at all by {significant(zero)} mm"
        goal = (goals_mm or {}).get(quantity) if band == BAND else None
        if goal is not None:
            tone = "bad" if own > goal else tone
            over = f"missed by {significant(own - goal)} mm" if own > goal else "kept"
            text += f". Asked were {goal:g} mm: {over}"
        parts = []
        for name, words_of in (("odometry", "with the true position"), ("imu", "with an ideal IMU")):
            twin = _twin(case, others, name)
            least = sd_of(twin, main, quantity, band=band) if twin else np.nan
            if least > 0.0:
                parts.append(f"{significant(least)} mm {words_of}")
        both = _twin(case, others, "both")
        least = sd_of(both, main, quantity, band=band) if both else np.nan
        if least > 0.0:
            parts.append(
                f"{significant(least)} mm with both, which is the vehicle between IMU and rails, and the "
                "method"
            )
        text += f". It would be {', '.join(parts)}." if parts else "."
        text += _beside(case, styles, quantity, band=band)
        result.append(Finding(tone, text))
    return result + _lost(case, styles, band) + _coverage(case, main, band, known)


def _beside(case: Case, styles: Sequence[MethodStyle], quantity: str, *, band: str) -> str:
    """What the other methods under test err by: all of a few, else the best and the worst."""
    _, *rest = [style for style in mappers(case, styles) if not is_zero(style)]
    sds = {style.label: sd_of(case, style, quantity, band=band) for style in rest}
    sds = {label: sd for label, sd in sds.items() if sd > 0.0}
    if not sds:
        return ""
    if len(sds) <= MOST_OTHERS:
        first, *more = [(label, f"by {significant(sd)} mm") for label, sd in sds.items()]
        told = [f"That of {first[0]} is off {first[1]}", *(f"that of {label} {by}" for label, by in more)]
        return f" {listed(told)}."
    best, worst = (choose(sds, key=lambda label: sds[label]) for choose in (min, max))
    return (
        f" Of the {len(sds)} other methods, that of {best} is off the least, by {significant(sds[best])} mm, "
        f"and that of {worst} the most, by {significant(sds[worst])} mm."
    )


def _lost(case: Case, styles: Sequence[MethodStyle], band: str) -> list[Finding]:
    """Which of the other methods lose to no IMU at all; the first says so itself."""
    first, lost = main_of(case, styles), []
    for quantity in JUDGED:
        behind = behind_baseline(case, styles, quantity, band=band)
        worse = [style.label for style in behind if style is not first]
        if worse:
            lost.append(f"{listed(worse)} in {QUANTITIES[quantity]}")
    return [Finding("bad", f"No IMU at all beats {'; '.join(lost)}.")] if lost else []


def _coverage(case: Case, main: MethodStyle, band: str, known: Mapping[str, Band]) -> list[Finding]:
    """What the 95 % intervals of the first method hold, in one sentence as bad as the worst of them.

    Those of the band that counts where the method has them, else those of the unfiltered rails.
    """
    told, tones = [], []
    if not any(case.get(main.name, quantity, "coverage95", band=band).draws for quantity in JUDGED):
        band = FULL
    for quantity in JUDGED:
        covered = case.get(main.name, quantity, "coverage95", band=band)
        if not covered.draws:
            continue
        tone, verdict = interval_verdict(covered.value)
        told.append(f"the true {QUANTITIES[quantity]} in {100.0 * covered.value:.0f} %: {verdict}")
        tones.append(tone)
    if not told:
        return []
    worst = next(tone for tone in ("bad", "note", "good") if tone in tones)
    where = "of the unfiltered rails" if band == FULL else waves_words(band, known)
    text = f"The 95 % interval of {main.label}, {where}, holds {'; '.join(told)}."
    return [Finding(worst, text)]


def _twin(case: Case, others: Sequence[Case], what: str) -> Case | None:
    """The case that differs in an ideal IMU, the true odometry, or both; None if there is none."""
    if case.labels["imu"] == "ideal" or case.labels["odometry"] == "truth":
        return None
    mount = case.labels["mount"]
    wanted = dict(case.labels)
    for other in others:
        labels = other.labels
        is_ideal = labels["imu"] == "ideal"
        same_mount = labels["mount"] in (mount, f"{mount}_ideal")
        if not same_mount or any(labels[k] != wanted[k] for k in ("ride", "vehicle")):
            continue
        odometry_true = labels["odometry"] == "truth"
        same_odometry = labels["odometry"] == wanted["odometry"]
        fits = {
            "odometry": odometry_true and labels["imu"] == wanted["imu"],
            "imu": is_ideal and same_odometry,
            "both": is_ideal and odometry_true,
        }
        if fits[what]:
            return other
    return None
