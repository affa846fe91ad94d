"""The map as the evidence takes it: a table over places, and which element's errors matter where."""

from dataclasses import dataclass

import numpy as np

from simrail.core.jit import FloatArray, IntArray
from simrail.track.alignment import element_starts
from simrail.track.design import Curve, TrackDesign

STEP_M, MOST_ROWS = 0.25, 200_000
"""Step of the table, and its longest."""

K1, K2, K3, ALONG, LEVEL, UP = range(6)
"""Columns: Darboux curvatures of the track frame, and the share of upward gravity along its X, Y and Z."""


@dataclass(frozen=True)
class MapTable:
    """The design between two places, evaluated by straight lines between rows.

    Attributes
    ----------
    first_m, step_m : float
        Place of the first row, and distance of rows.
    rows : ndarray (n, 6)
        The three Darboux curvatures, and the three shares of what gravity pushes.
    joints_m : ndarray (j,)
        Places where two elements meet, in the range.
    bends : ndarray (m, 2)
        Place of the middle of each curve of constant curvature, and that curvature.
    starts_m, is_curve : ndarray
        Starts of all elements, with the end of the last, and whether each is such a curve.
    """

    first_m: float
    step_m: float
    rows: FloatArray
    starts_m: FloatArray
    curves: IntArray

    def at(self, place_m: FloatArray) -> FloatArray:
        """Columns (n, 6) at places (n,); beyond the table those of its ends."""
        at = np.clip((place_m - self.first_m) / self.step_m, 0.0, len(self.rows) - 1.000001)
        row = at.astype(np.int64)
        share = (at - row)[:, None]
        values: FloatArray = self.rows[row] + share * (self.rows[row + 1] - self.rows[row])
        return values

    def joints(self, low_m: float, high_m: float) -> FloatArray:
        """Places of the joints of elements in a range."""
        inner = self.starts_m[1:-1]
        return inner[(inner > low_m) & (inner < high_m)]

    def moved(self, joint_m: float, place_m: FloatArray) -> FloatArray:
        """Share (n,) of the error of a joint's place that is felt at places: 1 there, 0 at its neighbours."""
        i = int(np.searchsorted(self.starts_m, joint_m))
        share: FloatArray = np.interp(place_m, self.starts_m[i - 1 : i + 2], [0.0, 1.0, 0.0])
        return share

    def curves_in(self, low_m: float, high_m: float) -> IntArray:
        """Numbers of the elements of constant curvature that lie in a range, or in part."""
        low, high = self.starts_m[self.curves], self.starts_m[self.curves + 1]
        return self.curves[(high > low_m) & (low < high_m)]

    def in_curve(self, curve: int, place_m: FloatArray) -> FloatArray:
        """Share (n,) of a curve's error of curvature or cant at places: 1 inside, falling over its ends."""
        starts = self.starts_m
        low = starts[curve - 1] if curve > 0 else starts[0] - 1.0
        high = starts[curve + 2] if curve + 2 < len(starts) else starts[-1] + 1.0
        share: FloatArray = np.interp(
            place_m, [low, starts[curve], starts[curve + 1], high], [0.0, 1.0, 1.0, 0.0]
        )
        return share


def map_table(track: TrackDesign, low_m: float, high_m: float) -> MapTable:
    """Table of a design between two places; what lies beyond its ends goes on as its last element does."""
    step = max(STEP_M, (high_m - low_m) / MOST_ROWS)
    places = low_m + step * np.arange(int(np.ceil((high_m - low_m) / step)) + 2)
    frame = track.frame_extended(places)
    level = np.cos(frame.pitch_rad)
    shares = (-np.sin(frame.pitch_rad), level * np.sin(frame.roll_rad), level * np.cos(frame.roll_rad))
    rows = np.column_stack([frame.k, *shares])
    curves = [i for i, element in enumerate(track.elements) if isinstance(element, Curve)]
    starts = np.asarray(element_starts(track.elements, track.start_m), dtype=np.float64)
    return MapTable(low_m, step, rows, starts, np.array(curves, dtype=np.int64))
