"""Settings of the command line: ``--set ride.speed_kmh=70`` replaces what the file says.

A key is a dotted path. In an array of tables a step may be an index (``ride[0].speed_kmh``) or a
name (``ride.go20A.speed_kmh``); without either the setting goes to every table of the array. The
value is read as TOML, or else as text. What the values mean is judged by the models afterwards.
"""

import copy
import re
import tomllib
from collections.abc import Collection, Sequence
from typing import Any

from simrail.core.errors import InputError, did_you_mean, one_of

_STEP = re.compile(r"^([A-Za-z0-9_+-]+)(?:\[(\d+)\])?$")
_EXAMPLE = (
    "write e.g. --set ride[0].speed_kmh=70, --set monte_carlo.sensor_draws=20 or --set imu.axle.grade=ideal"
)


def override(
    data: dict[str, Any], settings: Sequence[str], *, tables: Collection[str] = ()
) -> dict[str, Any]:
    """Return a copy of raw scenario data with settings ``key=value`` applied in turn.

    One that names a table of ``tables`` begins it where the scenario has none.

    Raises
    ------
    InputError
        If a setting is no ``key=value``, or its key leads nowhere.
    """
    result = copy.deepcopy(data)
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals or not key.strip():
            raise InputError(
                "is not key=value", file="--set", value=setting, remedy=_EXAMPLE, limit="key=value"
            )
        steps: list[str | int] = []
        for step in key.strip().split("."):
            match = _STEP.match(step)
            if match is None:
                raise InputError(
                    "is not a dotted path of keys",
                    file="--set",
                    value=key,
                    remedy=_EXAMPLE,
                    limit="keys with dots between them",
                )
            steps.append(match[1])
            if match[2] is not None:
                steps.append(int(match[2]))
        if steps[0] in tables and len(steps) > 1 and isinstance(steps[1], str):
            result.setdefault(str(steps[0]), {})
        _set(result, steps, _value(text.strip()), key.strip())
    return result


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _set(place: Any, steps: list[str | int], value: Any, key: str) -> None:
    """Walk down the path and set the value at its end."""
    step, rest = steps[0], steps[1:]
    if isinstance(place, list):
        if isinstance(step, int):
            if step >= len(place):
                raise InputError(
                    "there is no such item",
                    file="--set",
                    field=key,
                    value=step,
                    limit=f"0 to {len(place) - 1}" if place else "the array is empty",
                )
            targets, rest = [place[step]], rest
        else:
            named = [item for item in place if isinstance(item, dict) and item.get("name") == step]
            if not named and rest:
                _judge_name(place, step, key)
            if named:
                targets = named
            else:
                targets, rest = list(place), steps
        if not rest:
            raise InputError(
                "sets a whole table", file="--set", field=key, remedy=_EXAMPLE, limit="one value of the table"
            )
        for target in targets:
            _set(target, rest, value, key)
        return
    if not isinstance(place, dict) or isinstance(step, int):
        raise InputError(
            "leads into something that is no table",
            file="--set",
            field=key,
            remedy=_EXAMPLE,
            limit="a key of a table",
        )
    if not rest:
        place[step] = value
        return
    if step not in place:
        if rest and isinstance(rest[0], int):
            raise InputError(
                "the scenario has no such array",
                file="--set",
                field=key,
                remedy=_EXAMPLE,
                limit="an array of the scenario",
            )
        guess = did_you_mean(step, map(str, place))
        if guess:
            raise InputError(
                "unknown key",
                file="--set",
                field=key,
                value=step,
                remedy=guess,
                limit="a key of the scenario",
            )
        place[step] = {}
    _set(place[step], rest, value, key)


def _judge_name(place: list[Any], step: str, key: str) -> None:
    """Refuse a step that is no key of any table of an array, and nearly the name of one."""
    tables = [item for item in place if isinstance(item, dict)]
    names = [str(item["name"]) for item in tables if "name" in item]
    guess = did_you_mean(step, names, cutoff=0.75)
    if guess and not any(step in item for item in tables):
        one_of(step, names, "nothing is called so", file="--set", field=key, remedy=guess)
