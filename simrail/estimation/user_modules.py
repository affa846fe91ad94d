"""Estimator classes by name; those of a person's own Python files are loaded, and carried to other processes.

A file becomes a module named after its content, so two files, or two versions of one, never share a
module. An instance of a class in it can be unpickled where `install` has been called with the file.
"""

import hashlib
import sys
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

from simrail.core.errors import InputError
from simrail.core.toml_files import existing_file
from simrail.estimation.estimate import Estimator, estimator_class

_PREFIX = "simrail_own_"


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
    found = getattr(load_own(existing_file(path_name, folder), shown=path_name), class_name, None)
    if not isinstance(found, type) or not callable(getattr(found, "estimate", None)):
        raise InputError(
            "the file has no such estimator class",
            value=class_name,
            limit="a class with a method estimate(recording)",
            remedy="see 'simrail new estimator NAME'",
        )
    own: type[Estimator] = found
    return own


def load_own(path: Path, *, shown: str) -> ModuleType:
    """The module of a file; loaded once per content.

    Parameters
    ----------
    path : Path
        The file.
    shown : str
        How messages call it.

    Raises
    ------
    InputError
        If it cannot be imported.
    """
    try:
        return _module(path.read_bytes(), str(path))
    except Exception as error:
        raise InputError(f"cannot be imported: {type(error).__name__}: {error}", value=shown) from error


def sources_of(things: list[object]) -> dict[str, bytes]:
    """File path -> content of every own file that the classes of these things come from."""
    modules = {type(thing).__module__ for thing in things}
    found = [sys.modules[name] for name in sorted(modules) if name.startswith(_PREFIX)]
    return {str(module.__file__): module.__loader__.source for module in found}  # type: ignore[union-attr]


def install(sources: dict[str, bytes]) -> None:
    """Load own files from their content, in a process that may not have them."""
    for path, source in sources.items():
        _module(source, path)


class _Loader:
    """Runs a module from the content of its file, which it keeps."""

    def __init__(self, source: bytes, path: str) -> None:
        self.source, self.path = source, path

    def create_module(self, spec: object) -> None:
        """Leave the making of the module to the import system."""

    def exec_module(self, module: ModuleType) -> None:
        """Run the content."""
        module.__file__ = self.path
        exec(compile(self.source, self.path, "exec"), module.__dict__)


def _module(source: bytes, path: str) -> ModuleType:
    name = f"{_PREFIX}{hashlib.sha256(source).hexdigest()[:16]}"
    if name not in sys.modules:
        spec = spec_from_loader(name, _Loader(source, path))  # type: ignore[arg-type]
        assert spec is not None
        module = module_from_spec(spec)
        sys.modules[name] = module  # dataclasses look their module up there
        try:
            _Loader(source, path).exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
    return sys.modules[name]
