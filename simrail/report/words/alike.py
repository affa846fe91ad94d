"""Methods whose attitudes hardly differ, so that a page says of one what holds of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simrail.core.jit import FloatArray
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Figures

ALIKE = 0.01
"""Methods are alike if no figure of their attitude differs by more than this share of it."""

QUANTITIES = ("roll", "pitch", "yaw_debiased")
WINDOWS = ("whole", "straight", "transition", "curve", "standstill")


def alike(case: Figures, styles: Sequence[MethodStyle]) -> list[list[MethodStyle]]:
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


def one_of_each(case: Figures, styles: Sequence[MethodStyle]) -> list[MethodStyle]:
    """Methods without those that lie upon an earlier one in a figure, which says how many they are."""
    like, labels = set(), {}
    for first, *rest in alike(case, styles):
        like |= {style.name for style in rest}
        labels[first.name] = f"{first.label} and {len(rest)} alike" if rest else first.label
    return [replace(s, label=labels.get(s.name, s.label)) for s in styles if s.name not in like]


def _figures(case: Figures, style: MethodStyle) -> FloatArray:
    errors = [case.get(style.name, q, "rms", window=w).value for q in QUANTITIES for w in WINDOWS]
    held = [case.get(style.name, quantity, "coverage95").value for quantity in QUANTITIES]
    return np.array([*errors, *held])
