"""What a tuning knows of each hyper-parameter: identified, held at an edge of the search, or flat.

About an optimum the objective f is a bowl in the logarithms of the parameters. A parameter is judged by how
far it can go before f rises by a tolerance: along its own axis the others stay, along the bowl's valley they
follow (the profile). With the likelihood of a model that is true, the inverse of n times the curvature is the
covariance of the estimate (Cramer-Rao); on a real ride the model is not true and that is but a scale.

Not here: how the optimum was found (`simrail.estimators.tuning.tune`).
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import pandas as pd
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.tuning.objectives import Likelihood, Objective
from simrail.estimators.tuning.space import (
    CONSTRAINT,
    FLAT,
    HELD,
    IDENTIFIED,
    LOWER,
    NAMES,
    UPPER,
    SearchSpace,
)

from simrail.core.jit import FloatArray

TOLERANCE = 1e-3
"""Rise of the objective that counts: negative log-likelihood per sample, or mm."""

STEP = 0.1
"""Of the differences, in the natural logarithm: values good to 1e-12 give a curvature good to 1e-10."""

EDGE = 1e-3
"""Of an axis of the cube: closer to an end than this is at it."""


@dataclass(frozen=True)
class Identification:
    """What is known of the hyper-parameters at an optimum.

    Attributes
    ----------
    table : pandas.DataFrame
        One row per hyper-parameter (index ``parameter``): ``value``; ``status``; ``tenth`` and ``tenfold``,
        the rise of the objective if the value is divided by or multiplied with ten and the others stay
        (negative where the optimum lies beyond what was allowed); ``curvature`` along its own axis and
        ``profile_curvature`` along the valley, second derivatives by the natural logarithm; ``span_decades``,
        how many powers of ten it can go along the valley until the objective has changed by the tolerance;
        and, for a likelihood, ``sd_decades``, the standard deviation of its logarithm if the model were
        true. The last four are of the parameters inside the box only, NaN for others.
    inside : tuple of str
        The parameters inside the box.
    curvature : ndarray (k, k)
        Second derivatives of the objective by their natural logarithms.
    curvatures, directions : ndarray (k,), (k, k)
        Its eigenvalues, smallest first, and in columns its eigenvectors: what only a combination shows.
    """

    table: pd.DataFrame
    inside: tuple[str, ...]
    curvature: FloatArray
    curvatures: FloatArray
    directions: FloatArray


def identify(
    objective: Objective,
    parameters: Hyperparameters,
    space: SearchSpace,
    *,
    tolerance: float = TOLERANCE,
    threads: int | None = None,
) -> Identification:
    """Judge every hyper-parameter at an optimum of a search.

    A parameter that is held is ``held``. One that can be divided by and multiplied with ten, as far as box
    and constraint allow, at less than the tolerance is ``flat``, and so is one inside the box whose span is
    more than one decade; one at an end of its range is ``at the lower edge``, ``at the upper edge`` or
    ``at the constraint``; any other is ``identified``.

    Parameters
    ----------
    objective : Objective
        What was minimised.
    parameters : Hyperparameters
        The optimum.
    space : SearchSpace
        Where was searched.
    tolerance : float
        Rise of the objective that counts.
    threads : int, optional
        By default one per core.
    """
    logs = np.log(parameters.vector())
    ends = {
        number: _end(number, parameters.vector(), space) if number in space.searched else HELD
        for number in range(len(NAMES))
    }
    inside = [number for number, end in ends.items() if end == ""]
    k = len(inside)
    axes = np.eye(len(NAMES))[inside] * STEP
    decades = np.eye(len(NAMES)) * math.log(10.0)
    pairs = [(i, j) for i in range(k) for j in range(i)]
    both = np.array([axes[i] + axes[j] for i, j in pairs]).reshape(-1, len(NAMES))
    points = logs + np.vstack([np.zeros(len(NAMES)), -decades, decades, -axes, axes, -both, both])
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        sets = [Hyperparameters.from_vector(np.exp(point)) for point in points]
        values = np.array(list(pool.map(objective.value, sets)))
    rises = values[1:] - values[0]
    tenth, tenfold, less, more, both_less, both_more = np.split(
        rises, np.cumsum([len(NAMES), len(NAMES), k, k, len(pairs)])
    )
    curvature = np.diag(less + more)
    for at, (i, j) in enumerate(pairs):
        mixed = both_less[at] + both_more[at] - less[i] - more[i] - less[j] - more[j]
        curvature[i, j] = curvature[j, i] = 0.5 * mixed
    curvature = curvature / STEP**2
    curvatures, directions = np.linalg.eigh(curvature)

    # A direction without curvature ends at the box: with no end at all, any parameter that it holds a trace
    # of would count as flat. Where a search was cut short, it may curve down: the fall tells too.
    least = 2.0 * tolerance / math.log(space.box[1] / space.box[0]) ** 2
    spread = (directions**2 / np.maximum(np.abs(curvatures), least)).sum(axis=1)
    columns = {
        "curvature": np.diag(curvature),
        "profile_curvature": 1.0 / spread,
        "span_decades": np.sqrt(2.0 * tolerance * spread) / math.log(10.0),
    }
    if isinstance(objective, Likelihood):
        columns["sd_decades"] = np.sqrt(spread / objective.samples) / math.log(10.0)
    spans = dict(zip(inside, columns["span_decades"], strict=True))
    table = pd.DataFrame(
        {
            "value": parameters.vector(),
            "status": [
                _status(ends[number], tenth[number], tenfold[number], spans.get(number, 0.0), tolerance)
                for number in range(len(NAMES))
            ],
            "tenth": tenth,
            "tenfold": tenfold,
        },
        index=pd.Index(NAMES, name="parameter"),
    )
    names = [NAMES[number] for number in inside]
    table = table.join(pd.DataFrame(columns, index=names))
    return Identification(table, tuple(names), curvature, curvatures, directions)


def _end(number: int, values: FloatArray, space: SearchSpace) -> str:
    """Which end of its range a searched parameter is at; empty inside."""
    low, high = np.log(space.limits(values)[space.searched.index(number)])
    at = math.log(values[number])
    width = math.log(space.box[1] / space.box[0])
    if at - low < EDGE * width:
        return LOWER
    if high - at < EDGE * width:
        return UPPER if high > math.log(space.box[1]) - EDGE * width else CONSTRAINT
    return ""


def _status(end: str, tenth: float, tenfold: float, span: float, tolerance: float) -> str:
    """Judge one parameter; at an end only the way back counts, since what lies beyond is not on offer."""
    if end == HELD:
        return HELD
    ways = [tenth] * (end != LOWER) + [tenfold] * (end not in (UPPER, CONSTRAINT))
    return FLAT if max(ways) < tolerance or span > 1.0 else end or IDENTIFIED
