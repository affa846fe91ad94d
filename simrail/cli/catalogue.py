"""What there is to choose from: scenarios, tracks, vehicles, IMUs, estimators, with a title each.

Titles are read without importing any of it, so that the answer comes at once.
"""

from __future__ import annotations

import ast
import tomllib
from importlib.metadata import EntryPoint, entry_points
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

FOLDERS = {"scenarios": "", "tracks": "tracks", "vehicles": "vehicles", "imus": "imus"}


def catalogue() -> dict[str, dict[str, str]]:
    """Return name -> title for each kind: scenarios, tracks, vehicles, imus, estimators."""
    home = Path(str(files("simrail.scenarios")))
    found = {
        kind: {path.stem: _toml_title(path) for path in sorted((home / folder).glob("*.toml"))}
        for kind, folder in FOLDERS.items()
    }
    entries = sorted(entry_points(group="simrail.estimators"), key=lambda entry: entry.name)
    found["estimators"] = {entry.name: _class_title(entry) for entry in entries}
    return found


def _toml_title(path: Path) -> str:
    try:
        title = tomllib.loads(path.read_text(encoding="utf-8")).get("title", "")
    except (OSError, ValueError):
        return "(cannot be read)"
    return str(title)


def _class_title(entry: EntryPoint) -> str:
    """First line of a class's docstring, read from its source."""
    try:
        spec = find_spec(entry.module)
        source = Path(spec.origin).read_text(encoding="utf-8") if spec and spec.origin else ""
    except (ImportError, OSError, ValueError):
        return "(not installed)"
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ClassDef) and node.name == entry.attr:
            return (ast.get_docstring(node) or "").split("\n")[0]
    return ""
