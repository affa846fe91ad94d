"""Distributions as values: ``speed_kmh = { uniform = [20.0, 70.0] }`` instead of one number or a list.

A `Distribution` is what a person wrote, judged; `at` turns a number between 0 and 1 into a value, by
the inverse of the distribution function. Every distribution is bounded: a value that no field could hold is
refused when the scenario is read, not when the draw that has it is run hours later.

All distributions of a scenario (of its tables, rides, IMUs and estimators) are dimensions of one design, a
Latin hypercube or Sobol points, so that few samples fill the whole space (`samples_of`). Each dimension has
a random stream of its own, found by its name:

* Latin hypercube: a dimension's values do not change when another distribution is added; they do
  when the number of samples changes, since every sample is one of n equal shares.
* Sobol: a dimension's values stay when samples are added, and when a distribution is added behind it;
  the number of samples is a power of two. Points are moved by a random digital shift per dimension.

* The designs of a sensitivity analysis, in blocks: `simrail.scenario.designs`.

Sources: McKay, Beckman, Conover 1979 (Latin hypercube); Owen 1998, section on digital shifts (Sobol).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import exp, log
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import ndtr, ndtri

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.core.toml_files import Part
from simrail.scenario.designs import DESIGNS, block_size, design_shares

if TYPE_CHECKING:
    from simrail.scenario.scenario import ScenarioFile

Value = str | int | float | bool

FORMS = {
    "uniform": "{ uniform = [20.0, 70.0] }",
    "log_uniform": "{ log_uniform = [0.1, 10.0] }",
    "normal": "{ normal = [50.0, 5.0], bounds = [35.0, 65.0] }",
    "choice": '{ choice = ["a", "b"] }',
}
"""How each kind is written."""

SOBOL_BITS = 30
ARRAYS = ("ride", "imu", "estimator")

LARGEST = 1e300
"""Beyond it, differences of two numbers are no numbers any more."""


@dataclass(frozen=True)
class Distribution:
    """A distribution of one value.

    Attributes
    ----------
    kind : str
        ``uniform`` and ``log_uniform`` between two bounds, ``normal`` with its tails beyond the bounds
        cut off, or ``choice``: every item is as likely.
    parameters : tuple
        The two bounds; mean and standard deviation (of the normal distribution before it is cut); the
        items.
    bounds : tuple of float, optional
        Of ``normal`` only.
    """

    kind: str
    parameters: tuple[Value, ...]
    bounds: tuple[float, float] | None = None

    def at(self, share: float) -> Value:
        """Value below which a share (0 to 1) of the distribution lies."""
        if self.kind == "choice":
            return self.parameters[min(int(share * len(self.parameters)), len(self.parameters) - 1)]
        first, second = (float(number) for number in self.parameters)
        if self.kind == "uniform":
            return first + share * (second - first)
        if self.kind == "log_uniform":
            return min(max(exp(log(first) + share * (log(second) - log(first))), first), second)
        assert self.bounds is not None
        low, high = self.bounds
        below, above = ndtr((low - first) / second), ndtr((high - first) / second)
        value = first + second * float(ndtri(below + share * (above - below)))
        return min(max(value, low), high)

    @property
    def extremes(self) -> tuple[Value, ...]:
        """All items of a choice; else the two bounds and a value between them."""
        if self.kind == "choice":
            return self.parameters
        return (self.at(0.0), self.at(0.382), self.at(1.0))


def is_distribution(value: object) -> bool:
    """Whether a table of an estimator's options is meant as a distribution."""
    return isinstance(value, dict) and bool(set(value) & set(FORMS))


def read_distribution(table: dict[str, Any], judge: Callable[[Any], Any] | None = None) -> Distribution:
    """Read and judge a distribution.

    Parameters
    ----------
    table : dict
        As written.
    judge : callable, optional
        The field's own judgement of one value; it raises where the field cannot have it.

    Raises
    ------
    InputError
        If it is no distribution, has no (finite, ordered) bounds, or reaches values that the field
        cannot have.
    """
    kinds = [name for name in table if name in FORMS]
    unknown = [name for name in table if name not in (*FORMS, "bounds")]
    if len(kinds) != 1 or unknown:
        raise InputError(
            "is no distribution",
            value=table,
            limit=" or ".join(FORMS.values()),
            remedy="give one number, a list of them, or one of these",
        )
    kind, given, bounds = kinds[0], table[kinds[0]], table.get("bounds")
    if kind == "choice":
        distribution = _choice(given, bounds)
    else:
        pair = _pair(given, kind, "mean and standard deviation" if kind == "normal" else "lowest, highest")
        distribution = _continuous(kind, pair, bounds)
    if judge is None:
        return distribution
    judged = tuple(judge(value) for value in distribution.extremes)
    return Distribution(kind, judged) if kind == "choice" else distribution


def _choice(given: object, bounds: object) -> Distribution:
    if bounds is not None:
        raise InputError(
            "a choice has no bounds",
            field="bounds",
            value=bounds,
            remedy="remove them",
            limit="a choice without bounds",
        )
    if not isinstance(given, list) or not given:
        raise InputError(
            "is an empty choice" if given == [] else "is no list of values",
            field="choice",
            value=given,
            limit=FORMS["choice"],
            remedy="give at least one value",
        )
    return Distribution("choice", tuple(given))


def _continuous(kind: str, pair: tuple[float, float], bounds: object) -> Distribution:
    if kind != "normal":
        if bounds is not None:
            raise InputError(
                f"{kind} has its bounds already",
                field="bounds",
                value=bounds,
                remedy="remove them",
                limit="a normal distribution",
            )
        _ordered(pair, kind)
        if kind == "log_uniform" and pair[0] <= 0.0:
            raise InputError(
                "has no logarithm", field=kind, value=list(pair), limit="> 0", remedy="take uniform"
            )
        return Distribution(kind, pair)
    if pair[1] <= 0.0:
        raise InputError(
            "has no positive standard deviation", field=kind, value=pair[1], limit="> 0", remedy=FORMS[kind]
        )
    if bounds is None:
        raise InputError(
            "is a distribution without bounds",
            field=kind,
            value=list(pair),
            limit="bounds = [lowest, highest]",
            remedy=f"add bounds, e.g. {FORMS[kind]}",
        )
    limits = _pair(bounds, "bounds", "lowest, highest")
    _ordered(limits, "bounds")
    # Far in a tail the inverse has no digits left, and hardly anybody means that.
    inside = float(ndtr((limits[1] - pair[0]) / pair[1]) - ndtr((limits[0] - pair[0]) / pair[1]))
    if inside < 0.01:
        raise InputError(
            "lies outside its bounds",
            field="bounds",
            value=list(limits),
            limit="at least 1 % of the normal distribution",
            remedy="move the mean or the bounds",
        )
    return Distribution(kind, pair, limits)


def _ordered(pair: tuple[float, float], field: str) -> None:
    if pair[0] >= pair[1]:
        raise InputError(
            "is not (lowest, highest)",
            field=field,
            value=list(pair),
            remedy="give the smaller bound first",
            limit="the smaller bound first",
        )


def _pair(given: object, field: str, meaning: str) -> tuple[float, float]:
    """Two finite numbers, or a fault that says what they mean."""
    if not isinstance(given, list) or len(given) != 2 or not all(_is_finite(item) for item in given):
        raise InputError(
            "is no pair of finite numbers",
            field=field,
            value=given,
            limit=f"[{meaning}]",
            remedy=f"write e.g. {FORMS.get(field, FORMS['normal'])}",
        )
    return float(given[0]), float(given[1])


def _is_finite(item: object) -> bool:
    return isinstance(item, (int, float)) and not isinstance(item, bool) and -LARGEST < item < LARGEST


def distributions_of(
    model: Part, *, prefix: str = "", fields: Iterable[str] | None = None
) -> dict[str, Distribution]:
    """Find the distributions of a model and of the tables within it; see `simrail.scenario.axes.axes_of`."""
    return {name: value for name, value in leaves(model, prefix, fields) if isinstance(value, Distribution)}


def leaves(model: Part, prefix: str, fields: Iterable[str] | None) -> Iterator[tuple[str, object]]:
    """Names and values of a model's fields and of those of the tables within it."""
    for name in type(model).model_fields if fields is None else fields:
        value = getattr(model, name)
        if isinstance(value, Part):
            yield from leaves(value, f"{prefix}{name}.", None)
        elif isinstance(value, dict):
            yield from ((f"{prefix}{name}.{key}", item) for key, item in value.items())
        else:
            yield prefix + name, value


def dimensions(spec: ScenarioFile) -> dict[str, Distribution]:
    """All distributions of a scenario, by name: ``irregularity.scale``, ``ride.out.speed_kmh``."""
    named = distributions_of(spec)
    for array in ARRAYS:
        for part in getattr(spec, array):
            named |= distributions_of(part, prefix=f"{array}.{part.name}.")
    return named


def samples_of(spec: ScenarioFile) -> list[dict[str, Value]]:
    """The values of all distributions in each sample; one sample without values if there are none.

    Parameters
    ----------
    spec : ScenarioFile
        Its ``[monte_carlo]`` says how many samples, and by which method.
    """
    named = dimensions(spec)
    if not named:
        return [{}]
    draws = spec.monte_carlo
    return _samples(draws.method, draws.samples, spec.seed, tuple(named.items()))


@lru_cache(maxsize=4)
def _samples(
    method: str, count: int, seed: int, named: tuple[tuple[str, Distribution], ...]
) -> list[dict[str, Value]]:
    """The samples, remembered: many ask for one of them."""
    shares = _shares(method, count, seed, [name for name, _ in named])
    return [
        {name: distribution.at(share) for (name, distribution), share in zip(named, row, strict=True)}
        for row in shares.tolist()
    ]


def sample_count(spec: ScenarioFile) -> int:
    """Number of samples; 1 without distributions."""
    count, draws = len(dimensions(spec)), spec.monte_carlo
    if count == 0:
        return 1
    return draws.samples * (block_size(draws.method, count) if draws.method in DESIGNS else 1)


def shares_of(spec: ScenarioFile) -> FloatArray:
    """Points (samples, dimensions) in the unit cube, whose values are `samples_of`."""
    return _shares(spec.monte_carlo.method, spec.monte_carlo.samples, spec.seed, list(dimensions(spec)))


def _shares(method: str, n: int, seed: int, names: list[str]) -> FloatArray:
    if method in DESIGNS:
        return design_shares(method, n, names, seed)
    from scipy.stats import qmc  # slow to import, and needed by few scenarios

    if method == "latin_hypercube":
        # Columns of a Latin hypercube are independent, so that each may have a stream of its own.
        columns = [qmc.LatinHypercube(1, rng=stream(seed, "sample", name)).random(n) for name in names]
        return np.hstack(columns)
    points = qmc.Sobol(len(names), scramble=False, bits=SOBOL_BITS).random(n)
    digits = np.round(points * 2**SOBOL_BITS).astype(np.int64)
    shifts = [int(stream(seed, "sample", name).integers(2**SOBOL_BITS)) for name in names]
    shares: FloatArray = ((digits ^ np.array(shifts)) + 0.5) / 2.0**SOBOL_BITS
    return shares
