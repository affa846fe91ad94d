"""What the scores say, in sentences: every figure in them is looked up, none is known beforehand.

A sentence is written whether it flatters or not: where 'design angles only' beats a filter it says
so, and where compensation does not help it says that.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from simrail.core.jit import FloatArray
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case, ablated
from simrail.report.words.ablations import WORDS
from simrail.report.words.sentences import Finding, degrees, interval_verdict, listed, significant
from simrail.scoring.ablations import ABLATIONS

_QUANTITIES = {"roll": "roll", "pitch": "pitch", "yaw_debiased": "yaw without its initial offset"}
_WINDOWS = {
    "straight": "in straights",
    "transition": "in transitions",
    "curve": "in curves",
    "standstill": "at standstill",
}

ALIKE = 0.01
"""Methods are alike if no figure of their attitude differs by more than this share of it."""

MOST_NAMED = 3
"""So many methods have a sentence each; of more, sentences tell together."""


def findings(case: Case, styles: Sequence[MethodStyle], *, others: Sequence[Case] = ()) -> list[Finding]:
    """Everything that is worth saying of a case.

    Parameters
    ----------
    case : Case
        The case.
    styles : sequence of MethodStyle
        The methods of the scenario.
    others : sequence of Case
        All cases of the scenario: those with an ideal IMU and of ablations are looked for among them.
    """
    groups = alike(case, styles)
    like = {style.name for _, *rest in groups for style in rest}
    unlike = [style for style in styles if style.name not in like]
    return [
        *_alike(groups),
        *_compensation(case, unlike),
        *_design_angles(case, unlike),
        *_general_purpose(case, unlike),
        *_floor(case, unlike, others),
        *_ablations(case, unlike, others),
        *_consistency(case, unlike),
        *_odometry(case),
        *_failures(case),
    ]


def _rms(case: Case, name: str, quantity: str = "roll", *, window: str = "whole") -> float:
    """Error of a method; NaN without any."""
    return case.get(name, quantity, "rms", window=window).value


def _alike(groups: Sequence[Sequence[MethodStyle]]) -> Iterator[Finding]:
    """Methods that the other sentences do not tell apart."""
    for group in groups:
        if len(group) > 1:
            yield Finding(
                "note",
                f"The attitudes of {listed([style.label for style in group])} differ by less than "
                f"{100.0 * ALIKE:g} %: what is said of {group[0].label} holds of "
                f"{'both' if len(group) == 2 else 'all of them'}.",
            )


def _compensation(case: Case, styles: Sequence[MethodStyle]) -> Iterator[Finding]:
    for style in styles:
        in_curves = case.get(style.name, "roll", "rms", window="curve").draws > 0
        window, where = ("curve", "In curves") if in_curves else ("whole", "Over the whole ride")
        own, without = (_rms(case, name, window=window) for name in (style.name, style.twin))
        if not (style.compensated and own > 0.0 and without > 0.0):
            continue
        roll, ratio = f"the roll error of {style.kind}", without / own
        sizes = f"from {degrees(without)} rms without to {degrees(own)} with it"
        if ratio >= 1.05:
            yield Finding("good", f"{where}, compensation takes {roll} {sizes}: {ratio:.1f} times less.")
        else:
            yield Finding("bad", f"{where}, compensation does not reduce {roll}: it goes {sizes}.")


def _design_angles(case: Case, styles: Sequence[MethodStyle]) -> Iterator[Finding]:
    design = next((style for style in styles if not style.uses_imu), None)
    if design is None:
        yield Finding(
            "note", "'Design angles only' was not run: whether a filter beats no IMU at all is not known."
        )
        return
    losses = {
        style: [loss for quantity in _QUANTITIES if (loss := _loss(case, style, design, quantity))]
        for style in styles
        if style.uses_imu and not style.baseline and case.get(style.name, "roll", "rms").draws
    }
    unbeaten = [style.label for style, lost in losses.items() if not lost]
    beaten = [style for style, lost in losses.items() if lost]
    if unbeaten:
        yield Finding(
            "good",
            f"'Design angles only', which uses no IMU, nowhere beats {listed(unbeaten)}: neither "
            "overall nor in any kind of track.",
        )
    if len(beaten) > MOST_NAMED:
        yield from _many_beaten(case, beaten, design)
    else:
        for style in beaten:
            text = f"'Design angles only', which uses no IMU, beats {style.label} in {listed(losses[style])}."
            yield Finding("bad", text)


def _many_beaten(case: Case, styles: Sequence[MethodStyle], design: MethodStyle) -> Iterator[Finding]:
    """Where the design angles win over many methods: a sentence per quantity, without the sizes."""
    for quantity, word in _QUANTITIES.items():
        floor = _rms(case, design.name, quantity)
        lost = [style for style in styles if _loss(case, style, design, quantity)]
        overall = [style.label for style in lost if floor < _rms(case, style.name, quantity)]
        in_parts = [style.label for style in lost if style.label not in overall]
        parts = [f"{listed(overall)} over the whole ride"] if overall else []
        parts += [f"{listed(in_parts)} in some kind of track"] if in_parts else []
        if parts:
            text = f"In {word}, 'design angles only', which uses no IMU, beats {', and '.join(parts)}."
            yield Finding("bad", text)


def _loss(case: Case, style: MethodStyle, design: MethodStyle, quantity: str) -> str:
    """Where a method loses to the design angles in one quantity, in words; "" if nowhere."""
    word = _QUANTITIES[quantity]
    own, floor = (
        {window: _rms(case, name, quantity, window=window) for window in ("whole", *_WINDOWS)}
        for name in (style.name, design.name)
    )
    if not floor["whole"] < own["whole"]:
        lost = [place for window, place in _WINDOWS.items() if floor[window] < own[window]]
        return f"{word} {listed(lost)}" if lost else ""
    won = [place for window, place in _WINDOWS.items() if own[window] < floor[window]]
    inside = f", though not {listed(won)}" if won else ""
    return f"{word} ({degrees(floor['whole'])} against {degrees(own['whole'])} rms{inside})"


def _general_purpose(case: Case, styles: Sequence[MethodStyle]) -> Iterator[Finding]:
    tested = [s for s in styles if not s.baseline and case.get(s.name, "roll", "rms").draws]
    if not tested:
        return
    best = min(tested, key=lambda style: _rms(case, style.name))
    own = _rms(case, best.name)
    others = {s: _rms(case, s.name) for s in styles if s.baseline == "general purpose"}
    for word, tone, found in (
        ("worse", "good", [s for s, other in others.items() if other > max(own, 0.0)]),
        ("better", "bad", [s for s, other in others.items() if 0.0 < other <= own]),
    ):
        if found:
            sizes = listed([f"{degrees(others[style])} by {style.label}" for style in found])
            head = f"The general-purpose filter {found[0].label} is"
            if len(found) == 1:
                sizes = degrees(others[found[0]])
            else:
                head = f"{len(found)} general-purpose filters are"
            text = f"{head} {word} than {best.label} in roll: {sizes} against {degrees(own)} rms"
            yield Finding(tone, f"{text} over the whole ride.")


_OF_THE_IMU = ("imu", "imu.grade", "mount", "case")
"""Labels in which the case of the ideal IMU differs by its nature; it may be an IMU of its own."""


def _floor(case: Case, styles: Sequence[MethodStyle], others: Sequence[Case]) -> Iterator[Finding]:
    if case.labels["imu"] == "ideal":
        return
    # The same ride in every other respect: speed, irregularity and whatever else there is an axis for.
    same = {(name, label) for name, label in case.labels.items() if name not in _OF_THE_IMU}
    ideal = next((c for c in others if c.labels["imu"] == "ideal" and same <= c.labels.items()), None)
    if ideal is None:
        text = "No ideal IMU was run beside this one: what of the errors is the methods' own is not known."
        yield Finding("note", text)
        return
    sizes = {
        style.label: (least, own)
        for style in styles
        if not style.baseline
        and (own := _rms(case, style.name)) > 0.0
        and (least := _rms(ideal, style.name)) > 0.0
    }
    words = [f"{label} {degrees(least)} instead of {degrees(own)}" for label, (least, own) in sizes.items()]
    parts = f"{'; '.join(words)} rms."
    if len(sizes) > MOST_NAMED:
        with_ideal, with_own = (
            f"{degrees(min(rms))} to {degrees(max(rms))}" for rms in zip(*sizes.values(), strict=True)
        )
        parts = f"{with_ideal} rms, by method, instead of {with_own}."
    if sizes:
        yield Finding("note", f"With an ideal IMU the roll error over the whole ride would be: {parts}")


def _ablations(case: Case, styles: Sequence[MethodStyle], others: Sequence[Case]) -> Iterator[Finding]:
    """By ablation and angle, the method whose error it would change the most."""
    for one in ABLATIONS:
        twin = ablated(case, others, one)
        if twin is not None:
            yield from _ablation(case, styles, twin, WORDS[one].phrase)


def _ablation(case: Case, styles: Sequence[MethodStyle], twin: Case, phrase: str) -> Iterator[Finding]:
    parts = []
    for quantity, word in _QUANTITIES.items():
        sizes = {
            style.label: (least, own)
            for style in styles
            if (own := _rms(case, style.name, quantity)) > 0.0
            and (least := _rms(twin, style.name, quantity)) > 0.0
        }
        if sizes:
            label = max(sizes, key=lambda label: abs(np.log(sizes[label][1] / sizes[label][0])))
            least, own = sizes[label]
            parts.append(f"{word} of {label} ({degrees(least)} instead of {degrees(own)} rms)")
    if parts:
        text = f"{phrase}, an ablation, the errors over the whole ride that would change the most are"
        yield Finding("note", f"{text} {listed(parts)}.")


def _consistency(case: Case, styles: Sequence[MethodStyle]) -> Iterator[Finding]:
    shares = {}
    for style in styles:
        covered = {angle: case.get(style.name, angle, "coverage95") for angle in ("roll", "pitch")}
        held = {angle: share.value for angle, share in covered.items() if share.draws}
        if held and not style.baseline:
            shares[style.label] = held
    if len(shares) > MOST_NAMED:
        # A sentence per verdict, each method with the worse of roll and pitch.
        by_verdict: dict[tuple[str, str], list[str]] = {}
        for label, held in shares.items():
            worse = min(held.values())
            words = f"{label} ({100.0 * worse:.0f} % inside)"
            by_verdict.setdefault(interval_verdict(worse), []).append(words)
        for (tone, verdict), named in by_verdict.items():
            yield Finding(tone, f"The 95 % interval of roll or pitch is {verdict} with {listed(named)}.")
        return
    for label, held in shares.items():
        parts = [f"the true {angle} in {100.0 * share:.0f} %" for angle, share in held.items()]
        tone, verdict = interval_verdict(min(held.values()))
        text = f"The 95 % interval of {label} holds {listed(parts)} of the samples: "
        yield Finding(tone, f"{text}the standard deviations that it claims are {verdict}.")


def _odometry(case: Case) -> Iterator[Finding]:
    for name in case.estimators():
        if name.startswith("odometry:"):
            rms, largest = (case.get(name, "position", metric).value for metric in ("rms", "max"))
            # A scenario says which metrics it keeps.
            sizes = [f"{significant(rms)} m rms"] * (rms >= 0.0)
            sizes += [f"at most {significant(largest)} m"] * (largest >= 0.0)
            source = name.removeprefix("odometry:")
            note = ", the true one: an ablation, not something that a train has" if source == "truth" else ""
            if sizes:
                yield Finding(
                    "note",
                    f"Methods that find neither take position and speed from the odometry '{source}'{note}; "
                    f"its position error is {listed(sizes)}.",
                )


def _failures(case: Case) -> Iterator[Finding]:
    empty = case.table[(case.table["failed"] > 0) & (case.table["window"].astype(str) == "whole")]
    for name in empty["estimator"].unique():
        yield Finding("bad", f"{name} has no value for some figures; see 'What failed'.")


def alike(case: Case, styles: Sequence[MethodStyle]) -> list[list[MethodStyle]]:
    """Methods under test in groups that are alike, in their order; most groups are of one.

    What is compared are rms errors by quantity and kind of track, and what the 95 % intervals hold.
    """
    groups: list[list[MethodStyle]] = []
    for style in styles:
        if style.baseline:
            continue
        own = _figures(case, style)
        like = (
            group
            for group in groups
            if np.isfinite(own).any()
            and np.allclose(own, _figures(case, group[0]), rtol=ALIKE, atol=0.0, equal_nan=True)
        )
        group = next(like, None)
        if group is None:
            groups.append([style])
        else:
            group.append(style)
    return groups


def one_of_each(case: Case, styles: Sequence[MethodStyle]) -> list[MethodStyle]:
    """Methods without those that lie upon an earlier one in a figure, which says how many they are."""
    like, labels = set(), {}
    for first, *rest in alike(case, styles):
        like |= {style.name for style in rest}
        labels[first.name] = f"{first.label} and {len(rest)} alike" if rest else first.label
    return [replace(s, label=labels.get(s.name, s.label)) for s in styles if s.name not in like]


def _figures(case: Case, style: MethodStyle) -> FloatArray:
    windows = ("whole", *_WINDOWS)
    errors = [_rms(case, style.name, q, window=window) for q in _QUANTITIES for window in windows]
    held = [case.get(style.name, quantity, "coverage95").value for quantity in _QUANTITIES]
    return np.array([*errors, *held])
