"""What the source says of the keys of a file: the string below a field, or its entry among the attributes.

The source is read when somebody asks for it, so that no command but those that show the words waits for it.
"""

import ast
import inspect
import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from functools import cache
from itertools import pairwise
from textwrap import dedent
from typing import Any, get_args, get_type_hints

from simrail.core.errors import joined
from simrail.core.toml_files import Part

_ENTRY = re.compile(r"^(\w[\w, ]*?)(?: : .*)?\n((?:    .*\n|\n)+)", re.MULTILINE)
"""Names of a numpydoc section, perhaps several, their type, and the indented words below."""


@cache
def words_of(model: type) -> dict[str, str]:
    """What the source says of each field of a model or a dataclass, one line each."""
    words: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if base is not Part and (issubclass(base, Part) or is_dataclass(base)):
            words |= _of_section(inspect.getdoc(base) or "") | _below_fields(base)
    return words


def _below_fields(model: type) -> dict[str, str]:
    try:
        lines = dedent(inspect.getsource(model))
    except (OSError, TypeError):
        return {}  # a model that was made, not written: its fields bring their descriptions
    (definition,) = ast.parse(lines).body
    words = {}
    for field, below in pairwise(getattr(definition, "body", [])):
        is_text = isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and is_text:
            words[field.target.id] = joined(below.value.value)
    return words


def _of_section(docstring: str) -> dict[str, str]:
    _, _, section = docstring.partition("Attributes\n----------\n")
    words = {}
    for names, text in _ENTRY.findall(section + "\n"):
        for name in names.split(", "):
            words[name] = joined(text)
    return words


def models_in(model: type) -> dict[str, type]:
    """Every model and dataclass that a model holds, with itself, by the names that a schema gives them."""
    found: list[type] = []
    _gather(model, found)
    names = [one.__name__ for one in found]
    whole = [f"{one.__module__}.{one.__name__}".replace(".", "__") for one in found]
    alone = [name if names.count(name) == 1 else long for name, long in zip(names, whole, strict=True)]
    return dict(zip(alone, found, strict=True))


def _gather(kind: Any, found: list[type]) -> None:
    if isinstance(kind, type) and (issubclass(kind, Part) or is_dataclass(kind)):
        if kind in found:
            return
        found.append(kind)
        for inner in _annotations(kind):
            _gather(inner, found)
    for inner in get_args(kind):
        _gather(inner, found)


def _annotations(model: type) -> Iterator[Any]:
    if issubclass(model, Part):
        yield from (field.annotation for field in model.model_fields.values())
    else:
        yield from get_type_hints(model).values()
