"""From a scenario's words to an estimator: its class by name or file, its options judged by their types.

A strange estimator in a person's own file is run here for the first time: what it does wrong is told,
not raised.

An option may be a file: where the class declares a type that has `from_file(path)`, the scenario gives a
path, seen from its own folder first, then from here, then among what is shipped: a copy of a shipped scenario
finds its files wherever it lies. Nothing is estimated here.
"""

from __future__ import annotations

import dataclasses
import difflib
from pathlib import Path
from typing import Any, get_args, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.errors import PydanticUserError

from simrail.core.errors import InputError
from simrail.core.toml_files import blame, shipped_folder
from simrail.estimation.estimate import SENSORS, Estimator, estimator_class
from simrail.estimation.user_modules import load_own
from simrail.scenario.cells import Method
from simrail.scenario.scenario import Scenario


def estimator_of(scenario: Scenario, method: Method) -> Estimator:
    """Make an estimator from its class and the options of the scenario.

    Raises
    ------
    InputError
        If no such estimator is registered, it has no such option (the message lists those that it
        has), an option has a value that it cannot have, or it needs a sensor that the scenario lacks.
    """
    field = f"estimator[{method.index}]"
    with blame(scenario.file, f"{field}.method"):
        known_class = class_named(method.part.method, scenario.folder)
    with blame(scenario.file, f"{field}.options"):
        estimator = construct(known_class, method.part.options, folder=scenario.folder)
    _judge_needs(scenario, method, estimator)
    return estimator


def _judge_needs(scenario: Scenario, method: Method, estimator: Estimator) -> None:
    """Refuse an estimator that needs a sensor which the scenario lacks."""
    for need in getattr(estimator, "needs", ()):
        field = f"estimator[{method.index}]"
        if need not in SENSORS:
            raise InputError(
                "needs what no scenario has",
                file=scenario.file,
                field=f"{field}.method",
                value=need,
                limit="one of " + ", ".join(SENSORS),
                remedy="mend 'needs' of the estimator",
            )
        if getattr(scenario.spec, need) is not None:
            continue
        # Where an option of that name asks for the sensor, the option may as well be given up.
        asked = method.part.options.get(need)
        raise InputError(
            f"the scenario has no {need.replace('_', ' ')}",
            file=scenario.file,
            field=f"{field}.options.{need}" if asked else f"{field}.method",
            value=asked or method.part.method,
            limit=f"a scenario with a table [{need}]",
            remedy=f"add a [{need}] to the scenario, or "
            + (f"set {need} = false" if asked is True else "remove this estimator"),
        )


def class_named(name: str, folder: Path | None) -> type[Estimator]:
    """Class of a method: a registered name, or ``"file.py:Class"`` for one's own file."""
    path_name, colon, class_name = name.rpartition(":")
    if not colon or not path_name.endswith(".py"):
        return estimator_class(name)
    found = getattr(load_own(_existing(path_name, folder), shown=path_name), class_name, None)
    if not isinstance(found, type) or not callable(getattr(found, "estimate", None)):
        raise InputError(
            "the file has no such estimator class",
            value=class_name,
            limit="a class with a method estimate(recording)",
            remedy="see 'simrail new estimator NAME'",
        )
    own: type[Estimator] = found
    return own


def _existing(name: str, folder: Path | None, *, also: Path | None = None) -> Path:
    """A file by its path, seen from a folder (that of the scenario), from here, or from one more folder."""
    for candidate in (*([folder / name] if folder else []), Path(name), *([also / name] if also else [])):
        if candidate.is_file():
            return candidate
    near = difflib.get_close_matches(name, _relative(also), n=1) if also else []
    raise InputError(
        "no such file",
        value=name,
        remedy="mend the path; it is seen from the scenario's folder"
        + (f" (shipped: {near[0]})" if near else ""),
    )


def _relative(folder: Path) -> list[str]:
    """TOML files in the folders of a folder, as a scenario names them."""
    return [path.relative_to(folder).as_posix() for path in sorted(folder.glob("*/*.toml"))]


def option_files(estimator: Estimator) -> dict[str, str]:
    """What was read from files that options named, as text, by option."""
    if not dataclasses.is_dataclass(estimator):
        return {}
    values = {entry.name: getattr(estimator, entry.name) for entry in dataclasses.fields(estimator)}
    return {name: repr(value) for name, value in values.items() if hasattr(value, "from_file")}


REMOVED = {
    "backend": "remove it: kernels alone run; their filterpy twins are in the tests (tests/estimators/twins)"
}
"""Options that estimators once had, and what to do about each in a scenario of that time."""


def construct(
    known_class: type[Estimator], options: dict[str, Any], *, folder: Path | None = None
) -> Estimator:
    """Make an estimator from its options, each judged against the type that its class declares.

    ``folder`` is where files that options name are looked for, before the working folder.
    """
    if not dataclasses.is_dataclass(known_class):
        raise InputError(
            "is no dataclass, so its options cannot be judged",
            value=known_class.__qualname__,
            remedy="make the estimator a frozen dataclass, as in 'simrail new estimator'",
        )
    known = {entry.name for entry in dataclasses.fields(known_class) if entry.init and entry.name != "causal"}
    types = get_type_hints(known_class)
    values: dict[str, Any] = {}
    for name, value in options.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            raise InputError(
                f"{known_class.__name__} has no such option",
                field=name,
                value=value,
                limit="one of " + ", ".join(sorted(known)) if known else "it has no options",
                remedy=REMOVED.get(name) or (f"did you mean {near[0]}?" if near else "remove it"),
            )
        values[name] = _option(types.get(name, Any), name, value, folder)
    try:
        made: Estimator = known_class(**values)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError(f"{known_class.__name__} refuses them: {error}", value=options) from error
    return made


def _option(kind: Any, name: str, value: Any, folder: Path | None) -> Any:
    """Judge one option against the type that the class declares for it; tuples may be given as arrays."""
    of_file = next((part for part in (kind, *get_args(kind)) if hasattr(part, "from_file")), None)
    if of_file is not None:
        if not isinstance(value, str):
            raise InputError("has the wrong type", field=name, value=value, limit="the path of a file")
        with blame(None, name):
            return of_file.from_file(_existing(value, folder, also=shipped_folder()))
    if isinstance(value, list):
        value = tuple(tuple(item) if isinstance(item, list) else item for item in value)
    try:
        adapter = TypeAdapter(kind, config=ConfigDict(strict=True, allow_inf_nan=False))
    except PydanticUserError:
        return value
    try:
        return adapter.validate_python(value)
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(
            "has the wrong type or value",
            field=name,
            value=value,
            limit=first["msg"].removeprefix("Input should be "),
        ) from None
