"""What a search of hyper-parameters knows of each: read from the tunings that a scenario names."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from simrail.core.errors import InputError
from simrail.estimation.user_modules import class_named
from simrail.estimators.trajectory.smoother import TrajectorySmoother
from simrail.estimators.tuning.file import Tuning
from simrail.estimators.tuning.space import CONSTRAINT, FLAT, HELD, IDENTIFIED, LOWER, NAMES, UPPER
from simrail.report.papers.gonzalez_2023.parts import PAPER
from simrail.report.tables.tables import Cell, Row, Table
from simrail.scenario.build_estimator import construct
from simrail.scenario.cells import Method

EDGES = (LOWER, UPPER, CONSTRAINT)


def tunings_of(methods: Sequence[Method], folder: Path | None) -> dict[str, Tuning]:
    """Tunings that methods name, by the method's name; one that cannot be read any more is left out."""
    tunings: dict[str, Tuning] = {}
    for method in methods:
        if method.part.method != TrajectorySmoother.__name__ or "tuning" not in method.part.options:
            continue
        try:
            made = construct(class_named(method.part.method, folder), method.part.options, folder=folder)
        except InputError:
            continue
        if isinstance(made, TrajectorySmoother) and made.tuning is not None:
            tunings[method.name] = made.tuning
    return tunings


def by_part(names: Mapping[str, str], tunings: Mapping[str, Tuning]) -> dict[str, Tuning]:
    """Searched tunings whose file says what is known, by the part that their method plays."""
    return {
        part: tunings[names[part]]
        for part in PAPER.parts
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
    return Table(
        [("value, SI, and what the search knows of it", len(tunings))],
        [PAPER.label(part) for part in tunings],
        rows,
    )


def commands(tunings: Mapping[str, Tuning]) -> list[tuple[str, str]]:
    """By label, the command that makes a tuning."""
    return [(PAPER.label(part), t.search.command) for part, t in tunings.items() if t.search is not None]


def notes(tunings: Mapping[str, Tuning]) -> list[str]:
    """How many of the parameters each search tells anything about, and which not."""
    sentences = []
    for part, tuning in tunings.items():
        assert tuning.status is not None
        sure = [name for name in NAMES if tuning.status[name] == IDENTIFIED]
        searched = [name for name in NAMES if tuning.status[name] != HELD]
        text = (
            f"{PAPER.label(part)} identifies {len(sure)} of the {len(searched)} parameters that it searches"
        )
        for words, kinds in (("at an edge or at the constraint", EDGES), ("flat", (FLAT,))):
            those = [name for name in NAMES if tuning.status[name] in kinds]
            text += f"; {words}: {', '.join(those)}" if those else ""
        sentences.append(text + ".")
    return sentences + _apart(tunings)


def _apart(tunings: Mapping[str, Tuning]) -> list[str]:
    """How far searches of the same kind over other parts of the track came from each other."""
    same = [part for part in ("kom", "kom_start", "kom_end") if part in tunings]
    if len(same) < 2:
        return []
    logs = np.log10([[getattr(tunings[part].hyperparameters, name) for name in NAMES] for part in same])
    decades = np.ptp(logs, axis=0)
    widest = int(np.argmax(decades))
    return [
        f"{', '.join(PAPER.label(part) for part in same)}: their values lie up to {decades[widest]:.1f} "
        f"decades apart ({NAMES[widest]}), at least {decades.min():.1f}. Identified is meant of one search "
        "and about the place where it ended; what differs so between parts of one ride is no property of the "
        "vehicle."
    ]
