"""What a person writes into the tables of a scenario, as models, one per table.

Only the form of each field is judged here. Sensors beside the IMU are in `simrail.scenario.sensor_tables`;
the scenario itself, and the reading of it, in `simrail.scenario.scenario`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, create_model, field_validator, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part, blame, existing_file
from simrail.recording.files.data_file import TABLES, TEXTS
from simrail.recording.sheets.figures import FIGURES
from simrail.recording.sheets.imu_file import ImuHead, described, limited
from simrail.scenario.axes import Listed, each
from simrail.scenario.designs import DESIGNS
from simrail.scenario.measured_file import MeasuredPart
from simrail.scenario.measured_header import recognise
from simrail.scenario.spectrum_file import is_spectrum, read_spectrum
from simrail.scoring.requirement import Requirement, limit_of
from simrail.track.defects import Defect
from simrail.track.irregularity import OWN, Irregularity
from simrail.track.map_errors import EXACT, MapDefect, MapErrors
from simrail.track.map_file import (
    CantSd,
    CorrelationLength,
    GradientSd,
    OffsetSd,
    PlaceSd,
    RadiusSd,
    ScaleSd,
    map_errors_of,
)
from simrail.track.measured import MeasuredRails
from simrail.vehicle.factors import VehicleFactors

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$", max_length=64)]
"""A name that can stand in tables and file names: letters, digits and ``_ . + -``."""

Positive = Annotated[float, Field(gt=0.0)]

OnBoard = Annotated[float, Field(ge=-50.0, le=50.0)]
"""A coordinate of something that a vehicle carries, m from its reference point."""


def _refuse_on_standstill(field: str, problem: str) -> None:
    raise InputError(
        f"a standstill, without end_m, {problem}",
        field=field,
        limit="a ride with end_m",
        remedy=f"remove {field}, or add end_m and speed_kmh",
    )


Draws = Annotated[int, Field(ge=1, le=1_000_000)]


def _ordered(wavelengths_m: tuple[float, float]) -> tuple[float, float]:
    if wavelengths_m[0] >= wavelengths_m[1]:
        limit = "[shortest, longest]"
        raise InputError("are no range", value=list(wavelengths_m), limit=limit, remedy="swap them")
    return wavelengths_m


Wavelengths = Annotated[tuple[Positive, Positive], AfterValidator(_ordered)]
"""The shortest and the longest wavelength, m."""


Scale = Annotated[float, Field(ge=0.0, le=10.0)]
"""A factor on amplitudes."""


class DefectPart(Part):
    """``[[irregularity.defect]]``: a discrete defect by form and place (`simrail.track.defects`)."""

    form: Literal["ramp", "step", "dip", "joint", "twist"]
    """Its form."""
    at_m: float
    """Where it begins, s along the track, m."""
    length_m: Positive
    """Length of the form, of a ramp, step or twist that of its rise, m."""
    size_mm: float
    """Its size, mm: up or left positive, of a dip or joint down or right, of a twist left rail up."""
    direction: Literal["vertical", "lateral"] = "vertical"
    """Whether rails leave their place up and down, or aside."""
    rails: Literal["both", "left", "right"] = "both"
    """Which of the rails have it."""
    hold_m: Annotated[float, Field(ge=0.0)] | None = None
    """How far a ramp or a twist keeps its height before it returns, m."""

    def defect(self) -> Defect:
        """The defect that it describes."""
        return Defect(
            form=self.form,
            at_m=self.at_m,
            length_m=self.length_m,
            size_m=self.size_mm / 1000.0,
            direction=self.direction,
            rails=self.rails,
            hold_m=self.hold_m,
        )


Factor = Annotated[float, Field(ge=0.1, le=10.0)]
"""Beyond it lies another vehicle."""


class VehicleFactorsPart(Part):
    """``[vehicle_factors]``: how the vehicle that runs differs from its drawing, which the train believes.

    The kinematic engine has no springs: only what follows from the drawing itself would change, so that it is
    refused there. What the wheel's radius is believed to be is ``radius_error`` of the encoder.
    """

    load: Listed[Factor] = 1.0
    """Factor on mass and inertias of frames and car bodies."""
    stiffness: Listed[Factor] = 1.0
    """Factor on the stiffness of all suspensions, rods, bushings and stops."""
    damping: Listed[Factor] = 1.0
    """Factor on the damping of all suspensions and dampers."""

    def factors(self) -> VehicleFactors:
        """The noun."""
        return VehicleFactors(**self.model_dump())


class IrregularityPart(Part):
    """``[irregularity]``: how the rails deviate from the design. Without it they do not.

    What the spectrum gives lies from ``start_m`` to ``end_m``, or along the whole track; rails from a file
    and defects are added.

    In the place of a spectrum's name may stand the path of a measuring car's export, whose columns are known
    by their names: its rails are laid from ``start_m`` or the start of the track on, as far as they reach;
    or that of a table of densities (`simrail.scenario.spectrum_file`).
    """

    spectrum: Listed[str] = "none"
    """Spectrum that the rails are drawn from, by its name."""
    wavelengths_m: Wavelengths = (1.5, 100.0)
    """Shortest and longest wavelength, m."""
    fade_m: Listed[Annotated[float, Field(ge=0.0, le=1000.0)]] = 40.0
    """Length over which irregularities rise at their beginning and fall at their end, m."""
    scale: Listed[Scale] = 1.0
    """Factor on all amplitudes."""
    alignment_scale: Listed[Scale] = 1.0
    """Factor on the amplitudes of the alignment, beside scale."""
    vertical_profile_scale: Listed[Scale] = 1.0
    """Factor on the amplitudes of the vertical profile, beside scale."""
    cross_level_scale: Listed[Scale] = 1.0
    """Factor on the amplitudes of the cross-level, beside scale."""
    gauge_scale: Listed[Scale] = 1.0
    """Factor on the amplitudes of the gauge, beside scale."""
    start_m: Listed[float] | None = None
    """Where what the spectrum gives begins, s along the track, m; with the track if left out."""
    end_m: Listed[float] | None = None
    """Where it ends, m; with the track if left out."""
    measured: MeasuredPart | None = None
    """Rails from a file, in place of the spectrum or beside it."""
    defect: tuple[DefectPart, ...] = ()
    """Discrete defects, added to it."""

    @classmethod
    def explained(cls, key: str, value: object) -> str | None:  # noqa: ARG003
        """Where keys of measured rails belong."""
        own = set(MeasuredPart.model_fields) - set(cls.model_fields)
        if key in own or key == "start":
            name = key if key in own else "start_m"
            return f"put it into a table of its own: [irregularity.measured] {name} = ..."
        return None

    def with_file(self, folder: Path | None, *, start_m: Callable[[], float]) -> IrregularityPart:
        """The part with the rails of a file that stands in the place of a spectrum's name; else itself."""
        if not self._names_file:
            return self
        with blame(None, "spectrum"):
            path = existing_file(str(self.spectrum), folder)
            if self.measured is not None and not is_spectrum(path):
                raise InputError(
                    "is a file beside that of [irregularity.measured]",
                    value=str(self.spectrum),
                    limit="one file of measured rails",
                    remedy="keep one of them",
                )
            if is_spectrum(path):
                return self
            recognise(path)
        place = start_m() if self.start_m is None else float(self.start_m)
        measured = MeasuredPart(file=str(self.spectrum), start_m=place, partial=True)
        return self.model_copy(update={"spectrum": "none", "measured": measured, "start_m": None})

    def irregularity(self, measured: MeasuredRails | None, *, folder: Path | None = None) -> Irregularity:
        """The irregularity that it describes, with the rails of its file; nothing in it is a list."""
        own = self.model_dump(exclude={"defect", "measured"})
        defects = tuple(part.defect() for part in self.defect)
        if not self._names_file:
            return Irregularity(**own, defects=defects, measured=measured)
        with blame(None, "irregularity.spectrum"):
            spectrum = read_spectrum(existing_file(str(self.spectrum), folder))
        own |= {"spectrum": OWN, "own_spectrum": spectrum}
        return Irregularity(**own, defects=defects, measured=measured)

    @property
    def _names_file(self) -> bool:
        return Path(str(self.spectrum)).suffix.lower() in (*TEXTS, *TABLES)


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


class _SheetPart(Part):
    """``[imu.sheet]``: figures that take the place of those of the grade's data sheet."""

    @classmethod
    def explained(cls, key: str, value: object) -> str | None:
        """What to write in the place of the words of a data sheet; see `ImuHead.explained`."""
        return ImuHead.explained(key, value)

    def figures(self) -> dict[str, float]:
        """Those that are given. Nothing of it is a list."""
        return {name: value for name, value in self.model_dump().items() if value is not None}


if TYPE_CHECKING:
    SheetPart = _SheetPart
else:
    _figures: dict[str, Any] = {
        name: (Listed[limited(name)] | None, Field(default=None, description=described(name)))
        for name in FIGURES
    }
    SheetPart = create_model("SheetPart", __base__=_SheetPart, __module__=__name__, **_figures)


NOISE = "noise"
"""Word in the name of an IMU or of its grade that says that noise was added to its signals."""


class ImuPart(Part):
    """``[[imu]]``: an IMU of some grade, mounted on a body of the vehicle.

    ``sensor_draws`` limits the draws of this IMU below those of ``[monte_carlo]``: an ideal one has no
    errors to be drawn, so that one or two draws (of the encoder) say all. ``vehicle`` names the one that it
    is on, where a scenario has several whose bodies have other names. ``sheet`` has figures that take the
    place of those of the grade's data sheet, by the keys of IMU files: a number, a list, or a distribution.
    """

    name: Name
    """Name of the IMU in tables."""
    grade: Listed[str]
    """A shipped IMU, or the path of an IMU file."""
    vehicle: str | None = None
    """The vehicle that it is on, where a scenario has several with bodies of other names."""
    body: Listed[str]
    """The body that carries it."""
    position_m: tuple[OnBoard, OnBoard, OnBoard]
    """Where, m: ahead of the body's reference point, left of the track's centre, above the rails, as it
    stands on level track."""
    roll_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    """How it is turned on the body about X, degrees; nobody tells the train."""
    pitch_deg: Listed[Annotated[float, Field(ge=-90.0, le=90.0)]] = 0.0
    """The same about Y, degrees."""
    yaw_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    """The same about Z, degrees."""
    sensor_draws: Draws | None = None
    """Fewer draws than those of [monte_carlo], for one that has no errors to be drawn."""
    sheet: SheetPart | None = None
    """Figures in the place of those of the grade's data sheet."""

    def is_on(self, vehicle: str) -> bool:
        """Whether it is on a vehicle."""
        return self.vehicle in (None, vehicle)

    @property
    def noise_added(self) -> bool:
        """Whether it stands for another one with noise added, as a report sets the two side by side."""
        return NOISE in self.name or NOISE in str(self.grade)


class MapDefectPart(Part):
    """``[[map.defect]]``: one fault of the map that the train does not know of.

    ``at_m`` lies in the transition or the curve that is wrong, or in the middle of what has settled.
    """

    kind: Literal["missing_transition", "straightened_transition", "coarse_curve", "settled"]
    """What is wrong: a transition that is missing or straight, a curve drawn by chords, ground that has
    settled."""
    at_m: float
    """In the transition or curve that is wrong, or the middle of what has settled, m."""
    chord_m: Annotated[float, Field(ge=1.0, le=200.0)] = 20.0
    """Distance of the vertices by which a coarse curve is known, m."""
    depth_mm: Annotated[float, Field(ge=-500.0, le=500.0)] = 20.0
    """How deep the ground has settled, mm."""
    length_m: Annotated[float, Field(ge=20.0, le=1000.0)] = 60.0
    """Over which length it has, m."""


class MapPart(Part):
    """``[map]``: how the map that the train carries differs from what was laid. Without it, not at all.

    Standard deviations by kind, and single defects. ``exact = true`` is an ablation: a map without errors,
    and a train that knows it to be so.
    """

    exact: Listed[bool] = False
    """True is an ablation: a map without errors, and a train that knows it to be so."""
    cant_sd_mm: Listed[CantSd] = 3.0
    """Standard deviation of the cant of a curve, one error for each, mm."""
    cant_along_sd_mm: Listed[CantSd] = 1.0
    """Standard deviation of the cant that wanders along the line, mm."""
    cant_along_length_m: Listed[CorrelationLength] = 100.0
    """Distance at which the correlation of that has fallen to 1/e, m."""
    radius_sd_percent: Listed[RadiusSd] = 1.0
    """Relative standard deviation of the curvature of a curve, one error for each, percent."""
    place_sd_m: Listed[PlaceSd] = 0.5
    """Standard deviation of the place of each joint of two segments, m."""
    gradient_sd_permil: Listed[GradientSd] = 0.2
    """Standard deviation of the slope of each gradient, per mille."""
    chainage_scale_sd_percent: Listed[ScaleSd] = 0.0
    """Relative standard deviation of all lengths, percent."""
    chainage_offset_sd_m: Listed[OffsetSd] = 0.0
    """Standard deviation of a shift of all places, m."""
    defect: tuple[MapDefectPart, ...] = ()
    """Single faults of the map that the train does not know of."""

    def errors(self) -> MapErrors:
        """The sizes in SI."""
        return EXACT if self.exact else map_errors_of(self, EXACT)

    def defects(self) -> tuple[MapDefect, ...]:
        """The single defects in SI; none of an exact map."""
        if self.exact:
            return ()
        return tuple(
            MapDefect(
                part.kind,
                part.at_m,
                part.chord_m if part.kind == "coarse_curve" else 1e-3 * part.depth_mm,
                part.length_m,
            )
            for part in self.defect
        )


class EarthPart(Part):
    """``[earth]``: the Earth turns. Without it, it is at rest.

    ``x_axis_deg`` is the direction of the track's X axis, counter-clockwise from east.
    """

    latitude_deg: Listed[Annotated[float, Field(ge=-90.0, le=90.0)]]
    """Latitude, degrees north."""
    x_axis_deg: Listed[Annotated[float, Field(ge=-360.0, le=360.0)]] = 0.0
    """Direction of the track's X axis, degrees counter-clockwise from east."""


class TemperaturePart(Part):
    """``[temperature]``: of the IMUs, from ``start_c`` to ``ambient_c``. Without it, that of calibration."""

    start_c: Listed[Annotated[float, Field(ge=-60.0, le=120.0)]]
    """At the start of the recording, degrees Celsius."""
    ambient_c: Listed[Annotated[float, Field(ge=-60.0, le=120.0)]]
    """What it goes to."""
    time_constant_s: Listed[Positive] = 600.0
    """How fast, s."""


TimeLimit = Annotated[float, Field(ge=0.01, le=86400.0)]


class EstimatorPart(Part):
    """``[[estimator]]``: a method under a name, with the keyword arguments of its class.

    ``stands_for`` says which row of the paper's table it is set beside, by the words of the page of that
    paper (`simrail.report.papers`). ``time_limit_s`` is how long it may take for a recording; it is then
    ended, and its row says so. Without one, nothing ends it.
    """

    name: Name
    """Name of the method in tables."""
    method: str
    """Its class by name, or FILE.py:CLASS for one of your own."""
    time_limit_s: TimeLimit | None = None
    """Longest time for a recording, s, in place of the scenario's."""
    stands_for: Name | None = None
    """The row of the paper's table that it is set beside."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Arguments of the class; a list of one makes an axis."""


class MonteCarloPart(Part):
    """``[monte_carlo]``: how often chance is asked.

    Each of the ``samples`` draws a value from every distribution of the scenario, jointly by ``method``,
    and has draws of its own: ``track_draws`` lay the rails anew, each ride over them is made with
    ``map_draws`` draws of the map, and recorded with ``sensor_draws`` draws of the sensors.
    Without a distribution there is one sample.

    ``"morris"`` and ``"saltelli"`` are the designs of a sensitivity analysis (`simrail.scenario.designs`),
    whose samples come in blocks: ``samples`` is then the number of trajectories, or of blocks, and all of
    them share their draws.
    """

    samples: Draws = 1
    """How many values each distribution of the scenario draws, all of them jointly."""
    method: Literal["latin_hypercube", "sobol", "morris", "saltelli"] = "latin_hypercube"
    """How they fill the space: Latin hypercube, Sobol points, or the design of a sensitivity analysis."""
    track_draws: Draws = 1
    """How often the rails are laid anew, for each sample."""
    map_draws: Draws = 1
    """How many maps are drawn for each laying of the rails."""
    sensor_draws: Draws = 1
    """How many devices record each ride."""

    @model_validator(mode="after")
    def _fills_the_space(self) -> MonteCarloPart:
        if self.method in ("sobol", "saltelli") and self.samples & (self.samples - 1):
            raise InputError(
                "Sobol points are balanced in powers of two only",
                field="samples",
                value=self.samples,
                limit="1, 2, 4, 8, ...",
                remedy=f"take {1 << self.samples.bit_length()}"
                + (", or the method latin_hypercube" if self.method == "sobol" else ""),
            )
        if self.method in DESIGNS and self.samples < 2:
            raise InputError(
                "is too few for indices with intervals",
                field="samples",
                value=self.samples,
                limit=">= 2 trajectories, or blocks",
                remedy="take some 10 trajectories of morris, or 256 blocks of saltelli",
            )
        return self


class RequirePart(Part):
    """``[[require]]``: what is asked of an IMU: a figure below a limit, on a share of the devices.

    A device is one draw of the errors that stay with a sensor. ``limit`` has a unit (``"0.1 deg"``; a bare
    number is in that of the score table). With ``over = "all"`` a device must meet it on every ride of the
    scenario, with ``"each"`` every kind of ride has a verdict of its own. ``chance`` is that of a false
    verdict. See `simrail.scoring.verdicts`. ``budget_draws`` is over how many draws it is found out which
    terms of the sheets the error is made of (`simrail.campaign.budget`); 0 for not at all.
    """

    quantity: str
    """What is asked for, e.g. roll or alignment."""
    limit: float | str
    """The figure that it must stay below, with its unit, e.g. 0.1 deg."""
    metric: Literal["rms", "sd", "p95", "p9985", "max"] = "rms"
    """Which figure of the error: rms, p95 or max."""
    band: str = "full"
    """Wavelength band, for rails."""
    window: str = "whole"
    """Stretch of the line that counts."""
    reference: Literal["truth", "design"] = "truth"
    """What the error is held against; the truth if left out."""
    share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Share of devices that must meet it."""
    over: Literal["all", "each"] = "all"
    """all: a device must meet it on every ride; each: every kind of ride has a verdict of its own."""
    chance: Annotated[float, Field(ge=1e-4, le=0.2)] = 0.05
    """Chance of a false verdict that is accepted."""
    budget_draws: Annotated[int, Field(ge=0, le=1000)] = 0
    """Over how many draws it is found out what the error is made of; 0 for not at all."""

    def requirement(self) -> Requirement:
        """The requirement, in the unit of the score table."""
        own = self.model_dump(exclude={"budget_draws"})
        return Requirement(**own | {"limit": limit_of(self.limit, self.quantity)})


class StopRulePart(Part):
    """``[stop]``: draw no more once chance would change little.

    Either ``verdicts = true``: once every ``[[require]]`` is settled for every IMU and method; what is
    settled before is drawn no more (`simrail.scenario.requirements`). Or once the 95 % interval of a mean is
    narrower than ``width``, in every case: the mean over the draws of one figure of the score table, in its
    unit there (`simrail.scenario.stop_rule`).
    """

    estimator: str = ""
    """Method whose mean is waited for."""
    quantity: str = ""
    """Its quantity."""
    metric: str = ""
    """Its figure."""
    width: Annotated[float, Field(gt=0.0)] = math.inf
    """Width of the 95 % interval of the mean that is narrow enough, in the unit of the score table."""
    window: str = "whole"
    """Stretch of the line that counts."""
    reference: Literal["truth", "design"] = "truth"
    """What the error is held against."""
    band: str = "full"
    """Wavelength band, for rails."""
    least_draws: Annotated[int, Field(ge=2, le=1_000_000)] = 10
    """Draws that are made in any case."""
    verdicts: bool = False
    """True: draw until every [[require]] is settled."""

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        for name in ("estimator", "quantity", "metric", "width"):
            given = name in self.model_fields_set
            if given == self.verdicts:
                raise InputError(
                    "goes with an interval, verdicts have none" if given else "is missing",
                    field=name,
                    value=getattr(self, name) if given else None,
                    limit="estimator, quantity, metric and width; or verdicts = true alone",
                    remedy=f"take out {name}, or verdicts" if given else f"add {name}, or verdicts = true",
                )
        return self


class ScorePart(Part):
    """``[score]``: what of the score table is kept; everything, unless said otherwise.

    ``"curve:*"`` among the windows keeps every single curve.
    """

    windows: tuple[str, ...] | None = None
    """Stretches that are kept, e.g. whole, curve, straight; curve:* keeps every single curve."""
    metrics: tuple[str, ...] | None = None
    """Figures that are kept, e.g. rms, p95, max."""


class RunningSafetyPart(Part):
    """``[running_safety]``: scores the forces between wheels and rails after EN 14363.

    ``vehicle`` says which limit of Prud'homme's counts, and ``derailment_limit`` what the report holds Y/Q
    against. Forces are kept at ``contact_rate_hz``, or at the rate of the truth if that is not given.
    """

    vehicle: Literal["passenger", "freight"] = "passenger"
    """Kind of vehicle, which says the limit of Prud'homme's that counts."""
    derailment_limit: Annotated[float, Field(gt=0.0, le=3.0)] = 0.8
    """What Y/Q is held against."""


class RideComfortPart(Part):
    """``[ride_comfort]``: scores N_MV (EN 12299) and Sperling's Wz where each IMU sits."""


class GeometryLimitsPart(Part):
    """``[geometry.limits.<quantity>]``: limits that the report holds sections of 200 m against, mm.

    ``error_sd_mm`` is asked of the estimate, not of the rails: standard deviation of its error in D1.
    """

    sd_mm: Positive | None = None
    """Standard deviation of the rails over 200 m, mm."""
    defect_mm: Positive | None = None
    """Single value, mm."""
    error_sd_mm: Positive | None = None
    """Standard deviation of the estimate's error in D1, mm."""


class GeometryPart(Part):
    """``[geometry]``: in which wavelength bands, and over which base of twist, rail geometry is scored.

    ``bands`` are those of `simrail.track.bands` by name; ``own_bands`` are others, name = [shortest,
    longest], m. ``limits`` change no score: what lies beyond them is marked in the report.
    """

    bands: tuple[Literal["D0", "D1", "D2", "D3"], ...] = ("D0", "D1", "D2", "D3")
    """Wavelength bands by name, e.g. D1."""
    own_bands: dict[Name, Wavelengths] = Field(default_factory=dict)
    """Others: name = [shortest, longest], m."""
    twist_base_m: Annotated[float, Field(gt=0.0, le=50.0)] = 3.0
    """Base of the twist, m."""
    limits: dict[Literal["alignment", "vertical_profile", "cross_level"], GeometryLimitsPart] = Field(
        default_factory=dict
    )
    """What the page marks where it is exceeded, by quantity; no score changes."""

    @field_validator("own_bands")
    @classmethod
    def _bands(cls, value: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        for name in value:
            if name in ("full", "D0", "D1", "D2", "D3"):
                limit, remedy = "another name than full, D0 to D3", "give the band another name"
                raise InputError("is a name that is taken", value=name, limit=limit, remedy=remedy)
        return value
