"""When a campaign has seen enough: the interval of a named metric is narrower than asked, in every case.

The rule looks at fixed numbers of draws, `least_draws` first and then half as many more each time, and
never at what happens to be finished: the cells of a stage are all run before it is asked, so that the cells
of the result, and their scores, are the same for any number of workers, batch size, or interruption.

A draw is one of the level at which an interval resamples (`simrail.scoring.bootstrap`): the track if the
scenario lays it more than once; else the samples of its distributions, if there are several; else the
sensors. More draws of a lower level would not make up for few of the upper one, so those are always taken
whole. A first part of a Latin hypercube is a plain random sample of the distributions.

Looking again and again is optional stopping: a run stops the sooner, the smaller its spread happens to come
out, so that the interval at the stop holds the true mean less often than its 95 %. Few looks and a sound
`least_draws` keep the loss small; the tests measure it.
"""

from collections.abc import Collection, Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.scenario.cells import Cell, sensor_draws
from simrail.scenario.distributions import sample_count
from simrail.scenario.scenario import ScenarioFile
from simrail.scenario.study_tables import StopRulePart
from simrail.scoring.bootstrap import clustered, mean_interval
from simrail.scoring.table import BANDS, CURVE_PREFIX, EVERY_CURVE, METRICS, QUANTITY_UNITS, WINDOWS, unit_of

LEVELS = {
    "track_draw": "draws of the track",
    "sample": "samples of the distributions",
    "sensor_draw": "draws of the sensors",
}
"""What a draw may be, and in words."""

_FIGURE = ("estimator", "quantity", "band", "reference", "window", "metric")


@dataclass(frozen=True)
class StopState:
    """What the rule knows after so many draws.

    Attributes
    ----------
    draws, of : int
        Draws that it was asked about, and that the scenario has.
    level : str
        One of `LEVELS`.
    figure : str
        Whose interval it is, in words.
    width : float, optional
        Of the widest interval among the cases; None where a case has too few draws with a value.
    asked : float
        Width that is asked for.
    unit : str
        Of both.
    case : str
        The case with the widest interval, in words.
    """

    draws: int
    of: int
    level: str
    figure: str
    width: float | None
    asked: float
    unit: str
    case: str

    @property
    def reached(self) -> bool:
        """Whether the interval is narrower than asked, in every case."""
        return self.width is not None and self.width < self.asked

    @property
    def words(self) -> str:
        """One line for people."""
        width = "unknown for want of values" if self.width is None else f"{self.width:.3g} {self.unit} wide"
        which = f"the widest 95 % interval of {self.figure} is {width} ({self.case})"
        of = f"{self.draws} of {self.of}" if self.draws < self.of else f"all {self.of}"
        what = "reached" if self.reached else "not reached"
        asked = f"less than {self.asked:g} {self.unit} asked"
        return f"stop rule {what} after {of} {LEVELS[self.level]}: {which}, {asked}"

    @property
    def record(self) -> dict[str, Any]:
        """Plain values for the manifest."""
        return asdict(self) | {"reached": self.reached, "told": self.words}


def level_of(spec: ScenarioFile) -> str:
    """What a draw of a scenario is, one of `LEVELS`."""
    if spec.monte_carlo.track_draws > 1:
        return "track_draw"
    return "sample" if sample_count(spec) > 1 else "sensor_draw"


def draws_of(spec: ScenarioFile) -> int:
    """Number of draws that a scenario has."""
    level = level_of(spec)
    if level == "track_draw":
        return spec.monte_carlo.track_draws
    if level == "sample":
        return sample_count(spec)
    return max(sensor_draws(spec, imu) for imu in spec.imu)


def stages_of(least: int, draws: int) -> tuple[int, ...]:
    """After how many draws a rule is asked: at first `least`, then half as many more each time."""
    stages = [min(least, draws)]
    while stages[-1] < draws:
        stages.append(min(draws, (3 * stages[-1] + 1) // 2))
    return tuple(stages)


@dataclass(frozen=True)
class Looks:
    """A rule that looks at fixed numbers of draws.

    Attributes
    ----------
    spec : ScenarioFile
        The scenario.
    asked : StopRulePart
        What it asks for.
    """

    spec: ScenarioFile
    asked: StopRulePart

    @property
    def level(self) -> str:
        """What a draw is, one of `LEVELS`."""
        return level_of(self.spec)

    @property
    def draws(self) -> int:
        """Number of draws that the scenario has."""
        return draws_of(self.spec)

    @property
    def stages(self) -> tuple[int, ...]:
        """After how many draws the rule is asked."""
        return stages_of(self.asked.least_draws, self.draws)


@dataclass(frozen=True)
class StopRule(Looks):
    """The rule that stops once an interval is narrow."""

    def has(self, cell: Cell, draws: int, _former: object) -> bool:
        """Whether a cell is among those of the first so many draws."""
        number: int = getattr(cell, self.level)
        return number < draws

    def state(
        self, cells: Iterable[Cell], tables: Iterable[pd.DataFrame], draws: int, _former: object = None
    ) -> StopState:
        """What the first so many draws say.

        Intervals are those of ``scores.csv``, but for the ends that are cut off at 0 there: cut, they would
        look narrow when they are widest. A case needs `least_draws` draws with a value. Draws of the sensors
        that an IMU is not given (its own ``sensor_draws``) are not waited for: its cases are not asked.

        Parameters
        ----------
        cells : iterable of Cell
            Those of the scenario, in order.
        tables : iterable of pandas.DataFrame
            Score tables that hold, among others, the rows of these draws.
        draws : int
            How many.
        """
        values = self._values(tables)
        cases: dict[int, list[Cell]] = {}
        for cell in cells:
            short = self.level == "sensor_draw" and sensor_draws(self.spec, cell.imu) < self.draws
            if not short and self.has(cell, draws, None):
                cases.setdefault(cell.case, []).append(cell)
        widths = self._widths([self._clusters(members, values) for members in cases.values()])
        widest = int(np.argmax(widths))
        return StopState(
            draws=draws,
            of=self.draws,
            level=self.level,
            figure=f"{self.asked.estimator} {self.asked.quantity} {self.asked.metric}",
            width=float(widths[widest]) if np.isfinite(widths[widest]) else None,
            asked=self.asked.width,
            unit=unit_of(self.asked.quantity, self.asked.metric),
            case=self._case_words(list(cases.values())[widest]),
        )

    def _values(self, tables: Iterable[pd.DataFrame]) -> dict[int, float]:
        """Value of the figure in each cell; NaN, or none, where it failed."""
        values: dict[int, float] = {}
        for scores in tables:
            wanted = np.ones(len(scores), dtype=bool)
            for name in _FIGURE:
                wanted &= (scores[name] == getattr(self.asked, name)).to_numpy()
            values.update(zip(scores["cell"][wanted].tolist(), scores["value"][wanted].tolist(), strict=True))
        return values

    def _clusters(self, members: list[Cell], values: dict[int, float]) -> tuple[FloatArray, FloatArray]:
        """Sums and numbers (k,) of the values of each of the k clusters of a case that has some."""
        of_cells = [values.get(cell.number, np.nan) for cell in members]
        if self.level == "sensor_draw":
            finite, labels = clustered(of_cells, None)
        else:
            tracks = {draw: i for i, draw in enumerate(sorted({(c.track_draw, c.sample) for c in members}))}
            clusters = [tracks[cell.track_draw, cell.sample] for cell in members]
            finite, labels = clustered(of_cells, clusters, apart=False)
        counts = np.bincount(labels)
        return np.asarray(np.bincount(labels, finite), dtype=np.float64), counts.astype(np.float64)

    def _widths(self, clusters: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
        """Width of the interval of each case, infinite where too few draws have a value."""
        most = max(len(sums) for sums, _ in clusters)
        sums, counts = np.zeros((len(clusters), most)), np.zeros((len(clusters), most))
        for i, (total, count) in enumerate(clusters):
            sums[i, : len(total)], counts[i, : len(count)] = total, count
        # The sums of a linear-algebra library depend on its number of threads.
        with threadpool_limits(1):
            _, low, high = mean_interval(sums, counts)
        enough = (counts > 0).sum(axis=1) >= self.asked.least_draws
        return np.where(enough & np.isfinite(high - low), high - low, np.inf)

    def _case_words(self, members: list[Cell]) -> str:
        """What a case is called: its ride, its IMU and the values of its axes."""
        first = members[0]
        same = {
            name: value
            for name, value in first.settings.items()
            if name != "imu.grade" and all(cell.settings.get(name) == value for cell in members)
        }
        words = [f"ride {first.ride.name}", f"{first.imu.grade} on {first.imu.name}"]
        return ", ".join(words + [f"{name} = {value}" for name, value in same.items()])


def judge_stop_rule(spec: ScenarioFile, estimators: Collection[str]) -> None:
    """Refuse a stop rule that could not be asked, or would never be told anything.

    Parameters
    ----------
    spec : ScenarioFile
        A scenario with such a rule.
    estimators : collection of str
        Names of its estimators in the tables.

    Raises
    ------
    InputError
        If the rule names what the score table does not have, or there are too few draws.
    """
    assert spec.stop is not None
    asked, windows, metrics = spec.stop, spec.score.windows, spec.score.metrics
    possible: dict[str, Collection[str]] = {
        "estimator": estimators,
        "quantity": QUANTITY_UNITS,
        # Time differs from run to run, and with it would the draws.
        "metric": [one for one in METRICS if one != "us_per_sample" and (metrics is None or one in metrics)],
        "band": (*BANDS, *spec.geometry.own_bands),
        "window": WINDOWS if windows is None else windows,
    }
    every_curve = windows is None or EVERY_CURVE in windows
    for field, words in possible.items():
        value = getattr(asked, field)
        if field == "window" and every_curve and value.startswith(CURVE_PREFIX) and value != EVERY_CURVE:
            continue
        if value not in words or value == EVERY_CURVE:
            scored = " or keep another in [score]" if field in ("metric", "window") else ""
            raise InputError(
                f"is no {field} whose interval this scenario can stop at",
                field=f"stop.{field}",
                value=value,
                limit="one of " + ", ".join(words),
                remedy=f"name one of these{scored}",
            )
    judge_least_draws(spec, asked.least_draws)


def judge_least_draws(spec: ScenarioFile, least: int) -> None:
    """Refuse a rule that would be asked after more draws than there are."""
    draws = draws_of(spec)
    if least > draws:
        raise InputError(
            f"is more than the scenario has {LEVELS[level_of(spec)]}",
            field="stop.least_draws",
            value=least,
            limit=f"2 to {draws}" if draws > 1 else "at least 2 draws, this scenario has 1",
            remedy="raise track_draws or sensor_draws in [monte_carlo], or leave out [stop]",
        )
