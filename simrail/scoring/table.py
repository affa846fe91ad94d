"""The score table: one row per figure, always the same columns and the same words.

Tables of different campaigns, and of different years, are laid side by side, so neither columns nor
words may drift: a word that is not in the vocabulary here is refused. This module knows the table
only; what the figures mean and how they are computed is in `simrail.scoring.score`.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
from pandas.api.types import union_categoricals

from simrail.track.bands import BANDS as _STANDARD_BANDS
from simrail.track.bands import TOO_COARSE, TOO_SHORT

FIGURE_COLUMNS = (
    "quantity",
    "band",
    "reference",
    "window",
    "metric",
    "value",
    "unit",
    "n_samples",
    "status",
)
"""What one figure is: the part of a row that `simrail.scoring.score` fills."""

LABEL_COLUMNS = (
    "cell",
    "scenario",
    "ride",
    "vehicle",
    "mount",
    "imu",
    "odometry",
    "map",
    "vibration",
    "tuning",
    "track_draw",
    "sensor_draw",
    "estimator",
)
"""What the figure is about: the part that the campaign fills."""

SCORE_COLUMNS = LABEL_COLUMNS + FIGURE_COLUMNS
"""All columns of a score table, in their order."""

INTEGER_COLUMNS = ("cell", "track_draw", "sensor_draw", "n_samples")

QUANTITY_UNITS = {
    "roll": "deg",
    "pitch": "deg",
    "yaw": "deg",
    "lateral": "mm",
    "vertical": "mm",
    "position": "m",
    "speed": "m/s",
    "acceleration_x": "m/s2",
    "acceleration_y": "m/s2",
    "acceleration_z": "m/s2",
    "alignment": "mm",
    "vertical_profile": "mm",
    "cross_level": "mm",
    "gauge": "mm",
    "twist": "mm",
    "yaw_debiased": "deg",
    "distance_relative": "1",
    "gyro_bias": "deg/s",
    "accel_bias": "m/s2",
    "derailment_quotient": "1",
    "sum_y": "kN",
    "sum_y_relative": "1",
    "guiding_force": "kN",
    "wheel_load": "kN",
    "wheel_unloading": "1",
    "comfort_nmv": "1",
    "sperling_lateral": "1",
    "sperling_vertical": "1",
    "lateral_growth": "1/s",
}
"""Every quantity that can be scored, with the unit of its error; the last ten are of the ride itself."""

METRIC_UNITS = {
    **dict.fromkeys(("nees", "nis", "outside", "fault"), "1"),
    **dict.fromkeys(("coverage50", "coverage90", "coverage95", "coverage99", "coverage999"), "1"),
    "us_per_sample": "us",
}
"""Metrics whose unit is not the quantity's."""

FULL = "full"
"""The band of what no filter has cut."""
BANDS = (FULL, *_STANDARD_BANDS)
REFERENCES = ("truth", "design", "reference")
WINDOWS = ("whole", "cropped", "straight", "transition", "curve", "standstill", "moving")
METRICS = ("rms", "mean", "sd", "p95", "p9985", "max", "final", "nees", "nis", "coverage95", "us_per_sample")
ON_REQUEST = ("coverage50", "coverage90", "coverage99", "coverage999", "bound", "outside", "fault")
"""Metrics that are made only where they are named."""
EXACT_MAP, DRAWN_MAP = "exact", "drawn"
"""What the train knows of the line: all of it, an ablation, or a map with errors."""
SHAKEN, SILENT = "on", "off"
"""Whether short waves and wheels shake the vehicle; off is an ablation."""
OK = "ok"
NO_SAMPLES = "no samples"
"""Status of a figure over a window that the ride does not have."""
UNOBSERVABLE = "not observable by this method"
"""Status of an irregularity that an estimate leaves open."""
NO_TWIST = "base of the twist is no multiple of the step"
LEFT_OPEN = (UNOBSERVABLE, TOO_SHORT, TOO_COARSE, NO_TWIST)
"""Statuses of what a method or a ride cannot give, which is no failure."""
CURVE_PREFIX = "curve:"
"""A window of one curve is ``curve:`` and the name of its segment."""
EVERY_CURVE = CURVE_PREFIX + "*"
"""In a choice of windows: each single curve."""

_CLOSED = {
    "quantity": tuple(QUANTITY_UNITS),
    "band": BANDS,
    "reference": REFERENCES,
    "window": WINDOWS,
    "metric": (*METRICS, *ON_REQUEST),
    "unit": tuple(dict.fromkeys((*QUANTITY_UNITS.values(), *METRIC_UNITS.values()))),
    "status": (OK,),
}


def unit_of(quantity: str, metric: str) -> str:
    """Unit of a figure: the metric's own if it has one, else the quantity's."""
    return METRIC_UNITS.get(metric, QUANTITY_UNITS[quantity])


def as_score_table(frame: pd.DataFrame, *, bands: Sequence[str] = ()) -> pd.DataFrame:
    """Give a frame of scores the fixed columns and dtypes, and refuse words outside the vocabulary.

    Parameters
    ----------
    frame : pandas.DataFrame
        All `FIGURE_COLUMNS`, and as many `LABEL_COLUMNS` as are filled already.
    bands : sequence of str
        The scenario's own wavelength bands, by name.

    Returns
    -------
    pandas.DataFrame
        Text columns categorical with the whole vocabulary first, ``value`` float64, counts int64.

    Raises
    ------
    ValueError
        On a missing or unknown column, an unknown word, a unit that is not the quantity's, a value
        beside a failure status, or a figure that is not finite beside ``ok``.
    """
    unknown = [str(name) for name in frame.columns if name not in SCORE_COLUMNS]
    missing = [name for name in FIGURE_COLUMNS if name not in frame.columns]
    if unknown or missing:
        raise ValueError(f"score table: unknown columns {unknown}, missing columns {missing}")
    columns = {name: frame[name].tolist() for name in SCORE_COLUMNS if name in frame.columns}
    return _table(columns, bands).set_axis(frame.index)


def table_of(rows: Sequence[tuple[object, ...]], *, bands: Sequence[str] = ()) -> pd.DataFrame:
    """Figures, each a tuple in the order of `FIGURE_COLUMNS`, as a table; see `as_score_table`."""
    columns = zip(*rows, strict=True) if rows else ((),) * len(FIGURE_COLUMNS)
    return _table(dict(zip(FIGURE_COLUMNS, columns, strict=True)), bands)


def concat_scores(tables: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Stack score tables; categories are united, columns stay categorical and in order."""
    stack = list(tables)
    if not stack:
        return as_score_table(pd.DataFrame(columns=list(SCORE_COLUMNS)))
    columns: dict[str, object] = {}
    for name in stack[0].columns:
        parts = [table[name].array for table in stack]
        if isinstance(parts[0], pd.Categorical):
            columns[name] = union_categoricals(parts)
        else:
            columns[name] = np.concatenate([np.asarray(part) for part in parts])
    return pd.DataFrame(columns)


def in_order(scores: pd.DataFrame) -> pd.DataFrame:
    """Rows in the order of the cells, words in that of the vocabulary and then of the rows.

    What is returned depends on the rows of each cell alone, not on the order in which cells were stacked.
    """
    cell = scores["cell"].to_numpy()
    if (np.diff(cell) < 0).any():
        scores = scores.iloc[np.argsort(cell, kind="stable")].reset_index(drop=True)
    columns: dict[str, object] = {}
    for name in scores.columns:
        column = scores[name]
        if isinstance(column.dtype, pd.CategoricalDtype):
            used = [column.cat.categories[code] for code in pd.unique(column.cat.codes)]
            words = list(dict.fromkeys((*_CLOSED.get(name, ()), *used)))
            column = column.cat.set_categories(words)
        columns[name] = column
    return pd.DataFrame(columns)


def labelled(pairs: Sequence[tuple[pd.DataFrame, Mapping[str, object]]]) -> pd.DataFrame:
    """Stack the figures of many estimates, with the campaign's labels before them.

    Parameters
    ----------
    pairs : sequence of (pandas.DataFrame, mapping)
        What `simrail.scoring.score.score` returned, and a value for each of `LABEL_COLUMNS`.
    """
    for _, labels in pairs:
        missing = [name for name in LABEL_COLUMNS if name not in labels]
        if missing or len(labels) != len(LABEL_COLUMNS):
            raise ValueError(f"score table: labels must be exactly {LABEL_COLUMNS}; missing {missing}")
    figures = concat_scores([table for table, _ in pairs])
    lengths = [len(table) for table, _ in pairs]
    columns: dict[str, object] = {}
    for name in LABEL_COLUMNS:
        if name in INTEGER_COLUMNS:
            each: Any = [labels[name] for _, labels in pairs]
            columns[name] = np.repeat(np.array(each, dtype=np.int64), lengths)
        else:
            words = [str(labels[name]) for _, labels in pairs]
            dtype, place = _words(tuple(dict.fromkeys(words)))
            codes = np.repeat(np.array([place[word] for word in words], dtype=np.int64), lengths)
            columns[name] = pd.Categorical.from_codes(codes, dtype=dtype)
    columns |= {name: figures[name].array for name in FIGURE_COLUMNS}
    return pd.DataFrame(columns)


def is_failure(scores: pd.DataFrame) -> "pd.Series[bool]":
    """Which rows have no value for a fault, not for what a method or a ride cannot give."""
    return ~scores["status"].isin((OK, NO_SAMPLES, *LEFT_OPEN))


def failed_figures(reason: str) -> pd.DataFrame:
    """The one row that stands for an estimate or a cell that could not be made."""
    first = ("roll", "full", "truth", "whole", "rms", np.nan, "deg", 0, reason.strip() or "failed")
    return table_of([first])


def _table(columns: Mapping[str, Sequence[Any]], bands: Sequence[str]) -> pd.DataFrame:
    """Columns as a table, judged."""
    made: dict[str, object] = {}
    for name, values in columns.items():
        if name in INTEGER_COLUMNS:
            made[name] = np.array(values, dtype=np.int64)
        elif name == "value":
            made[name] = np.array(values, dtype=np.float64)
        else:
            made[name] = _categorical(name, values, bands)
    _check(columns)
    return pd.DataFrame(made)


def _categorical(name: str, values: Sequence[object], bands: Sequence[str]) -> pd.Categorical:
    vocabulary = tuple(dict.fromkeys((*_CLOSED.get(name, ()), *(bands if name == "band" else ()))))
    extra = sorted({str(word) for word in dict.fromkeys(values)}.difference(vocabulary))
    is_open = name in LABEL_COLUMNS or name == "status"
    if not is_open:
        refused = [word for word in extra if not (name == "window" and word.startswith(CURVE_PREFIX))]
        if refused:
            raise ValueError(f"score table: {name} {refused[0]!r} is not in the vocabulary {vocabulary}")
    dtype, place = _words((*vocabulary, *extra))
    codes = np.array([place[str(word)] for word in values], dtype=np.int64)
    return pd.Categorical.from_codes(codes, dtype=dtype)


@lru_cache(maxsize=512)
def _words(words: tuple[str, ...]) -> tuple[pd.CategoricalDtype, dict[str, int]]:
    """The type of a column of these words, and the code of each."""
    return pd.CategoricalDtype(list(words)), {word: code for code, word in enumerate(words)}


def _check(columns: Mapping[str, Sequence[Any]]) -> None:
    for quantity, metric, unit in set(
        zip(columns["quantity"], columns["metric"], columns["unit"], strict=True)
    ):
        if unit != unit_of(quantity, metric):
            raise ValueError(
                f"score table: unit of {quantity} {metric} is {unit_of(quantity, metric)}, not {unit}"
            )
    ok = np.array([status == OK for status in columns["status"]], dtype=bool)
    value = np.array(columns["value"], dtype=np.float64)
    if not np.isfinite(value[ok]).all():
        raise ValueError("score table: a figure with status ok is not finite")
    if not np.isnan(value[~ok]).all():
        raise ValueError("score table: a figure with a failure status has a value")
