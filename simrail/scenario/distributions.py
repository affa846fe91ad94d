"""Distributions as values: ``speed_kmh = { uniform = [20.0, 70.0] }`` instead of one number or a list.

A `Distribution` is what a person wrote, judged; `at` turns a number between 0 and 1 into a value, by
the inverse of the distribution function. Which numbers those are, jointly for all distributions of a
scenario, is decided in `simrail.scenario.samples`.

Every distribution is bounded: a value that no field could hold is refused when the scenario is read,
not when the draw that has it is run hours later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import exp, log
from typing import Any

from scipy.special import ndtr, ndtri

from simrail.core.errors import InputError

Value = str | int | float | bool

FORMS = {
    "uniform": "{ uniform = [20.0, 70.0] }",
    "log_uniform": "{ log_uniform = [0.1, 10.0] }",
    "normal": "{ normal = [50.0, 5.0], bounds = [35.0, 65.0] }",
    "choice": '{ choice = ["a", "b"] }',
}
"""How each kind is written."""

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
        found = _choice(given, bounds)
    else:
        pair = _pair(given, kind, "mean and standard deviation" if kind == "normal" else "lowest, highest")
        found = _continuous(kind, pair, bounds)
    if judge is None:
        return found
    judged = tuple(judge(value) for value in found.extremes)
    return Distribution(kind, judged) if found.kind == "choice" else found


def _choice(given: object, bounds: object) -> Distribution:
    if bounds is not None:
        raise InputError("a choice has no bounds", field="bounds", value=bounds, remedy="remove them")
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
                f"{kind} has its bounds already", field="bounds", value=bounds, remedy="remove them"
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
            "is not (lowest, highest)", field=field, value=list(pair), remedy="give the smaller bound first"
        )


def _pair(given: object, field: str, meaning: str) -> tuple[float, float]:
    """Two finite numbers, or a fault that says what they mean."""
    numbers = list(_numbers(given)) if isinstance(given, list) else []
    if not isinstance(given, list) or len(given) != 2 or len(numbers) != 2:
        raise InputError(
            "is no pair of finite numbers",
            field=field,
            value=given,
            limit=f"[{meaning}]",
            remedy=f"write e.g. {FORMS.get(field, FORMS['normal'])}",
        )
    return numbers[0], numbers[1]


def _numbers(given: list[Any]) -> Iterator[float]:
    for item in given:
        if isinstance(item, (int, float)) and not isinstance(item, bool) and -LARGEST < item < LARGEST:
            yield float(item)
