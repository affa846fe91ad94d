"""The two ways of tuning the trajectory smoother: constrained maximum likelihood, and a known output.

Gonzalez-Carbajal et al. 2023 (paper 001), section 4. **CML** takes the hyper-parameters under which the
recorded signals are likeliest, by prediction-error decomposition. **KOM** takes those with which the rails
come out as a reference has them.

Straights and curves may have a set each: a search then counts the samples, or places, of its own kind only,
the set holding throughout, so that the two searches do not depend on each other.

The likelihood does not identify the virtual positions' variances (`SearchSpace.position_m2`), and what it
finds for the other parameters makes the signals likely under a model that the train does not obey: see
`simrail.estimators.tuning.identify`.

Not here: what is minimised (`simrail.estimators.tuning.objectives`), the search itself
(`simrail.estimators.tuning.search`), the file of a result (`simrail.estimators.tuning.file`).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.trajectory.smoother import TrajectorySmoother
from simrail.estimators.tuning.file import Search, Tuning
from simrail.estimators.tuning.objectives import KINDS, STEP_M, TUNED, Objective, objective_of, side_by_side
from simrail.estimators.tuning.search import EVALUATIONS, Record, least
from simrail.estimators.tuning.space import SearchSpace

from simrail.core.jit import FloatArray, kernel_hash
from simrail.core.seeds import stream
from simrail.recording.recording import Recording
from simrail.track.bands import Band

Progress = Callable[[str, int, float], None]
"""Is told how a search goes: which set, evaluations so far, least value so far."""


def tune(
    recordings: Sequence[Recording],
    smoother: TrajectorySmoother,
    *,
    references: Sequence[pd.DataFrame] | None = None,
    space: SearchSpace | None = None,
    by_kind: bool = False,
    band: Band | None = None,
    step_m: float = STEP_M,
    evaluations: int = EVALUATIONS,
    at_most: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    unfinished: Path | None = None,
    progress: Progress | None = None,
    fitted_on: Sequence[str] = (),
    command: str = "",
) -> Tuning:
    """Search hyper-parameters by CML, or by KOM if references are given.

    Parameters
    ----------
    recordings : sequence of Recording
        Rides to fit on, all together.
    smoother : TrajectorySmoother
        Its equations are used; its hyper-parameters (on straights) are where the search begins.
    references : sequence of DataFrame, optional
        The rails of each ride, columns `TUNED` over ``position_m``; only places between its ends count.
    space : SearchSpace, optional
        Where to search; the paper's box and constraint if not given.
    by_kind : bool
        One set for straights, another for transitions and curves.
    band : Band, optional
        KOM compares within this band of wavelengths.
    step_m : float
        Distance of the places at which KOM compares.
    evaluations : int
        Of CMA-ES; L-BFGS-B adds about as many times three.
    at_most : int, optional
        Of the whole search of each set; without a limit a known output may take thousands to settle.
    seed : int
        Of the search.
    threads : int, optional
        By default one per core. The result does not depend on it.
    unfinished : Path, optional
        Where what has been found so far is kept: a file ``<unfinished>`` with the best tuning so far after
        each improvement, and one ``<unfinished>.<set>.npz`` per set with which a search with the same
        arguments goes on where it was. They are removed when the search is over.
    progress : Progress, optional
        Is told how it goes.
    fitted_on : sequence of str
        What to call the recordings in the result.
    command : str
        Command to write into the result.

    Returns
    -------
    Tuning
        Its `search` says how it was found.

    Raises
    ------
    InputError
        See `objective_of`.
    """
    space = SearchSpace() if space is None else space
    method = "cml" if references is None else "kom"
    goals = {
        name: objective_of(recordings, smoother, kind=kind, references=references, band=band, step_m=step_m)
        for name, kind in ([(name, i) for i, name in enumerate(KINDS)] if by_kind else [("all", None)])
    }
    so_far = Search(
        method=method,
        objective=(),
        unit=next(iter(goals.values())).unit,
        space=space,
        seed=seed,
        evaluations=0,
        fitted_on=tuple(fitted_on),
        command=command,
        finished=False,
    )
    files: list[Path] = []
    points: list[FloatArray] = []

    def extended(point: FloatArray, value: float, count: int) -> tuple[Tuning, Search]:
        """The tuning with one more set, and how it was found."""
        sets = [Hyperparameters.from_vector(space.values(at)) for at in (*points, point)]
        search = replace(so_far, objective=(*so_far.objective, value), evaluations=so_far.evaluations + count)
        return Tuning(sets[0], sets[1] if len(sets) > 1 else None, search), search

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for name, goal in goals.items():
            record = Record()
            if unfinished is not None:
                files.append(unfinished.with_name(f"{unfinished.name}.{name}.npz"))
                record = Record(files[-1], _key(goal, space, name, seed, evaluations))
            best = np.inf

            def report(count: int, point: FloatArray, value: float, name: str = name) -> None:
                nonlocal best
                if unfinished is not None and value < best:
                    extended(point, value, count)[0].write(unfinished)
                best = min(best, value)
                if progress is not None:
                    progress(name, count, value)

            found = least(
                side_by_side(goal, space, pool),
                start=space.point(smoother.noise[0].vector()),
                generator=stream(seed, "tuning", method, name),
                evaluations=evaluations,
                at_most=at_most,
                record=record,
                report=report,
            )
            tuning, so_far = extended(found.point, found.value, found.evaluations)
            points.append(found.point)
    for file in [*files, *([unfinished] if unfinished is not None else [])]:
        file.unlink(missing_ok=True)
    return replace(tuning, search=replace(so_far, finished=True))


def _key(objective: Objective, space: SearchSpace, *rest: object) -> str:
    """What recorded values belong to: data, code of the kernels, space and search."""
    digest = hashlib.sha256(repr((type(objective).__name__, space, rest, kernel_hash())).encode())
    arrays = [array for model in objective.models for array in model]  # type: ignore[attr-defined]
    arrays += getattr(objective, "counts", ())
    for reference in getattr(objective, "references", ()):
        arrays += [reference.index.to_numpy(), reference[list(TUNED)].to_numpy()]
    digest.update(repr([getattr(objective, name, None) for name in ("kind", "band", "step_m")]).encode())
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
