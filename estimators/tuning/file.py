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

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.tuning.space import NAMES, STATUSES, SearchSpace

from simrail.core.atomic_files import whole_file
from simrail.core.errors import InputError
from simrail.core.toml_files import Part, blame, judge, read_toml, toml_text

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
        tables = judge(_Tables, read_toml(file), file=file.name)
        with blame(file.name):
            search = None if tables.search is None else tables.search.search()
            sets = [_hyperparameters(getattr(tables, name), name, search) for name in SETS]
            for name in STATUS:
                _judge_status(getattr(tables, name), name)
        return cls(sets[0] or Hyperparameters(), sets[1], search, tables.status, tables.curve_status)


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
        """The file's text; numbers read back bit by bit."""
        own = [entry.name for entry in fields(Search) if entry.name != "space"]
        tables = {
            **dict(zip(SETS, self.values, strict=False)),
            "search": {name: getattr(self, name) for name in own} | dict(self.settings),
            **dict(zip(STATUS, self.status, strict=False)),
        }
        return (f"# Made by: {self.command}\n\n" if self.command else "") + toml_text(tables)

    def write(self, path: str | Path) -> None:
        """Write the file: whole or not at all."""
        with whole_file(Path(path)) as stream:
            stream.write(self.text().encode())


SETS = ("hyperparameters", "curve_hyperparameters")
"""Tables of hyper-parameters."""

STATUS = ("status", "curve_status")
"""Tables of what is known of each."""


class _SearchTable(Part):
    """Table [search]: a `Search`, whose space lies flat in it."""

    method: str
    objective: tuple[float, ...]
    unit: str
    box: tuple[float, float]
    constrained: tuple[str, ...]
    position_m2: float | None = None
    seed: int
    evaluations: int
    fitted_on: tuple[str, ...] = ()
    command: str = ""
    finished: bool = True

    def search(self) -> Search:
        """The same as a noun."""
        entries = self.model_dump()
        with blame(None, "search"):
            space = SearchSpace(**{entry.name: entries.pop(entry.name) for entry in fields(SearchSpace)})
        return Search(space=space, **entries)


class _Tables(Part):
    """Tables of a tuning file."""

    hyperparameters: dict[str, Any]
    curve_hyperparameters: dict[str, Any] | None = None
    search: _SearchTable | None = None
    status: dict[str, Any] | None = None
    curve_status: dict[str, Any] | None = None


def _judge_names(table: Mapping[str, Any], name: str) -> None:
    """Refuse a table that does not name each hyper-parameter."""
    for parameter in [*table, *NAMES]:
        if parameter not in NAMES or parameter not in table:
            is_unknown = parameter not in NAMES
            raise InputError(
                "no such hyper-parameter" if is_unknown else "the hyper-parameter is missing",
                field=f"{name}.{parameter}",
                value=table.get(parameter),
                limit="the hyper-parameters " + ", ".join(NAMES),
                remedy="remove it" if is_unknown else REMEDY,
            )


def _judge_status(table: Mapping[str, Any] | None, name: str) -> None:
    if table is None:
        return
    _judge_names(table, name)
    for parameter, status in table.items():
        if status not in STATUSES:
            raise InputError(
                "is no status",
                field=f"{name}.{parameter}",
                value=status,
                limit="one of " + ", ".join(STATUSES),
                remedy="tune anew with 'simrail tune', or leave the table out",
            )


def _hyperparameters(
    table: Mapping[str, Any] | None, name: str, search: Search | None
) -> Hyperparameters | None:
    if table is None:
        return None
    _judge_names(table, name)
    with blame(None, name):
        try:
            hyperparameters = Hyperparameters(**table)
            if search is not None:
                search.space.check(hyperparameters)
        except InputError as error:
            error.remedy = REMEDY
            raise
    return hyperparameters
