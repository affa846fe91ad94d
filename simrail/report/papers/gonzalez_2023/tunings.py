"""What a search of hyper-parameters knows of each: read from the tunings that a scenario names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from simrail.core.errors import InputError
from simrail.estimation.user_modules import class_named
from simrail.estimators.trajectory.smoother import TrajectorySmoother
from simrail.estimators.tuning.file import Tuning
from simrail.estimators.tuning.space import CONSTRAINT, FLAT, HELD, IDENTIFIED, LOWER, NAMES, UPPER
from simrail.report.papers.claim import Claim
from simrail.report.papers.gonzalez_2023.parts import PARTS
from simrail.report.tables.tables import Cell, Row, Table
from simrail.report.words.sentences import significant
from simrail.scenario.build_estimator import construct
from simrail.scenario.cells import Method

POSITIONS = ("lateral_position_m2", "vertical_position_m2")
"""Variances of the virtual positions, which are constants and no measurements."""

EDGES = (LOWER, UPPER, CONSTRAINT)


def tunings_of(methods: Sequence[Method], folder: Path | None) -> dict[str, Tuning]:
    """Tunings that methods name, by the method's name; one that cannot be read any more is left out."""
    found: dict[str, Tuning] = {}
    for method in methods:
        if method.part.method != TrajectorySmoother.__name__ or "tuning" not in method.part.options:
            continue
        try:
            made = construct(class_named(method.part.method, folder), method.part.options, folder=folder)
        except InputError:
            continue
        if isinstance(made, TrajectorySmoother) and made.tuning is not None:
            found[method.name] = made.tuning
    return found


def by_part(names: Mapping[str, str], tunings: Mapping[str, Tuning]) -> dict[str, Tuning]:
    """Searched tunings whose file says what is known, by the part that their method plays."""
    return {
        part: tunings[names[part]]
        for part in PARTS
        if part in names and names[part] in tunings and tunings[names[part]].status is not None
    }


def status_table(tunings: Mapping[str, Tuning]) -> Table | None:
    """Value and status of each hyper-parameter by part; None without any. Only what is identified is bold."""
    if not tunings:
        return None
    rows = []
    for name in NAMES:
        cells = []
        for tuning in tunings.values():
            assert tuning.status is not None
            status = tuning.status[name]
            value = f"{getattr(tuning.hyperparameters, name):.1e}".replace("-", "\u2212")
            cells.append(Cell(value, f" {status}", "best" if status == IDENTIFIED else ""))
        rows.append(Row(name, "", "", cells))
    return Table([("value, SI, and what the search knows of it", len(tunings))], columns_of(tunings), rows)


def columns_of(tunings: Mapping[str, Tuning]) -> list[str]:
    """Heads of the table."""
    return [PARTS[part] for part in tunings]


def commands(tunings: Mapping[str, Tuning]) -> list[tuple[str, str]]:
    """By label, the command that makes a tuning."""
    return [(PARTS[part], t.search.command) for part, t in tunings.items() if t.search is not None]


def notes(tunings: Mapping[str, Tuning]) -> list[str]:
    """How many of the parameters each search tells anything about, and which not."""
    told = []
    for part, tuning in tunings.items():
        assert tuning.status is not None
        sure = [name for name in NAMES if tuning.status[name] == IDENTIFIED]
        searched = [name for name in NAMES if tuning.status[name] != HELD]
        text = f"{PARTS[part]} identifies {len(sure)} of the {len(searched)} parameters that it searches"
        for words, kinds in (("at an edge or at the constraint", EDGES), ("flat", (FLAT,))):
            those = [name for name in NAMES if tuning.status[name] in kinds]
            text += f"; {words}: {', '.join(those)}" if those else ""
        told.append(text + ".")
    return told + _apart(tunings)


def _apart(tunings: Mapping[str, Tuning]) -> list[str]:
    """How far searches of the same kind over other parts of the track came from each other."""
    same = [part for part in ("kom", "kom_start", "kom_end") if part in tunings]
    if len(same) < 2:
        return []
    logs = np.log10([[getattr(tunings[part].hyperparameters, name) for name in NAMES] for part in same])
    decades = np.ptp(logs, axis=0)
    widest = int(np.argmax(decades))
    return [
        f"{', '.join(PARTS[part] for part in same)}: their values lie up to {decades[widest]:.1f} decades "
        f"apart ({NAMES[widest]}), at least {decades.min():.1f}. Identified is meant of one search and about "
        "the place where it ended; what differs so between parts of one ride is no property of the vehicle."
    ]


def constraint_claim(tuning: Tuning | None) -> Claim:
    """Whether the paper's constraint keeps CML from trusting the virtual positions without end."""
    said = (
        "Section 4.2.1: plain likelihood may trust the virtual positions too much, as if the vehicle never "
        "left the design line; the constraint that the variance of the lateral accelerometer is at most a "
        "tenth of that of the lateral virtual position keeps it from that."
    )
    if tuning is None or tuning.status is None or tuning.search is None:
        return Claim("constraint", said, None, "Not run here: CML.")
    if tuning.search.space.constrained != ("y",) or tuning.search.space.position_m2 is not None:
        return Claim("constraint", said, None, "Not run here: CML with that constraint and no other.")
    told = [
        f"{name} {significant(getattr(tuning.hyperparameters, name))}, {tuning.status[name]}"
        for name in (*POSITIONS, "accel_y_m2ps4", "accel_z_m2ps4")
    ]
    low, high = tuning.search.space.box
    kept = [tuning.status[name] not in EDGES for name in POSITIONS]
    found = (
        f"CML in the box {low:g} to {high:g}: {'; '.join(told)} (holds if no virtual position lies at an "
        "edge of what is allowed)."
    )
    cause = (
        ""
        if all(kept)
        else "What is constant is the more likely the smaller its variance is said to be: only the box, or "
        "the constraint, ends the search."
    )
    return Claim("constraint", said, all(kept), found, cause)
