"""Lists as axes: a scalar of a scenario may be a list, and then the scenario is a campaign.

A field annotated ``Listed[float]`` takes one number or a list of them. A list becomes an `Axis`;
`expand` turns a model that holds axes into one model per combination, none of which holds an axis.
Fields that are lists by nature (positions, stops) are not annotated so and stay what they are.

This module neither reads files nor knows what the fields mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import product
from typing import Annotated, Any, TypeVar

from pydantic import WrapValidator

from simrail.scenario.files import Part

Scalar = str | int | float | bool
_T = TypeVar("_T")
_Part = TypeVar("_Part", bound=Part)


class Axis(tuple[Scalar, ...]):
    """Values that a field takes in turn."""

    __slots__ = ()


def _one_or_list(value: Any, handler: Callable[[Any], Any]) -> Any:
    if not isinstance(value, (list, tuple)):
        return handler(value)
    if not value:
        raise ValueError("is an empty list: give at least one value")
    items = Axis(handler(item) for item in value)
    if len(set(items)) < len(items):
        raise ValueError(f"lists a value twice: {list(items)}")
    return items


Listed = Annotated[_T, WrapValidator(_one_or_list)]
"""One value, or a list of values that makes an axis."""


def axes_of(model: Part, *, prefix: str = "", fields: Iterable[str] | None = None) -> dict[str, Axis]:
    """Find the axes of a model and of the tables within it.

    Parameters
    ----------
    model : Part
        Model as read, possibly holding axes.
    prefix : str, optional
        Put before every name, e.g. ``"ride."``.
    fields : iterable of str, optional
        Look at these fields only.

    Returns
    -------
    dict
        Dotted field name -> its values, in the order of the fields. Arrays of tables (rides, IMUs,
        estimators) are not looked into: each of their tables has axes of its own.
    """
    found: dict[str, Axis] = {}
    for name in type(model).model_fields if fields is None else fields:
        value = getattr(model, name)
        if isinstance(value, Axis):
            found[prefix + name] = value
        elif isinstance(value, Part):
            found.update(axes_of(value, prefix=f"{prefix}{name}."))
        elif isinstance(value, dict):
            inner = {f"{prefix}{name}.{key}": item for key, item in value.items() if isinstance(item, Axis)}
            found.update(inner)
    return found


def expand(
    model: _Part, *, prefix: str = "", fields: Iterable[str] | None = None
) -> list[tuple[dict[str, Scalar], _Part]]:
    """Return every combination of a model's axes.

    Parameters
    ----------
    model : Part
        Model as read.
    prefix : str, optional
        Put before every axis name in the settings that are returned.
    fields : iterable of str, optional
        Expand these fields only.

    Returns
    -------
    list of (dict, Part)
        The settings (axis name -> value) and the model that has them; the last axis runs fastest.
    """
    axes = axes_of(model, fields=fields)
    combinations = []
    for values in product(*axes.values()):
        settings = dict(zip(axes, values, strict=True))
        concrete = model
        for name, value in settings.items():
            concrete = _with(concrete, name.split("."), value)
        combinations.append(({prefix + name: value for name, value in settings.items()}, concrete))
    return combinations


def _with(model: Any, path: list[str], value: Scalar) -> Any:
    """Return a copy of a model with one (nested) field set."""
    head, rest = path[0], path[1:]
    if isinstance(model, dict):
        return {**model, ".".join(path): value}
    inner = _with(getattr(model, head), rest, value) if rest else value
    return model.model_copy(update={head: inner})
