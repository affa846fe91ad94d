"""The budget of an error: how much of its square each term of the sensors' sheets makes.

One term at a time is taken away from what is recorded, on the same ride and the same draws, and from nothing
else: the train still believes its sheets. What the error e then changes by, c, is what the term has done to
it, and its share of the squared error is <c e> / <e e>. Where an estimator is linear, the changes and the
error that is left without any term add up to e, and the shares to one; what they lack or have too much stands
in the budget as ``together``. A term that has nothing in common with the others has the share <c c> / <e e>.

The bandwidth, which delays and is no error of a draw, is part of the estimator's own floor.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import pandas as pd

from simrail.campaign.cell import record_cell, simulated, unless_of_the_machine
from simrail.campaign.progress import Watcher
from simrail.campaign.time_limit import estimate_here
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimator, description_of
from simrail.recording.recording import Recording
from simrail.recording.sheets.grades import ImuGrade
from simrail.ride.truth import Truth
from simrail.scenario.build import Parts, ResolvedCell, bands_by_name
from simrail.scenario.cells import Cell, cells, labels_of
from simrail.scenario.check import Plan
from simrail.scenario.requirements import requirements_of
from simrail.scoring.ablations import without_ablations
from simrail.scoring.bootstrap import mean_interval
from simrail.scoring.geometry import rail_error_of
from simrail.scoring.requirement import RAILS, Requirement
from simrail.scoring.score import Reference, error_of, reference_of
from simrail.scoring.verdicts import GROUP
from simrail.scoring.windows import chosen_windows, windows_of
from simrail.track.map_errors import EXACT

FLOOR, TOGETHER = "floor", "together"
"""Rows of a budget beside its terms."""

OF_THE_RIDE = -1
"""Number of the requirement of a budget that none has asked for."""

OF_RIDES = tuple(Requirement(quantity, np.inf) for quantity in ("roll", "position", "speed", *RAILS))
"""What the budget of a ride is of: the first of them that its method tells."""

WORDS = {
    FLOOR: "what the method leaves with no error of sensors or map",
    TOGETHER: "what terms do together, or against each other",
}


@dataclass(frozen=True)
class Term:
    """An error that can be taken away.

    Attributes
    ----------
    name, words : str
        Its name in tables, and in sentences.
    grade : tuple of str
        Fields of `ImuGrade` that are it.
    encoder : dict
        Fields of the encoder's specification, with what they are without it.
    is_map : bool
        True for the errors of the map.
    """

    name: str
    words: str
    grade: tuple[str, ...] = ()
    encoder: Mapping[str, Any] | None = None
    is_map: bool = False

    def is_in(self, told: ResolvedCell) -> bool:
        """Whether a cell has it."""
        if self.is_map:
            return told.track_map is not None
        if self.encoder is not None:
            spec = told.encoder
            return spec is not None and any(
                getattr(spec, key) not in (value, None) for key, value in self.encoder.items()
            )
        return any(getattr(told.grade, name) != _NONE[name] for name in self.grade)

    def spared(self, told: ResolvedCell) -> ResolvedCell:
        """The cell without it."""
        if self.is_map:
            return replace(told, track_map=None, map_errors=EXACT)
        if self.encoder is not None and told.encoder is not None:
            return replace(told, encoder=replace(told.encoder, **self.encoder))
        return replace(told, grade=replace(told.grade, **{name: _NONE[name] for name in self.grade}))


_NONE: dict[str, Any] = {field.name: field.default for field in fields(ImuGrade)}
"""What each field of a grade is without its term."""


def _both(term: str) -> tuple[str, ...]:
    """Fields of a term of both triads."""
    return tuple(name for name in _NONE if name.split("_", 1)[-1].startswith(term))


def _of(kind: str, term: str) -> tuple[str, ...]:
    return tuple(name for name in _NONE if name.startswith(f"{kind}_{term}"))


TERMS = (
    Term("gyro_turn_on_bias", "the gyro's turn-on bias", _of("gyro", "turn_on_bias")),
    Term("accel_turn_on_bias", "the accelerometer's turn-on bias", _of("accel", "turn_on_bias")),
    Term("gyro_in_run_bias", "the gyro's in-run bias", _of("gyro", "bias_instability")),
    Term("accel_in_run_bias", "the accelerometer's in-run bias", _of("accel", "bias_instability")),
    Term("gyro_noise", "the gyro's white noise", _of("gyro", "noise")),
    Term("accel_noise", "the accelerometer's white noise", _of("accel", "noise")),
    Term("rate_walk", "rate random walk", _both("random_walk")),
    Term("gyro_scale", "the gyro's scale", (*_of("gyro", "scale_error"), "gyro_nonlinearity")),
    Term("accel_scale", "the accelerometer's scale", (*_of("accel", "scale_error"), "accel_nonlinearity")),
    Term("misalignment", "misalignment of the package", ("package_misalignment_rad",)),
    Term("axes", "axes that are not square", _both("nonorthogonality")),
    Term("g_sensitivity", "g-sensitivity", _of("gyro", "g_sensitivity")),
    Term("rectification", "vibration rectification", _both("vibration_rectification")),
    Term("quantisation", "quantisation", _both("resolution")),
    Term("clock", "the IMU's clock", ("clock_jitter_s", "clock_drift")),
    Term("temperature", "temperature", (*_both("bias_temperature"), *_both("scale_temperature"))),
    Term("wheel_radius", "the wheel's radius", encoder={"radius_error_sd": 0.0, "radius_error": 0.0}),
    Term("wheel_slip", "slip", encoder={"slip": ()}),
    Term(
        "edges",
        "edges of the encoder",
        encoder={"edge_pattern_sd": 0.0, "edge_jitter_sd": 0.0, "missed_rate": 0.0},
    ),
    Term("map", "the map", is_map=True),
)
"""What is taken away, one at a time; data sheets of the rest have no draws."""


def error_budget(
    draws: Sequence[Cell],
    parts: Parts,
    estimator: Estimator,
    wanted: Requirement,
    *,
    watcher: Watcher | None = None,
) -> pd.DataFrame:
    """The budget of the error of one figure, over some cells that share IMU, mount and method.

    Parameters
    ----------
    draws : sequence of Cell
        Draws of one case, or of one on several kinds of rides.
    parts : Parts
        Of their scenario.
    estimator : Estimator
        The method.
    wanted : Requirement
        Whose quantity, band and window; the figure is the mean square of the error.
    watcher : Watcher, optional
        Is told of the progress.

    Returns
    -------
    pandas.DataFrame
        One row per term that the cells have, largest share first, then `FLOOR` and `TOGETHER`: ``term``,
        ``words``, ``rms`` of what it does, in the score table's unit, ``share`` of the mean square with
        ``low95`` and ``high95`` (bootstrap over draws; NaN of one).

    Raises
    ------
    InputError
        If the method says nothing of the quantity, or a cell is of several passes.
    """
    watcher = watcher or Watcher()
    rows = []
    terms = [term for term in TERMS if term.is_in(parts.resolve(draws[0]))]
    watcher.cells_begin(0, len(draws))
    for number, cell in enumerate(draws):
        if cell.passes:
            raise InputError(
                "has no budget: it is fused of several rides",
                field="passes",
                limit="a scenario without passes",
                remedy="leave out passes, or the budget",
            )
        truth = simulated(cell, parts, watcher, number + 1, len(draws))
        rows.append(_products(cell, truth, parts, estimator, wanted, terms))
        watcher.cells_done(number + 1, len(draws), 0, "")
    products, squares = np.array(rows).transpose(1, 0, 2)
    names = [*(term.name for term in terms), FLOOR, TOGETHER]
    words = WORDS | {term.name: term.words for term in terms}
    whole, made = products[:, 0], products[:, 1:]
    made = np.column_stack([made, whole - made.sum(axis=1)])
    # A ratio of means: each draw's part counts by how large its error is.
    share, low, high = mean_interval(made.T, np.tile(whole, (len(names), 1)))
    table = pd.DataFrame({"term": names, "words": [words[name] for name in names]})
    table["rms"] = [*np.sqrt(squares[:, 1:].mean(axis=0)), np.nan]
    table["what"], table["unit"] = replace(wanted, metric="rms").what, wanted.unit
    table["share"], table["low95"], table["high95"] = share, low, high
    table["rms_of_whole"], table["draws"] = float(np.sqrt(whole.mean())), len(draws)
    last = table["term"].isin((FLOOR, TOGETHER))
    return pd.concat([table[~last].sort_values("share", ascending=False), table[last]], ignore_index=True)


def _products(
    cell: Cell, truth: Truth, parts: Parts, estimator: Estimator, wanted: Requirement, terms: Sequence[Term]
) -> FloatArray:
    """Mean products with the error, and mean squares, (2, 2 + terms).

    Of the error itself, of what each term changes it by, and of what is left without all of them.
    """

    def error(spared: Callable[[ResolvedCell], ResolvedCell] | None) -> "pd.Series[float]":
        recording = record_cell(cell, truth, parts, spared=spared)
        return _error(cell, recording, truth, parts, estimator, wanted)

    def without_all(told: ResolvedCell) -> ResolvedCell:
        for term in terms:
            told = term.spared(told)
        return told

    whole = error(None)
    changes = [(whole - error(term.spared)).dropna() for term in terms]
    left = error(without_all)
    return np.array(
        [(_mean_product(one, whole), _mean_product(one, one)) for one in (whole, *changes, left)]
    ).T


def _mean_product(one: "pd.Series[float]", other: "pd.Series[float]") -> float:
    """Mean product at the samples, or places, that both have."""
    both = one.index.intersection(other.index)
    return float((one.loc[both].to_numpy() * other.loc[both].to_numpy()).mean()) if len(both) else 0.0


def _error(
    cell: Cell, recording: Recording, truth: Truth, parts: Parts, estimator: Estimator, wanted: Requirement
) -> "pd.Series[float]":
    """The error of one recording, over time or, of rails, over places."""
    (estimate,) = estimate_here(estimator, [recording]).estimates
    if wanted.quantity in RAILS:
        band = None if wanted.band == "full" else bands_by_name(cell.spec)[wanted.band]
        base = cell.spec.geometry.twist_base_m
        of_rails = rail_error_of(estimate, parts.rails(cell), wanted.quantity, band, twist_base_m=base)
        if of_rails is not None:
            places = of_rails.index.to_numpy(dtype=np.float64)
            windows = windows_of(truth.track, places, np.ones(len(places)))
            return of_rails.iloc[chosen_windows(windows, (wanted.window,))[wanted.window]]
    else:
        against: Reference = reference_of(truth, recording)
        values: FloatArray | None = error_of(estimate, against, wanted.quantity)
        if values is not None:
            at = chosen_windows(against.windows, (wanted.window,))[wanted.window]
            return pd.Series(values[at], index=at)
    raise InputError(
        "this method says nothing of it",
        field="quantity",
        value=wanted.what,
        remedy="name another method",
        limit="a method with such an estimate",
    )


def budget_sentence(budget: pd.DataFrame) -> str:
    """The largest part of an error in one sentence: ``"94 % of the squared error of roll rms is ..."``."""
    first = budget.sort_values("share", ascending=False).iloc[0]
    whole = f"{first['what']} ({first['rms_of_whole']:.3g} {first['unit']})"
    return f"{100.0 * first['share']:.0f} % of the squared error of {whole} is {first['words']}"


def budgets_of(plan: Plan, verdicts: pd.DataFrame, *, watcher: Watcher | None = None) -> pd.DataFrame:
    """Budgets of a scenario's requirements that ask for one, of each IMU at each mount.

    Parameters
    ----------
    plan : Plan
        What was run.
    verdicts : pandas.DataFrame
        What became of it: the budget is of the method under test whose devices are best.
    watcher : Watcher, optional
        Is told of the progress.

    Returns
    -------
    pandas.DataFrame
        `error_budget`, behind ``requirement``, ``number``, ``vehicle``, ``mount``, ``imu``, ``estimator``.
    """
    tables = []
    for number, (part, wanted) in enumerate(
        zip(plan.scenario.spec.require, requirements_of(plan.scenario.spec), strict=True)
    ):
        if not part.budget_draws or verdicts.empty:
            continue
        of_this = verdicts[(verdicts["number"] == number) & verdicts["estimator"].map(_is_tested(plan))]
        of_this = of_this.assign(group=of_this.groupby(list(GROUP), sort=False).ngroup())
        best = of_this.sort_values("at_share", na_position="last").drop_duplicates("group")
        if part.budget_at == "worst":
            best = best.sort_values("at_share", ascending=False, na_position="last")
            best = best.drop_duplicates(["vehicle", "imu"])
        for row in best.sort_values("group").to_dict("records"):
            vehicle, mount, imu = (str(row[name]) for name in GROUP)
            chosen = _first_draws(plan, (vehicle, mount, imu), part.budget_draws)
            labels = {"requirement": wanted.words, "number": number, "vehicle": vehicle, "mount": mount}
            labels |= {"imu": imu, "estimator": str(row["estimator"])}
            tables.append(_labelled(labels, chosen, plan, [wanted], watcher or Watcher()))
    tables = [table for table in tables if len(table)]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def ride_budget(plan: Plan, draws: int, *, watcher: Watcher | None = None) -> pd.DataFrame:
    """What the error of the first method under test is made of, with the first IMU on the first ride.

    It is of the first of `OF_RIDES` that the method tells. A draw costs as many recordings and estimates as
    the sheets have terms, and two more; what it took is told.

    Parameters
    ----------
    plan : Plan
        What was run.
    draws : int
        Over how many draws, of those that the scenario has.
    watcher : Watcher, optional
        Is told of the progress, of the cost, and of a method that has failed.

    Returns
    -------
    pandas.DataFrame
        As of `budgets_of`, with `OF_THE_RIDE` as the number; of no rows if the method fails.
    """
    watcher = watcher or Watcher()
    first = next(iter(cells(plan.scenario)))
    tested = next(name for name, is_tested in _is_tested(plan).items() if is_tested)
    group = first.spec.vehicle, first.imu.name, str(first.imu.grade)
    labels = {"requirement": "", "number": OF_THE_RIDE, "vehicle": group[0], "mount": group[1]}
    labels |= {"imu": group[2], "estimator": tested}
    begun = time.perf_counter()
    chosen = _first_draws(plan, group, draws)
    table = _labelled(labels, chosen, plan, OF_RIDES, watcher)
    if len(table):
        runs = len(table) * len(chosen)  # as many as rows: of the whole in the place of `TOGETHER`
        watcher.told(f"budget: {runs} estimates by {tested}, {time.perf_counter() - begun:.1f} s")
    return table


def _labelled(
    labels: dict[str, Any], chosen: list[Cell], plan: Plan, wanted: Sequence[Requirement], watcher: Watcher
) -> pd.DataFrame:
    """The budget of the first figure that the method tells; none of a method that fails, which is told."""
    name = labels["estimator"]
    reason: Exception | None = None
    for one in wanted:
        try:
            budget = error_budget(chosen, plan.parts, plan.estimators[name], one, watcher=watcher)
        except Exception as error:
            unless_of_the_machine(error)
            reason = error
            if not isinstance(error, InputError):
                break
        else:
            return pd.DataFrame([labels] * len(budget)).join(budget)
    watcher.told(f"no budget of {name} with {labels['imu']}: {' '.join(str(reason).split())}")
    return pd.DataFrame()


def _is_tested(plan: Plan) -> dict[str, bool]:
    """Which methods are under test, by name."""
    told = {name: description_of(estimator) for name, estimator in plan.estimators.items()}
    tested = {name: one.uses_imu and one.role == "method" for name, one in told.items()}
    return tested if any(tested.values()) else {name: one.uses_imu for name, one in told.items()}


def _first_draws(plan: Plan, group: tuple[str, str, str], most: int) -> list[Cell]:
    """The first draws of a grade at a mount of a vehicle; of the rides that it has, the first."""
    own = [
        cell
        for cell in cells(plan.scenario)
        if (cell.spec.vehicle, cell.imu.name, str(cell.imu.grade)) == group
    ]
    kept = set(without_ablations(pd.DataFrame([labels_of(cell) for cell in own]))["cell"])
    first = min(cell.case for cell in own if cell.number in kept)
    own = [cell for cell in own if cell.case == first]
    return sorted(own, key=lambda cell: (cell.track_draw, cell.sample, cell.sensor_draw))[:most]
