"""Lists as axes: a scalar of a scenario may be a list, and then the scenario is a campaign.

A field annotated ``Listed[float]`` takes one number, a list of them or a distribution. A list becomes
an `Axis`; `expand` turns a model that holds axes into one model per combination, none of which holds
an axis. A distribution becomes a `Distribution`; `drawn` puts the values of a sample in its place.
Fields that are lists by nature (positions, stops) are not annotated so and stay what they are.

This module neither reads files nor knows what the fields mean.
"""

from collections.abc import Callable, Iterable, Mapping
from itertools import product
from typing import Annotated, Any, TypeVar

from pydantic import GetJsonSchemaHandler, WrapValidator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.scenario.distributions import (
    FORMS,
    Distribution,
    Value,
    distributions_of,
    leaves,
    read_distribution,
)

_T = TypeVar("_T")
_Part = TypeVar("_Part", bound=Part)


class Axis(tuple[Value, ...]):
    """Values that a field takes in turn."""

    __slots__ = ()


def _one_or_list(value: Any, handler: Callable[[Any], Any]) -> Any:
    if isinstance(value, dict):
        return read_distribution(value, handler)
    if not isinstance(value, (list, tuple)):
        return handler(value)
    if not value:
        raise InputError("is an empty list", value=[], limit="at least one value", remedy="give one")
    items = Axis(handler(item) for item in value)
    if len(set(items)) < len(items):
        limit = "each value once"
        raise InputError("lists a value twice", value=list(items), limit=limit, remedy="take one of them out")
    return items


class _Form:
    """What an editor is told of such a field: one value, a list of values, or a table of a distribution."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        one = handler(schema)
        pair = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
        several = {"type": "array", "items": one, "minItems": 1, "uniqueItems": True}
        spread = {
            "type": "object",
            "properties": {kind: several if kind == "choice" else pair for kind in FORMS} | {"bounds": pair},
            "additionalProperties": False,
            "minProperties": 1,
        }
        return {"anyOf": [one, several, spread]}


Listed = Annotated[_T, WrapValidator(_one_or_list), _Form()]
"""One value, a list of values that makes an axis, or a distribution that values are drawn from."""


def each(value: Any) -> tuple[Any, ...]:
    """What a field may turn out to be: its value, the values of its list, or the extremes of its draws."""
    if isinstance(value, Axis):
        return value
    return value.extremes if isinstance(value, Distribution) else (value,)


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
    return {name: value for name, value in leaves(model, prefix, fields) if isinstance(value, Axis)}


def expand(
    model: _Part, *, prefix: str = "", fields: Iterable[str] | None = None
) -> list[tuple[dict[str, Value], _Part]]:
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


def drawn(
    model: _Part,
    values: Mapping[str, Value],
    *,
    prefix: str = "",
    shown: str = "",
    fields: Iterable[str] | None = None,
) -> tuple[dict[str, Value], _Part]:
    """Put the values of one sample in the place of a model's distributions.

    Parameters
    ----------
    model : Part
        Model without axes.
    values : mapping of str to value
        Of the sample, by the names that the distributions have with the prefix.
    prefix : str, optional
        Stands before the model's names in ``values``, e.g. ``"ride.out."``.
    shown : str, optional
        Put before every name in the settings that are returned.
    fields : iterable of str, optional
        These fields only.

    Returns
    -------
    settings : dict
        Name -> value.
    concrete : Part
        The model that has them.
    """
    settings = {name: values[prefix + name] for name in distributions_of(model, fields=fields)}
    for name, value in settings.items():
        model = _with(model, name.split("."), value)
    return {shown + name: value for name, value in settings.items()}, model


def _with(model: Any, path: list[str], value: Value) -> Any:
    """Return a copy of a model with one (nested) field set."""
    head, rest = path[0], path[1:]
    if isinstance(model, dict):
        return {**model, ".".join(path): value}
    inner = _with(getattr(model, head), rest, value) if rest else value
    return model.model_copy(update={head: inner})
