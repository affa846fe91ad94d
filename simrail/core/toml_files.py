"""Reading and judging TOML: finds a file by name or path, and turns every fault into one message.

A scenario and each of its parts (track, vehicle, IMU) is one TOML file, checked by a pydantic model
that derives from `Part`. Shipped files are found by their bare name; a path finds a person's own.
What the numbers mean physically is judged by the models, not here.
"""

from __future__ import annotations

import difflib
import json
import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import tomli_w
from pydantic import BaseModel, ConfigDict, ValidationError

from simrail.core.errors import Faults, InputError, did_you_mean

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

FOLDERS = {"scenario": "", "track": "tracks", "vehicle": "vehicles", "imu": "imus", "spectrum": "spectra"}


MOST = 1e12
"""No number of a file is as large: the stiffest is a modulus of elasticity, 2e11 N/m2."""


MOST_LETTERS = 10_000
"""Of one text of a file."""


class Part(BaseModel):
    """Base of every file model.

    Unknown keys are refused, numbers are finite, values are frozen. Types are strict: text is never
    read as a number (``"20 km/h"``), nor true as 1. Whole numbers stand for floats, and TOML arrays
    for tuples.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    @classmethod
    def explained(cls, key: str, value: object) -> str | None:  # noqa: ARG003
        """What to write in the place of an unknown key, or of a value of the wrong type.

        None where the model knows no better than a guess by letters.
        """
        return None

    @classmethod
    def others(cls, data: Mapping[str, Any]) -> Iterable[InputError]:  # noqa: ARG003
        """Faults that only several keys have together; asked for where a file has faults already.

        ``data`` are those keys that have none.
        """
        return ()


_Part = TypeVar("_Part", bound=Part)


def shipped_folder() -> Path:
    """Where the shipped scenarios lie, and their parts in folders beside them."""
    return Path(str(files("simrail.scenarios")))


def shipped(kind: str) -> dict[str, Path]:
    """Shipped files of a kind, a key of `FOLDERS`, by name."""
    folder = shipped_folder() / FOLDERS[kind]
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def is_file(path: Path) -> bool:
    """Whether there is such a file; not where its name cannot be one, or its folder may not be entered."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def existing_file(name: str, folder: Path | None, *, also: Path | None = None) -> Path:
    """A file by its path, seen from a folder (that of the scenario), from here, or from one more folder.

    Raises
    ------
    InputError
        If there is none; the message names the nearest file in the folders of ``also``.
    """
    for candidate in (*([folder / name] if folder else []), Path(name), *([also / name] if also else [])):
        if is_file(candidate):
            return candidate
    shown = [path.relative_to(also).as_posix() for path in sorted(also.glob("*/*.toml"))] if also else []
    near = difflib.get_close_matches(name, shown, n=1)
    raise InputError(
        "no such file",
        value=name,
        limit="the path of a file that is there",
        remedy="mend the path; it is seen from the scenario's folder, and from here"
        + (f" (shipped: {near[0]})" if near else ""),
    )


def find(kind: str, name: str, *, folder: Path | None = None) -> Path:
    """Find a file: a path as given, a path in a folder (that of the scenario), or a shipped name.

    Raises
    ------
    InputError
        If there is no such file; the message lists the nearest shipped names.
    """
    looks_like_path = name.endswith(".toml") or "/" in name or "\\" in name
    if looks_like_path:
        for candidate in (*([folder / name] if folder else []), Path(name)):
            if is_file(candidate):
                return candidate
        raise InputError(
            "no such file",
            value=name,
            limit=f"the path of a {kind} file, or a shipped name",
            remedy=f"mend the path; shipped: {', '.join(shipped(kind))}",
        )
    paths = shipped(kind)
    if name in paths:
        return paths[name]
    near = difflib.get_close_matches(name, paths, n=3) or sorted(paths)
    raise InputError(
        f"no {kind} of this name is shipped",
        value=name,
        limit="e.g. " + ", ".join(near),
        remedy=f"'simrail list' shows all; a file of your own needs its path, e.g. ./{name}.toml",
    )


def label(path: Path) -> str:
    """Name a file in messages and results: no more of the machine's folders than its reader needs."""
    for root, prefix in ((shipped_folder(), "scenarios"), (Path.cwd(), "")):
        if path.resolve().is_relative_to(root.resolve()):
            return (Path(prefix) / path.resolve().relative_to(root.resolve())).as_posix()
    return str(path)


def read_text(path: Path) -> str:
    """Read a text file, or say why it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        if isinstance(error, FileNotFoundError):
            limit, remedy = "the path of a file that is there", "mend the path"
            raise InputError("no such file", value=str(path), limit=limit, remedy=remedy) from None
        limit, remedy = "a file that may be read", "mend the path, or its rights"
        raise InputError(
            "cannot be read", file=label(path), value=error.strerror, limit=limit, remedy=remedy
        ) from error
    except UnicodeDecodeError as error:
        bad = error.object[error.start : error.start + 8]
        raise InputError(
            f"is not UTF-8 text, at byte {error.start}",
            file=label(path),
            value=bad,
            limit="UTF-8",
            remedy="save the file as UTF-8",
        ) from error


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file, or say in which line it is broken."""
    return parse_toml(read_text(path), file=label(path))


def parse_toml(text: str, *, file: object) -> dict[str, Any]:
    """Parse TOML text, or say in which line it is broken."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also a whole number of more digits than Python reads
        raise InputError(
            f"is not valid TOML: {error}",
            file=file,
            value=_around(text, str(error)),
            limit="TOML 1.0",
            remedy='mend that place; text stands in quotes, numbers do not: name = "go20A", speed_kmh = 20.0',
        ) from error


def _around(text: str, said: str) -> str:
    """The line of a text that an error of its reader speaks of; its beginning where none is named."""
    lines = text.splitlines() or [""]
    number = re.search(r"at line (\d+)", said)
    at = int(number[1]) - 1 if number else 0
    return lines[min(at, len(lines) - 1)].strip()[:60]


def toml_text(data: Mapping[str, Any]) -> str:
    """TOML text of plain data: text, numbers, tuples or lists of them, tables and arrays of tables.

    Numbers read back bit by bit. None is left out: TOML has no such value.
    """
    return tomli_w.dumps(_plain(data))


def _plain(value: Any) -> Any:
    """A value without None in its tables, and numpy's numbers as Python's."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items() if item is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value.item() if hasattr(value, "item") else value


def judge(model: type[_Part], data: dict[str, Any], *, file: object, folder: Path | None = None) -> _Part:
    """Build a file model from raw TOML data; its faults become an `InputError`, a line for each.

    ``folder`` is where files that the data names by a relative path are looked for.
    """
    try:
        # JSON is the mode in which pydantic is strict about numbers and still takes arrays for tuples.
        part = model.model_validate_json(json.dumps(data, default=str), context={"folder": folder})
        _refuse_absurd(data, file)
        return part
    except ValidationError as error:
        faults = error.errors()
        found = _input_errors(faults, model, file)
        bad = {fault["loc"][0] for fault in faults if fault["loc"]}
        with blame(file):
            gathered = Faults()
            gathered.found = [*found, *model.others({k: v for k, v in data.items() if k not in bad})]
            gathered.refuse()
        raise


def _refuse_absurd(data: Any, file: object, field: str = "") -> None:
    """Refuse a number beyond all that these files speak of, which overflows somewhere, and endless texts."""
    if isinstance(data, dict):
        for key, value in data.items():
            if key not in ("seed", "options"):
                _refuse_absurd(value, file, f"{field}.{key}" if field else str(key))
    elif isinstance(data, list | tuple):
        for i, value in enumerate(data):
            _refuse_absurd(value, file, f"{field}[{i}]")
    elif isinstance(data, str) and len(data) > MOST_LETTERS:
        limit = f"at most {MOST_LETTERS} characters"
        raise InputError("is too long", file=file, field=field, value=data, limit=limit, remedy="shorten it")
    elif (
        isinstance(data, int | float) and MOST <= abs(data) < math.inf
    ):  # models refuse infinity where it is none
        limit, remedy = f"below {MOST:g}", "mind the unit, which is in the name of the field"
        raise InputError("is out of range", file=file, field=field, value=data, limit=limit, remedy=remedy)


def load(model: type[_Part], kind: str, name: str, *, folder: Path | None = None) -> _Part:
    """Find, read and judge one file."""
    path = find(kind, name, folder=folder)
    return judge(model, read_toml(path), file=label(path), folder=path.parent)


@contextmanager
def blame(file: object, field: str = "") -> Iterator[None]:
    """Say in which file and field an `InputError` arose, where it does not say so itself."""
    try:
        yield
    except InputError as error:
        for one in error.each:
            if one.file is None:
                _place(one, file, field)
        raise


def _place(error: InputError, file: object, field: str) -> None:
    """Put a file and the field that it arose in before what an error says of its own."""
    error.file = error.file or file
    error.field = ".".join(part for part in (field, error.field) if part) or None


class _Message(NamedTuple):
    """What an `InputError` says of a value."""

    problem: str
    limit: str | None = None
    remedy: str | None = None
    with_value: bool = True


def _input_errors(faults: list[ErrorDetails], model: type[Part], file: object) -> list[InputError]:
    """The faults of a model as messages that name their places."""
    # An unknown key is usually a misspelling that also leaves a required one missing: say it first, and once.
    faults = sorted(faults, key=lambda fault: fault["type"] not in _UNKNOWN)
    found: dict[tuple[int | str, ...], InputError] = {}
    for fault in faults:
        # Items of one array with one fault, such as a unit that was mistaken, are told once.
        place = fault["loc"]
        if isinstance(place[-1] if place else None, int):
            place = (*place[:-1], "[out of range]" if fault["type"] in _SIGNS else f"[{fault['type']}]")
        misspelt = fault["type"] == "missing" and any(
            other[:-1] == place[:-1] and f" {place[-1]}" in (error.remedy or "")
            for other, error in found.items()
        )
        if place not in found and not misspelt:
            found[place] = _input_error(fault, model, file)
    return list(found.values())


def _input_error(fault: ErrorDetails, model: type[Part], file: object) -> InputError:
    """A fault of a model as a message that names its place."""
    field = ""
    for step in fault["loc"]:
        field += f"[{step}]" if isinstance(step, int) else (f".{step}" if field else str(step))
    inner = fault.get("ctx", {}).get("error")
    if isinstance(inner, InputError):
        for one in inner.each:
            _place(one, file, field)
        return inner
    if fault["type"] == "string_pattern_mismatch":
        field = field.removesuffix(".[key]")
    message = _message(fault, model)
    value = fault.get("input")
    if not message.with_value:
        value = None
    return InputError(
        message.problem,
        file=file,
        field=field or None,
        value=value,
        limit=message.limit,
        remedy=message.remedy,
    )


def _message(fault: ErrorDetails, model: type[Part]) -> _Message:
    """What to say of a fault that pydantic found."""
    kind, context = fault["type"], fault.get("ctx", {})
    if kind in _UNKNOWN:
        return _unknown_key(model, fault["loc"], fault["input"])
    if kind in _SIGNS:
        # A count has no unit.
        key, sign = _SIGNS[kind]
        remedy = "mind the unit, which is in the name of the field"
        if isinstance(context[key], int):
            remedy = "give a number within the limit"
        return _Message("is out of range", f"{sign} {context[key]}", remedy)
    if kind in _TYPES:
        return _wrong_type(kind, fault["input"], _explained(model, fault["loc"], fault["input"]))
    if kind == "literal_error":
        expected = str(context.get("expected", ""))
        words = expected.replace("'", "").replace(" or ", ", ").split(", ")
        guess = did_you_mean(fault["input"], words)
        return _Message("is not one of the possible values", f"one of {expected}", guess)
    if kind in ("too_short", "too_long"):
        return _Message("has the wrong number of items", fault["msg"].split(" after ")[0])
    return {
        "missing": _Message("is required", "this key, with a value", "add it", with_value=False),
        "value_error": _Message(*_split(str(context.get("error")))),
        "finite_number": _Message("is not a finite number", "a finite number", "replace NaN or infinity"),
        "string_pattern_mismatch": _Message("is no name", f"what matches {context.get('pattern')}"),
        "string_too_long": _Message(
            "is too long", f"at most {context.get('max_length')} characters", "shorten it"
        ),
        "string_too_short": _Message(
            "is too short", f"{context.get('min_length')} characters or more", "write it"
        ),
    }.get(
        kind, _Message("cannot be taken", fault["msg"].removeprefix("Input should be "), "write it like that")
    )


def _split(words: str) -> tuple[str, str, str | None]:
    """What a check of a model said, as a fault, a limit and a remedy, which it may have put behind it."""
    problem, _, remedy = words.partition("; ")
    limit = "see the remedy" if remedy else "what the key is for"
    return problem, limit, remedy or "change it"


def _unknown_key(model: type[Part], place: tuple[int | str, ...], value: Any) -> _Message:
    explained = _explained(model, place, value)
    if explained is not None:
        return _Message("unknown key", "the keys that are known here", explained)
    allowed = _fields_at(model, place[:-1])
    guess = did_you_mean(place[-1], allowed)
    # A guess is worth more than a list that nobody reads.
    short = allowed and not (guess and len(allowed) > 25)
    limit = "one of " + ", ".join(allowed) if short else f"one of the {len(allowed)} keys that are known here"
    return _Message("unknown key", limit, guess or "remove it")


def _explained(model: type[Part], place: tuple[int | str, ...], value: Any) -> str | None:
    """What the model at a place says itself of a key."""
    owner = _model_at(model, place[:-1])
    return owner.explained(str(place[-1]), value) if owner and issubclass(owner, Part) else None


def _wrong_type(kind: str, value: Any, explained: str | None) -> _Message:
    limit = _TYPES[kind]
    if explained is not None:
        return _Message("has the wrong type", limit, explained)
    remedy: str | None = None
    if kind == "string_type":
        remedy = "write it in quotes"
    elif kind == "tuple_type" and isinstance(value, str) and any(letter.isalpha() for letter in value):
        limit, remedy = "an array", f'write it in brackets: ["{value}"]'
    elif isinstance(value, str):
        remedy = "write it without quotes, in the unit that the field's name says"
    if isinstance(value, list) and kind not in ("tuple_type", "list_type"):
        remedy = "give one value, not a list"
    return _Message("has the wrong type", limit, remedy)


_SIGNS = {
    "greater_than": ("gt", ">"),
    "greater_than_equal": ("ge", ">="),
    "less_than": ("lt", "<"),
    "less_than_equal": ("le", "<="),
}
"""Of a number out of range: where its limit stands, and its sign."""

_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
"""An unknown key, in a model and in a dataclass."""

_TYPES = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number that fits 64 bits",
    "string_type": "text",
    "bool_type": "true or false",
    "tuple_type": "an array, e.g. [0.0, 0.0, 0.6]",
    "list_type": "an array of tables, e.g. [[ride]]",
    "model_type": "a table",
    "dict_type": "a table",
}


def _fields_at(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    """Names of the fields that are allowed at a place in a model."""
    current = _model_at(model, location)
    if current is None:
        return []
    return list(current.model_fields) if issubclass(current, BaseModel) else [f.name for f in fields(current)]


def _model_at(model: type[BaseModel], location: tuple[int | str, ...]) -> type[Any] | None:
    """The model or dataclass that stands at a place in a model."""
    current: type[Any] | None = model
    for step in location:
        if isinstance(step, int) or current is None or not issubclass(current, BaseModel):
            continue
        annotation = current.model_fields.get(step)
        current = _model_in(annotation.annotation) if annotation else None
    return current


def _model_in(annotation: Any) -> type[Any] | None:
    if isinstance(annotation, type) and (issubclass(annotation, BaseModel) or is_dataclass(annotation)):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        model = _model_in(argument)
        if model is not None:
            return model
    return None
