"""What a search can find of an estimator: named parameters within boxes, and what says how good they are.

An estimator in one file becomes tunable by `parameters` and one of two verbs: `likelihood`, which judges
values by the recordings alone (constrained maximum likelihood, ``cml``), and `reference_error`, which judges
them against a reference that is handed in (known output, ``kom``). `simrail tune` asks for nothing else.

Not here: the search (`simrail.estimators.tuning.tune`).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

import pandas as pd

from simrail.core.errors import InputError
from simrail.recording.recording import Recording


@dataclass(frozen=True)
class Parameter:
    """A number that is searched.

    Attributes
    ----------
    name, unit : str
        What it is called in files, and its unit.
    lower, upper : float
        Its box. A parameter with ``lower == upper`` is held there.
    start : float
        Where a search begins.
    scale : str
        ``"log"`` if it is searched in its logarithm (positive, over decades), or ``"linear"``.
    at_most : (str, float), optional
        Name of another parameter and a share: the value is at most that share of the other's. Both are
        searched in their logarithm, and the other has no such bound itself.
    """

    name: str
    unit: str
    lower: float
    upper: float
    start: float
    scale: Literal["log", "linear"] = "log"
    at_most: tuple[str, float] | None = None

    def __post_init__(self) -> None:
        least = 0.0 if self.scale == "log" else -math.inf
        if not least < self.lower <= self.upper < math.inf:
            raise InputError(
                "is no box",
                field=self.name,
                value=[self.lower, self.upper],
                limit="0 < lower <= upper" if self.scale == "log" else "lower <= upper",
            )

    @property
    def is_held(self) -> bool:
        """True if there is nothing to search."""
        return self.lower == self.upper


class Objective(Protocol):
    """What a search minimises."""

    @property
    def unit(self) -> str:
        """What its values are, in words, e.g. ``"negative log-likelihood per sample"``."""
        ...

    def value(self, values: Mapping[str, float]) -> float:
        """Of a value for each parameter; not finite where the method breaks down."""
        ...


@runtime_checkable
class Tunable(Protocol):
    """An estimator, or a part of one, whose parameters can be searched.

    It is `ByLikelihood`, `ByReference` or both.

    An estimator with several sets of parameters, each searched by itself, or with settings of its own for the
    search, has instead a verb ``tunables(settings)``: a `Tunable` for each set by name (at most two, the
    second for transitions and curves), from the settings (mapping of str) that a user has given.
    """

    def parameters(self) -> Sequence[Parameter]:
        """What is searched, in a fixed order."""
        ...


@runtime_checkable
class ByLikelihood(Tunable, Protocol):
    """Judged by what was recorded, and nothing else."""

    def likelihood(self, recordings: Sequence[Recording]) -> Objective:
        """What is minimised on recordings taken together, e.g. their negative log-likelihood per sample."""
        ...


@runtime_checkable
class ByReference(Tunable, Protocol):
    """Judged against a reference that is handed in."""

    def reference_error(
        self, recordings: Sequence[Recording], references: Sequence[pd.DataFrame]
    ) -> Objective:
        """What is minimised on recordings taken together, with a reference of the rails for each.

        A reference is a frame over ``position_m`` with columns `simrail.core.columns.IRREGULARITY`; only
        places between its ends count.
        """
        ...


METHODS = ("cml", "kom")
"""Methods of tuning: `ByLikelihood` and `ByReference`."""


def methods_of(tunable: Tunable) -> tuple[str, ...]:
    """By which of `METHODS` something can be tuned."""
    offers = isinstance(tunable, ByLikelihood), isinstance(tunable, ByReference)
    return tuple(name for name, is_offered in zip(METHODS, offers, strict=True) if is_offered)


def tunables_of(estimator: object, settings: Mapping[str, Any], *, method: str) -> dict[str, Tunable]:
    """What there is to tune of an estimator, by the name of each set of parameters.

    Parameters
    ----------
    estimator : object
        A `Tunable`, or an estimator with a verb ``tunables``.
    settings : mapping
        Settings of the search that a user has given; see `Tunable`.
    method : str
        One of `METHODS`.

    Raises
    ------
    InputError
        If there is nothing to tune, a setting is not known, or the method is not offered.
    """
    if hasattr(estimator, "tunables"):
        tunables: dict[str, Tunable] = estimator.tunables(settings)
    elif isinstance(estimator, Tunable):
        refuse_settings(estimator, settings)
        tunables = {"all": estimator}
    else:
        raise InputError(
            "has nothing to tune",
            field="--estimator",
            value=type(estimator).__name__,
            limit="an estimator with parameters() and likelihood() or reference_error(), "
            "e.g. TrajectorySmoother",
        )
    for tunable in tunables.values():
        offered = methods_of(tunable)
        if method not in offered:
            raise InputError(
                f"{type(estimator).__name__} cannot be tuned by this method",
                field="--method",
                value=method,
                limit=" or ".join(offered) or "none: it has neither likelihood() nor reference_error()",
            )
    return tunables


def refuse_settings(estimator: object, settings: Mapping[str, Any], *, known: Sequence[str] = ()) -> None:
    """Refuse settings of a search, given by name, that are none of those that an estimator has.

    Raises
    ------
    InputError
        Naming the setting.
    """
    for name in settings:
        if name not in known:
            raise InputError(
                f"{type(estimator).__name__} has no such setting of its search",
                field=name,
                remedy="leave it out",
                limit="the settings of its search",
            )


@dataclass(frozen=True)
class TunedValues:
    """Values that `simrail tune` has found, as an option of an estimator of one's own: the path of the file.

    Attributes
    ----------
    values : mapping of str to float
        By name of the parameter.
    """

    values: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def from_file(cls, path: str | Path) -> TunedValues:
        """Read the table [hyperparameters] of a tuning file.

        Raises
        ------
        InputError
            If the file cannot be read, or has no such table of numbers.
        """
        file = Path(path)
        try:
            table = tomllib.loads(file.read_text(encoding="utf-8")).get("hyperparameters")
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise InputError(
                f"cannot be read: {error}",
                file=file.name,
                remedy="mend the path",
                limit="a TOML file of a tuning",
            ) from error
        if not isinstance(table, dict) or not all(type(value) in (int, float) for value in table.values()):
            raise InputError(
                "has no table of numbers",
                file=file.name,
                field="hyperparameters",
                value=table,
                limit="a table [hyperparameters] of numbers",
                remedy="write it by simrail tune",
            )
        return cls({name: float(value) for name, value in table.items()})
