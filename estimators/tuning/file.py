"""What a search has found, as a file, and the trajectory smoother's tuning that is read from it.

    [hyperparameters]          # all 13; SI
    roll_rad2ps3 = 1e-2
    ...
    [curve_hyperparameters]    # optional: for transitions and curves, the first then being for straights
    ...
    [search]                   # optional: how they were found
    method = "cml"
    ...
    [status]                   # optional: what the search knows of each; [curve_status] of the second set
    roll_rad2ps3 = "identified"
    ...

Parameters that lie outside the box of their own search are refused: somebody has changed one of the two. For
parameters set by hand, leave [search] out. Not here: the search (`simrail.estimators.tuning.tune`).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.tuning.space import NAMES, STATUSES, SearchSpace

from simrail.core.atomic_files import whole_file
from simrail.core.errors import InputError
from simrail.core.toml_files import toml_text

REMEDY = "tune anew with 'simrail tune', or leave out [search] for values set by hand"


@dataclass(frozen=True)
class Search:
    """How hyper-parameters were found.

    Attributes
    ----------
    method : str
        ``"cml"`` or ``"kom"``.
    objective : tuple of float
        What was reached: of the first set, and of that for transitions and curves if there is one.
    unit : str
        What the objective is.
    space : SearchSpace
        Where was searched.
    seed, evaluations : int
        Seed of the search, and how often it evaluated the objective.
    fitted_on : tuple of str
        The recordings, in words.
    command : str
        What makes the file again; empty if no command made it.
    finished : bool
        False for the best of a search that was not over.
    """

    method: str
    objective: tuple[float, ...]
    unit: str
    space: SearchSpace
    seed: int
    evaluations: int
    fitted_on: tuple[str, ...] = ()
    command: str = ""
    finished: bool = True


@dataclass(frozen=True)
class Tuning:
    """Hyper-parameters and where they come from.

    Attributes
    ----------
    hyperparameters : Hyperparameters
        For the whole track, or its straights.
    curve_hyperparameters : Hyperparameters, optional
        For its transitions and curves.
    search : Search, optional
        How they were found; None for values set by hand.
    status, curve_status : mapping of str to str, optional
        What the search knows of each hyper-parameter of the first and of the second set: one of
        `simrail.estimators.tuning.space.STATUSES`. It changes no estimate.
    """

    hyperparameters: Hyperparameters = field(default_factory=Hyperparameters)
    curve_hyperparameters: Hyperparameters | None = None
    search: Search | None = None
    status: Mapping[str, str] | None = None
    curve_status: Mapping[str, str] | None = None

    @classmethod
    def from_file(cls, path: str | Path) -> Tuning:
        """Read a file.

        Raises
        ------
        InputError
            Naming the file, the field, its value, the limit and the remedy: a file that is not there, a table
            or name that is missing or unknown, a number that is none, not positive or outside the box.
        """
        file = Path(path)
        tables = _tables(file)
        search = _search(tables["search"], file) if "search" in tables else None
        sets = [_hyperparameters(tables[name], name, search, file) for name in SETS if name in tables]
        for name in (name for name in STATUS if name in tables):
            _judge_status(tables[name], name, file)
        statuses = [tables.get(name) for name in STATUS]
        return cls(sets[0], sets[1] if len(sets) > 1 else None, search, *statuses)

    def text(self) -> str:
        """The file's text; numbers read back bit by bit."""
        tables: dict[str, Mapping[str, Any] | None] = {
            name: None if getattr(self, name) is None else asdict(getattr(self, name)) for name in SETS
        }
        if self.search is not None:
            search = asdict(self.search)
            tables["search"] = search | search.pop("space")
        return _text(tables | {name: getattr(self, name) for name in STATUS})

    def write(self, path: str | Path) -> None:
        """Write the file: whole or not at all."""
        with whole_file(Path(path)) as stream:
            stream.write(self.text().encode())


@dataclass(frozen=True)
class TuningResult:
    """What a search has found for any tunable estimator: parameters by name, and how.

    Attributes
    ----------
    values : tuple of mapping of str to float
        Of the first set of parameters, and of that for transitions and curves if there is one.
    status : tuple of mapping of str to str
        What the search knows of each parameter, set by set; empty if it has not been judged.
    method, objective, unit, seed, evaluations, fitted_on, command, finished
        See `Search`.
    settings : mapping of str
        Settings of the search that are the estimator's own, e.g. those of `SearchSpace`.
    """

    method: str
    unit: str
    seed: int
    settings: Mapping[str, Any]
    values: tuple[Mapping[str, float], ...] = ()
    status: tuple[Mapping[str, str], ...] = ()
    objective: tuple[float, ...] = ()
    evaluations: int = 0
    fitted_on: tuple[str, ...] = ()
    command: str = ""
    finished: bool = False

    def extended(self, values: Mapping[str, float], objective: float, evaluations: int) -> TuningResult:
        """The result with one more set."""
        return replace(
            self,
            values=(*self.values, values),
            objective=(*self.objective, objective),
            evaluations=self.evaluations + evaluations,
        )

    def text(self) -> str:
        """The file's text, as `Tuning.text` has it."""
        own = {entry.name for entry in fields(Search)} - {"space"}
        search = {entry.name: getattr(self, entry.name) for entry in fields(Search) if entry.name in own}
        return _text(
            dict(zip(SETS, self.values, strict=False))
            | {"search": {**search, **self.settings}}
            | dict(zip(STATUS, self.status, strict=False))
        )

    def write(self, path: str | Path) -> None:
        """Write the file: whole or not at all."""
        with whole_file(Path(path)) as stream:
            stream.write(self.text().encode())


def _text(tables: Mapping[str, Mapping[str, Any] | None]) -> str:
    """Text of a tuning file: the command that made it, if there is one, and the tables that there are."""
    command = (tables.get("search") or {}).get("command")
    return (f"# Made by: {command}\n\n" if command else "") + toml_text(tables)


SETS = ("hyperparameters", "curve_hyperparameters")
"""Tables of hyper-parameters."""

STATUS = ("status", "curve_status")
"""Tables of what is known of each."""


def _tables(file: Path) -> dict[str, dict[str, Any]]:
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", file=file.name, value=str(file), remedy="mend the path"
        ) from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"is no TOML: {error}", file=file.name, remedy=REMEDY) from error
    _judge_names(data, (*SETS, "search", *STATUS), needed=SETS[:1], file=file, what="table")
    for name, table in data.items():
        if not isinstance(table, dict):
            raise InputError("is no table", file=file.name, field=name, value=table, remedy=f"write [{name}]")
    return data


def _judge_names(
    data: Mapping[str, Any],
    allowed: tuple[str, ...],
    *,
    needed: tuple[str, ...],
    file: Path,
    what: str,
    prefix: str = "",
) -> None:
    """Refuse a name that is not allowed, and one that is needed and missing."""
    for name in [*data, *needed]:
        if name not in allowed or name not in data:
            raise InputError(
                f"no such {what}" if name not in allowed else f"the {what} is missing",
                file=file.name,
                field=prefix + name,
                value=data.get(name),
                limit=f"the {what}s " + ", ".join(allowed),
                remedy=REMEDY if name in allowed else "remove it",
            )


def _judge_status(table: dict[str, Any], name: str, file: Path) -> None:
    _judge_names(table, NAMES, needed=NAMES, file=file, what="hyper-parameter", prefix=f"{name}.")
    for parameter, status in table.items():
        if status not in STATUSES:
            raise InputError(
                "is no status",
                file=file.name,
                field=f"{name}.{parameter}",
                value=status,
                limit="one of " + ", ".join(STATUSES),
                remedy="tune anew with 'simrail tune', or leave the table out",
            )


def _hyperparameters(table: dict[str, Any], name: str, search: Search | None, file: Path) -> Hyperparameters:
    _judge_names(table, NAMES, needed=NAMES, file=file, what="hyper-parameter", prefix=f"{name}.")
    try:
        hyperparameters = Hyperparameters(**table)
        if search is not None:
            search.space.check(hyperparameters)
    except InputError as error:
        raise InputError(
            error.problem,
            file=file.name,
            field=f"{name}.{error.field}",
            value=error.value,
            limit=error.limit,
            remedy=REMEDY,
        ) from error
    return hyperparameters


KINDS: dict[str, tuple[str, type | tuple[type, ...], bool]] = {
    "method": ("text", str, False),
    "objective": ("an array of numbers", (int, float), True),
    "unit": ("text", str, False),
    "box": ("an array of two numbers", (int, float), True),
    "constrained": ("an array of axes", str, True),
    "position_m2": ("a number", (int, float), False),
    "seed": ("a whole number", int, False),
    "evaluations": ("a whole number", int, False),
    "fitted_on": ("an array of text", str, True),
    "command": ("text", str, False),
    "finished": ("true or false", bool, False),
}
"""Of the table [search]: what each entry is in words, its type, and whether it is an array of them."""


def _search(table: dict[str, Any], file: Path) -> Search:
    needed = tuple(e.name for e in fields(Search) if e.default is MISSING and e.name != "space")
    needed += ("box", "constrained")
    _judge_names(table, tuple(KINDS), needed=needed, file=file, what="entry", prefix="search.")
    values: dict[str, Any] = {}
    for name, value in table.items():
        words, kind, many = KINDS[name]
        items = value if many else [value]
        good = isinstance(items, list) and all(isinstance(item, kind) for item in items)
        good = good and (kind is bool or not any(isinstance(item, bool) for item in items))
        if not good or (name == "box" and len(items) != 2):
            raise InputError(
                "has the wrong type", file=file.name, field=f"search.{name}", value=value, limit=words
            )
        values[name] = tuple(items) if many else value
    try:
        space = SearchSpace(
            **{entry.name: values.pop(entry.name) for entry in fields(SearchSpace) if entry.name in values}
        )
    except InputError as error:
        error.file, error.field = file.name, f"search.{error.field}"
        raise
    return Search(space=space, **values)
