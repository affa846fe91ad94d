"""What a scenario runs: its cells, in a fixed order, each with everything that it needs to be run.

A *world* is what decides the motion: track, vehicle, engine, step, irregularity and a ride. A world
and a track draw make one simulated ride; a ride, a sensor setting, an IMU and a sensor draw make one
*cell*: one recording, on which every estimator runs. Cells that differ by chance only (in their
sample of the scenario's distributions, and in their draws) share a *case*: scores are aggregated over
the cells of a case.

A list compares: its values meet the same draws. A distribution is chance: each of its samples has draws of
its own, but those of a design (`simrail.scenario.designs`), which differ by their values alone: they share
their seeds, and those with the same motion their ride. Of lists that set an ablation beside what a train has,
an exact map and silence, one thing is taken away at a time: no cell has both.

Of several passes, a cell is so many rides over the same rails, in an order that chance decides, anew for each
track draw: four passes are the first four of sixteen. Each has a device of its own, and the same map.

Nothing depends on the order: seeds are found by name (`ride_seed`, `sensor_seed`), so a cell gives
the same scores alone, among others, or in another order.
"""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from math import prod
from statistics import fmean
from typing import Any

from simrail.core.seeds import stream
from simrail.scenario.axes import axes_of, drawn, each, expand
from simrail.scenario.designs import DESIGNS
from simrail.scenario.distributions import Value, distributions_of, sample_count, samples_of
from simrail.scenario.imu_tables import ImuPart
from simrail.scenario.ride_tables import RidePart
from simrail.scenario.scenario import Scenario, ScenarioFile, ride_count
from simrail.scenario.study_tables import EstimatorPart
from simrail.scoring.table import DRAWN_MAP, EXACT_MAP, SHAKEN, SILENT

WORLD = (
    *("track", "vehicle", "vehicle_factors", "engine", "step_s", "truth_rate_hz"),
    *("irregularity", "vibration"),
)
SENSING = (
    "odometry",
    "map",
    "encoder",
    "magnetometer",
    "rail_sensor",
    "second_imu",
    "gnss",
    "earth",
    "temperature",
)


@dataclass(frozen=True)
class Cell:
    """One recording to be made and estimated from.

    Attributes
    ----------
    number : int
        Its place in the order of the scenario, from 0.
    case : int
        Number that it shares with the cells that differ in sample and draws only.
    ride_number : int
        Number that it shares with the cells that use the same simulated ride.
    spec : ScenarioFile
        The scenario with this cell's values; nothing in it that the cell uses is a list or a
        distribution.
    ride, imu : RidePart, ImuPart
        Its ride and its IMU.
    ride_index, imu_index : int
        Where they stand in the scenario, for messages.
    sample, track_draw, map_draw, sensor_draw : int
        Sample of the distributions, and draws within it, from 0.
    settings : dict
        Values of the scenario's lists and distributions by dotted name, e.g.
        ``{"ride.speed_kmh": 70.0}``.
    """

    number: int
    case: int
    ride_number: int
    spec: ScenarioFile
    ride: RidePart
    imu: ImuPart
    ride_index: int
    imu_index: int
    sample: int
    track_draw: int
    map_draw: int
    sensor_draw: int
    settings: dict[str, Value]
    passes: tuple["Cell", ...] = ()
    """The cells whose rides are fused, this one's the first of them; none of a cell that is one ride."""

    @property
    def ride_seed(self) -> int:
        """Root seed of the track that is laid: the same for all rides over a track draw."""
        return derived_seed(self.spec.seed, *self._sample_name, "track_draw", self.track_draw)

    @property
    def sensor_seed(self) -> int:
        """Root seed of the sensors: rides over the same draws are paired, draws share nothing."""
        return derived_seed(self.spec.seed, *self._sample_name, "sensors_of_track_draw", self.track_draw)

    @property
    def map_seed(self) -> int:
        """Root seed of the map: each track draw has maps of its own, the same for all rides over it."""
        return derived_seed(self.spec.seed, *self._sample_name, "map_of_track_draw", self.track_draw)

    @property
    def map_label(self) -> str:
        """What tables call the map."""
        return EXACT_MAP if self.spec.map is None or self.spec.map.exact else DRAWN_MAP

    @property
    def vibration_label(self) -> str:
        """What tables call the vibration."""
        return SILENT if self.spec.vibration is None or self.spec.vibration.off else SHAKEN

    @property
    def shares_seeds(self) -> bool:
        """Whether all samples have the same seeds: those of a design (`simrail.scenario.designs`)."""
        return self.spec.monte_carlo.method in DESIGNS

    @property
    def _sample_name(self) -> tuple[str | int, ...]:
        # The first sample keeps the seeds that the cell has without any distribution.
        return ("sample", self.sample) if self.sample and not self.shares_seeds else ()


@dataclass(frozen=True)
class Method:
    """An estimator to run: its unique name in the tables, and what makes it.

    Attributes
    ----------
    name : str
        The scenario's name; a variant of an axis adds its values, ``"ekf[compensated=True]"``.
    tuning : str
        The option ``tuning``, or ``"default"``.
    part : EstimatorPart
        Class and options.
    index : int
        Where it stands in the scenario, for messages.
    """

    name: str
    tuning: str
    part: EstimatorPart
    index: int


def derived_seed(root: int, *names: str | int) -> int:
    """Return the seed (63 bits) that belongs to a name under a root seed."""
    digest = hashlib.sha256(repr((int(root), *names)).encode()).digest()
    return int.from_bytes(digest[:8], "little") >> 1


def cells(scenario: Scenario) -> Iterator[Cell]:
    """Yield every cell of a scenario, those of one simulated ride in a row.

    Parameters
    ----------
    scenario : Scenario
        As read by `simrail.scenario.scenario.load_scenario`.
    """
    if scenario.spec.passes is not None:
        yield from _cells_of_passes(scenario.spec)
        return
    number = ride_number = 0
    for world in _worlds(scenario.spec):
        for track_draw in range(scenario.spec.monte_carlo.track_draws):
            for sensing in _sensings(scenario.spec, world):
                for map_draw, sensor_draw in product(
                    range(map_draws(sensing.spec)), range(sensor_draws(scenario.spec, sensing.imu))
                ):
                    yield replace(
                        sensing,
                        number=number,
                        ride_number=ride_number,
                        track_draw=track_draw,
                        map_draw=map_draw,
                        sensor_draw=sensor_draw,
                    )
                    number += 1
            ride_number += 1


def _cells_of_passes(spec: ScenarioFile) -> Iterator[Cell]:
    """Cells of several rides, those over the same rails in a row."""
    rides, samples, draws = ride_count(spec.ride), sample_count(spec), spec.monte_carlo.track_draws
    worlds, number = list(_worlds(spec)), 0
    for first, k, draw in product(range(0, len(worlds), rides * samples), range(samples), range(draws)):
        order = stream(spec.seed, "passes", k, draw).permutation(rides).tolist()
        places = [first + ride * samples + k for ride in range(rides)]
        sensings = zip(*(_sensings(spec, worlds[place]) for place in places), strict=True)
        for of_rides in sensings:
            one = of_rides[0]
            for map_draw, sensor_draw in product(
                range(map_draws(one.spec)), range(sensor_draws(spec, one.imu))
            ):
                passes = tuple(
                    replace(
                        of_rides[ride],
                        ride_number=places[ride] * draws + draw,
                        track_draw=draw,
                        map_draw=map_draw,
                        sensor_draw=sensor_draw * rides + ride,  # a device of its own for each
                    )
                    for ride in order
                )
                for cell in _of_passes(spec, one, passes):
                    yield replace(cell, number=number, sensor_draw=sensor_draw)
                    number += 1


def _of_passes(spec: ScenarioFile, one: Cell, passes: tuple[Cell, ...]) -> Iterator[Cell]:
    """A cell for each number of passes; ``one`` is the first ride's, which names the case."""
    counts = each(spec.passes)
    settings = {name: value for name, value in one.settings.items() if not name.startswith("ride.")}
    for i, count_of_passes in enumerate(counts):
        n = int(count_of_passes)
        case = one.case * len(counts) + i
        yield replace(passes[0], case=case, passes=passes[:n], settings=settings | {"passes": n})


def rides_of(cells: Iterable[Cell]) -> list[Cell]:
    """The cells that stand for the rides of these: of one ride, or of passes over the same rails."""
    listed = list(cells)
    return list(max((cell.passes for cell in listed), key=len, default=()) or listed[:1])


def labels_of(cell: Cell) -> dict[str, object]:
    """What tells the rows of a cell from those of others: the labels of the score table."""
    return {
        "cell": cell.number,
        "ride": "+".join(dict.fromkeys(one.ride.name for one in cell.passes or (cell,))),
        "vehicle": cell.spec.vehicle,
        "mount": cell.imu.name,
        "imu": cell.imu.grade,
        "odometry": cell.spec.odometry,
        "map": cell.map_label,
        "vibration": cell.vibration_label,
        "track_draw": cell.track_draw,
        "sensor_draw": cell.sensor_draw,
    }


def cell_record(cell: Cell) -> dict[str, object]:
    """Row of the table of cells: labels, what is worth knowing of the ride, and the axes' values."""
    rides = [one.ride for one in cell.passes or (cell,)]
    record: dict[str, object] = labels_of(cell) | {
        "case": cell.case,
        "sample": cell.sample,
        "map_draw": cell.map_draw,
        "track": cell.spec.track,
        "engine": cell.spec.engine,
        "speed_kmh": fmean(float(ride.speed_kmh or 0.0) for ride in rides),
        "direction": _direction(rides),
    }
    return record | {name: value for name, value in cell.settings.items() if name not in record}


def _direction(rides: Sequence[RidePart]) -> str:
    """Whether rides run towards larger s, smaller s, both ways, or not at all."""
    steps = [step for ride in rides for step in pairwise((ride.start_m, *ride.ends_m))]
    ways = {"forward" if after > before else "backward" for before, after in steps}
    return "both ways" if len(ways) > 1 else next(iter(ways), "standing")


def first_cells(scenario: Scenario) -> Iterator[Cell]:
    """Yield one cell of each case and sample, its first draws, numbered as in `cells`: passes one by one."""
    spec = scenario.spec
    draws = spec.monte_carlo.track_draws
    number = 0
    for w, world in enumerate(_worlds(spec)):
        before = 0
        for sensing in _sensings(spec, world):
            yield replace(sensing, number=number + before, ride_number=w * draws)
            before += map_draws(sensing.spec) * sensor_draws(spec, sensing.imu)
        number += before * draws


@dataclass(frozen=True)
class _World:
    """What decides the motion, of one case and sample."""

    case: int
    settings: dict[str, Value]
    spec: ScenarioFile
    ride: RidePart
    ride_index: int
    samples: tuple[tuple[int, dict[str, Value]], ...]
    """Numbers and values of the samples that have it."""


def _of_one_ride(spec: ScenarioFile) -> list[tuple[tuple[int, dict[str, Value]], ...]]:
    """Samples that share their rides: each has its own, but those of a design that differ in sensors only."""
    samples = list(enumerate(samples_of(spec)))
    if spec.monte_carlo.method not in DESIGNS:
        return [(one,) for one in samples]
    deciding = [
        *distributions_of(spec, fields=WORLD),
        *(name for part in spec.ride for name in distributions_of(part, prefix=f"ride.{part.name}.")),
    ]
    alike: dict[tuple[Value, ...], list[tuple[int, dict[str, Value]]]] = {}
    for k, values in samples:
        alike.setdefault(tuple(values[name] for name in deciding), []).append((k, values))
    return [tuple(group) for group in alike.values()]


def _worlds(spec: ScenarioFile) -> Iterator[_World]:
    groups, sensings = _of_one_ride(spec), _sensing_count(spec)
    listed = (
        (world_settings, world, i, ride_settings, ride)
        for world_settings, world in expand(spec, fields=WORLD)
        for i, part in enumerate(spec.ride)
        for ride_settings, ride in expand(part, prefix="ride.")
    )
    for w, (world_settings, world, i, ride_settings, ride) in enumerate(listed):
        for group in groups:
            values = group[0][1]
            world_drawn, concrete = drawn(world, values, fields=WORLD)
            ride_drawn, ridden = drawn(ride, values, prefix=f"ride.{ride.name}.", shown="ride.")
            settings = world_settings | world_drawn | ride_settings | ride_drawn
            yield _World(w * sensings, settings, concrete, ridden.as_ridden, i, group)


def _sensings(spec: ScenarioFile, world: _World) -> Iterator[Cell]:
    """First cells of a world, one for each of its samples and each setting of the sensors; not numbered."""
    listed = [
        (k, sensing_settings, sensing, i, imu_settings, imu)
        for k, (sensing_settings, sensing, i, imu_settings, imu) in enumerate(
            (sensing_settings, sensing, i, imu_settings, imu)
            for sensing_settings, sensing in expand(spec, fields=SENSING)
            for i, part in enumerate(spec.imu)
            for imu_settings, imu in expand(part, prefix="imu.")
        )
    ]
    for (sample, values), (k, sensing_settings, sensing, i, imu_settings, imu) in product(
        world.samples, listed
    ):
        if not imu.is_on(world.spec.vehicle):
            continue
        if _takes_both(spec, world.spec, sensing):
            continue
        sensing_drawn, concrete = drawn(sensing, values, fields=SENSING)
        imu_drawn, mounted = drawn(imu, values, prefix=f"imu.{imu.name}.", shown="imu.")
        settings = world.settings | sensing_settings | sensing_drawn | imu_settings | imu_drawn
        of_estimators = {name: value for name, value in values.items() if name.startswith("estimator.")}
        yield Cell(
            number=0,
            case=world.case + k,
            ride_number=0,
            spec=world.spec.model_copy(update={name: getattr(concrete, name) for name in SENSING}),
            ride=world.ride,
            imu=mounted,
            ride_index=world.ride_index,
            imu_index=i,
            sample=sample,
            track_draw=0,
            map_draw=0,
            sensor_draw=0,
            settings=settings | of_estimators,
        )


def _sets_both(spec: ScenarioFile) -> bool:
    """Whether both ablations stand beside what a train has."""
    if spec.map is None or spec.vibration is None:
        return False
    return len(set(each(spec.map.exact))) > 1 and len(set(each(spec.vibration.off))) > 1


def _takes_both(spec: ScenarioFile, world: ScenarioFile, sensing: ScenarioFile) -> bool:
    """Whether a cell would have both ablations of a scenario that sets each beside what a train has."""
    if not _sets_both(spec):
        return False
    return bool(world.vibration and world.vibration.off and sensing.map and sensing.map.exact)


def sensor_draws(spec: ScenarioFile, imu: ImuPart) -> int:
    """Number of sensor draws of an IMU."""
    return min(spec.monte_carlo.sensor_draws, imu.sensor_draws or spec.monte_carlo.sensor_draws)


def map_draws(spec: ScenarioFile) -> int:
    """Number of draws of the map, of a setting of the sensors; an exact one has no errors to be drawn."""
    return 1 if spec.map is None or spec.map.exact else spec.monte_carlo.map_draws


def _sensing_count(spec: ScenarioFile) -> int:
    return _size(spec, SENSING) * sum(_size(part) for part in spec.imu)


def count(scenario: Scenario) -> tuple[int, int]:
    """Return the numbers of rides to simulate and of cells, without listing them."""
    spec = scenario.spec
    worlds = _size(spec, WORLD) * sum(_size(part) for part in spec.ride) * spec.monte_carlo.track_draws
    recorded_rides = worlds * sample_count(spec)
    shared = spec.monte_carlo.method in DESIGNS
    rides = worlds * len(_of_one_ride(spec)) if shared else recorded_rides
    counts = 0 if spec.passes is None else len(each(spec.passes))
    groups = recorded_rides * counts // ride_count(spec.ride) if counts else recorded_rides
    maps = groups * _size(spec, SENSING)
    if spec.map is not None:
        exact = each(spec.map.exact)
        exact_draws = sum(1 for one in exact if one)
        maps = maps // len(exact) * ((len(exact) - exact_draws) * spec.monte_carlo.map_draws + exact_draws)
        if _sets_both(spec):
            off = each(spec.vibration.off) if spec.vibration is not None else []
            silent = groups * sum(1 for one in off if one) // len(off)
            maps -= silent * (_size(spec, SENSING) // len(exact)) * exact_draws
    vehicles = each(spec.vehicle)
    on = [(part, sum(part.is_on(str(vehicle)) for vehicle in vehicles)) for part in spec.imu]
    recorded = sum(n * _size(part) * sensor_draws(spec, part) for part, n in on)
    return rides, maps * recorded // len(vehicles)


def methods(scenario: Scenario, *, sample: int = 0) -> list[Method]:
    """Return the estimators of a scenario, one for each combination of their options' axes.

    Parameters
    ----------
    scenario : Scenario
        As read.
    sample : int, optional
        Whose values the options have that are distributions. Names are the same in every sample.
    """
    values = samples_of(scenario.spec)[sample]
    listed_methods = []
    for i, part in enumerate(scenario.spec.estimator):
        for settings, listed in expand(part):
            _, concrete = drawn(listed, values, prefix=f"estimator.{part.name}.")
            options = {name.removeprefix("options."): value for name, value in settings.items()}
            variant = ",".join(f"{key}={value}" for key, value in options.items())
            name = f"{part.name}[{variant}]" if variant else part.name
            tuning = str(concrete.options.get("tuning", "default"))
            listed_methods.append(Method(name=name, tuning=tuning, part=concrete, index=i))
    return listed_methods


def _size(part: Any, fields: tuple[str, ...] | None = None) -> int:
    return prod(len(axis) for axis in axes_of(part, fields=fields).values())
