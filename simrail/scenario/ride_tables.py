"""Tables of a scenario that say how a train runs: ``[[ride]]`` with its stops, ``[[rail_condition]]``."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.scenario.axes import Listed, each
from simrail.scenario.fields import Name


def _refuse_on_standstill(field: str, problem: str) -> None:
    raise InputError(
        f"a standstill, without end_m, {problem}",
        field=field,
        limit="a ride with end_m",
        remedy=f"remove {field}, or add end_m and speed_kmh",
    )


class StopPart(Part):
    """A stop on the way: where the reference point of the vehicle stands, and for how long."""

    position_m: float
    """Where the reference point of the vehicle stands, s along the track, m."""
    dwell_s: Annotated[float, Field(ge=0.0, le=3600.0)]
    """For how long, s."""


class RunPart(Part):
    """One of the ``runs`` of a ride: where it ends, and how long the train stands before the next one."""

    end_m: float
    """Where the run ends, m."""
    turn_s: Annotated[float, Field(ge=0.0, le=3600.0)] | None = None
    """How long the train stands before the next one, s."""


class RestrictionPart(Part):
    """``[[ride.restriction]]``: a stretch of the line that is passed more slowly, in either direction."""

    start_m: float
    """Where it begins, m."""
    end_m: float
    """Where it ends, m."""
    speed_kmh: Annotated[float, Field(gt=0.0, le=400.0)]
    """Highest speed there, km/h."""

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if self.end_m <= self.start_m:
            raise InputError(
                "the stretch has no length",
                field="end_m",
                value=self.end_m,
                limit=f"> start_m = {self.start_m:g} m",
                remedy="start_m is the smaller s, whichever way the train goes",
            )
        return self


class CoastingPart(Part):
    """``[ride.coasting]``: at its speed the train rolls, until it brakes or is as slow as ``least_kmh``."""

    deceleration_mps2: Annotated[float, Field(gt=0.0, le=0.5)]
    """How much a rolling train slows down, m/s2."""
    least_kmh: Annotated[float, Field(gt=0.0, le=400.0)]
    """Speed at which it holds its speed again, km/h."""


class RidePart(Part):
    """``[[ride]]``: one ride over the track. It runs backwards if ``end_m < start_m``.

    In place of ``end_m``, ``runs`` says where each of several runs ends, and for how long the train stands
    (``turn_s``) before the next; it is not turned: a run towards smaller s is run backwards. Every run stops
    at those of the ``stops`` that it passes.

    With ``reverse = true`` it is ridden the other way, from ``end_m`` to ``start_m``, stops in turn; with
    ``reverse = [false, true]`` both ways. Without ``end_m`` and ``speed_kmh`` the vehicle stands where it
    is, for ``rest_s + final_rest_s``. Over a small kick in smooth straight rails, ``kick_end_m`` says where
    it ends: it is scored whether the wheelsets' lateral motion decays beyond (`simrail.scoring.kick`).
    """

    name: Name
    """Name of the ride in tables."""
    start_m: Listed[float]
    """Where the vehicle's reference point stands at first, s along the track, m."""
    end_m: Listed[float] | None = None
    """Where it stands at last, m; with smaller s than at the start it runs backwards."""
    speed_kmh: Listed[Annotated[float, Field(gt=0.0, le=400.0)]] | None = None
    """Cruise speed, km/h."""
    acceleration_mps2: Listed[Annotated[float, Field(gt=0.0, le=3.0)]] = 0.6
    """Most that it accelerates, and brakes unless braking_mps2 is given, m/s2."""
    jerk_mps3: Listed[Annotated[float, Field(gt=0.0, le=10.0)]] = 0.4
    """Most that the acceleration changes, m/s3."""
    rest_s: Listed[Annotated[float, Field(ge=0.0, le=3600.0)]] = 20.0
    """Time at rest before the first start, s."""
    final_rest_s: Listed[Annotated[float, Field(ge=0.0, le=3600.0)]] = 5.0
    """Time at rest after the last stop, s."""
    stops: tuple[StopPart, ...] = ()
    """Stops on the way."""
    drive: Listed[Literal["guide", "wheels"]] = "guide"
    """Who moves the vehicle: a guide at its centre, or its own wheels."""
    reverse: Listed[bool] = False
    """True rides it the other way, from end_m to start_m; [false, true] both ways."""
    kick_end_m: float | None = None
    """Where a kick of the rails ends, m: it is scored whether the wheelsets' motion decays behind it."""
    runs: tuple[RunPart, ...] = ()
    """Several runs in place of end_m; the train is not turned between them."""
    braking_mps2: Listed[Annotated[float, Field(gt=0.0, le=3.0)]] | None = None
    """Most that it brakes, m/s2."""
    restriction: tuple[RestrictionPart, ...] = ()
    """Stretches of the line that are passed more slowly."""
    coasting: CoastingPart | None = None
    """At its speed the train rolls; without it, it holds its speed."""

    @model_validator(mode="after")
    def _goes_or_stands(self) -> RidePart:
        if self.runs:
            self._check_runs()
            return self
        if "runs" in self.model_fields_set:
            raise InputError(
                "is empty: the ride goes nowhere",
                field="runs",
                value="[]",
                limit="one run or more",
                remedy="say where each run ends, or take out runs and give end_m",
            )
        if (self.end_m is None) != (self.speed_kmh is None):
            missing = "end_m" if self.end_m is None else "speed_kmh"
            limit = "end_m and speed_kmh for a ride, neither for a standstill"
            raise InputError(f"{missing} is missing", limit=limit, remedy=f"add {missing}")
        if self.end_m is None and self.stops:
            _refuse_on_standstill("stops", "has no stops on the way")
        if self.end_m is None and any(each(self.reverse)):
            _refuse_on_standstill("reverse", "cannot be reversed")
        if self.end_m is None and (self.restriction or self.coasting):
            field = "restriction" if self.restriction else "coasting"
            _refuse_on_standstill(field, "has neither restrictions nor coasting")
        return self

    def _check_runs(self) -> None:
        def refuse(problem: str, field: str, value: object, limit: str | None, remedy: str) -> None:
            raise InputError(problem, field=field, value=value, limit=limit, remedy=remedy)

        if self.end_m is not None:
            refuse("has runs, which say where it ends", "end_m", self.end_m, None, "take out end_m, or runs")
        if self.speed_kmh is None:
            refuse("is missing: runs need a speed", "speed_kmh", None, None, "add speed_kmh")
        if any(each(self.reverse)):
            refuse("has runs, which say the ways", "reverse", True, "false", "list the runs the other way")
        if self.kick_end_m is not None:
            refuse(
                "is scored over one run", "kick_end_m", self.kick_end_m, None, "use end_m in place of runs"
            )
        for i, run in enumerate(self.runs):
            last = i == len(self.runs) - 1
            if last and run.turn_s is not None:
                refuse("no run follows", f"runs[{i}].turn_s", run.turn_s, None, "use final_rest_s")
            if not last and run.turn_s is None:
                refuse("is missing", f"runs[{i}].turn_s", None, "0 to 3600 s", "say how long the turn takes")

    @property
    def as_ridden(self) -> RidePart:
        """The ride from where it really starts to where it really ends; itself unless reversed."""
        if not self.reverse:
            return self
        turned = {"start_m": self.end_m, "end_m": self.start_m, "stops": self.stops[::-1], "reverse": False}
        return self.model_copy(update=turned)

    @property
    def ends_m(self) -> tuple[float, ...]:
        """Where each run ends; nothing of a standstill. As ridden, no list."""
        ends = self.runs or (() if self.end_m is None else (self,))
        return tuple(part.end_m for part in ends)  # type: ignore[misc]

    @property
    def reach_m(self) -> tuple[float, float]:
        """Smallest and largest s of the vehicle's reference point. As ridden, no list."""
        places = (self.start_m, *self.ends_m)
        return min(places), max(places)

    @property
    def stands(self) -> bool:
        """Whether the vehicle does not move."""
        return self.end_m is None and not self.runs


class RailConditionPart(Part):
    """``[[rail_condition]]``: what lies on the rails, by a name or by its friction coefficient."""

    start_m: float
    """Where it begins, s along the track, m."""
    end_m: float
    """Where it ends, m."""
    condition: Literal["dry", "wet", "leaves"] | None = None
    """What lies there, by its name."""
    friction: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    """Friction coefficient there, in place of a name."""
    rails: Literal["both", "left", "right"] = "both"
    """Which rails it lies on."""

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.condition is None) == (self.friction is None):
            raise InputError(
                "needs either a condition or a friction coefficient",
                field="condition",
                value=None if self.condition is None else f"{self.condition}, friction {self.friction:g}",
                limit="dry, wet or leaves",
                remedy='give condition = "leaves" or friction = 0.05',
            )
        return self

    @property
    def words(self) -> str:
        """What lies there, for reports."""
        what = self.condition or f"friction {self.friction:g}"
        return what if self.rails == "both" else f"{what}, {self.rails} rail"
