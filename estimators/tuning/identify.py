"""What a tuning knows of each hyper-parameter: identified, held at an edge of the search, or flat.

About an optimum the objective f is a bowl in the logarithms of the parameters. A parameter is judged by how
far it can go before f rises by a tolerance: along its own axis the others stay, along the bowl's valley they
follow (the profile). A parameter that is searched on a linear scale has no decades: a tenth of its box
stands for one. With the likelihood of a model that is true, the inverse of n times the curvature is the
covariance of the estimate (Cramer-Rao); on a real ride the model is not true and that is but a scale.

Not here: how the optimum was found (`simrail.estimators.tuning.tune`).
"""

import math
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas as pd
from simrail.estimators.tuning.cube import Cube
from simrail.estimators.tuning.space import CONSTRAINT, FLAT, HELD, IDENTIFIED, LOWER, UPPER

from simrail.core.jit import FloatArray
from simrail.estimation.tunable import Objective, Parameter

TOLERANCE = 1e-3
"""Rise of the objective that counts: negative log-likelihood per sample, or mm."""

STEP = 0.1
"""Of the differences, in the natural logarithm: values good to 1e-12 give a curvature good to 1e-10."""

EDGE = 1e-3
"""Of an axis of the cube: closer to an end than this is at it."""


def identify(
    objective: Objective,
    values: Mapping[str, float],
    cube: Cube,
    *,
    tolerance: float = TOLERANCE,
    threads: int | None = None,
) -> pd.DataFrame:
    """Judge every parameter at an optimum of a search.

    A parameter that is held is ``held``. One that can be divided by and multiplied with ten, as far as box
    and constraint allow, at less than the tolerance is ``flat``, and so is one inside the box whose span is
    more than one decade; one at an end of its range is ``at the lower edge``, ``at the upper edge`` or
    ``at the constraint``; any other is ``identified``.

    Parameters
    ----------
    objective : Objective
        What was minimised; a likelihood says in ``samples`` how many samples it counts.
    values : mapping of str to float
        The optimum.
    cube : Cube
        Where was searched.
    tolerance : float
        Rise of the objective that counts.
    threads : int, optional
        By default one per core.

    Returns
    -------
    pandas.DataFrame
        One row per hyper-parameter (index ``parameter``): ``value``; ``status``; ``tenth`` and ``tenfold``,
        the rise of the objective if the value is divided by or multiplied with ten and the others stay
        (negative where the optimum lies beyond what was allowed), ``tenth_allowed`` and ``tenfold_allowed``,
        whether boxes and bounds allow it; ``curvature`` along its own axis and
        ``profile_curvature`` along the valley, second derivatives by the natural logarithm; ``span_decades``,
        how many powers of ten it can go along the valley until the objective has changed by the tolerance;
        and, for a likelihood, ``sd_decades``, the standard deviation of its logarithm if the model were
        true. The last four are of the parameters inside the box only, NaN for others. Its ``attrs`` hold in
        ``curvature`` the second derivatives (k, k) of the objective by the natural logarithms of these.
    """
    names, parameters = cube.names, cube.parameters
    optimum = np.array([values[name] for name in names])
    logs = np.array(list(map(_to_log, parameters, optimum)))
    n = len(names)
    ends = {i: _end(i, optimum, cube) if i in cube.searched else HELD for i in range(n)}
    inside = [number for number, end in ends.items() if end == ""]
    k = len(inside)
    axes = np.eye(n)[inside] * STEP
    tens = np.eye(n) * math.log(10.0)
    pairs = [(i, j) for i in range(k) for j in range(i)]
    both = np.array([axes[i] + axes[j] for i, j in pairs]).reshape(-1, n)
    places = logs + np.vstack([np.zeros(n), -tens, tens, -axes, axes, -both, both])
    points = [dict(zip(names, map(_from_log, parameters, place), strict=True)) for place in places]
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        heights = np.array(list(pool.map(objective.value, points)))
    rises = heights[1:] - heights[0]
    tenth, tenfold, less, more, both_less, both_more = np.split(rises, np.cumsum([n, n, k, k, len(pairs)]))
    curvature = np.diag(less + more)
    for at, (i, j) in enumerate(pairs):
        mixed = both_less[at] + both_more[at] - less[i] - more[i] - less[j] - more[j]
        curvature[i, j] = curvature[j, i] = 0.5 * mixed
    curvature = curvature / STEP**2
    curvatures, directions = np.linalg.eigh(curvature)

    # A direction without curvature ends at the box: with no end at all, any parameter that it holds a trace
    # of would count as flat. Where a search was cut short, it may curve down: the fall tells too.
    least = 2.0 * tolerance / max(_width(parameters[i]) for i in cube.searched) ** 2
    spread = (directions**2 / np.maximum(np.abs(curvatures), least)).sum(axis=1)
    columns = {
        "curvature": np.diag(curvature),
        "profile_curvature": 1.0 / spread,
        "span_decades": np.sqrt(2.0 * tolerance * spread) / math.log(10.0),
    }
    samples = getattr(objective, "samples", None)
    if samples is not None:
        columns["sd_decades"] = np.sqrt(spread / samples) / math.log(10.0)
    spans = dict(zip(inside, columns["span_decades"], strict=True))
    allowed = [
        cube.allows({**values, parameter.name: _moved(parameter, values[parameter.name], decades=by)})
        for by in (-1, 1)
        for parameter in parameters
    ]
    table = pd.DataFrame(
        {
            "value": optimum,
            "status": [
                _status(ends[i], tenth[i], tenfold[i], spans.get(i, 0.0), tolerance) for i in range(n)
            ],
            "tenth": tenth,
            "tenfold": tenfold,
            "tenth_allowed": allowed[:n],
            "tenfold_allowed": allowed[n:],
        },
        index=pd.Index(names, name="parameter"),
    )
    table = table.join(pd.DataFrame(columns, index=[names[number] for number in inside]))
    table.attrs["curvature"] = curvature
    return table


def _width(parameter: Parameter) -> float:
    """Width of a parameter's box in natural logarithms; ten decades on a linear scale."""
    if parameter.scale == "log":
        return math.log(parameter.upper / parameter.lower)
    return 10.0 * math.log(10.0)


def _moved(parameter: Parameter, value: float, *, decades: int) -> float:
    """A value some decades further on; on a linear scale a tenth of the box is one decade."""
    if parameter.scale == "log":
        return float(10.0**decades) * value
    return value + 0.1 * decades * (parameter.upper - parameter.lower)


def _to_log(parameter: Parameter, value: float) -> float:
    """Natural logarithm of a value; on a linear scale a tenth of the box is one decade."""
    if parameter.scale == "log":
        return math.log(value)
    return _width(parameter) * value / (parameter.upper - parameter.lower)


def _from_log(parameter: Parameter, log: float) -> float:
    """Inverse of `_to_log`."""
    if parameter.scale == "log":
        return math.exp(log)
    return log * (parameter.upper - parameter.lower) / _width(parameter)


def _end(number: int, values: FloatArray, cube: Cube) -> str:
    """Which end of its range a searched parameter is at; empty inside."""
    parameter = cube.parameters[number]
    low, high = (_to_log(parameter, end) for end in cube.limits(values)[cube.searched.index(number)])
    place, width = _to_log(parameter, values[number]), _width(parameter)
    if place - low < EDGE * width:
        return LOWER
    if high - place < EDGE * width:
        return UPPER if high > _to_log(parameter, parameter.upper) - EDGE * width else CONSTRAINT
    return ""


def _status(end: str, tenth: float, tenfold: float, span: float, tolerance: float) -> str:
    """Judge one parameter; at an end only the way back counts, since what lies beyond is not on offer."""
    if end == HELD:
        return HELD
    ways = [tenth] * (end != LOWER) + [tenfold] * (end not in (UPPER, CONSTRAINT))
    return FLAT if max(ways) < tolerance or span > 1.0 else end or IDENTIFIED
