"""Columns of one sensor in another order: what a ride says once they are put back.

Which column is which is told by what each follows: the gyro's by the rates of the line, the accelerometer's Z
by gravity and its X and Y by push and curves. An order is believed if the ride that has it is sound, where
the ride as it is given is not.
"""

import math
from dataclasses import replace
from itertools import permutations, product

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.evidence.axes import weigh_axes
from simrail.recording.evidence.finding import Finding
from simrail.recording.evidence.judge import Evidence, is_near_sound, weigh
from simrail.recording.evidence.slopes import LEAST, expected_of, seconds_of
from simrail.recording.recording import Recording

MARGIN = 0.1
"""By how much the correlations of another order, summed, have to be larger than those of the given one."""

SIDES = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
"""Signs that axes named with a minus leave of columns in another order."""


def weigh_exchange(recording: Recording) -> Evidence | None:
    """What a ride with the columns of a sensor put back says, with that; None where it is no more sound.

    Parameters
    ----------
    recording : Recording
        A ride of which something is wrong.
    """
    expected = expected_of(recording)
    for kind, names in (("gyro", GYRO), ("accel", ACCEL)) if expected else ():
        follows = _correlations(recording, names, expected)
        order, signs, share = _best(follows)
        if order == (0, 1, 2):
            continue
        imu = recording.imu.copy()
        for i, name in enumerate(names):
            imu[name] = signs[i] * recording.imu[names[order[i]]]
        put_back = replace(recording, imu=imu)
        if not is_near_sound(put_back):
            continue
        evidence = weigh(put_back)
        axes = weigh_axes(put_back, evidence.single)
        if any(finding.wrong for finding in (*evidence.findings, *axes)):
            continue
        finding = _finding(kind, order, share, len(expected[GYRO[0]]))
        return replace(evidence, findings=(*evidence.findings, *axes, finding))
    return None


def _correlations(
    recording: Recording, names: tuple[str, ...], expected: dict[str, FloatArray]
) -> FloatArray:
    """How each column (3,) follows what is expected of each axis (3,), -1 to 1; gravity is a Z's share."""
    columns = [seconds_of(recording, name) for name in names]
    follows = np.zeros((3, 3))
    for i, column in enumerate(columns):
        for j, name in enumerate(names):
            if name in expected:
                off, other = expected[name] - expected[name].mean(), column - column.mean()
                size = float(np.linalg.norm(off) * np.linalg.norm(other))
                known = np.linalg.norm(off) > LEAST[name] * math.sqrt(len(off))
                follows[i, j] = float(off @ other) / size if known and size > 0.0 else 0.0
    if names == ACCEL:
        rest = np.array([float(np.median(column)) for column in columns])
        follows[:, 2] = rest / float(np.linalg.norm(rest))
    return follows


def _best(follows: FloatArray) -> tuple[tuple[int, ...], tuple[int, ...], float]:
    """Which column each axis is, and with which sign; and how well the given order follows beside that."""
    given = float(np.trace(follows))
    best, signs = given + MARGIN, SIDES[0]
    order: tuple[int, ...] = (0, 1, 2)
    for columns, sides in product(permutations(range(3)), SIDES):
        found = sum(sides[j] * follows[columns[j], j] for j in range(3))
        if columns != (0, 1, 2) and found > best:
            best, order, signs = float(found), columns, sides
    return order, signs, max(given, 0.0) / best


def _finding(kind: str, order: tuple[int, ...], share: float, count: int) -> Finding:
    moved = ", ".join(f"{'XYZ'[i]} stands as {'XYZ'[order[i]]}" for i in range(3) if order[i] != i)
    return Finding(
        f"how well the columns of the {kind} follow, as they are given",
        f"order_{kind}",
        share,
        1.0 / math.sqrt(count),
        1.0,
        "1",
        "all of the ride",
        "surely wrong",
        f"its columns stand in another order ({moved}): put back, all of the ride is sound",
        field=f"imu.columns.{kind}",
        remedy=f"mend the order in columns.{kind}",
    )
