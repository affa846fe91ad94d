"""Cells that share a ride: their sensors drawn, every estimator run on the recordings, each estimate scored.

What fails becomes a row with its reason and the others go on. Seeds belong to names, so the scores of
a cell do not depend on which cells ran before it, or with it. Who runs which cells together, and
where, is decided in `simrail.campaign.campaign`.
"""

import errno
import math
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from simrail.campaign.fence import MOST_PRINTED, digest, fenced, handed
from simrail.campaign.time_limit import FIRST_CALL_S, LimitedEstimator, Outcome, estimate_here
from simrail.core.errors import InputError, joined
from simrail.core.interrupts import Check, interruptible
from simrail.core.jit import FloatArray
from simrail.estimation.choose_odometry import TRUTH, with_odometry
from simrail.estimation.estimate import Estimate, Estimator
from simrail.recording.recording import Recording, beginning
from simrail.recording.sheets.grades import imu_sheet
from simrail.ride.ride import simulate
from simrail.ride.truth import Truth
from simrail.scenario.build import Parts, ResolvedCell
from simrail.scenario.cells import Cell, cell_record, labels_of
from simrail.scoring.geometry import score_geometry
from simrail.scoring.kick import score_kick
from simrail.scoring.ride_figures import RIDE, score_ride_comfort, score_running_safety
from simrail.scoring.running_safety import TRACK_SHIFT_FACTOR
from simrail.scoring.score import Reference, reference_of, score, score_odometry, truth_at_imu
from simrail.scoring.table import failed_figures
from simrail.sensors.measure import measure
from simrail.track.design import TrackDesign
from simrail.track.laid_track import LaidTrack

if TYPE_CHECKING:
    from simrail.campaign.progress import Watcher  # how it is shown decides no score

STAGES = ("simulate", "measure", "estimate", "score")

_OF_THE_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EMFILE, errno.ENFILE)
"""What the machine lacks, whoever finds it out; any other `OSError` of an estimator is its own failure."""


@dataclass(frozen=True)
class Failure:
    """A cell, or one estimator on it, that failed: the reason for the table, the traceback for its author."""

    cell: int
    estimator: str
    reason: str
    trace: str


@dataclass(frozen=True)
class CellResult:
    """Recording, truth and estimates of one cell: what the report draws.

    Attributes
    ----------
    cell : dict
        The labels of the cell, as in the score table (``ride``, ``vehicle``, ``imu``, ...), and the
        values of the scenario's axes.
    recording : Recording
        What the train recorded.
    motion : pandas.DataFrame
        True motion of the mount at the IMU times (`simrail.scoring.score.truth_at_imu`).
    estimates : dict of str to Estimate
        By the estimator's name in the scenario, in the scenario's order; failed ones are left out.
    rails : LaidTrack, optional
        The rails that the ride was run on, if an estimate speaks of rails.
    contacts : dict of str to ndarray (k, 12)
        Forces of each wheel (`simrail.ride.truth.Truth.contacts`), mapped from disk, if the ride kept them.
    laid : TrackDesign, optional
        The design that was laid, where it is not the map of the recording.
    shaken : dict of str to str, optional
        What shook the ride by short waves, with where the figures come from; None if nothing did.
    """

    cell: dict[str, object]
    recording: Recording
    motion: pd.DataFrame
    estimates: dict[str, Estimate]
    rails: LaidTrack | None = None
    contacts: dict[str, FloatArray] = field(default_factory=dict)
    laid: TrackDesign | None = None
    shaken: dict[str, str] | None = None

    @property
    def line(self) -> TrackDesign:
        """The design that was laid; what the train knows of it is `recording.track`."""
        return self.laid or self.recording.track


@dataclass
class BatchTally:
    """What is gathered while the cells of a batch run: tables with their labels, failures, times.

    Attributes
    ----------
    scenario : str
        Name of what is run.
    estimators : mapping of str to Estimator
        By their names in the tables.
    tunings : mapping of str to str
        How each is tuned, by the same names.
    warm : set of str
        Estimators whose kernels have been compiled in this process.
    limits_s : mapping of str to float
        How long an estimator may take for a recording, by the names of those that have such a limit.
    limits_mb : mapping of str to float
        How much memory an estimator may take, by the names of those that have such a limit.
    figures : list of (pandas.DataFrame, dict)
        Figures of one estimate, and their labels.
    failures : list of Failure
        What failed.
    printed : dict of str to str
        What estimators printed, by their names.
    wall_s, cpu_s : dict of str to float
        Wall time, and time of this process on the processor, of the stages `STAGES`.
    """

    scenario: str
    estimators: Mapping[str, Estimator]
    tunings: Mapping[str, str]
    warm: set[str] = field(default_factory=set)
    limits_s: Mapping[str, float] = field(default_factory=dict)
    limits_mb: Mapping[str, float] = field(default_factory=dict)
    figures: list[tuple[pd.DataFrame, dict[str, object]]] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    printed: dict[str, str] = field(default_factory=dict)
    wall_s: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    cpu_s: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the time of a block to a stage."""
        begun, worked = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.wall_s[stage] += time.perf_counter() - begun
            self.cpu_s[stage] += time.process_time() - worked

    def note_print(self, estimator: str, text: str) -> None:
        """Keep what an estimator printed, once, for the log."""
        words = joined(text)[:MOST_PRINTED]
        if words and estimator not in self.printed:
            self.printed[estimator] = words

    def fail(self, cell: Cell, estimator: str, error: Exception | str) -> None:
        """Note a failure as a row with its reason: what was raised, or words."""
        reason = error if isinstance(error, str) else _reason_of(error)
        trace = f"{error}\n" if isinstance(error, str) else "".join(traceback.format_exception(error))
        self.failures.append(Failure(cell.number, estimator, reason, trace))
        self.add(cell, estimator, failed_figures(reason))

    def add(self, cell: Cell, estimator: str, figures: pd.DataFrame) -> None:
        """Note the figures of one estimator, or of the odometry, on a cell."""
        labels = labels_of(cell) | {"scenario": self.scenario, "estimator": estimator}
        self.figures.append((figures, labels | {"tuning": self.tunings.get(estimator, "default")}))


class _Recorded(NamedTuple):
    """A cell with its recording and what its estimates are compared with."""

    cell: Cell
    recording: Recording
    reference: Reference
    digest: int


def run_cells(cells: Sequence[Cell], truth: Truth, parts: Parts, tally: BatchTally, check: Check) -> None:
    """Record cells of one ride, run every estimator on the recordings, and score.

    Parameters
    ----------
    cells : sequence of Cell
        Cells that share the ride.
    truth : Truth
        Their ride.
    parts : Parts
        Parts of their scenario.
    tally : BatchTally
        Gathers what comes of it.
    check : callable
        Raises `KeyboardInterrupt` if there was one that a library swallowed.
    """
    recorded = []
    for cell in cells:
        try:
            recorded.append(_record(cell, truth, parts, tally))
        except Exception as error:
            check()
            unless_of_the_machine(error)
            for name in tally.estimators:
                tally.fail(cell, name, error)
        if cell.sensor_draw == cell.map_draw == 0:  # neither changes anything of the ride itself
            try:
                _score_ride(cell, truth, parts, tally)
            except Exception as error:
                check()
                unless_of_the_machine(error)
                tally.fail(cell, RIDE, error)
    if not recorded:
        return
    for name, estimator in tally.estimators.items():
        outcomes = list(estimates_of(name, estimator, [one.recording for one in recorded], tally, check))
        for i, (one, outcome) in enumerate(zip(recorded, outcomes, strict=True)):
            try:
                if digest(one.recording) != one.digest:
                    recorded[i] = _record(one.cell, truth, parts, tally, again=True)
                    raise ValueError("it changed the recording that all estimators share")
                if isinstance(outcome, Exception):
                    raise outcome
                _score(one, name, *outcome, parts, tally)
            except Exception as error:
                check()
                unless_of_the_machine(error)
                tally.fail(one.cell, name, error)


def unless_of_the_machine(error: BaseException) -> None:
    """Raise an error that is no property of a cell: it ends the campaign, which goes on when it is mended."""
    if isinstance(error, OSError) and error.errno in _OF_THE_MACHINE:
        raise error


def record_cell(
    cell: Cell, truth: Truth, parts: Parts, *, spared: Callable[[ResolvedCell], ResolvedCell] | None = None
) -> Recording:
    """Measure a cell, its sensors on its ride, and run its odometry.

    ``spared`` takes errors away from what is recorded; the sheets that the train knows stay as they are.
    """
    told = parts.resolve(cell)
    resolved = told if spared is None else spared(told)
    recording = measure(
        truth,
        name=cell.ride.name,
        mount=resolved.mount,
        grade=resolved.grade,
        encoder=resolved.encoder,
        magnetometer=resolved.magnetometer,
        rail_sensor=resolved.rail_sensor,
        rails=None if resolved.rail_sensor is None else parts.rails(cell),
        second_imu=resolved.second_imu,
        gnss=resolved.gnss,
        odometry=TRUTH if cell.spec.odometry == TRUTH else None,
        seed=cell.sensor_seed,
        draw=cell.sensor_draw,
        earth_rate=resolved.earth_rate,
        temperature=resolved.temperature,
        track_map=resolved.track_map,
        map_errors=resolved.map_errors,
        vehicle_sheet=resolved.vehicle_sheet,
    )
    if spared is not None:
        recording = with_sheets_of(recording, told)
    if resolved.odometry is None:
        return recording
    with fenced():
        estimated = with_odometry(handed(recording), resolved.odometry, source=cell.spec.odometry)
    return replace(recording, odometry=estimated.odometry, odometry_source=estimated.odometry_source)


def with_sheets_of(recording: Recording, told: ResolvedCell) -> Recording:
    """A recording whose train believes of its sensors and its map what it is told."""
    sheet = imu_sheet(told.grade, delay_s=recording.imu_sheet.delay_s)
    recording = replace(recording, imu_sheet=sheet, map_errors=told.map_errors)
    encoder = recording.encoder_sheet
    if encoder is None or told.encoder is None:
        return recording
    sd = math.hypot(told.encoder.radius_error_sd, told.encoder.rolling_sd)
    return replace(recording, encoder_sheet=replace(encoder, radius_relative_sd=sd))


def simulated(cell: Cell, parts: Parts, watcher: "Watcher", number: int, count: int) -> Truth:
    """Ride ``number`` of ``count``, that of a cell, for what is no campaign: simulated, or from the cache."""
    watcher.ride_begins(number, count, cell.ride.name)
    with interruptible() as check:
        try:
            truth = simulate(parts.ride(cell), progress=watcher.ride_goes, told=watcher.told, warn=False)
        except Exception:
            check()  # an engine in C++ may have made an error of its own of Ctrl-C
            raise
    watcher.ride_ends()
    for warning in truth.manifest.get("warnings", ()):
        watcher.told(f"warning: ride {cell.ride.name}: {warning}")
    return truth


def look_at(cell: Cell, truth: Truth, parts: Parts, tally: BatchTally) -> CellResult:
    """Run a cell again for the figures of a report: its recording and estimates, without scores."""
    recording = record_cell(cell, truth, parts)
    estimates = {}
    for name, estimator in tally.estimators.items():
        (outcome,) = estimates_of(name, estimator, [recording], tally, lambda: None)
        if not isinstance(outcome, Exception):
            estimates[name] = outcome[0]
    speaks_of_rails = any(estimate.geometry is not None for estimate in estimates.values())
    rails = parts.rails(cell) if speaks_of_rails else None
    labels = {"scenario": tally.scenario, **cell_record(cell)}
    motion = truth_at_imu(truth, recording)
    shaken = None if truth.short_waves is None else truth.short_waves.sources
    return CellResult(labels, recording, motion, estimates, rails, truth.contacts, truth.track, shaken)


def _reason_of(error: Exception) -> str:
    """One line that says why."""
    text = joined(error)
    named = text if isinstance(error, InputError) else f"{type(error).__name__}: {text}"
    return named[:300]


def _record(cell: Cell, truth: Truth, parts: Parts, tally: BatchTally, *, again: bool = False) -> _Recorded:
    """Record one cell and score its odometry, if it has one; not ``again``."""
    with tally.timed("measure"):
        recording = record_cell(cell, truth, parts)
    with tally.timed("score"):
        reference = reference_of(truth, recording)
        if recording.odometry is not None and not again:
            figures = score_odometry(recording, reference, **wanted_of(cell))
            tally.add(cell, f"odometry:{recording.odometry_source}", figures)
    return _Recorded(cell, recording, reference, digest(recording))


def estimates_of(
    name: str, estimator: Estimator, recordings: Sequence[Recording], tally: BatchTally, check: Check
) -> Iterator[tuple[Estimate, float] | Exception]:
    """Each estimate and the microseconds per sample that it took, or what went wrong with it.

    A method that takes many recordings at once takes them all; if one of them upsets it, it takes them
    one by one, so that only that one fails. One with a limit runs in a process of its own.
    """
    limit_s, limit_mb = tally.limits_s.get(name), tally.limits_mb.get(name)
    if limit_s is None and limit_mb is None:
        yield from _outcomes(name, estimator, recordings, partial(estimate_here, estimator), tally, check)
        return
    limited = LimitedEstimator(estimator, limit_s, limit_mb)
    try:
        # Every process of its own loads its kernels, or compiles them.
        with tally.timed("estimate"), suppress(Exception):
            limited.estimate([beginning(recordings[0], samples=64)], at_least_s=FIRST_CALL_S)
        tally.warm.add(name)
        yield from _outcomes(name, estimator, recordings, limited.estimate, tally, check)
    finally:
        limited.close()


def _outcomes(
    name: str,
    estimator: Estimator,
    recordings: Sequence[Recording],
    run: Callable[[Sequence[Recording]], Outcome],
    tally: BatchTally,
    check: Check,
) -> Iterator[tuple[Estimate, float] | Exception]:
    """What `estimates_of` yields, by a way to run an estimator."""
    if name not in tally.warm:
        # The first call of a kernel compiles it or loads it from disk: that is no property of the method.
        with tally.timed("estimate"), suppress(Exception):
            run([beginning(recordings[0], samples=64)])
        tally.warm.add(name)
    groups = [list(recordings)] if hasattr(estimator, "estimate_many") else [[one] for one in recordings]
    while groups:
        group = groups.pop(0)
        try:
            with tally.timed("estimate"):
                outcome = run(group)
            if name in tally.limits_s or name in tally.limits_mb:
                tally.cpu_s["estimate"] += outcome.cpu_s  # of another process
            tally.note_print(name, outcome.printed)
            estimates = outcome.estimates
            if len(estimates) != len(group):
                raise ValueError(f"estimate_many gave {len(estimates)} estimates of {len(group)} recordings")
        except Exception as error:
            check()
            if len(group) > 1:
                groups = [[one] for one in group]
            else:
                yield error
            continue
        us_per_sample = 1e6 * outcome.wall_s / sum(len(one.imu) for one in group)
        yield from ((estimate, us_per_sample) for estimate in estimates)


def _score(
    one: _Recorded, name: str, estimate: Estimate, us_per_sample: float, parts: Parts, tally: BatchTally
) -> None:
    """Score one estimate: its states, and its geometry if it has one.

    One that is not finite has rows that say so, and is a failure of its cell as well.
    """
    cell, wanted = one.cell, wanted_of(one.cell)
    with tally.timed("score"):
        tables = [score(estimate, one.reference, one.recording, us_per_sample=us_per_sample, **wanted)]
        if estimate.geometry is not None:
            tables.append(
                score_geometry(
                    estimate,
                    parts.rails(cell),
                    one.recording,
                    bands=parts.resolve(cell).bands,
                    twist_base_m=cell.spec.geometry.twist_base_m,
                    **wanted,
                )
            )
        for figures in tables:
            tally.add(cell, name, figures)
    bad = int((~np.isfinite(estimate.states.to_numpy(dtype=np.float64))).any(axis=1).sum())
    if bad:
        reason = f"estimate not finite in {bad} of {len(estimate.states)} samples"
        tally.failures.append(Failure(cell.number, name, reason, reason + "\n"))


def _score_ride(cell: Cell, truth: Truth, parts: Parts, tally: BatchTally) -> None:
    """Score the ride itself, where the scenario asks for it."""
    spec, resolved = cell.spec, parts.resolve(cell)
    with tally.timed("score"):
        if spec.running_safety is not None:
            factor = TRACK_SHIFT_FACTOR[spec.running_safety.vehicle]
            vehicle, windows = resolved.ride.vehicle, spec.score.windows
            tally.add(cell, RIDE, score_running_safety(truth, vehicle, factor=factor, windows=windows))
        if spec.ride_comfort is not None:
            tally.add(cell, RIDE, score_ride_comfort(truth, resolved.mount))
        if cell.ride.kick_end_m is not None:
            tally.add(cell, RIDE, score_kick(truth, after_m=cell.ride.kick_end_m))


def wanted_of(cell: Cell) -> dict[str, Any]:
    """What of the score table the scenario keeps."""
    return {"windows": cell.spec.score.windows, "metrics": cell.spec.score.metrics}
