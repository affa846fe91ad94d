"""What a search of hyper-parameters knows of each: read from the tunings that a scenario names.

And whether that is true of more than the ride that it was searched on.
"""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from simrail.core.errors import InputError
from simrail.estimation.user_modules import class_named
from simrail.estimators.trajectory.smoother import TrajectorySmoother
from simrail.estimators.tuning.file import Tuning
from simrail.estimators.tuning.space import CONSTRAINT, FLAT, HELD, IDENTIFIED, LOWER, NAMES, UPPER
from simrail.report.papers.gonzalez_2023.parts import FILTERED, PAPER, Rows
from simrail.report.tables.geometry import QUANTITIES
from simrail.report.tables.tables import Cell, Row, Table
from simrail.scenario.build_estimator import construct
from simrail.scenario.cells import Method
from simrail.scenario.scenario import Scenario
from simrail.scoring.ablations import ABLATIONS, VIBRATION, Ablation

EDGES = (LOWER, UPPER, CONSTRAINT)


def _setting(ablation: Ablation) -> str:
    """Setting of a search on recordings with an ablation."""
    return f"{ablation.axis}=true"


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
    groups = [("value, SI, and what the search knows of it", len(tunings))]
    return Table(groups, [PAPER.label(part) for part in tunings], rows)


def commands(tunings: Mapping[str, Tuning]) -> list[tuple[str, str]]:
    """By label, the command that makes a tuning."""
    return [(PAPER.label(part), t.search.command) for part, t in tunings.items() if t.search is not None]


def notes(tunings: Mapping[str, Tuning]) -> list[str]:
    """How many of the parameters each search tells anything about, and which not.

    And how far searches of the same kind over other parts of the track came from each other.
    """
    sentences = []
    kinds = {"identified": (IDENTIFIED,), "at_an_edge": EDGES, "flat": (FLAT,)}
    for part, tuning in tunings.items():
        assert tuning.status is not None
        status = {name: tuning.status[name] for name in NAMES if tuning.status[name] != HELD}
        names = {kind: [name for name in status if status[name] in held] for kind, held in kinds.items()}
        sentences.append(PAPER.written(PAPER.words["search"], part=part, searched=len(status), **names))
    same = [part for part in ("kom", "kom_start", "kom_end") if part in tunings]
    if len(same) > 1:
        logs = np.log10([[getattr(tunings[part].hyperparameters, name) for name in NAMES] for part in same])
        decades = dict(zip(NAMES, np.ptp(logs, axis=0), strict=True))
        sentences.append(PAPER.written(PAPER.words["searches"], parts=same, decades=decades))
    return sentences


def searched_on(tuning: Tuning, scenario: Scenario, cell: Mapping[str, object]) -> bool:
    """Whether a tuning was searched on this very cell of this very scenario, and on no other.

    By the command that made it: the scenario's name and settings, ride and IMU, the first draw.
    """
    search = tuning.search
    is_first = not any(cell.get(draw) for draw in ("track_draw", "map_draw", "sensor_draw"))
    if search is None or len(search.fitted_on) != 1 or not is_first:
        return False
    words, settings = shlex.split(search.command), _settings(tuning)
    # Of a list the cell has one of both, which the command names.
    for one in ABLATIONS:
        has_table = getattr(scenario.spec, one.column) is not None
        if (_setting(one) in settings) != (has_table and cell[one.column] == one.ablated):
            return False
    ablations = [_setting(one) for one in ABLATIONS]
    others, own = ([one for one in said if one not in ablations] for said in (settings, scenario.overrides))
    if words[:3] != ["simrail", "tune", scenario.name] or others != own:
        return False
    ride = f"{scenario.name}: {cell['ride']}, {cell['mount']} on "
    return search.seed == scenario.spec.seed and search.fitted_on[0].startswith(ride)


def _settings(tuning: Tuning) -> list[str]:
    """Settings of the command that made a tuning."""
    words = shlex.split(tuning.search.command) if tuning.search is not None else []
    return [words[at + 1] for at, word in enumerate(words) if word == "--set"]


def silence_note(tunings: Mapping[str, Tuning]) -> str:
    """Which tunings were searched on rides without vibration; "" if none was, by their commands."""
    parts = [part for part, tuning in tunings.items() if _setting(VIBRATION) in _settings(tuning)]
    return PAPER.written(PAPER.words["silent"], parts=parts) if parts else ""


def own_ride_note(rows: Rows, own: Mapping[str, Sequence[float]]) -> str:
    """How a tuning does on the ride that it was searched on, and on all draws; "" if none was.

    A verdict takes rides over other rails: with the same ones, only the sensors' errors are others.

    Parameters
    ----------
    rows : Rows
        The scores.
    own : mapping of str to sequence of float
        Sd of the filtered error on the own ride, mm, by part, in the order of `FILTERED`.
    """
    largest, worst, draws = {}, 0.0, 0
    for part, sds in own.items():
        means = [rows.get(part, quantity, "sd", filtered=True) for quantity in FILTERED]
        factors = np.array([mean.value / sd for mean, sd in zip(means, sds, strict=True)])
        if np.isfinite(factors).all() and means[0].draws > 1:
            at = int(np.argmax(factors))
            worst, draws = max(worst, factors[at]), means[at].draws
            largest[part] = QUANTITIES[FILTERED[at]], sds[at], means[at].value
    if not largest:
        return ""
    tracks = int(rows.case.table["track_draws"].max())
    text = PAPER.words["own_ride"]
    return PAPER.written(text, largest=largest, worst=worst, draws=draws, tracks=tracks)
