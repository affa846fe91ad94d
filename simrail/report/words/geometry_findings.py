"""What the scores say of the rails, in sentences: looked up in the scores, whether they flatter or not."""

from collections.abc import Mapping, Sequence

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
from simrail.report.tables.pivot import Case, ablated
from simrail.report.words.ablations import WORDS
from simrail.report.words.sentences import Finding, interval_verdict, listed, significant
from simrail.scoring.ablations import ABLATIONS, COLUMNS
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
        All cases: those with the true position, an ideal IMU and the ablations say what the error is of.
    goals_mm : mapping of str to float, optional
        By quantity: what its error in `BAND` is asked to be at most, sd; nothing is asked in other bands.
    known : mapping of str to Band
        Bands whose wavelengths are told.
    """
    floor, main, band = baseline_of(case, styles), main_of(case, styles), judged_band(case)
    if main is None:
        return []
    where = waves_words(band, known)
    twins = {
        "with the true position": _twin(case, others, odometry=True),
        **{WORDS[one].phrase.lower(): ablated(case, others, one) for one in ABLATIONS},
        "with an ideal IMU": _twin(case, others, imu=True),
        "with both, which is the vehicle between IMU and rails, and the method": _twin(
            case, others, odometry=True, imu=True
        ),
    }
    result = []
    for quantity in JUDGED:
        own, words = sd_of(case, main, quantity, band=band), QUANTITIES[quantity]
        if not own > 0.0:
            continue
        tone, text = "note", f"{where[:1].upper()}{where[1:]}, the {words} of {main.label}"
        text += f" is off by {significant(own)} mm (sd)"
        if floor:
            zero = sd_of(case, floor, quantity, band=band)
            tone = "good" if own < zero else "bad"
            text += f"; that of no IMU at all by {significant(zero)} mm"
        goal = (goals_mm or {}).get(quantity) if band == BAND else None
        if goal is not None:
            tone = "bad" if own > goal else tone
            over = f"missed by {significant(own - goal)} mm" if own > goal else "kept"
            text += f". Asked were {goal:g} mm: {over}"
        sds = {name: sd_of(twin, main, quantity, band=band) for name, twin in twins.items() if twin}
        parts = [f"{significant(sd)} mm {name}" for name, sd in sds.items() if sd > 0.0]
        text += f". It would be {', '.join(parts)}." if parts else "."
        result.append(Finding(tone, text + _beside(case, styles, quantity, band=band)))
    return result + _lost(case, styles, band) + _coverage(case, main, band, known)


def _beside(case: Case, styles: Sequence[MethodStyle], quantity: str, *, band: str) -> str:
    """What the other methods under test err by: all of a few, else the best and the worst."""
    _, *rest = [style for style in mappers(case, styles) if not is_zero(style)]
    sds = {style.label: sd_of(case, style, quantity, band=band) for style in rest}
    by = {label: f"by {significant(sd)} mm" for label, sd in sds.items() if sd > 0.0}
    if not by:
        return ""
    if len(by) <= MOST_OTHERS:
        (first, its), *more = by.items()
        return (
            f" {listed([f'That of {first} is off {its}', *(f'that of {one} {own}' for one, own in more)])}."
        )
    best, worst = (choose(by, key=lambda label: sds[label]) for choose in (min, max))
    return (
        f" Of the {len(by)} other methods, that of {best} is off the least, {by[best]}, and that of {worst} "
        f"the most, {by[worst]}."
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
    for name in (band, FULL):
        covered = {quantity: case.get(main.name, quantity, "coverage95", band=name) for quantity in JUDGED}
        shares = {quantity: share.value for quantity, share in covered.items() if share.draws}
        if shares:
            verdicts = {quantity: interval_verdict(share) for quantity, share in shares.items()}
            parts = [
                f"the true {QUANTITIES[quantity]} in {100.0 * share:.0f} %: {verdicts[quantity][1]}"
                for quantity, share in shares.items()
            ]
            tones = [tone for tone, _ in verdicts.values()]
            worst = next(tone for tone in ("bad", "note", "good") if tone in tones)
            where = "of the unfiltered rails" if name == FULL else waves_words(name, known)
            return [Finding(worst, f"The 95 % interval of {main.label}, {where}, holds {'; '.join(parts)}.")]
    return []


def _twin(case: Case, others: Sequence[Case], *, imu: bool = False, odometry: bool = False) -> Case | None:
    """The case that differs in an ideal IMU, the true odometry, or both; None if there is none.

    Ablations are the same: what they change is told by itself.
    """
    own = case.labels
    if own["imu"] == "ideal" or own["odometry"] == "truth":
        return None
    for other in others:
        labels = other.labels
        fits = (
            labels["mount"] in (own["mount"], f"{own['mount']}_ideal")
            and all(labels[name] == own[name] for name in ("ride", "vehicle", *COLUMNS))
            and labels["imu"] == ("ideal" if imu else own["imu"])
            and labels["odometry"] == ("truth" if odometry else own["odometry"])
        )
        if fits:
            return other
    return None
