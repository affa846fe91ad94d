"""Errors of the vertical profile by place of the IMU, and how those of two methods differ on the same rides.

A place is a vehicle and a mount. Rides of one draw, there and back, are over the same rails and count as one
cluster: intervals resample the draws (`simrail.scoring.bootstrap`).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.report.papers.claim import read_paper
from simrail.scoring.bootstrap import Interval, interval
from simrail.scoring.table import OK

PAPER = read_paper("hidalgo")

IDEAL = "ideal"
"""Grade of the IMU without errors."""

BAND = "D1"
"""Wavelengths that the claims are judged in: the longest that the rides are long enough for, many times."""


@dataclass(frozen=True)
class Places:
    """Errors by ride.

    Attributes
    ----------
    table : pandas.DataFrame
        A row per place, draw and direction (index), a column per part: sd of the error in `BAND`, mm.
    others : mapping of str to pandas.DataFrame
        The same of other figures: ``"D2"``, and ``"coverage95"`` of the unfiltered profile.
    """

    table: pd.DataFrame
    others: Mapping[str, pd.DataFrame]

    @property
    def names(self) -> list[str]:
        """Places, in the order of the scores."""
        return list(dict.fromkeys(self.table.index.get_level_values("place")))

    def has(self, part: str) -> bool:
        """Whether a part was run, in every place."""
        return part in self.table and all(self.table[part].xs(name).notna().any() for name in self.names)

    def mean(self, part: str, place: str, figure: str = BAND) -> Interval:
        """Mean over the rides with its interval; NaN without any."""
        table = self.table if figure == BAND else self.others.get(figure, self.table.iloc[:, :0])
        if part not in table or place not in table.index.get_level_values("place"):
            return Interval(np.nan, np.nan, np.nan)
        return _interval(table[part].xs(place).dropna())

    def changes(self, part: str, other: str) -> dict[str, Interval]:
        """By place: by how many per cent a part's error is larger than another's, on the same rides.

        The mean of the logarithm of the ratio: half and double balance.
        """
        found = {}
        for place in self.names:
            both = self.table[[part, other]].xs(place).dropna()
            logs = _interval((both[part] / both[other]).map(math.log))
            found[place] = Interval(*(100.0 * np.expm1([logs.value, logs.low, logs.high])))
        return found


def _interval(values: pd.Series) -> Interval:
    """Mean of values by draw and direction."""
    return interval(values.to_numpy(dtype=np.float64), values.index.get_level_values("draw").to_numpy())


def places_of(scores: pd.DataFrame, cells: pd.DataFrame, names: Mapping[str, str]) -> Places | None:
    """Errors from a score table; None if no method that plays a part has a vertical profile.

    Parameters
    ----------
    scores, cells : pandas.DataFrame
        The score table, and a row per cell.
    names : mapping of str to str
        By part, the method's name.
    """
    about = cells.set_index("cell")[["direction", "sample"]]
    rows = scores[(scores["quantity"] == "vertical_profile") & (scores["window"] == "whole")]
    rows = rows[rows["estimator"].isin(list(names.values())) & (rows["status"] == OK)]
    rows = rows[rows["imu"] != IDEAL]  # of a device without errors nothing is claimed
    if rows.empty:
        return None
    part_of = {name: part for part, name in names.items()}
    long = pd.DataFrame(
        {
            "place": rows["vehicle"].astype(str).str.replace("_", " ") + ", " + rows["mount"].astype(str),
            "draw": about["sample"].reindex(rows["cell"]).to_numpy() * 1000 + rows["track_draw"].to_numpy(),
            "direction": about["direction"].reindex(rows["cell"]).to_numpy(),
            "cell": rows["cell"].to_numpy(),
            "part": rows["estimator"].astype(str).map(part_of),
            "band": rows["band"].astype(str),
            "metric": rows["metric"].astype(str),
            "value": rows["value"].to_numpy(dtype=np.float64),
        }
    )

    def table(band: str, metric: str) -> pd.DataFrame:
        chosen = long[(long["band"] == band) & (long["metric"] == metric)]
        index = ["place", "draw", "direction", "cell"]
        return chosen.pivot_table(index=index, columns="part", values="value", sort=False)

    main = table(BAND, "sd")
    if main.empty:
        return None
    return Places(main, {"D2": table("D2", "sd"), "coverage95": table("full", "coverage95")})
