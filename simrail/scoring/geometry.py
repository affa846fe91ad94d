"""Scores of rail geometry: what an estimator says of the rails against the rails as they lie.

An error is estimate minus truth at the same s. The filters of `simrail.track.bands` are linear, so the error
in a band is the error, filtered; over their margins, where they would need to know the rails beyond the ends
of the ride, nothing counts. Consistency (nees, coverage95) of the unfiltered irregularities is by the
estimate's standard deviations. In a band, and of twist, the sd depends on how the errors hang together along
the track, which these do not say: coverage95 is told where the estimate has draws of its error
(`geometry_draws`), which are filtered as the error is. nees is not: with the sd of m draws its mean is not 1.

Windows are those of the track (whole, straight, transition, curve and each curve): a place has no speed.
"""

from collections.abc import Collection, Iterator, Sequence

import numpy as np
import pandas as pd

from simrail.core.columns import IRREGULARITY, require
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.scoring.metrics import Row, Series, figures
from simrail.scoring.table import NO_TWIST, UNOBSERVABLE, table_of
from simrail.scoring.windows import chosen_metrics, chosen_windows, windows_of
from simrail.track.bands import BANDS, TWIST_BASE_M, Band, band_pass, sd_of_draws, twist, why_not
from simrail.track.laid_track import LaidTrack

_NO_PLACE_METRICS = ("final", "nis", "us_per_sample")


def score_geometry(
    estimate: Estimate,
    rails: LaidTrack,
    recording: Recording,
    *,
    bands: Sequence[Band] = tuple(BANDS.values()),
    twist_base_m: float = TWIST_BASE_M,
    windows: Collection[str] | None = None,
    metrics: Collection[str] | None = None,
) -> pd.DataFrame:
    """Score the geometry of an estimate.

    Parameters
    ----------
    estimate : Estimate
        Its `geometry`, by its `geometry_draws` if it has some, and nothing else, is scored.
    rails : LaidTrack
        The rails that the ride was run on; their design defines the windows.
    recording : Recording
        What the estimator saw.
    bands : sequence of Band
        Bands to score in, beside ``full``.
    twist_base_m : float
        Base of the twist.
    windows, metrics : collection of str, optional
        What to keep; by default all that a place can have.

    Returns
    -------
    pandas.DataFrame
        Columns `simrail.scoring.table.FIGURE_COLUMNS`: alignment, vertical_profile, cross_level, gauge and
        twist, in mm. For what is not observable, or has nothing in a band, one row says why.

    Raises
    ------
    InputError
        If the estimate has no geometry, or lacks an irregularity, or is not over uniform places.
    """
    geometry = estimate.geometry
    if geometry is None:
        raise InputError("the estimate says nothing of the rails", field="geometry", limit="a frame")
    require(geometry, IRREGULARITY, what="geometry")
    position = geometry.index.to_numpy(dtype=np.float64)
    step = _step_of(position)
    if estimate.mount != recording.mount:
        raise InputError("the estimate speaks of another mount", value=estimate.mount, limit=recording.mount)
    chosen = chosen_windows(windows_of(rails.design, position, np.ones(len(position))), windows)
    chosen = {name: at for name, at in chosen.items() if name not in ("standstill", "moving")}
    keep = [name for name in chosen_metrics(metrics) if name not in _NO_PLACE_METRICS]
    for band in bands:
        band.check()
    draws = estimate.geometry_draws
    if draws is None:
        draws = np.empty((0, len(geometry), len(IRREGULARITY)))
    if draws.shape[1:] != (len(geometry), len(IRREGULARITY)):
        raise InputError(
            "are not over the places of the geometry",
            field="geometry_draws",
            value=draws.shape,
            limit=f"(draws, {len(geometry)}, {len(IRREGULARITY)})",
        )
    rows: list[Row] = []
    for series, counts in _series(geometry, rails.irregularities(position), draws, step, bands, twist_base_m):
        names = list(chosen)[:1] if series.reason else chosen  # a reason is told once
        inside = {name: chosen[name][counts[chosen[name]]] for name in names}
        own = series.band == "full" and series.quantity != "twist"  # the estimate's own sd
        rows += figures(series, inside, keep if own else [name for name in keep if name != "nees"])
    return table_of(rows, bands=[band.name for band in bands])


def rail_error_of(
    estimate: Estimate, rails: LaidTrack, quantity: str, band: Band | None, *, twist_base_m: float = 3.0
) -> "pd.Series[float] | None":
    """Error of one quantity of the rails, mm, over the places that count; None if it is not estimated.

    Parameters
    ----------
    estimate, rails
        As of `score_geometry`.
    quantity : str
        As in the score table.
    band : Band, optional
        None for all wavelengths.
    twist_base_m : float
        Base of the twist.
    """
    geometry = estimate.geometry
    if geometry is None:
        return None
    position = geometry.index.to_numpy(dtype=np.float64)
    bands, wanted = ([], "full") if band is None else ([band], band.name)
    none = np.empty((0, len(geometry), len(IRREGULARITY)))
    truth = rails.irregularities(position)
    for series, counts in _series(geometry, truth, none, _step_of(position), bands, twist_base_m):
        if series.quantity == quantity and series.band == wanted and not series.reason:
            return pd.Series(series.error[counts], index=position[counts])
    return None


def _step_of(position: FloatArray) -> float:
    """Distance of the places; 0 if there are fewer than two."""
    steps = np.diff(position)
    if len(steps) == 0:
        return 0.0
    step = (position[-1] - position[0]) / len(steps)
    if not (step > 0.0 and np.abs(steps - step).max() < 1e-6 * step):
        raise InputError("is not over uniform places", field="geometry", limit="equal steps towards larger s")
    return float(step)


def _series(
    geometry: pd.DataFrame,
    truth: pd.DataFrame,
    draws: FloatArray,
    step_m: float,
    bands: Sequence[Band],
    twist_base_m: float,
) -> Iterator[tuple[Series, np.ndarray]]:
    """Errors of every quantity and band, mm, and which places (n,) count.

    The error and its draws (m, n, 4) go the same way: as lines (1 + m, n), the error first.
    """
    n = len(geometry)
    everywhere = np.ones(n, dtype=bool)
    for at, name in enumerate(IRREGULARITY):
        quantity = name.removesuffix("_m")
        error = geometry[name].to_numpy(dtype=np.float64) - truth[name].to_numpy()
        lines = 1e3 * np.vstack([error, draws[:, :, at]])
        unknown = UNOBSERVABLE if n and np.isnan(error).all() else ""
        sd_name = f"{quantity}_sd_m"
        sd = 1e3 * geometry[sd_name].to_numpy(dtype=np.float64) if sd_name in geometry else None
        yield Series(quantity, "truth", lines[0], sd, unknown), everywhere
        in_bands = [(band.name, *_filtered(lines, band, quantity, step_m)) for band in bands if not unknown]
        for band_name, filtered, reason in in_bands:
            yield _of_lines(quantity, filtered, reason, band_name)
        if quantity != "cross_level":
            continue
        for band_name, levels, reason in [("full", lines, unknown), *in_bands]:
            turned, why = _twisted(levels, twist_base_m, step_m, reason)
            yield _of_lines("twist", turned, why, band_name)


def _of_lines(quantity: str, lines: FloatArray, reason: str, band: str) -> tuple[Series, np.ndarray]:
    """Series of an error with the sd that its draws have, and which places (n,) count."""
    sd = sd_of_draws(lines[1:]) if len(lines) > 1 else None
    return Series(quantity, "truth", lines[0], sd, reason, band), _counts(lines[0], reason)


def _filtered(lines: FloatArray, band: Band, quantity: str, step_m: float) -> tuple[FloatArray, str]:
    """Lines (m, n) in a band, and the reason if they have none."""
    edges = band.edges_m(quantity)
    reason = why_not(edges, count=lines.shape[1], step_m=step_m)
    if reason or not np.isfinite(lines[0]).all():
        return lines, reason
    return band_pass(lines, edges, step_m=step_m), ""


def _twisted(lines: FloatArray, base_m: float, step_m: float, reason: str) -> tuple[FloatArray, str]:
    if reason or lines.shape[1] == 0:
        return lines, reason
    try:
        return twist(lines, base_m=base_m, step_m=step_m), ""
    except InputError:
        return lines, NO_TWIST


def _counts(values: FloatArray, reason: str) -> np.ndarray:
    """Which places count: all where there is a reason against the whole, else those inside the margins.

    Outer NaN are margins; one within is a fault of the estimate and counts, so that it is told.
    """
    numbers = np.flatnonzero(~np.isnan(values))
    counts = np.ones(len(values), dtype=bool)
    if not reason and len(numbers):
        counts[: numbers[0]] = counts[numbers[-1] + 1 :] = False
    return counts
