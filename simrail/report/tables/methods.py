"""What the report knows of a method: its label, its colour, and what it is in the comparison.

Estimators say themselves what they are (`simrail.estimation.estimate.Description`); no name is looked into.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.colors import to_hex, to_rgb

from simrail.estimation.estimate import description_of
from simrail.scenario import cells
from simrail.scenario.build import Parts
from simrail.scenario.scenario import Scenario

# Okabe and Ito's colours, which people with any colour vision tell apart: (compensated, not compensated).
_COLOURS = {
    "AttitudeEkf": ("#0072B2", "#56B4E9"),
    "AttitudeGda": ("#D55E00", "#E69F00"),
    "Vqf": ("#AA4499", "#CC79A7"),
}
_NO_IMU = ("#6b7280", "#6b7280")
_OTHERS = (("#009E73", "#66c2a5"), ("#7b5e2a", "#c8a25c"), ("#6350c4", "#a79ce0"), ("#a8326f", "#c47f9f"))
_FEW_SHADES = (0.0, 0.55, -0.35)
"""Shares of white, or of black, of up to three methods that would have one colour: the first keeps it."""
_SHADES = (-0.3, 0.65)
"""Of more, from the darkest to the lightest; they stay beside those of their twins."""
_APART = (
    *("#0072B2", "#D55E00", "#56B4E9", "#E69F00", "#CC79A7"),
    *("#6350c4", "#a8326f", "#7b5e2a", "#999933", "#661100"),
)
"""Colours of methods of one class that nothing but their options tells apart; the first keeps its own."""
_STROKES = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)))
_SPELLED = {word.lower(): word for word in ("Sabatini", "Yuan", "EKF", "GDA", "VQF", "AHRS", "KF", "IMU")}


@dataclass(frozen=True)
class MethodStyle:
    """One method as the report shows it.

    Attributes
    ----------
    name, label : str
        Name in the tables; the same, readable.
    baseline : str
        ``""`` for a method under test and for an ablation, else what kind of baseline it is.
    uses_imu : bool
        False for "design angles only", and for rails that lie as designed.
    twin : str
        Name of the method that differs in compensation only; "" if there is none.
    compensated : bool or None
        Whether it compensates track-frame accelerations; None if it has no such option.
    colour, stroke
        For plots.
    kind : str
        Label of its class: what it shares with its twin.
    ablation : bool
        True for a method with what no train has, or without a part of its own.
    """

    name: str
    label: str
    baseline: str
    uses_imu: bool
    twin: str
    compensated: bool | None
    colour: str
    stroke: str | tuple[float, tuple[float, ...]]
    kind: str = ""
    ablation: bool = False


def readable(name: str) -> str:
    """Name of a method in words: ``"ekf_compensated"`` becomes ``"EKF compensated"``."""
    head, bracket, tail = name.partition("[")
    words = " ".join(_SPELLED.get(word, word) for word in head.split("_"))
    return words + bracket + tail


def method_styles(scenario: Scenario) -> dict[str, MethodStyle]:
    """Styles of a scenario's methods, by name, in their order."""
    methods, estimators = cells.methods(scenario), Parts(scenario).estimators(0)
    flags = {name: getattr(estimator, "compensated", None) for name, estimator in estimators.items()}
    compensated = {name: flag if isinstance(flag, bool) else None for name, flag in flags.items()}
    styles: dict[str, MethodStyle] = {}
    seen: list[tuple[str, bool | None]] = []
    other_classes: list[str] = []
    for method in methods:
        family, flag = method.part.method, compensated[method.name]
        told = description_of(estimators[method.name])
        if told.uses_imu and family not in _COLOURS and family not in other_classes:
            other_classes.append(family)
        if told.uses_imu:
            pair = _COLOURS.get(family) or _OTHERS[other_classes.index(family) % len(_OTHERS)]
        else:
            pair = _NO_IMU
        twins = [m.name for m in methods if m is not method and _is_twin(method, m, compensated)]
        baseline = ""
        if told.role == "general_purpose":
            baseline = "uncompensated" if twins else "general purpose"
        elif told.role == "baseline":
            baseline = "baseline" if told.uses_imu else "no IMU"
        styles[method.name] = MethodStyle(
            name=method.name,
            label=readable(method.name) + (" (ablation)" if told.role == "ablation" else ""),
            baseline=baseline,
            uses_imu=told.uses_imu,
            twin=twins[0] if twins else "",
            compensated=flag,
            colour=pair[1] if flag is False else pair[0],
            stroke=_STROKES[seen.count((family, flag)) % len(_STROKES)],
            kind=told.label,
            ablation=told.role == "ablation",
        )
        seen.append((family, flag))
    return _shaded(styles)


def attitude_methods(styles: Sequence[MethodStyle]) -> list[MethodStyle]:
    """Methods that are told apart by their attitude: of those without an IMU, the first.

    Rails that lie as designed give the design angles once more.
    """
    first = next((style for style in styles if not style.uses_imu), None)
    return [style for style in styles if style.uses_imu or style is first]


def _shaded(styles: dict[str, MethodStyle]) -> dict[str, MethodStyle]:
    """Tell methods apart that share a colour: by colours that no other has, or by shades."""
    sharing: dict[str, list[str]] = {}
    for style in styles.values():
        if style.uses_imu:
            sharing.setdefault(style.colour, []).append(style.name)
    shaded = dict(styles)
    free = [colour for colour in _APART if colour not in sharing]
    for colour, names in sharing.items():
        fit = 1 < len(names) <= len(free) + 1 and all(styles[name].compensated is None for name in names)
        if fit:
            for name in names[1:]:
                shaded[name] = replace(styles[name], colour=free.pop(0))
        elif len(names) > 1:
            many = np.linspace(*_SHADES, len(names)).tolist()
            shades = _FEW_SHADES[: len(names)] if len(names) <= len(_FEW_SHADES) else many
            for share, name in zip(shades, names, strict=True):
                shaded[name] = replace(styles[name], colour=mixed(colour, share) if share else colour)
    return shaded


def mixed(colour: str, share: float) -> str:
    """A colour with a share of white, or of black if it is negative."""
    red, green, blue = ((1.0 - abs(share)) * part + max(share, 0.0) for part in to_rgb(colour))
    return to_hex((red, green, blue))


def _is_twin(one: cells.Method, other: cells.Method, compensated: dict[str, bool | None]) -> bool:
    flags = compensated[one.name], compensated[other.name]
    if None in flags or flags[0] == flags[1] or one.part.method != other.part.method:
        return False
    rest = [{k: v for k, v in m.part.options.items() if k != "compensated"} for m in (one, other)]
    return rest[0] == rest[1]
