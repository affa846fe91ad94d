"""Rides as a page shows them: which methods, in what order, by what they are chosen, and their facts."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from simrail.campaign.cell import CellResult
from simrail.report.figures.geometry import has_rails
from simrail.report.figures.ride import direction_of, runs_of
from simrail.report.figures.views import View, bins_for, ride_view
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case
from simrail.report.tables.question import Question
from simrail.report.words.ablations import value_words
from simrail.report.words.findings import one_of_each
from simrail.report.words.sentences import axis_words, recording_facts, vibration_facts
from simrail.report.words.verdicts import short_name
from simrail.scoring.ablations import AXES, MAP
from simrail.track.bands import Band

MOST_TESTED = 4
"""Methods under test that are kept of each ride, the best first; the tables hold all."""


def views_of(
    examples: Sequence[CellResult],
    styles: Sequence[MethodStyle],
    *,
    question: Question | None,
    cells: pd.DataFrame,
    band: Band | None,
) -> list[View]:
    """Rides as the page shows them, the worst recording first.

    Parameters
    ----------
    examples : sequence of CellResult
        The rides.
    styles : sequence of MethodStyle
        Methods that are kept of each, see `shown_styles`.
    question : Question, optional
        What the scenario asks for: by it, and its best method, a recording is the worst.
    cells : pandas.DataFrame
        Table of cells.
    band : Band, optional
        Wavelengths that rails are judged in.
    """
    errors = pd.Series(dtype=float)
    if question is not None and question.ranked:
        judged = question.judged
        errors = judged[judged["estimator"] == question.ranked[0].name].set_index("cell")["value"]
    rails = max((sum(has_rails(one, style) for style in styles) for one in examples), default=0)
    bins = bins_for(len(examples), len(styles), rails)
    ordered = sorted(examples, key=lambda one: -float(errors.get(one.cell.get("cell"), -np.inf)))
    return [
        ride_view(
            example,
            styles,
            picks=_picks(example, errors, cells),
            facts=[*ride_facts(example), *vibration_facts(example.shaken)],
            bins=bins if place else 2 * bins,
            band=band,
        )
        for place, example in enumerate(ordered)
    ]


def shown_styles(
    styles: Sequence[MethodStyle],
    *,
    attitude: Sequence[MethodStyle],
    question: Question | None,
    case: Case | None,
) -> list[MethodStyle]:
    """Methods that are kept of each ride: the best under test and a baseline of each kind; of alike ones one.

    Parameters
    ----------
    styles, attitude : sequence of MethodStyle
        The scenario's methods, and those that are told apart by their attitude.
    question : Question, optional
        By which they are ranked.
    case : Case, optional
        By whose figures they are alike.
    """
    unlike = one_of_each(case, styles) if case else list(styles)
    ranked = [style.name for style in question.ranked] if question else []
    order = {name: place for place, name in enumerate(ranked)}
    tested = [style for style in unlike if not style.baseline]
    tested.sort(key=lambda style: order.get(style.name, len(order)))
    kept = {style.name for style in tested[:MOST_TESTED]}
    # Beside them what uses no IMU, the best one's own without compensation, and a general-purpose filter.
    apart = [style for style in attitude if style.baseline]
    twin = next((style.twin for style in tested if style.twin), "")
    for group in (
        [style for style in apart if not style.uses_imu],
        [style for style in apart if style.name == twin],
        [style for style in apart if style.baseline == "general purpose"],
    ):
        kept |= {style.name for style in group[:1]}
    return [style for style in unlike if style.name in kept]


def _picks(example: CellResult, errors: pd.Series, cells: pd.DataFrame) -> dict[str, str]:
    """What a view is chosen by."""
    cell = example.cell
    draws = {"track_draw": "track", "sensor_draw": "sensors"}
    draw = ", ".join(f"{word} {cell[name]}" for name, word in draws.items() if name in cell) or "the only one"
    rank = _rank_words(cell.get("cell"), errors, cells)
    imu = short_name(cell.get("imu", example.recording.imu_sheet.grade))
    return {
        "ride": ride_title(example),
        "IMU": f"{imu} on {example.recording.mount}",
        "draw": f"{draw}: {rank}" if rank else draw,
    }


def _rank_words(number: object, errors: pd.Series, cells: pd.DataFrame) -> str:
    """Which of the recordings of its case a cell is."""
    known = {int(cell): float(error) for cell, error in errors.items()}  # type: ignore[call-overload]
    if "case" not in cells or not isinstance(number, int) or number not in known:
        return ""
    case = dict(zip(cells["cell"], cells["case"], strict=True))
    own = [error for cell, error in known.items() if case[cell] == case[number]]
    rank = sum(error > known[number] for error in own) + 1
    if len(own) < 2:
        return ""
    return f"the worst of {len(own)}" if rank == 1 else f"number {rank} of {len(own)}, the worst first"


def ride_title(example: CellResult) -> str:
    """Name of a ride, and the values of its axes; its map and what shakes it stand in the facts."""
    told = ("imu.grade", *AXES)
    axes = [
        axis_words(name, value) for name, value in example.cell.items() if "." in name and name not in told
    ]
    return " \u00b7 ".join([example.recording.name, *axes])


def ride_facts(example: CellResult) -> list[str]:
    """Length, speed, IMU, odometry and map of a ride, a line each."""
    motion, recording = example.motion, example.recording
    speed = np.abs(motion["speed_mps"].to_numpy())
    moving = speed > 0.01
    runs, places = runs_of(example)
    way = f"towards {'increasing' if direction_of(example) > 0 else 'decreasing'} distance"
    if runs > 1:
        way = f"in {runs} runs, to and fro between {places.min():.0f} and {places.max():.0f} m"
    mean = 3.6 * float(speed[moving].mean()) if moving.any() else 0.0
    duration = float(motion.index[-1] - motion.index[0])
    return [
        f"{np.abs(np.diff(places)).sum():.0f} m {way}, {duration:.0f} s",
        f"mean {mean:.1f} km/h while moving, at most {3.6 * float(speed.max()):.1f} km/h",
        *recording_facts(recording),
        f"the line from {value_words(MAP, example.cell['map'], title=True)}",
    ]
