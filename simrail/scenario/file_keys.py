"""Every key of every kind of file: a JSON schema for editors, and rows for a reference.

Both are made of the models that judge the files, so that they cannot tell otherwise than the judge. What a
JSON schema cannot say (that a transition joins what it touches) the judge alone knows.
"""

import json
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

from simrail.core.toml_files import Part
from simrail.recording.files.ride_file import RideFile
from simrail.recording.sheets.imu_file import ImuFile
from simrail.scenario.key_words import models_in, words_of
from simrail.scenario.scenario import ScenarioFile
from simrail.scoring.published_spectra import SpectrumFile
from simrail.track.file import TrackFile
from simrail.vehicle.file import VehicleFile

FILES: dict[str, type[Part]] = {
    "scenario": ScenarioFile,
    "track": TrackFile,
    "vehicle": VehicleFile,
    "imu": ImuFile,
    "ride": RideFile,
    "spectrum": SpectrumFile,
}
"""The kinds of files that a person writes, and the models that judge them."""

DIALECT = "https://json-schema.org/draft/2020-12/schema"


class Key(NamedTuple):
    """One key of a file.

    Attributes
    ----------
    table : str
        The table that it stands in, e.g. ``"[[ride]]"``; empty for those above all tables.
    name : str
        The key.
    form : str
        What is written there.
    default : str
        What holds if it is left out; empty if it must be there, or if nothing does.
    required : bool
        Whether it must be there.
    meaning : str
        What it says.
    """

    table: str
    name: str
    form: str
    default: str
    required: bool
    meaning: str


@cache
def schema_of(kind: str) -> dict[str, Any]:
    """JSON schema of a kind of file, a key of `FILES`."""
    schema = FILES[kind].model_json_schema()
    for name, model in models_in(FILES[kind]).items():
        table = schema if model is FILES[kind] else schema["$defs"].get(name, {})
        for key, words in words_of(model).items():
            table.get("properties", {}).get(key, {}).setdefault("description", words)
    return {"$schema": DIALECT, "$id": f"simrail/{kind}.schema.json", **schema}


def schema_text(kind: str) -> str:
    """The schema as it is shipped."""
    return json.dumps(schema_of(kind), indent=1, ensure_ascii=False) + "\n"


def keys_of(kind: str) -> list[Key]:
    """Every key of a kind of file, those above all tables first."""
    schema = schema_of(kind)
    return list(_keys(schema, schema.get("$defs", {}), ""))


def _keys(table: dict[str, Any], known: dict[str, Any], place: str, shown: str = "") -> Iterator[Key]:
    below: list[tuple[dict[str, Any], str, str]] = []
    for name, entry in table.get("properties", {}).items():
        inner, several = _table_of(entry, known)
        required = name in table.get("required", [])
        default = "" if required or entry.get("default") is None else json.dumps(entry["default"])
        if inner is None or not inner.get("properties"):
            form = _form(entry, known)
        else:
            path = f"{place}.{name}".lstrip(".")
            below.append((inner, path, f"[[{path}]]" if several else f"[{path}]"))
            form, default = "tables" if several else "table", ""
        yield Key(shown, name, form, default, required, entry.get("description", ""))
    for inner, path, brackets in below:
        yield from _keys(inner, known, path, brackets)


def _table_of(entry: dict[str, Any], known: dict[str, Any]) -> tuple[dict[str, Any] | None, bool]:
    """The table that an entry stands for, if it does, and whether there may be several of it."""
    if "$ref" in entry:
        return known[entry["$ref"].rpartition("/")[2]], False
    if isinstance(entry.get("items"), dict):
        return _table_of(entry["items"], known)[0], True
    for choice in entry.get("anyOf", []):
        inner, several = _table_of(choice, known)
        if inner is not None:
            return inner, several
    return None, False


def _form(entry: dict[str, Any], known: dict[str, Any]) -> str:
    """What is written there, in words."""
    if "$ref" in entry:
        return _form(known[entry["$ref"].rpartition("/")[2]], known)
    if "const" in entry:
        return json.dumps(entry["const"])
    if "enum" in entry:
        return "one of " + ", ".join(json.dumps(word) for word in entry["enum"])
    if "anyOf" in entry:
        if _is_listed(entry):
            return f"{_form(entry['anyOf'][0], known)}; a list of such; or a distribution"
        forms = dict.fromkeys(_form(choice, known) for choice in entry["anyOf"])
        return " or ".join(form for form in forms if form != "nothing")
    kind = entry.get("type", "any value")
    if kind == "array":
        fixed = entry.get("prefixItems")
        items = fixed[0] if fixed else entry.get("items") or {}
        same = entry.get("minItems") == entry.get("maxItems")
        exactly = len(fixed) if fixed else entry.get("maxItems", 0) * same
        return f"list of {f'{exactly} ' if exactly else ''}{_form(items, known)}"
    words = {"string": "text", "number": "number", "integer": "whole number", "boolean": "true or false"}
    return {"null": "nothing", "object": "table"}.get(kind) or words.get(kind, kind) + _limits(entry)


def _is_listed(entry: dict[str, Any]) -> bool:
    return any("uniform" in choice.get("properties", {}) for choice in entry["anyOf"])


def _limits(entry: dict[str, Any]) -> str:
    signs = {"exclusiveMinimum": ">", "minimum": ">=", "exclusiveMaximum": "<", "maximum": "<="}
    limits = [f"{sign} {entry[key]:g}" for key, sign in signs.items() if key in entry]
    return " " + " and ".join(limits) if limits else ""
