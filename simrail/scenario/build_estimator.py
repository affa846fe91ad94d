"""From a scenario's words to an estimator: its class by name or file, its options judged by their types.

A strange estimator in a person's own file is run here for the first time: what it does wrong is told,
not raised.

An option may be a file: where the class declares a type that has `from_file(path)`, the scenario gives a
path, seen from its own folder first, then from here, then among what is shipped: a copy of a shipped scenario
finds its files wherever it lies. Nothing is estimated here.
"""

import dataclasses
from pathlib import Path
from typing import Any, get_args, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.errors import PydanticUserError

from simrail.core.errors import InputError, did_you_mean
from simrail.core.toml_files import blame, existing_file, shipped_folder
from simrail.estimation.choose_odometry import NONE, TRUTH, odometry_named
from simrail.estimation.estimate import Estimator, description_of
from simrail.estimation.user_modules import class_named
from simrail.scenario.axes import each
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
    """Refuse an estimator that says nonsense of itself, or needs what the scenario lacks."""
    field = f"estimator[{method.index}]"
    with blame(scenario.file, f"{field}.method"):
        needs = description_of(estimator).needs
    lacking = lacks(scenario, needs)
    if not lacking:
        return
    need, limit, remedy = lacking
    # Where an option of that name asks for the sensor, the option may as well be given up.
    asked = method.part.options.get(need)
    remedy += f", or set {need} = false" if asked is True else ", or remove this estimator"
    with blame(scenario.file, f"{field}.options.{need}" if asked else f"{field}.method"):
        problem = f"the scenario has no {need.replace('_', ' ')}"
        raise InputError(problem, value=asked or method.part.method, limit=limit, remedy=remedy)


def lacks(scenario: Scenario, needs: tuple[str, ...]) -> tuple[str, str, str] | None:
    """The first of some needs that a scenario lacks, what it would take, and the remedy; None if none."""
    for need in needs:
        if need == "odometry":
            if NONE in each(scenario.spec.odometry):
                remedy = "add an [encoder] to the scenario, or name an odometry that needs none"
                return need, 'an odometry other than "none"', remedy
        elif getattr(scenario.spec, need) is None:
            return need, f"a scenario with a table [{need}]", f"add a [{need}] to the scenario"
    return None


def odometry_estimator(scenario: Scenario, name: str) -> Estimator | None:
    """The odometry that a scenario names; None where there is none to be run: ``"none"`` and ``"truth"``.

    Raises
    ------
    InputError
        If there is no such odometry, or it needs what the scenario lacks.
    """
    if name in (NONE, TRUTH):
        return None
    with blame(scenario.file, "odometry"):
        estimator = odometry_named(name, scenario.folder)
        lacking = lacks(scenario, description_of(estimator).needs)
        if lacking is not None:
            need, limit, remedy = lacking
            problem = f"the odometry needs {'an' if need[0] in 'aeiou' else 'a'} {need.replace('_', ' ')}"
            remedy += ', or set odometry = "truth" for an ablation, or "none"'
            raise InputError(problem, value=name, limit=limit, remedy=remedy)
    return estimator


def option_files(estimator: object) -> dict[str, str]:
    """What was read from files that options named, as text, by option."""
    if not dataclasses.is_dataclass(estimator):
        return {}
    values = {entry.name: getattr(estimator, entry.name) for entry in dataclasses.fields(estimator)}
    return {name: repr(value) for name, value in values.items() if hasattr(value, "from_file")}


REMOVED = {
    "backend": "remove it: kernels alone run; their filterpy twins are in the tests (tests/estimators/twins)"
}
"""Options that estimators once had, and what to do about each in a scenario of that time."""


def construct(known_class: type[Any], options: dict[str, Any], *, folder: Path | None = None) -> Estimator:
    """Make an estimator from its options, each judged against the type that its class declares.

    ``folder`` is where files that options name are looked for, before the working folder.
    """
    judged: object = known_class
    if not dataclasses.is_dataclass(judged):
        raise InputError(
            "is no dataclass, so its options cannot be judged",
            value=known_class.__qualname__,
            remedy="make the estimator a frozen dataclass, as in 'simrail new estimator'",
            limit="a dataclass",
        )
    known = {entry.name for entry in dataclasses.fields(judged) if entry.init and entry.name != "causal"}
    types = get_type_hints(known_class)
    values: dict[str, Any] = {}
    for name, value in options.items():
        if name not in known:
            raise InputError(
                f"{known_class.__name__} has no such option",
                field=name,
                value=value,
                limit="one of " + ", ".join(sorted(known)) if known else "it has no options",
                remedy=REMOVED.get(name) or did_you_mean(name, known) or "remove it",
            )
        values[name] = _option(types.get(name, Any), name, value, folder)
    try:
        made: Estimator = known_class(**values)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{known_class.__name__} refuses them: {error}",
            value=options,
            limit="options that the class takes",
            remedy="mend them",
        ) from error
    return made


def _option(kind: Any, name: str, value: Any, folder: Path | None) -> Any:
    """Judge one option against the type that the class declares for it; tuples may be given as arrays."""
    of_file = next((part for part in (kind, *get_args(kind)) if hasattr(part, "from_file")), None)
    if of_file is not None:
        if not isinstance(value, str):
            raise InputError("has the wrong type", field=name, value=value, limit="the path of a file")
        with blame(None, name):
            return of_file.from_file(existing_file(value, folder, also=shipped_folder()))
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
