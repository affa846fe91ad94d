"""Least value of a function over the unit cube: CMA-ES, then L-BFGS-B, many points at a time.

CMA-ES (Hansen; package `cma`) finds the valley among several, L-BFGS-B with central differences its floor.
Then each axis is looked along from edge to edge: a variance far below what the data show has no slope in its
logarithm, and a descent that got there stays. If it is lower elsewhere, the descent goes on from there.

All points of a generation, of a gradient, or along the axes are asked for together, so that they can be
evaluated side by side.

An interrupted search goes on where it was, bit by bit: what it does depends on its seed and on the values
alone, so it is run again from the start on the values that are on record (`Record`).
"""

import io
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import cma
import numpy as np
from scipy.optimize import minimize

from simrail.core.jit import FloatArray
from simrail.core.sealed_files import DamagedError, damage_told, read_sealed_file, write_sealed_file

Batch = Callable[[FloatArray], FloatArray]
"""Values (b,) at points (b, m) of the unit cube; no point's value may depend on the other points."""

Report = Callable[[int, FloatArray, float], None]
"""Is told after each batch: evaluations so far, the best point so far (m,), and its value."""

POPULATION = 16

EVALUATIONS = 480
"""Of CMA-ES, before L-BFGS-B takes over."""

START_SD = 0.25
"""Of the first generation, about the start."""

STEP = 1e-4
"""Of the differences, in the cube: with values good to 1e-12 a gradient is good to 1e-8."""

ALONG = 17
"""Points along each axis: two per three decades in a box of twelve, some two per decade in the paper's."""

ROUNDS = 4
"""Of descent and of looking along the axes, at most."""

GAIN = 1e-4
"""How much lower it must be elsewhere for another round: of likelihood per sample, or of mm."""

WORST = 1e12
"""Stands for a value that is not finite: a filter that broke down."""


USUAL_STEPS = 10
"""Of a descent, each of which asks for a gradient and some points along it."""

USUAL_ROUNDS = 2


def usual_evaluations(parameters: int, evaluations: int = EVALUATIONS) -> int:
    """About how often a search of so many parameters evaluates its objective, to tell how long it takes."""
    descent = USUAL_STEPS * (2 * parameters + 2)
    return evaluations + USUAL_ROUNDS * (descent + ALONG * parameters)


@dataclass(frozen=True)
class Least:
    """Where a search ended.

    Attributes
    ----------
    point : ndarray (m,)
        Best of all points.
    value : float
        Its value.
    evaluations : int
        How many points were evaluated, those on record among them.
    """

    point: FloatArray
    value: float
    evaluations: int


class _Enough(Exception):
    """As many points as were allowed have been asked for."""


class Record:
    """Points and values of a search that is not over, in the order in which they were asked for.

    Parameters
    ----------
    path : Path, optional
        File that is replaced after each batch, whole or not at all; None keeps them in memory only.
    key : str
        What the values belong to. A file with another key, or a broken one, is begun anew.
    """

    def __init__(self, path: Path | None = None, key: str = "") -> None:
        self._path, self._key, self._next = path, key, 0
        self._points: list[FloatArray] = []
        self._values: list[FloatArray] = []
        if path is not None and path.is_file():
            with suppress(DamagedError), damage_told():
                data = np.load(io.BytesIO(read_sealed_file(path)), allow_pickle=False)
                if str(data["key"]) == key:
                    self._points, self._values = list(data["points"]), list(data["values"])

    @property
    def count(self) -> int:
        """How many values are on record."""
        return len(self._values)

    def best(self) -> tuple[FloatArray, float]:
        """Best point (m,) of those asked for so far, and its value."""
        at = int(np.argmin(self._values[: self._next]))
        return self._points[at], float(self._values[at])

    @property
    def asked(self) -> int:
        """How many points were asked for so far."""
        return self._next

    def values(self, points: FloatArray, evaluate: Batch) -> FloatArray:
        """Values (b,) at points (b, m): from the record as far as it has them, else evaluated."""
        first, last = self._next, self._next + len(points)
        recorded = self._points[first:last]
        if len(recorded) < len(points) or not np.array_equal(recorded, points):
            values = evaluate(points)
            self._points[first:] = [point.copy() for point in points]
            self._values[first:] = list(np.where(np.isfinite(values), values, WORST))
            self._save()
        self._next = last
        return np.array(self._values[first:last])

    def _save(self) -> None:
        if self._path is None:
            return
        stream = io.BytesIO()
        np.savez(stream, key=self._key, points=self._points, values=self._values)
        write_sealed_file(self._path, stream.getvalue())


def least(
    evaluate: Batch,
    *,
    start: FloatArray,
    generator: np.random.Generator,
    evaluations: int = EVALUATIONS,
    at_most: int | None = None,
    record: Record | None = None,
    report: Report | None = None,
) -> Least:
    """Search the least value over the unit cube.

    Parameters
    ----------
    evaluate : Batch
        The function, of many points at once.
    start : ndarray (m,)
        Where it begins; what it finds is no worse.
    generator : numpy.random.Generator
        Of CMA-ES; numpy's global one is neither used nor touched.
    evaluations : int
        Of CMA-ES, rounded up to whole generations of `POPULATION`; L-BFGS-B then goes on from its best.
    at_most : int, optional
        Ends the search, wherever it is, with the batch by which so many points have been asked for.
    record : Record, optional
        What an earlier, interrupted search of the same function has evaluated; goes on growing.
    report : Report, optional
        Is told after each batch.

    Returns
    -------
    Least
        The best of all points that were evaluated.
    """
    record = Record() if record is None else record

    def ask(points: FloatArray) -> FloatArray:
        values = record.values(points, evaluate)
        if report is not None:
            report(record.asked, *record.best())
        if at_most is not None and record.asked >= at_most:
            raise _Enough
        return values

    with suppress(_Enough):
        ask(np.clip(start, 0.0, 1.0)[None])
        _cma(ask, start, generator, evaluations)
        for _ in range(ROUNDS):
            _descend(ask, record.best()[0])
            point, value = record.best()
            ask(along_axes(point))
            if record.best()[1] > value - GAIN:
                break
    point, value = record.best()
    return Least(point, value, record.asked)


def _cma(ask: Batch, start: FloatArray, generator: np.random.Generator, evaluations: int) -> None:
    options = {
        "popsize": POPULATION,
        "bounds": [0.0, 1.0],
        "maxfevals": evaluations,
        "randn": lambda *shape: generator.standard_normal(shape),
        "seed": np.nan,  # leaves numpy's global generator alone
        "verbose": -9,
        "verb_log": 0,
    }
    strategy = cma.CMAEvolutionStrategy(np.clip(start, 0.01, 0.99), START_SD, options)
    while not strategy.stop():
        points = np.clip(np.array(strategy.ask()), 0.0, 1.0)
        strategy.tell(list(points), list(ask(points)))


def _descend(ask: Batch, start: FloatArray) -> None:
    """L-BFGS-B; value and gradient of a point are one batch of 2 m + 1 points."""

    def with_gradient(point: FloatArray) -> tuple[float, FloatArray]:
        points, width = differences(point)
        values = ask(points)
        pairs = values[1:].reshape(-1, 2)
        return float(values[0]), (pairs[:, 1] - pairs[:, 0]) / width

    minimize(
        with_gradient,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=[(0.0, 1.0)] * len(start),
        options={"ftol": 1e-8, "gtol": 1e-5, "maxiter": 100},
    )


def along_axes(point: FloatArray) -> FloatArray:
    """The point with each of its coordinates in turn at `ALONG` places from edge to edge, (m ALONG, m)."""
    m = len(point)
    points = np.tile(point, (m, ALONG, 1))
    for i in range(m):
        points[i, :, i] = np.linspace(0.0, 1.0, ALONG)
    return points.reshape(-1, m)


def differences(point: FloatArray, step: float = STEP) -> tuple[FloatArray, FloatArray]:
    """The point, and two beside it along each axis (2 m + 1, m); and the distance (m,) of each two.

    At an edge of the cube one of the two is the point itself.
    """
    m = len(point)
    points = np.tile(point, (2 * m + 1, 1))
    for i in range(m):
        points[1 + 2 * i, i] = max(point[i] - step, 0.0)
        points[2 + 2 * i, i] = min(point[i] + step, 1.0)
    axes = np.arange(m)
    return points, points[2 + 2 * axes, axes] - points[1 + 2 * axes, axes]
