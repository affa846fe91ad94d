"""The search of a tunable estimator's parameters, on many recordings together.

Not here: what is minimised (the estimator's own, see `simrail.estimation.tunable`), the search itself
(`simrail.estimators.tuning.search`), what it knows of each parameter (`simrail.estimators.tuning.identify`),
the file of a result (`simrail.estimators.tuning.file`).
"""

import hashlib
import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from simrail.estimators.tuning.cube import Cube
from simrail.estimators.tuning.file import TuningResult
from simrail.estimators.tuning.search import EVALUATIONS, Batch, Record, least, usual_evaluations

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.core.source_hash import score_code_hash
from simrail.estimation.tunable import ByLikelihood, ByReference, Objective, Tunable
from simrail.recording.recording import Recording

Progress = Callable[[str, int, float], None]
"""Is told how a search goes: which set, evaluations so far, least value so far."""


Forecast = Callable[[str, float, int], None]
"""Is told before a search: which set, seconds of one evaluation with all cores at work, about how many."""


def objective_of(
    tunable: Tunable, recordings: Sequence[Recording], references: Sequence[pd.DataFrame] | None = None
) -> Objective:
    """What is minimised: by the likelihood of recordings (CML), or against references of them (KOM).

    Raises
    ------
    InputError
        If there is no recording, or not a reference for each; or as the estimator has it.
    """
    if not recordings:
        raise InputError("there is nothing to tune on", field="recordings", limit="at least one")
    if references is None:
        assert isinstance(tunable, ByLikelihood)
        return tunable.likelihood(recordings)
    if len(references) != len(recordings):
        raise InputError(
            "are not one per recording",
            field="references",
            value=len(references),
            limit="one for each recording",
            remedy="give as many as recordings",
        )
    assert isinstance(tunable, ByReference)
    return tunable.reference_error(recordings, references)


def tune(
    tunables: Mapping[str, Tunable],
    recordings: Sequence[Recording],
    *,
    references: Sequence[pd.DataFrame] | None = None,
    evaluations: int = EVALUATIONS,
    at_most: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    unfinished: Path | None = None,
    forecast: Forecast | None = None,
    progress: Progress | None = None,
    fitted_on: Sequence[str] = (),
    command: str = "",
) -> TuningResult:
    """Search parameters by CML, or by KOM if references are given.

    Parameters
    ----------
    tunables : mapping of str to Tunable
        What is tuned, each set of parameters by itself.
    recordings : sequence of Recording
        Rides to fit on, all together.
    references : sequence of DataFrame, optional
        The rails of each ride over ``position_m``; only places between its ends count.
    evaluations : int
        Of CMA-ES; L-BFGS-B adds about as many times three.
    at_most : int, optional
        Of the whole search of each set; without a limit a known output may take thousands to settle.
    seed : int
        Of the search.
    threads : int, optional
        By default one per core. The result does not depend on it.
    unfinished : Path, optional
        Where the best so far stands: a file ``<unfinished>`` with the best tuning so far after each
        improvement, and one ``<unfinished>.<set>.npz`` per set with which a search with the same arguments
        goes on where it was. They are removed when the search is over.
    forecast : Forecast, optional
        Is told how long each set will take about, for which it is evaluated a few times more.
    progress : Progress, optional
        Is told how it goes.
    fitted_on : sequence of str
        What to call the recordings in the result.
    command : str
        Command to write into the result.

    Raises
    ------
    InputError
        See `objective_of`.
    """
    method = "cml" if references is None else "kom"
    objectives = {name: objective_of(tunable, recordings, references) for name, tunable in tunables.items()}
    first = next(iter(tunables))
    result = TuningResult(
        method=method,
        unit=objectives[first].unit,
        seed=seed,
        fitted_on=tuple(fitted_on),
        command=command,
        settings=getattr(tunables[first], "search_settings", {}),
    )
    files = [] if unfinished is None else [unfinished]
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for name, tunable in tunables.items():
            cube = Cube(tuple(tunable.parameters()))
            record = Record()
            if unfinished is not None:
                files.append(unfinished.with_name(f"{unfinished.name}.{name}.npz"))
                key = _key(tunable, recordings, references or (), cube, name, seed, evaluations)
                record = Record(files[-1], key)
            before, best = result, np.inf

            def report(
                count: int,
                point: FloatArray,
                value: float,
                name: str = name,
                cube: Cube = cube,
                before: TuningResult = before,
            ) -> None:
                nonlocal best
                if unfinished is not None and value < best:
                    before.extended(cube.named(point), value, count).write(unfinished)
                best = min(best, value)
                if progress is not None:
                    progress(name, count, value)

            if forecast is not None:
                each_s = _seconds_each(objectives[name], cube, pool, threads or os.cpu_count() or 1)
                most = usual_evaluations(len(cube.searched), evaluations)
                forecast(name, each_s, most if at_most is None else min(most, at_most))
            end = least(
                _side_by_side(objectives[name], cube, pool),
                start=cube.start(),
                generator=stream(seed, "tuning", method, name),
                evaluations=evaluations,
                at_most=at_most,
                record=record,
                report=report,
            )
            result = before.extended(cube.named(end.point), end.value, end.evaluations)
    for file in files:
        file.unlink(missing_ok=True)
    return replace(result, finished=True)


def _seconds_each(objective: Objective, cube: Cube, pool: Executor, threads: int) -> float:
    """Time of one evaluation while all threads evaluate; what is compiled at the first is not counted."""
    start = cube.start()[None, :]
    evaluate = _side_by_side(objective, cube, pool)
    evaluate(start)
    begun = time.perf_counter()
    evaluate(np.repeat(start, threads, axis=0))
    return (time.perf_counter() - begun) / threads


def _side_by_side(objective: Objective, cube: Cube, pool: Executor) -> Batch:
    """An objective of many points of the cube at once: compiled kernels run without the GIL."""

    def evaluate(points: FloatArray) -> FloatArray:
        return np.array(list(pool.map(objective.value, [cube.named(point) for point in points])))

    return evaluate


def _content(value: object) -> object:
    """All that a value holds: what it shows when it is printed is less."""
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value


def _key(
    tunable: Tunable, recordings: Sequence[Recording], references: Sequence[pd.DataFrame], *rest: object
) -> str:
    """What recorded values belong to: the code, what is tuned, its box, the search, and the data."""
    # The module of a class in a person's own file is named after the file's content.
    digest = hashlib.sha256(repr((score_code_hash(), type(tunable).__module__, tunable, rest)).encode())
    frames = list(references)
    for recording in recordings:
        values = [getattr(recording, entry.name) for entry in fields(recording)]
        frames += [value for value in values if isinstance(value, pd.DataFrame)]
        plain = [value for value in values if not isinstance(value, pd.DataFrame)]
        digest.update(repr([_content(value) for value in plain]).encode())
    for frame in frames:
        digest.update(repr(list(frame.columns)).encode() + frame.index.to_numpy().tobytes())
        digest.update(np.ascontiguousarray(frame.to_numpy(dtype=np.float64)).tobytes())
    return digest.hexdigest()
