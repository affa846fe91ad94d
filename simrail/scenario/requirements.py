"""What a scenario asks of its IMUs (``[[require]]``): judged before a run, and drawn for until it is settled.

Like the rule of an interval (`simrail.scenario.stop_rule`), the rule here looks at fixed numbers of draws. At
each look the grades whose verdicts are all settled are left out of what is drawn next (successive
elimination). All looks together have no more than the requirement's chance of a false verdict
(`simrail.scoring.share.decide`).
"""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

import pandas as pd

from simrail.core.errors import InputError, one_of
from simrail.core.toml_files import blame
from simrail.scenario.cells import Cell, cell_record
from simrail.scenario.distributions import sample_count
from simrail.scenario.scenario import Scenario, ScenarioFile
from simrail.scenario.stop_rule import (
    LEVELS,
    Looks,
    StopRule,
    StopState,
    judge_least_draws,
    judge_stop_rule,
)
from simrail.scenario.study_tables import RequirePart
from simrail.scoring.requirement import Requirement, judge_band
from simrail.scoring.share import UNDECIDED, least_devices
from simrail.scoring.table import CURVE_PREFIX, EVERY_CURVE, QUANTITY_UNITS, WINDOWS, concat_scores
from simrail.scoring.verdicts import GROUP, settled, verdict_table
from simrail.track.bands import TOO_SHORT, Band, why_not
from simrail.track.design import TrackDesign

_STEP_M = 0.25
"""Places at which it is tried whether a ride is long enough for a band."""


def requirements_of(spec: ScenarioFile) -> tuple[Requirement, ...]:
    """What a scenario asks for, in the units of the score table."""
    return tuple(part.requirement() for part in spec.require)


def judge_requirements(spec: ScenarioFile, estimators: Collection[str]) -> None:
    """Refuse requirements on what the score table will not have, and a stop rule that could not be asked.

    Parameters
    ----------
    spec : ScenarioFile
        The scenario.
    estimators : collection of str
        Names of its estimators in the tables.

    Raises
    ------
    InputError
        Naming the requirement, its field, value and limit.
    """
    for i, part in enumerate(spec.require):
        at = f"require[{i}]"
        one_of(part.quantity, QUANTITY_UNITS, "is nothing that is scored", field=f"{at}.quantity")
        with blame(None, at):
            part.requirement()
        _judge_words(part, spec, at)
    if spec.stop is None:
        return
    if not spec.stop.verdicts:
        judge_stop_rule(spec, estimators)
        return
    judge_least_draws(spec, spec.stop.least_draws)
    if not spec.require:
        raise InputError(
            "there is no verdict to stop at",
            field="stop.verdicts",
            value=True,
            remedy="add a [[require]], or say whose interval is to be narrow",
            limit="a scenario with a [[require]]",
        )


def _judge_words(part: RequirePart, spec: ScenarioFile, at: str) -> None:
    """Band, window and metric must be among those that the scenario scores."""
    with blame(None, at):
        judge_band(part.requirement(), (*spec.geometry.bands, *spec.geometry.own_bands))
    kept = spec.score.windows
    if part.window.startswith(CURVE_PREFIX):
        if kept is not None and not {part.window, EVERY_CURVE}.intersection(kept):
            raise InputError(
                "is not kept by [score]",
                field=f"{at}.window",
                value=part.window,
                remedy="add it to windows",
                limit="one of those that [score] keeps",
            )
    else:
        one_of(part.window, WINDOWS if kept is None else kept, "is not scored", field=f"{at}.window")
    if spec.score.metrics is not None:
        one_of(part.metric, spec.score.metrics, "is not kept by [score]", field=f"{at}.metric")


def judge_requirements_of_ride(
    spec: ScenarioFile, track: TrackDesign, bands: Iterable[Band], reach_m: tuple[float, float]
) -> None:
    """Refuse a window that the ride has not, and a band that it is too short for.

    Parameters
    ----------
    spec : ScenarioFile
        Of a cell.
    track, bands, reach_m : TrackDesign, iterable of Band, (float, float)
        The line of its ride, the bands it is scored in, and its smallest and largest s.

    Raises
    ------
    InputError
        Naming the requirement.
    """
    first, last = reach_m
    known = {band.name: band for band in bands}
    met = range(int(track.segment(first)), int(track.segment(last)) + 1)
    names = [track.segment_name(i) for i in met]
    kinds = {track.elements[i].word for i in met}
    for i, part in enumerate(spec.require):
        window = part.window
        named = window.removeprefix(CURVE_PREFIX)
        lacks = window in ("straight", "transition", "curve") and window not in kinds
        if lacks or (window.startswith(CURVE_PREFIX) and named not in names):
            raise InputError(
                f"is no part of this ride over {track.name}",
                field=f"require[{i}].window",
                value=window,
                limit=f"{first:g} to {last:g} m has " + ", ".join(sorted(kinds)),
            )
        if part.band in known:
            edges = known[part.band].edges_m(part.quantity)
            if why_not(edges, count=int((last - first) / _STEP_M), step_m=_STEP_M) == TOO_SHORT:
                raise InputError(
                    "is a band that this ride is too short for",
                    field=f"require[{i}].band",
                    value=part.band,
                    limit=f"waves to {edges[1]:g} m, the ride has {last - first:g} m",
                )


@dataclass(frozen=True)
class VerdictState:
    """What is settled after so many draws.

    Attributes
    ----------
    draws, of : int
        Draws that were asked about, and that the scenario has.
    level : str
        One of `simrail.scenario.stop_rule.LEVELS`.
    open, verdicts : int
        Verdicts that are not settled, of how many.
    settled : dict of str to int
        After how many draws all verdicts of a group were; its name is that of `group_of`.
    so_far : tuple of str
        How many devices of each group pass that is open, by method, in words.
    """

    draws: int
    of: int
    level: str
    open: int
    verdicts: int
    settled: dict[str, int] = field(default_factory=dict)
    so_far: tuple[str, ...] = field(default=(), compare=False)

    @property
    def reached(self) -> bool:
        """Whether every verdict is settled."""
        return self.open == 0

    @property
    def words(self) -> str:
        """One line for people."""
        of = f"{self.draws} of {self.of}" if self.draws < self.of else f"all {self.of}"
        what = "every verdict is settled" if self.reached else f"{self.open} of {self.verdicts} are open"
        return f"after {of} {LEVELS[self.level]} {what}"

    @property
    def record(self) -> dict[str, Any]:
        """Plain values for the manifest."""
        own = asdict(self) | {"reached": self.reached, "told": self.words}
        del own["so_far"]
        return own


def _settled_by(state: StopState | VerdictState | None) -> dict[str, int]:
    return state.settled if isinstance(state, VerdictState) else {}


def group_of(vehicle: object, mount: object, imu: object) -> str:
    """Name of what is drawn together: a grade at a mount of a vehicle."""
    return f"{imu} on {mount} of {vehicle}"


@dataclass(frozen=True)
class VerdictRule(Looks):
    """The rule that draws until every verdict of a scenario is settled, or its draws are spent."""

    @property
    def words(self) -> str:
        """How many devices are drawn, and how many the answer takes."""
        most, parts = max(looks_of(self.spec)), []
        for share, chance in dict.fromkeys((one.share, one.chance) for one in requirements_of(self.spec)):
            least = least_devices(share, chance)
            beyond = "" if most >= least else ", more than are drawn: it cannot be the answer"
            parts.append(f"'enough' for {100.0 * share:g} % of them takes {least} that all pass{beyond}")
        return f"at most {most} devices of each IMU at each mount; " + "; ".join(parts)

    def has(self, cell: Cell, draws: int, former: StopState | VerdictState | None) -> bool:
        """Whether a cell is among those of the first so many draws, or of fewer if it was settled before."""
        number: int = getattr(cell, self.level)
        name = group_of(cell.spec.vehicle, cell.imu.name, cell.imu.grade)
        return number < min(draws, _settled_by(former).get(name, draws))

    def state(
        self,
        cells: Iterable[Cell],
        tables: Iterable[pd.DataFrame],
        draws: int,
        former: StopState | VerdictState | None,
    ) -> VerdictState:
        """What the first so many draws say; see `simrail.scenario.stop_rule.StopRule.state`."""
        listed = [cell_record(cell) for cell in cells if self.has(cell, draws, former)]
        scores = concat_scores(tables)
        scores = scores[scores["cell"].isin([one["cell"] for one in listed])]
        table = verdict_table(
            scores, pd.DataFrame.from_records(listed), requirements_of(self.spec), looks=looks_of(self.spec)
        )
        done = dict(_settled_by(former))
        for vehicle, mount, imu in sorted(settled(table)):
            done.setdefault(group_of(vehicle, mount, imu), draws)
        is_open = int((table["verdict"] == UNDECIDED).sum()) if len(table) else 0
        so_far = tuple(_so_far(table, done)) if draws < self.draws else ()
        return VerdictState(draws, self.draws, self.level, is_open, len(table), done, so_far)


def _so_far(table: pd.DataFrame, done: dict[str, int]) -> Iterator[str]:
    """How many devices pass by each method, of the groups that are open, a line each."""
    if table.empty:
        return
    left = 0
    for (vehicle, mount, imu), rows in table.groupby(list(GROUP), sort=False):
        if group_of(vehicle, mount, imu) in done:
            continue
        left += 1
        if left <= _MOST_TOLD:
            judged = rows[rows["devices"] > 0].to_dict("records")
            passed = [f"{row['estimator']} {row['passed']} of {row['devices']}" for row in judged]
            yield f"so far, {imu} on the {mount}: {', '.join(passed)} pass"
    if left > _MOST_TOLD:
        yield f"so far, and {left - _MOST_TOLD} more"


_MOST_TOLD = 12
"""Groups that are told of between two looks."""


def stop_rule_of(scenario: Scenario) -> StopRule | VerdictRule | None:
    """The stop rule of a scenario, if it has one."""
    asked = scenario.spec.stop
    if asked is None:
        return None
    return VerdictRule(scenario.spec, asked) if asked.verdicts else StopRule(scenario.spec, asked)


def looks_of(spec: ScenarioFile) -> tuple[int, ...]:
    """Devices at each look at the verdicts of a scenario."""
    if spec.stop is None or not spec.stop.verdicts:
        return (1,)
    rule = VerdictRule(spec, spec.stop)
    within = {
        "track_draw": sample_count(spec) * spec.monte_carlo.sensor_draws,
        "sample": spec.monte_carlo.sensor_draws,
    }
    return tuple(stage * within.get(rule.level, 1) for stage in rule.stages)
