"""Scores of an estimate on a recorded ride against something that measured the same better: a reference.

As scores against a truth, and in the same table, but called ``reference``: what measured it errs as well. An
estimate is taken at the times of the reference, by straight lines between its samples, and the rails at the
places of the estimate, by straight lines between those of the reference. Where a standard deviation of the
reference is known, consistency is judged by both together: sd^2 = estimate's sd^2 + reference's sd^2.
"""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from simrail.core.columns import ATTITUDE, IRREGULARITY
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.files.asked import RideReference
from simrail.recording.recording import Recording
from simrail.scoring.metrics import IntArray, Row, Series, figures
from simrail.scoring.score import wrap
from simrail.scoring.table import METRICS, table_of
from simrail.scoring.windows import STANDSTILL_MPS, windows_of
from simrail.track.bands import BANDS, Band
from simrail.track.rail_limits import TWIST, rail_lines

REFERENCE = "reference"
"""What the score table calls it."""

_LINEAR = (("position", "position_m", "position_sd_m"), ("speed", "speed_mps", "speed_sd_mps"))


def score_reference(
    estimate: Estimate, recording: Recording, reference: RideReference, *, twist_base_m: float
) -> pd.DataFrame:
    """Score an estimate against a reference.

    Parameters
    ----------
    estimate : Estimate
        What the method concluded.
    recording : Recording
        What it saw; its map, if it has one, and its odometry define the windows.
    reference : RideReference
        What it is compared with.
    twist_base_m : float
        Base of the twist.

    Returns
    -------
    pandas.DataFrame
        Columns `simrail.scoring.table.FIGURE_COLUMNS`, the reference of each row being ``"reference"``.
    """
    rows: list[Row] = []
    keep = [name for name in METRICS if name not in ("nis", "us_per_sample", "p9985")]
    for series, times in motion_errors(estimate, reference):
        rows += figures(series, _windows(recording, times), keep)
    for series, places in rail_errors(estimate, reference, twist_base_m=twist_base_m):
        windows = {"whole": np.arange(len(places))}
        if recording.track.is_map:
            windows = windows_of(recording.track, places, np.ones(len(places)))
        counts = np.isfinite(series.error)
        inside = {
            name: at[counts[at]] for name, at in windows.items() if name not in ("standstill", "moving")
        }
        rows += figures(series, inside, [name for name in keep if name != "final"])
    return table_of(rows)


def motion_errors(estimate: Estimate, reference: RideReference) -> Iterator[tuple[Series, FloatArray]]:
    """Estimate less reference at the reference's times, one series per quantity, and these times (n,) s."""
    if reference.motion is None:
        return
    states, have = estimate.states, estimate.states.index.to_numpy(dtype=np.float64)
    for name in reference.motion.columns:
        column = str(name)
        if column not in states.columns:
            continue
        known = reference.motion[column].dropna()
        known = known[(known.index >= have[0]) & (known.index <= have[-1])]
        if not len(known):
            continue
        times = known.index.to_numpy(dtype=np.float64)
        is_angle = column in ATTITUDE
        values = states[column].to_numpy(dtype=np.float64)
        found = np.interp(times, have, np.unwrap(values) if is_angle else values)
        error = found - known.to_numpy(dtype=np.float64)
        quantity = column.rpartition("_")[0]
        scale = 180.0 / np.pi if is_angle else 1.0
        error = scale * (wrap(error) if is_angle else error)
        unit = column.rpartition("_")[2]
        own = f"{quantity}_sd_{unit}"
        sd = None
        if own in states.columns:
            by_method = np.interp(times, have, states[own].to_numpy(dtype=np.float64))
            sd = scale * np.hypot(by_method, reference.sds.get(column, 0.0))
        yield Series(quantity, REFERENCE, error, sd), times
        if column == "yaw_rad":
            # Where the train's first heading comes from is no merit of a method.
            turned = np.rad2deg(wrap(np.deg2rad(error - error[0])))
            yield Series("yaw_debiased", REFERENCE, turned, None), times


def rail_errors(
    estimate: Estimate, reference: RideReference, *, twist_base_m: float
) -> Iterator[tuple[Series, FloatArray]]:
    """Estimate less reference over the places (n,) m that both have, mm, by quantity and band.

    The filters of the bands are linear: the error in a band is the error, filtered. A reference that was
    filtered before is compared with in its own band, and not filtered again.
    """
    if reference.rails is None or estimate.geometry is None or len(estimate.geometry) < 2:
        return
    geometry, rails, filtered_to = estimate.geometry, reference.rails, reference.rail_band
    place = geometry.index.to_numpy(dtype=np.float64)
    for column in (name for name in IRREGULARITY if name in rails.columns and name in geometry.columns):
        known = rails[column].dropna()
        inside = (place >= known.index.min()) & (place <= known.index.max())
        if np.count_nonzero(inside) < 2:
            continue
        measured = np.interp(place[inside], known.index.to_numpy(), known.to_numpy())
        names = [column, f"{column.removesuffix('_m')}_sd_m"]
        # One quantity at a time, over the places that it shares with the reference.
        cut = geometry.loc[inside, [name for name in names if name in geometry.columns]].copy()
        bands: list[Band] = [BANDS[filtered_to]] if filtered_to else list(BANDS.values())
        if not filtered_to:
            cut[column] -= measured
        draws = None if estimate.geometry_draws is None else estimate.geometry_draws[:, inside, :]
        own_sd = reference.rail_sds.get(column, 0.0)
        for line in rail_lines(cut, draws, bands=bands, twist_base_m=twist_base_m):
            if filtered_to and line.band != filtered_to:
                continue
            error = line.value - measured if filtered_to else line.value
            sd = None
            if line.sd is not None:
                # Two places of a reference err apart.
                sd = 1e3 * np.hypot(line.sd, own_sd * (np.sqrt(2.0) if line.quantity == TWIST else 1.0))
            yield Series(line.quantity, REFERENCE, 1e3 * error, sd, band=line.band), line.place


def _windows(recording: Recording, times: FloatArray) -> Mapping[str, IntArray]:
    """Windows of a ride at some of its times: by its map where it has one and an odometry."""
    everywhere = {"whole": np.arange(len(times))}
    if recording.odometry is None:
        return everywhere
    have = recording.odometry.index.to_numpy(dtype=np.float64)
    position, speed = (
        np.interp(times, have, recording.odometry[name].to_numpy(dtype=np.float64))
        for name in ("position_m", "speed_mps")
    )
    if recording.track.is_map:
        return windows_of(recording.track, position, speed)
    moving = np.abs(speed) >= STANDSTILL_MPS
    return everywhere | {"standstill": np.flatnonzero(~moving), "moving": np.flatnonzero(moving)}
