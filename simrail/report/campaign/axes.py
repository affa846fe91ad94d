"""Axes of a campaign as its report shows them, and the draws of a figure along them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.report.tables.question import UNLIKE
from simrail.report.words.ablations import value_words
from simrail.report.words.sentences import axis_name
from simrail.scenario.axes import axes_of
from simrail.scenario.scenario import Scenario
from simrail.scoring.ablations import ABLATIONS, AXES, COLUMNS, without_ablations
from simrail.scoring.aggregate import axis_columns
from simrail.scoring.table import CURVE_PREFIX, EVERY_CURVE, FULL

_FIRST = ("speed_kmh", "direction", "imu", "irregularity.scale", "irregularity.spectrum", "vehicle")
"""Columns of the table of cells that come first, and that stand for others which say the same."""

_LAST = ("mount", "odometry", *COLUMNS, "track", "engine", "ride")

_ABLATIONS = {one.column: one for one in ABLATIONS}

_TITLES = {
    "speed_kmh": "speed, km/h",
    "direction": "direction",
    "imu": "IMU",
    "irregularity.scale": "irregularity, times its spectrum",
    "irregularity.spectrum": "irregularity",
}


@dataclass(frozen=True)
class CampaignAxis:
    """One axis: its column in the table of cells, how it is called, and its values with their words."""

    column: str
    title: str
    values: tuple[object, ...]
    words: tuple[str, ...]

    @property
    def name(self) -> str:
        """Its title without a unit."""
        return self.title.partition(",")[0]

    def word_of(self, value: object) -> str:
        """Words for one of its values; a ride that has no value on an axis of another ride has NaN."""
        return next(
            word
            for known, word in zip(self.values, self.words, strict=True)
            if known == value or (_is_none(known) and _is_none(value))
        )


def is_campaign(scenario: Scenario) -> bool:
    """Whether a scenario has lists beside its IMU grades: axes that are worth a section.

    An ablation beside what a train has is told in a section of its own.
    """
    spec = scenario.spec
    names = set(axes_of(spec)) | {name for part in (*spec.ride, *spec.imu) for name in axes_of(part)}
    return bool(names - {"grade", *AXES})


def campaign_axes(cells: pd.DataFrame) -> list[CampaignAxis]:
    """The axes along which the cells differ, each told once, the usual ones first."""
    named = dict.fromkeys((*axis_columns(cells), "ride", "vehicle", "mount", "imu", "odometry", *COLUMNS))
    varying = [n for n in named if n in cells and n not in ("case", *AXES) and len(cells[n].unique()) > 1]
    others = [name for name in varying if name not in (*_FIRST, *_LAST)]
    ordered = [name for name in (*_FIRST, *others, *_LAST) if name in varying]
    columns: list[str] = []
    for name in ordered:
        # An axis of one ride is NaN in the rows of all others, where the axis of the whole still has a value.
        own = cells[cells[name].notna()]
        if not any(_follows(own, name, one) and _follows(own, one, name) for one in columns):
            columns.append(name)
    return [_axis(cells, name) for name in columns]


def finest(axes: Sequence[CampaignAxis], cells: pd.DataFrame) -> list[CampaignAxis]:
    """Axes that do not follow from another one, as the grade follows from the place if each has its own."""
    return [
        axis
        for axis in axes
        if not any(other is not axis and _follows(cells, axis.column, other.column) for other in axes)
    ]


def draws_of(
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    axes: Sequence[CampaignAxis],
    *,
    quantity: str = "roll",
    metric: str = "rms",
    window: str = "whole",
    band: str = FULL,
) -> pd.DataFrame:
    """One row per cell and method that has the figure: value, axes, draws, and ``cluster``.

    That is the number of the track that a draw was made over, the same in every case. ``window`` may be
    ``curve:*``: every single curve, one row each.
    """
    chosen = (scores["quantity"] == quantity) & (scores["metric"] == metric)
    chosen &= (scores["reference"] == "truth") & (scores["band"] == band) & scores["value"].notna()
    if window == EVERY_CURVE:
        curves = [name for name in scores["window"].cat.categories if name.startswith(CURVE_PREFIX)]
        chosen &= scores["window"].isin(curves)
    else:
        chosen &= scores["window"] == window
    columns = ["cell", "estimator", "window", "value", "track_draw", "sensor_draw"]
    beside = [axis.column for axis in axes] + [name for name in ("case", "sample") if name in cells]
    draws = scores.loc[chosen, columns].merge(cells[["cell", *dict.fromkeys(beside)]], on="cell", how="left")
    tracks = [name for name in ("sample", "track_draw") if name in draws]
    return draws.assign(cluster=draws.groupby(tracks, sort=True).ngroup())


def beside_ablations(axes: Sequence[CampaignAxis]) -> list[CampaignAxis]:
    """The axes but those of ablations."""
    return [axis for axis in axes if axis.column not in COLUMNS]


@dataclass(frozen=True)
class Held:
    """Values of what somebody chooses, at which a figure over other axes is held: it is never averaged over.

    Attributes
    ----------
    values : dict of str to object
        By column of the table of cells.
    words : str
        The same for a caption; "" if nothing is held.
    """

    values: dict[str, object]
    words: str

    def of(self, draws: pd.DataFrame) -> pd.DataFrame:
        """Draws at these values."""
        for column, value in self.values.items():
            draws = draws[draws[column] == value]
        return draws


def held(axes: Sequence[CampaignAxis], *shown: CampaignAxis) -> Held:
    """Hold what somebody chooses, but what is shown: at its first value that is no ideal."""
    columns = {axis.column for axis in shown}
    values, words = {}, []
    for axis in axes:
        if axis.column in UNLIKE and axis.column not in columns:
            real = next((value for value in axis.values if value != "ideal"), axis.values[0])
            values[axis.column] = real
            words.append(f"{axis.name} {axis.word_of(real)}")
    return Held(values, ", ".join(words))


def along(draws: pd.DataFrame, axis: CampaignAxis) -> pd.DataFrame:
    """Draws to be compared along an axis: those of an ablation along its own axis only."""
    return without_ablations(draws, but=_ABLATIONS.get(axis.column))


def _follows(cells: pd.DataFrame, one: str, other: str) -> bool:
    """Whether the value of `other` says that of `one`."""
    return len(cells[[one, other]].drop_duplicates()) == cells[other].nunique(dropna=False)


def _axis(cells: pd.DataFrame, name: str) -> CampaignAxis:
    values = list(cells[name].unique())
    if pd.api.types.is_numeric_dtype(cells[name]) and not pd.api.types.is_bool_dtype(cells[name]):
        values = sorted(values)
    elif name == "direction":
        values = sorted(values, reverse=True)  # standing, forward, backward
    elif name in _ABLATIONS:
        values = sorted(values, key=[_ABLATIONS[name].own, _ABLATIONS[name].ablated].index)
    return CampaignAxis(name, _title(name), tuple(values), tuple(_words(value, name) for value in values))


def _title(name: str) -> str:
    words, unit = axis_name(name)
    return _TITLES.get(name) or (f"{words}, {unit}" if unit else words)


def _is_none(value: object) -> bool:
    """Whether a cell has no value here: NaN, which alone differs from itself, or None."""
    return value is None or value != value


def _words(value: object, column: str) -> str:
    if _is_none(value):
        return "-"
    if column in _ABLATIONS:
        return value_words(_ABLATIONS[column], value)
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (int, float)):
        return f"{value:g}"
    text = str(value)
    return Path(text).stem if text.endswith(".toml") else text
