"""What the scores say, in sentences: every figure in them is looked up, none is known beforehand.

A sentence is written whether it flatters or not: where 'design angles only' beats a filter it says
so, and where compensation does not help it says that.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simrail.core.jit import FloatArray
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case
from simrail.report.words.sentences import Finding, degrees, interval_verdict, listed, significant

_QUANTITIES = {"roll": "roll", "pitch": "pitch", "yaw_debiased": "yaw without its initial offset"}
_WINDOWS = {
    "straight": "in straights",
    "transition": "in transitions",
    "curve": "in curves",
    "standstill": "at standstill",
}

ALIKE = 0.01
"""Methods are alike if no figure of their attitude differs by more than this share of it."""

_COMPARED = ("roll", "pitch", "yaw_debiased")
_EVERYWHERE = ("whole", "straight", "transition", "curve", "standstill")

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
        All cases of the scenario: the one with an ideal IMU is looked for among them.
    """
    groups = alike(case, styles)
    like = {style.name for _, *rest in groups for style in rest}
    told = [style for style in styles if style.name not in like]
    return [
        *_alike(groups),
        *_compensation(case, told),
        *_design_angles(case, told),
        *_general_purpose(case, told),
        *_floor(case, told, others),
        *_consistency(case, told),
        *_odometry(case),
        *_failures(case),
    ]


def _alike(groups: Sequence[Sequence[MethodStyle]]) -> list[Finding]:
    """Methods that the other sentences do not tell apart."""
    result = []
    for group in groups:
        if len(group) > 1:
            text = (
                f"The attitudes of {listed([style.label for style in group])} differ by less than "
                f"{100.0 * ALIKE:g} %: what is said of {group[0].label} holds of "
                f"{'both' if len(group) == 2 else 'all of them'}."
            )
            result.append(Finding("note", text))
    return result


def _compensation(case: Case, styles: Sequence[MethodStyle]) -> list[Finding]:
    result = []
    for style in styles:
        if not (style.compensated and style.twin):
            continue
        window = "curve" if case.get(style.name, "roll", "rms", window="curve").draws else "whole"
        where = "In curves" if window == "curve" else "Over the whole ride"
        own = case.get(style.name, "roll", "rms", window=window).value
        without = case.get(style.twin, "roll", "rms", window=window).value
        if not (own > 0.0 and without > 0.0):
            continue
        name, ratio = style.kind, without / own
        sizes = f"{degrees(without)} rms without to {degrees(own)} with it"
        if ratio >= 1.05:
            text = (
                f"{where}, compensation takes the roll error of {name} from {sizes}: {ratio:.1f} times less."
            )
            result.append(Finding("good", text))
        else:
            text = f"{where}, compensation does not reduce the roll error of {name}: it goes from {sizes}."
            result.append(Finding("bad", text))
    return result


def _design_angles(case: Case, styles: Sequence[MethodStyle]) -> list[Finding]:
    design = next((style for style in styles if not style.uses_imu), None)
    if design is None:
        text = "'Design angles only' was not run: whether a filter beats no IMU at all is not known."
        return [Finding("note", text)]
    result, unbeaten, baselines = [], [], []
    beaten: dict[str, list[str]] = {}
    for style in styles:
        if not style.uses_imu or not case.get(style.name, "roll", "rms").draws:
            continue
        losses = [
            loss
            for quantity, word in _QUANTITIES.items()
            if (loss := _loss(case, style, design, quantity, word))
        ]
        if losses and style.baseline:
            baselines.append(f"{style.label} in {listed(losses)}")
        elif losses:
            beaten[style.label] = losses
        else:
            unbeaten.append(style.label)
    if len(beaten) > MOST_NAMED:
        result += _many_beaten(case, [style for style in styles if style.label in beaten], design)
    else:
        for label, losses in beaten.items():
            text = f"'Design angles only', which uses no IMU, beats {label} in {listed(losses)}."
            result.append(Finding("bad", text))
    if baselines:
        text = f"Of the baselines, 'design angles only' beats {'; '.join(baselines)}."
        result.append(Finding("bad", text))
    if unbeaten:
        text = (
            f"'Design angles only', which uses no IMU, nowhere beats {listed(unbeaten)}: neither "
            "overall nor in any kind of track."
        )
        result.insert(0, Finding("good", text))
    return result


def _many_beaten(case: Case, styles: Sequence[MethodStyle], design: MethodStyle) -> list[Finding]:
    """Where the design angles win over many methods: a sentence per quantity, without the sizes."""
    result = []
    for quantity, word in _QUANTITIES.items():
        floor = case.get(design.name, quantity, "rms").value
        overall = [s.label for s in styles if floor < case.get(s.name, quantity, "rms").value]
        lost = [s.label for s in styles if _loss(case, s, design, quantity, word)]
        in_parts = [label for label in lost if label not in overall]
        parts = [f"{listed(overall)} over the whole ride"] if overall else []
        parts += [f"{listed(in_parts)} in some kind of track"] if in_parts else []
        if parts:
            text = f"In {word}, 'design angles only', which uses no IMU, beats {', and '.join(parts)}."
            result.append(Finding("bad", text))
    return result


def _loss(case: Case, style: MethodStyle, design: MethodStyle, quantity: str, word: str) -> str:
    """Where a method loses to the design angles in one quantity, in words; "" if nowhere."""
    own = {
        window: case.get(style.name, quantity, "rms", window=window).value for window in ("whole", *_WINDOWS)
    }
    floor = {window: case.get(design.name, quantity, "rms", window=window).value for window in own}
    lost = [place for window, place in _WINDOWS.items() if floor[window] < own[window]]
    if not floor["whole"] < own["whole"]:
        return f"{word} {listed(lost)}" if lost else ""
    won = [place for window, place in _WINDOWS.items() if own[window] < floor[window]]
    inside = f", though not {listed(won)}" if won else ""
    return f"{word} ({degrees(floor['whole'])} against {degrees(own['whole'])} rms{inside})"


def _general_purpose(case: Case, styles: Sequence[MethodStyle]) -> list[Finding]:
    result = []
    tested = [s for s in styles if not s.baseline and case.get(s.name, "roll", "rms").draws]
    if not tested:
        return []
    best = min(tested, key=lambda s: case.get(s.name, "roll", "rms").value)
    own = case.get(best.name, "roll", "rms").value
    for style in styles:
        value = case.get(style.name, "roll", "rms").value
        if style.baseline == "general purpose" and value > 0.0:
            verb, tone = ("is worse than", "good") if value > own else ("is better than", "bad")
            text = (
                f"The general-purpose filter {style.label} {verb} {best.label} in roll: "
                f"{degrees(value)} against {degrees(own)} rms over the whole ride."
            )
            result.append(Finding(tone, text))
    return result


_OF_THE_IMU = ("imu", "imu.grade", "mount", "case")
"""Labels in which the case of the ideal IMU differs by its nature; it may be an IMU of its own."""


def _floor(case: Case, styles: Sequence[MethodStyle], others: Sequence[Case]) -> list[Finding]:
    if case.labels["imu"] == "ideal":
        return []
    # The same ride in every other respect: speed, irregularity and whatever else there is an axis for.
    same = [name for name in case.labels if name not in _OF_THE_IMU]
    ideal = [
        c for c in others if c.labels["imu"] == "ideal" and all(c.labels[k] == case.labels[k] for k in same)
    ]
    if not ideal:
        text = "No ideal IMU was run beside this one: what of the errors is the methods' own is not known."
        return [Finding("note", text)]
    sizes = {}
    for style in styles:
        own, least = (c.get(style.name, "roll", "rms").value for c in (case, ideal[0]))
        if not style.baseline and own > 0.0 and least > 0.0:
            sizes[style.label] = (least, own)
    if not sizes:
        return []
    if len(sizes) > MOST_NAMED:
        with_ideal, with_own = (
            f"{degrees(min(values))} to {degrees(max(values))}"
            for values in zip(*sizes.values(), strict=True)
        )
        told = f"{with_ideal} rms, by method, instead of {with_own}."
    else:
        told = "; ".join(
            f"{label} {degrees(least)} instead of {degrees(own)}" for label, (least, own) in sizes.items()
        )
        told = f"{told} rms."
    return [Finding("note", f"With an ideal IMU the roll error over the whole ride would be: {told}")]


def _consistency(case: Case, styles: Sequence[MethodStyle]) -> list[Finding]:
    shares = {}
    for style in styles:
        covered = {q: case.get(style.name, q, "coverage95") for q in ("roll", "pitch")}
        known = {q: c.value for q, c in covered.items() if c.draws}
        if known and not style.baseline:
            shares[style.label] = known
    if len(shares) > MOST_NAMED:
        return _many_intervals({label: min(known.values()) for label, known in shares.items()})
    result = []
    for label, known in shares.items():
        parts = [f"the true {quantity} in {100.0 * share:.0f} %" for quantity, share in known.items()]
        tone, verdict = interval_verdict(min(known.values()))
        text = f"The 95 % interval of {label} holds {listed(parts)} of the samples: "
        result.append(Finding(tone, f"{text}the standard deviations that it claims are {verdict}."))
    return result


def _many_intervals(shares: dict[str, float]) -> list[Finding]:
    """The same of many methods: a sentence per verdict, each method with the worse of roll and pitch."""
    by_verdict: dict[tuple[str, str], list[str]] = {}
    for label, share in shares.items():
        by_verdict.setdefault(interval_verdict(share), []).append(f"{label} ({100.0 * share:.0f} % inside)")
    return [
        Finding(tone, f"The 95 % interval of roll or pitch is {verdict} with {listed(named)}.")
        for (tone, verdict), named in by_verdict.items()
    ]


def _odometry(case: Case) -> list[Finding]:
    result = []
    for name in case.estimators():
        if name.startswith("odometry:"):
            error, last = case.get(name, "position", "rms").value, case.get(name, "position", "max").value
            # A scenario says which metrics it keeps.
            known = {"rms": error, "at most": last}
            sizes = [
                f"{significant(size)} m {word}" if word == "rms" else f"{word} {significant(size)} m"
                for word, size in known.items()
                if size >= 0.0
            ]
            if not sizes:
                continue
            source = name.removeprefix("odometry:")
            told = ", the true one: an ablation, not something that a train has" if source == "truth" else ""
            text = (
                f"All methods take position and speed from the odometry '{source}'{told}; "
                f"its position error is {listed(sizes)}."
            )
            result.append(Finding("note", text))
    return result


def _failures(case: Case) -> list[Finding]:
    empty = case.table[(case.table["failed"] > 0) & (case.table["window"].astype(str) == "whole")]
    names = [str(name) for name in empty["estimator"].unique()]
    return [Finding("bad", f"{name} has no value for some figures; see 'What failed'.") for name in names]


def alike(case: Case, styles: Sequence[MethodStyle]) -> list[list[MethodStyle]]:
    """Methods under test in groups that are alike, in their order; most groups are of one.

    What is compared are rms errors by quantity and kind of track, and what the 95 % intervals hold.
    """
    groups: list[list[MethodStyle]] = []
    for style in styles:
        if style.baseline:
            continue
        own = _figures(case, style)
        for group in groups:
            first = _figures(case, group[0])
            if np.isfinite(own).any() and np.allclose(own, first, rtol=ALIKE, atol=0.0, equal_nan=True):
                group.append(style)
                break
        else:
            groups.append([style])
    return groups


def one_of_each(case: Case, styles: Sequence[MethodStyle]) -> list[MethodStyle]:
    """Methods without those that lie upon an earlier one in a figure, which says how many they are."""
    like, labels = set(), {}
    for first, *rest in alike(case, styles):
        like |= {style.name for style in rest}
        labels[first.name] = f"{first.label} and {len(rest)} alike" if rest else first.label
    return [replace(s, label=labels.get(s.name, s.label)) for s in styles if s.name not in like]


def _figures(case: Case, style: MethodStyle) -> FloatArray:
    errors = [case.get(style.name, q, "rms", window=w).value for q in _COMPARED for w in _EVERYWHERE]
    held = [case.get(style.name, quantity, "coverage95").value for quantity in _COMPARED]
    return np.array([*errors, *held])
