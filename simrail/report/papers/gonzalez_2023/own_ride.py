"""A search's own ride beside all others: what was found on one ride may be true of that one only."""

import shlex
from collections.abc import Mapping, Sequence

import numpy as np

from simrail.estimators.tuning.file import Tuning
from simrail.report.papers.gonzalez_2023.parts import FILTERED, PAPER, Rows
from simrail.report.tables.geometry_bands import QUANTITIES
from simrail.report.words.sentences import significant
from simrail.scenario.scenario import Scenario


def searched_on(tuning: Tuning, scenario: Scenario, cell: Mapping[str, object]) -> bool:
    """Whether a tuning was searched on this very cell of this very scenario, and on no other.

    By the command that made it: the scenario's name and settings, ride and IMU, the first draw.
    """
    search = tuning.search
    if search is None or len(search.fitted_on) != 1 or cell["track_draw"] or cell["sensor_draw"]:
        return False
    words = shlex.split(search.command)
    settings = [words[at + 1] for at, word in enumerate(words) if word == "--set"]
    if words[:3] != ["simrail", "tune", scenario.name] or settings != list(scenario.overrides):
        return False
    ride = f"{scenario.name}: {cell['ride']}, {cell['mount']} on "
    return search.seed == scenario.spec.seed and search.fitted_on[0].startswith(ride)


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
    sentences, worst, draws = [], 0.0, 0
    for part, sds in own.items():
        means = [rows.get(part, quantity, "sd", filtered=True) for quantity in FILTERED]
        factors = [mean.value / sd for mean, sd in zip(means, sds, strict=True)]
        if not np.isfinite(factors).all() or means[0].draws < 2:
            continue
        at = int(np.argmax(factors))
        worst, draws = max(worst, factors[at]), means[at].draws
        sentences.append(
            f"{PAPER.label(part)}, {QUANTITIES[FILTERED[at]]} {significant(sds[at])} there and "
            f"{significant(means[at].value)} mm on the mean"
        )
    if not sentences:
        return ""
    tracks = int(rows.case.table["track_draws"].max())
    if tracks < 2:
        verdict = "All are over the same rails, so what was fitted to these does not show"
    else:
        verdict = _verdict(worst)
    return (
        f"Sd of the filtered error on the ride that was searched on, and on the mean of {draws} draws over "
        f"{tracks} lay{'s' * (tracks > 1)} of the rails, of the quantity that differs most: "
        f"{'; '.join(sentences)}. {verdict}."
    )


def _verdict(worst: float) -> str:
    return (
        f"A search over one ride fits that ride: over all, itself among them, an error is up to {worst:.1f} "
        "times as large"
        if worst > PAPER.limits["overfitted_factor"]
        else "None was fitted to its ride alone: over all, itself among them, no error is more than "
        f"{worst:.1f} times as large"
    )
