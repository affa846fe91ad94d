"""How well a train knows where it is, and how well it knows how well: odometries over all cells.

One row per odometry, vehicle, mount, IMU and map, over all rides; and one per odometry, mount, IMU, map and
class of ride, over all vehicles. Every recording weighs alike, as elsewhere in the tables of a campaign. The
clusters of an interval are the draws of the track with their maps: both are shared by every vehicle, mount
and ride over them. Rides over several maps of one track share its rails and their sensors' errors, which
an interval does not count: where these matter as much as the map, draw more tracks.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from simrail.report.tables.tables import NONE, Cell, Row, Table, number_cell, without_empty
from simrail.report.words.ablations import value_words
from simrail.report.words.verdicts import short_name
from simrail.scoring.ablations import MAP, without_ablations
from simrail.scoring.bootstrap import interval
from simrail.scoring.table import DRAWN_MAP, EXACT_MAP, FULL

PREFIX = "odometry:"
"""Begin of the estimator's name in the rows of an odometry."""

TRUE = f"{PREFIX}truth"
"""The true one, an ablation without errors."""

FIGURES = {
    "position_rms_m": ("position", "rms"),
    "position_p95_m": ("position", "p95"),
    "speed_rms_mps": ("speed", "rms"),
    "position_coverage": ("position", "coverage95"),
    "speed_coverage": ("speed", "coverage95"),
}
"""Columns of the frames, and which figure of the score table each is of."""

COVERAGES = ("position_coverage", "speed_coverage")
"""Those that have an interval."""

PLACES = ("odometry", "vehicle", "mount", "imu", "map")
CLASSES = ("odometry", "mount", "imu", "speed_kmh", "direction", "map")
"""What is told apart in the two frames."""

COLUMNS = ("rms", "p95", "rms", "position", "speed", "")
GROUPS = (
    ("position, m", 2),
    ("speed, m/s", 1),
    ("inside the 95 % interval, %", 2),
    ("recordings", 1),
)
"""Heads of a table."""


class OdometryTable(NamedTuple):
    """One odometry's rows of a frame.

    Attributes
    ----------
    odometry : str
        Its name.
    what : str
        What its rows are.
    names : list of str
        Columns of the frame that tell the rows apart.
    rows : pandas.DataFrame
        The rows.
    """

    odometry: str
    what: str
    names: list[str]
    rows: pd.DataFrame


def odometry_draws(scores: pd.DataFrame, cells: pd.DataFrame) -> pd.DataFrame:
    """One row per cell whose odometry has a position error: `PLACES`, ride class, `FIGURES` and ``cluster``.

    Over whole rides, against the truth. The true odometry is left out, and so are rides without vibration
    where others have it.
    """
    scores = without_ablations(scores, but=MAP)
    name = scores["estimator"].astype(str)
    chosen = name.str.startswith(PREFIX) & (name != TRUE) & (scores["window"] == "whole")
    chosen &= (scores["reference"] == "truth") & (scores["band"] == FULL) & scores["value"].notna()
    rows = scores.loc[chosen, ["cell", "quantity", "metric", "value"]].astype(
        {"quantity": str, "metric": str}
    )
    rows["odometry"] = name[chosen].str.removeprefix(PREFIX)
    figures = rows.pivot_table(index=["cell", "odometry"], columns=["quantity", "metric"], values="value")
    table = figures.reindex(columns=pd.MultiIndex.from_tuples(FIGURES.values()))
    table.columns = pd.Index(FIGURES)
    table = table.dropna(subset="position_rms_m").reset_index()
    labels = scores[["cell", "vehicle", "mount", "imu", "map", "track_draw"]].drop_duplicates("cell")
    labels = labels.astype(dict.fromkeys(("vehicle", "mount", "imu", "map"), str))
    beside = [name for name in ("sample", "map_draw", "speed_kmh", "direction") if name in cells]
    table = table.merge(labels, on="cell").merge(cells[["cell", *beside]], on="cell")
    chance = [name for name in ("sample", "track_draw", "map_draw") if name in table]
    return table.assign(cluster=table.groupby(chance, sort=True).ngroup())


def odometry_frames(scores: pd.DataFrame, cells: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """The frames ``odometry`` and ``odometry_classes``; none where mount and map are the same in all cells.

    Returns
    -------
    dict of str to DataFrame
        Columns that tell the rows apart (those that differ); rms over the recordings (root of their mean
        square, m and m/s), mean of their 95th percentiles; mean coverages with their 95 % intervals
        (``_low95``, ``_high95``; NaN of one cluster alone); ``recordings``, and ``clusters``, the draws of
        track and map.
    """
    draws = odometry_draws(scores, cells)
    if draws.empty or not _differ(draws, "mount", "map"):
        return {}
    frames = {"odometry": _pooled(draws, _differing(draws, PLACES))}
    classes = _differing(draws, CLASSES)
    if _differ(draws, "speed_kmh", "direction", "vehicle"):
        mounts = [name for name in classes if name not in ("speed_kmh", "direction")]
        pooled = _pooled(draws, mounts).assign(**dict.fromkeys(set(classes) - set(mounts), "all"))
        every = [pooled] if classes == mounts else [pooled, _pooled(draws, classes)]
        frames["odometry_classes"] = pd.concat(every, ignore_index=True)[every[-1].columns]
    return frames


def _differing(draws: pd.DataFrame, names: Sequence[str]) -> list[str]:
    """The odometry and the map, and what of the others is not the same in all draws; an IMU once."""
    differing = [name for name in names if name in ("odometry", "map") or _differ(draws, name)]
    if len(draws[["mount", "imu"]].drop_duplicates()) == len(draws["mount"].unique()):
        return [name for name in differing if name != "imu"]  # each place has its own
    return differing


def _differ(draws: pd.DataFrame, *names: str) -> bool:
    """Whether one of some columns is there and has several values."""
    return any(name in draws and len(draws[name].unique()) > 1 for name in names)


def _pooled(draws: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """A row per combination of names, in their order in the draws, a map that errs before an exact one."""
    rank = {name: {value: number for number, value in enumerate(_values(draws, name))} for name in names}
    rows = []
    for values, own in draws.groupby(list(names), sort=False):
        row: dict[str, Any] = dict(zip(names, values, strict=True))
        for column, (_, metric) in FIGURES.items():
            figure = own[column].dropna()
            if column in COVERAGES:
                mean = interval(own[column], own["cluster"])
                # Of one draw of track and map alone, nothing says what another would change.
                known = _differ(own, "cluster")
                low, high = np.clip([mean.low, mean.high], 0.0, 1.0) if known else (np.nan, np.nan)
                row |= {column: mean.value, f"{column}_low95": low, f"{column}_high95": high}
            elif metric == "rms":
                row[column] = float(np.sqrt((figure**2).mean()))
            else:
                row[column] = float(figure.mean())
        rows.append(row | {"recordings": len(own), "clusters": own["cluster"].nunique()})
    rows.sort(key=lambda row: [rank[name][row[name]] for name in names])
    return pd.DataFrame(rows)


def _values(draws: pd.DataFrame, name: str) -> list[Any]:
    if name == "map":
        return [DRAWN_MAP, EXACT_MAP]
    values = list(draws[name].unique())
    return sorted(values, reverse=name == "direction") if name in ("speed_kmh", "direction") else values


def odometry_tables(frames: Mapping[str, pd.DataFrame]) -> list[OdometryTable]:
    """The rows of each odometry: by vehicle and mount, and by mount and class of ride."""
    titles = {"odometry": "over all rides", "odometry_classes": "by class of ride, over all vehicles"}
    tables = []
    odometries = next(iter(frames.values()))["odometry"].unique() if frames else ()
    for odometry in odometries:
        for frame, words in titles.items():
            if frame in frames:
                own = frames[frame][frames[frame]["odometry"] == odometry]
                names = [str(n) for n in own.columns[: list(own.columns).index("position_rms_m")]]
                tables.append(OdometryTable(str(odometry), words, names[1:], own))
    return tables


def row_words(name: str, value: object) -> str:
    """What a row is of, in words: ``60 km/h``, ``the map errs``."""
    if name == "map":
        return value_words(MAP, value)
    if value == "all":
        return {"speed_kmh": "all speeds", "direction": "both ways"}.get(name, "all")
    if name == "imu":
        return short_name(value)
    return f"{value:g} km/h" if name == "speed_kmh" else str(value)


def page_tables(frames: Mapping[str, pd.DataFrame]) -> list[tuple[str, Table]]:
    """Titles and tables for the page."""
    shown = []
    for one in odometry_tables(frames):
        rows = [
            Row(" \u00b7 ".join(row_words(n, row[n]) for n in one.names), "", "", _cells(row))
            for row in one.rows.to_dict("records")
        ]
        table = without_empty(Table(list(GROUPS), list(COLUMNS), rows))
        shown.append((f"{one.odometry}, {one.what}", table))
    return shown


def _cells(row: Mapping[Any, Any]) -> list[Cell]:
    cells = [number_cell(row[name]) for name in FIGURES if name not in COVERAGES]
    for name in COVERAGES:
        low, high = 100.0 * row[f"{name}_low95"], 100.0 * row[f"{name}_high95"]
        spread = f"{low:.0f} to {high:.0f}" if np.isfinite(low) else ""
        known = np.isfinite(row[name])
        cells.append(Cell(f"{100.0 * row[name]:.1f}", spread) if known else NONE)
    return [*cells, Cell(f"{row['recordings']:,}")]
