"""Figures of one error series: rms, percentiles, consistency, window by window.

With e = estimate - reference over the samples of a window:

* ``rms``, ``mean`` (signed), ``sd`` (about the mean, so rms^2 = mean^2 + sd^2);
* ``p95`` and ``max``: 95th percentile and maximum of abs(e); ``final``: e at the last sample;
* ``nees``: mean of (e / sd)^2, 1 for a consistent method; ``coverage95``: share of the samples with
  abs(e) <= 1.96 sd, and likewise ``coverage50``, ``90``, ``99`` and ``999`` (99.9 %). Only where the method
  gives a standard deviation;
* ``bound``: median of the method's own bound over the way travelled; ``outside``: share of that way on which
  abs(e) is larger; ``fault``: share of it behind a fault that the method has told. Only where it has bounds;
* ``nis``: mean normalised innovation squared divided by the number of innovations, again 1.

What cannot be computed is a row without a value whose status says why. This module does not know
where the errors come from; `simrail.scoring.score` does.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.special import ndtri

from simrail.core.columns import INNOVATION
from simrail.core.jit import FloatArray
from simrail.scoring.table import NO_SAMPLES, OK, unit_of

IntArray = npt.NDArray[np.intp]
Row = tuple[str, str, str, str, str, float, str, int, str]
"""One row of the score table, in the order of `simrail.scoring.table.FIGURE_COLUMNS`."""

_DEVIATION_METRICS = ("rms", "mean", "sd", "p95", "max", "final")
_QUANTILES = {
    f"coverage{name}": float(ndtri(0.5 + 0.5 * share))
    for name, share in (("50", 0.5), ("90", 0.9), ("95", 0.95), ("99", 0.99), ("999", 0.999))
}
_CONSISTENCY_METRICS = ("nees", *_QUANTILES)
_BOUND_METRICS = ("bound", "outside", "fault")

SHARES = (*_QUANTILES, "outside", "fault")
"""Metrics between 0 and 1."""


@dataclass(frozen=True)
class Bounds:
    """What a method says that its errors stay within.

    Attributes
    ----------
    bound : ndarray (n,)
        In the unit of the score table.
    fault : ndarray (n,)
        1 once the method has found that it is not to be relied on, before 0.
    way : ndarray (n,)
        Run by the train in each sample, m.
    """

    bound: FloatArray
    fault: FloatArray
    way: FloatArray


@dataclass(frozen=True)
class Series:
    """Errors of one quantity, in one band, against one reference, in the unit of the score table."""

    quantity: str
    reference: str
    error: FloatArray
    sd: FloatArray | None
    reason: str = ""
    band: str = "full"
    bounds: Bounds | None = None


def figures(series: Series, windows: Mapping[str, IntArray], keep: Sequence[str]) -> list[Row]:
    """All figures of one series, window by window."""
    deviations = [name for name in _DEVIATION_METRICS if name in keep]
    consistency = [name for name in _CONSISTENCY_METRICS if name in keep and series.sd is not None]
    bounds = [name for name in _BOUND_METRICS if name in keep and series.bounds is not None]
    rows: list[Row] = []
    for window, samples in windows.items():
        whole = len(samples) == len(series.error)
        error = series.error if whole else series.error[samples]
        values, status = _deviations(error, deviations)
        status = series.reason or status
        rows += _rows(series, window, deviations, values, len(samples), status)
        if consistency:
            assert series.sd is not None
            sd = series.sd if whole else series.sd[samples]
            values, sd_status = _consistency(error, sd, consistency)
            rows += _rows(
                series, window, consistency, values, len(samples), status if status != OK else sd_status
            )
        if bounds:
            assert series.bounds is not None
            values, status = _held(error, series.bounds, samples, bounds)
            rows += _rows(series, window, bounds, values, len(samples), series.reason or status)
    return rows


def _rows(
    series: Series, window: str, metrics: list[str], values: list[float], n: int, status: str
) -> list[Row]:
    if status != OK:
        values = [np.nan] * len(metrics)
    q = series.quantity
    return [
        (q, series.band, series.reference, window, metric, value, unit_of(q, metric), n, status)
        for metric, value in zip(metrics, values, strict=True)
    ]


def _deviations(error: FloatArray, metrics: list[str]) -> tuple[list[float], str]:
    n = len(error)
    if n == 0:
        return [np.nan] * len(metrics), NO_SAMPLES
    total = float(error.sum())
    if not np.isfinite(total):
        bad = int(n - np.isfinite(error).sum())
        return [np.nan] * len(metrics), f"estimate not finite in {bad} of {n} samples"
    mean = total / n
    centred = error - mean
    # Not centred @ centred: BLAS would start threads, and its sum depends on how many there are.
    variance = float(np.square(centred).sum()) / n
    size = np.abs(error)
    values = {
        "mean": mean,
        "sd": variance**0.5,
        "rms": (mean * mean + variance) ** 0.5,
        "max": float(size.max()),
        "final": float(error[-1]),
    }
    if "p95" in metrics:
        values["p95"] = percentile95(size)
    return [values[name] for name in metrics], OK


def percentile95(values: FloatArray) -> float:
    """What 95 % of some values (n,) are below, between the two nearest; their order is changed.

    The bits of ``numpy.percentile``, whose preparations take ten times as long as the work on the thousand
    samples of a short window, of which a campaign has thousands.
    """
    place = 0.95 * (len(values) - 1)
    low = int(place)
    high, share = min(low + 1, len(values) - 1), place - low
    values.partition((low, high))
    below, above = float(values[low]), float(values[high])
    step = above - below
    return below + step * share if share < 0.5 else above - step * (1.0 - share)


def _consistency(error: FloatArray, sd: FloatArray, metrics: list[str]) -> tuple[list[float], str]:
    n = len(error)
    if n == 0:
        return [np.nan] * len(metrics), NO_SAMPLES
    good = int(np.count_nonzero(np.isfinite(sd) & (sd > 0.0)))
    if good < n:
        return [np.nan] * len(metrics), f"standard deviation not positive in {n - good} of {n} samples"
    ratio = error / sd
    values: dict[str, float] = {
        name: np.count_nonzero(np.abs(ratio) <= at) / n for name, at in _QUANTILES.items() if name in metrics
    }
    values["nees"] = float(np.square(ratio).sum()) / n
    return [values[name] for name in metrics], OK


def _held(
    error: FloatArray, bounds: Bounds, samples: IntArray, metrics: list[str]
) -> tuple[list[float], str]:
    """Figures of the bounds, by the way that was run; behind a fault nothing is outside."""
    way, bound, fault = bounds.way[samples], bounds.bound[samples], bounds.fault[samples] > 0.0
    total = float(way.sum())
    if total <= 0.0:
        return [np.nan] * len(metrics), NO_SAMPLES
    order = np.argsort(bound)
    middle = int(np.searchsorted(np.cumsum(way[order]), 0.5 * total))
    values = {
        "bound": float(bound[order][min(middle, len(order) - 1)]),
        "outside": float(way[(np.abs(error) > bound) & ~fault].sum()) / total,
        "fault": float(way[fault].sum()) / total,
    }
    return [values[name] for name in metrics], OK


def nis_figures(innovations: pd.DataFrame, quantity: str, windows: Mapping[str, IntArray]) -> list[Row]:
    """The figure ``nis`` of every window."""
    names = [name for name in innovations.columns if str(name).startswith("innovation_")]
    nis = innovations[INNOVATION[-1]].to_numpy(dtype=np.float64) / max(len(names), 1)
    # Samples without an update have no innovation at all: they are not counted. A NIS that is
    # missing although there was an innovation is a fault and is told.
    updated = innovations[names].notna().any(axis=1).to_numpy() if names else np.ones(len(nis), dtype=bool)
    rows: list[Row] = []
    for window, samples in windows.items():
        values = nis[samples][updated[samples]]
        bad = int(len(values) - np.isfinite(values).sum())
        status = OK if len(values) and not bad else NO_SAMPLES
        if bad:
            status = f"NIS not finite in {bad} of {len(values)} samples"
        value = float(values.mean()) if status == OK else np.nan
        rows.append((quantity, "full", "truth", window, "nis", value, "1", len(values), status))
    return rows
