"""Estimator classes by name; those of a person's own Python files are loaded, and carried to other processes.

A file becomes a module named after its content, so two files, or two versions of one, never share a
module. An instance of a class in it can be unpickled where `install` has been called with the file.
"""

import hashlib
import sys
from pathlib import Path
from types import ModuleType

from simrail.core.errors import InputError
from simrail.core.toml_files import existing_file
from simrail.estimation.estimate import Estimator, estimator_class

_PREFIX = "simrail_own_"
_SOURCES: dict[str, bytes] = {}
"""Content of each file that was loaded, by the name of its module."""


def class_named(name: str, folder: Path | None) -> type[Estimator]:
    """Class of a method: a registered name, or ``"file.py:Class"`` for one's own file.

    Parameters
    ----------
    name : str
        As a scenario has it.
    folder : Path, optional
        Where files are looked for first, before the working folder.

    Raises
    ------
    InputError
        If nothing of that name is registered, or the file is missing, cannot be imported, or has no such
        class.
    """
    path_name, colon, class_name = name.rpartition(":")
    if not colon or not path_name.endswith(".py"):
        return estimator_class(name)
    file = existing_file(path_name, folder)
    try:
        module = _module(file.read_bytes(), str(file))
    except Exception as error:
        raise InputError(
            f"cannot be imported: {type(error).__name__}: {error}",
            value=path_name,
            limit="a Python file that can be imported",
            remedy="mend it; python FILE shows where",
        ) from error
    found = getattr(module, class_name, None)
    if not isinstance(found, type) or not callable(getattr(found, "estimate", None)):
        raise InputError(
            "the file has no such estimator class",
            value=class_name,
            limit="a class with a method estimate(recording)",
            remedy="see 'simrail new estimator NAME'",
        )
    return found


def sources_of(things: list[object]) -> dict[str, bytes]:
    """File path -> content of every own file that the classes of these things come from."""
    modules = {type(thing).__module__ for thing in things}
    return {str(sys.modules[name].__file__): _SOURCES[name] for name in sorted(modules & _SOURCES.keys())}


def install(sources: dict[str, bytes]) -> None:
    """Load own files from their content, in a process that may not have them."""
    for path, source in sources.items():
        _module(source, path)


def _module(source: bytes, path: str) -> ModuleType:
    name = f"{_PREFIX}{hashlib.sha256(source).hexdigest()[:16]}"
    if name not in sys.modules:
        module = sys.modules[name] = ModuleType(name)  # dataclasses look their module up there
        module.__file__, _SOURCES[name] = path, source
        try:
            exec(compile(source, path, "exec"), module.__dict__)
        except BaseException:
            del sys.modules[name]
            raise
    return sys.modules[name]
