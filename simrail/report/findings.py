"""What the scores say, in sentences: every figure in them is looked up, none is known beforehand.

A sentence is written whether it flatters or not: where 'design angles only' beats a filter it says
so, and where compensation does not help it says that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simrail.report.methods import MethodStyle
from simrail.report.pivot import Figures

_QUANTITIES = {"roll": "roll", "pitch": "pitch", "yaw_debiased": "yaw without its initial offset"}
_WINDOWS = {
    "straight": "in straights",
    "transition": "in transitions",
    "curve": "in curves",
    "standstill": "at standstill",
}


@dataclass(frozen=True)
class Finding:
    """One sentence.

    Attributes
    ----------
    tone : str
        ``"good"``, ``"bad"`` (a loss, an inconsistency, a failure) or ``"note"``.
    text : str
        Plain text.
    """

    tone: str
    text: str


def degrees(value: float) -> str:
    """An angle with three significant digits, at most four decimals: ``0.213°``."""
    return f"{significant(value)}\u00b0"


def significant(value: float, *, digits: int = 3) -> str:
    """A number with some significant digits and no exponent, at most four decimals."""
    if value == 0.0:
        return "0"
    # The exponent of the rounded number: 0.09999 is 0.100, not 0.1000.
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
    decimals = min(max(digits - 1 - exponent, 0), 4)
    return f"{value:.{decimals}f}" if abs(value) >= 5e-5 else "<0.0001"


def findings(
    case: Figures, styles: Sequence[MethodStyle], *, others: Sequence[Figures] = ()
) -> list[Finding]:
    """Everything that is worth saying of a case.

    Parameters
    ----------
    case : Figures
        The case.
    styles : sequence of MethodStyle
        The methods of the scenario.
    others : sequence of Figures
        All cases of the scenario: the one with an ideal IMU is looked for among them.
    """
    return [
        *_compensation(case, styles),
        *_design_angles(case, styles),
        *_general_purpose(case, styles),
        *_floor(case, styles, others),
        *_consistency(case, styles),
        *_odometry(case),
        *_failures(case),
    ]


def _compensation(case: Figures, styles: Sequence[MethodStyle]) -> list[Finding]:
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
        name, ratio = style.label.removesuffix(" compensated"), without / own
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


def _design_angles(case: Figures, styles: Sequence[MethodStyle]) -> list[Finding]:
    design = next((style for style in styles if not style.uses_imu), None)
    if design is None:
        text = "'Design angles only' was not run: whether a filter beats no IMU at all is not known."
        return [Finding("note", text)]
    result, unbeaten, baselines = [], [], []
    for style in styles:
        if not style.uses_imu or not case.get(style.name, "roll", "rms").draws:
            continue
        losses = [
            loss
            for quantity, word in _QUANTITIES.items()
            if (loss := _loss(case, style, design, quantity, word))
        ]
        if losses and style.baseline:
            baselines.append(f"{style.label} in {_listed(losses)}")
        elif losses:
            text = f"'Design angles only', which uses no IMU, beats {style.label} in {_listed(losses)}."
            result.append(Finding("bad", text))
        else:
            unbeaten.append(style.label)
    if baselines:
        text = f"Of the baselines, 'design angles only' beats {'; '.join(baselines)}."
        result.append(Finding("bad", text))
    if unbeaten:
        text = (
            f"{_listed(unbeaten)}: nowhere beaten by 'design angles only', neither overall nor in any window."
        )
        result.insert(0, Finding("good", text))
    return result


def _loss(case: Figures, style: MethodStyle, design: MethodStyle, quantity: str, word: str) -> str:
    """Where a method loses to the design angles in one quantity, in words; "" if nowhere."""
    own = {
        window: case.get(style.name, quantity, "rms", window=window).value for window in ("whole", *_WINDOWS)
    }
    floor = {window: case.get(design.name, quantity, "rms", window=window).value for window in own}
    lost = [place for window, place in _WINDOWS.items() if floor[window] < own[window]]
    if not floor["whole"] < own["whole"]:
        return f"{word} {_listed(lost)}" if lost else ""
    won = [place for window, place in _WINDOWS.items() if own[window] < floor[window]]
    inside = f", though not {_listed(won)}" if won else ""
    return f"{word} ({degrees(floor['whole'])} against {degrees(own['whole'])} rms{inside})"


def _general_purpose(case: Figures, styles: Sequence[MethodStyle]) -> list[Finding]:
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


def _floor(case: Figures, styles: Sequence[MethodStyle], others: Sequence[Figures]) -> list[Finding]:
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
    parts = []
    for style in styles:
        own, least = (c.get(style.name, "roll", "rms").value for c in (case, ideal[0]))
        if not style.baseline and own > 0.0 and least > 0.0:
            parts.append(f"{style.label} {degrees(least)} instead of {degrees(own)}")
    text = f"With an ideal IMU the roll error over the whole ride would be: {'; '.join(parts)} rms."
    return [Finding("note", text)] if parts else []


def _consistency(case: Figures, styles: Sequence[MethodStyle]) -> list[Finding]:
    result = []
    for style in styles:
        if style.baseline:
            continue
        covered = {q: case.get(style.name, q, "coverage95") for q in ("roll", "pitch")}
        parts = [f"the true {q} in {100.0 * c.value:.0f} %" for q, c in covered.items() if c.draws]
        if parts:
            known = [c.value for c in covered.values() if c.draws]
            tone, verdict = "good", "about right"
            if min(known) < 0.9:
                tone, verdict = "bad", "too small"
            elif min(known) > 0.985:
                tone, verdict = "note", "larger than its errors"
            text = f"The 95 % interval of {style.label} holds {_listed(parts)} of the samples: "
            result.append(Finding(tone, f"{text}the standard deviations that it claims are {verdict}."))
    return result


def _odometry(case: Figures) -> list[Finding]:
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
                f"its position error is {_listed(sizes)}."
            )
            result.append(Finding("note", text))
    return result


def _failures(case: Figures) -> list[Finding]:
    empty = case.table[(case.table["failed"] > 0) & (case.table["window"].astype(str) == "whole")]
    names = [str(name) for name in empty["estimator"].unique()]
    return [Finding("bad", f"{name} has no value for some figures; see 'What failed'.") for name in names]


def _listed(words: Sequence[str]) -> str:
    """a, b and c."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
