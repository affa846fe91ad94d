"""Figures of the methods by mount, line and device: what draws of rails and sensors make of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from simrail.core.jit import FloatArray
from simrail.report.papers.claim import read_paper
from simrail.scenario.cells import Method
from simrail.scoring.ablations import without_ablations
from simrail.scoring.bootstrap import interval
from simrail.scoring.table import OK

PAPER = read_paper("veillard_2016")

PER_MG = 1e3 / 9.81
"""Thousandths of the standard gravity in a metre per second squared, as the paper counts."""


class Figure(NamedTuple):
    """What is looked up of a method: quantity, metric and window of the score table, and its scale."""

    quantity: str
    metric: str
    window: str = "whole"
    scale: float = 1.0


FIGURES = {
    "along": Figure("acceleration_x", "rms", scale=PER_MG),
    "along_max": Figure("acceleration_x", "max", scale=PER_MG),
    "across": Figure("acceleration_y", "rms", scale=PER_MG),
    "roll": Figure("roll", "rms"),
    "pitch": Figure("pitch", "rms"),
    "roll_max": Figure("roll", "max"),
    "roll_curve": Figure("roll", "rms", "curve"),
    "roll_straight": Figure("roll", "rms", "straight"),
    "roll_still": Figure("roll", "rms", "standstill"),
    "speed": Figure("speed", "rms"),
    "speed_max": Figure("speed", "max"),
    "speed_mean": Figure("speed", "mean"),
    "distance": Figure("distance_relative", "final", scale=100.0),
}
"""By the name that the section has for them: mg, degrees, m/s; signed error of the distance, % of the way."""


class Draws(NamedTuple):
    """A figure of every line and device, k of them.

    Attributes
    ----------
    values : ndarray (k,)
        One per recording.
    lines : ndarray (k,)
        Number of the line, a draw of the rails.
    is_size : bool
        Whether it cannot be negative, as an rms cannot.
    """

    values: FloatArray
    lines: FloatArray
    is_size: bool = False

    @property
    def line_count(self) -> int:
        """How many lines there are."""
        return len(np.unique(self.lines))

    def mean(self) -> tuple[float, float, float]:
        """Mean over lines and devices with the ends of its 95 % interval, of which lines are the clusters."""
        found = interval(self.values, self.lines)
        found = found.within(0.0) if self.is_size else found
        return found.value, found.low, found.high

    def by_line(self) -> FloatArray:
        """Mean over the devices, line by line."""
        means: FloatArray = np.asarray(pd.Series(self.values).groupby(self.lines).mean(), dtype=np.float64)
        return means


@dataclass(frozen=True)
class Lines:
    """Scores of all recordings, by the part that a method plays.

    Attributes
    ----------
    table : pandas.DataFrame
        Rows of the score table: whole signal, against the truth, one grade of IMU, of what a train has.
    names : dict of str to str
        The scenario's name of the method that plays a part.
    mounts : tuple of str
        Where the IMUs are, in the order of the scenario.
    """

    table: pd.DataFrame
    names: dict[str, str]
    mounts: tuple[str, ...]

    def draws(self, part: str, figure: str, mount: str) -> Draws:
        """A figure of a part, where a mount is; of no values where it has none."""
        wanted, table = FIGURES[figure], self.table
        chosen = (
            (table["estimator"] == self.names.get(part, ""))
            & (table["mount"] == mount)
            & (table["quantity"] == wanted.quantity)
            & (table["metric"] == wanted.metric)
            & (table["window"] == wanted.window)
        )
        rows = table[chosen].sort_values(["track_draw", "sensor_draw"])
        lines = rows["track_draw"].to_numpy(dtype=np.float64)
        return Draws(wanted.scale * rows["value"].to_numpy(), lines, wanted.metric in ("rms", "max"))

    def has(self, *parts: str) -> bool:
        """Whether all parts were run and none of their recordings failed: only then they are judged."""
        return bool(self.mounts) and all(
            len(self.draws(part, _main_of(part), mount).values) == self.recordings(mount)
            for part in parts
            for mount in self.mounts
        )

    def recordings(self, mount: str) -> int:
        """How many recordings there are of a mount."""
        own = self.table[self.table["mount"] == mount]
        return len(own[["track_draw", "sensor_draw"]].drop_duplicates())

    def by_mount(self, part: str, figure: str) -> dict[str, Draws]:
        """A figure of a part, at each mount."""
        return {mount: self.draws(part, figure, mount) for mount in self.mounts}


def _main_of(part: str) -> str:
    """The figure without which a part has nothing to say."""
    return "roll" if part in ("complementary", "complementary_printed") else "speed"


def lines_of(scores: pd.DataFrame, methods: Sequence[Method]) -> Lines:
    """Gather the scores of what a train has, of the first grade of IMU that is not an ideal one."""
    names = PAPER.names(methods)
    table = without_ablations(scores)
    wanted = (table["reference"] == "truth") & (table["band"] == "full") & (table["status"] == OK)
    table = table[wanted & table["estimator"].isin(names.values())].astype({"mount": str, "imu": str})
    grades = sorted(table["imu"].unique(), key=lambda grade: grade == "ideal")
    table = table[table["imu"] == grades[0]] if grades else table
    order = scores["mount"].astype(str).unique()
    mounts = tuple(mount for mount in order if (table["mount"] == mount).any())
    return Lines(table, names, mounts)


def shares_of_chance(by_calibration: Mapping[str, Draws]) -> dict[str, float]:
    """Standard deviations of a figure between calibrations, between lines, and between devices on one line.

    Calibrations: of their means over lines and devices. Lines: of the means over devices about that of their
    calibration, all calibrations together. Devices: about the mean of their line, likewise.
    """
    means = [draws.values.mean() for draws in by_calibration.values()]
    lines = [draws.by_line() - draws.values.mean() for draws in by_calibration.values()]
    devices = [
        draws.values - pd.Series(draws.values).groupby(draws.lines).transform("mean").to_numpy()
        for draws in by_calibration.values()
    ]
    return {
        "calibrations": float(np.std(means, ddof=1)),
        "lines": _spread(lines, [draws.line_count - 1 for draws in by_calibration.values()]),
        "devices": _spread(devices, [len(one.values) - one.line_count for one in by_calibration.values()]),
    }


def _spread(deviations: Sequence[FloatArray], freedom: Sequence[int]) -> float:
    """Standard deviation of values about their means; NaN without any degree of freedom."""
    square = sum(float(np.square(one).sum()) for one in deviations)
    return (square / sum(freedom)) ** 0.5 if sum(freedom) > 0 else float("nan")
