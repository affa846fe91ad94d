"""The extremes of the forces between wheels and rails over a ride, gathered piece by piece, and warnings.

Of every output row, unfiltered: what a standard's filter and windows make of forces is in
`simrail.scoring`. Sliding means are over 2 m of way, as EN 14363 takes them of Y/Q and of the sum of Y.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from simrail.core.jit import FloatArray
from simrail.vehicle.engines.derailment import outward_ratio
from simrail.vehicle.engines.records import RecordArray
from simrail.vehicle.model import VehicleModel

WINDOW_M = 2.0
"""Way of the sliding means."""
STEP_M = 1e-3
"""Way that is worth a sample of a sliding mean: at rest there are none."""
MOST_LOAD = 3.0
"""Over its load at rest: a rigid track and a contact made for that load say little of more."""
LONGEST_JUMP_S = 5e-3
"""A wheel may leave its rail for so long, as one does over a joint."""

Place = dict[str, Any]
"""A value and where it occurred: plain values, for the manifest."""


class ContactExtremes:
    """What is kept of the forces of each wheel, whether or not they are.

    Parameters
    ----------
    model : VehicleModel
        Whose wheels.
    rate_hz : float
        Output rate.
    gravity_mps2 : float
        Gravity.
    """

    def __init__(self, model: VehicleModel, *, rate_hz: float, gravity_mps2: float) -> None:
        self._model, self._rate_hz = model, rate_hz
        self._static_n = model.wheel_load_n(gravity_mps2)
        self._side = np.array([wheel.side for wheel in model.wheels])
        self._found: dict[str, Place] = {}
        self._means = [_SlidingMean(3) for _ in model.axle_names]
        self._last_m: FloatArray | None = None
        self._up = np.zeros(len(model.wheels), dtype=np.int64)
        self._rows = self._rows_up = 0

    def add(self, time_s: FloatArray, told: RecordArray) -> None:
        """Take the next rows (n,), records `simrail.vehicle.contact.contact.CONTACT` (n, w)."""
        load, guiding = np.array(told["load_n"]), np.array(told["guiding_n"])
        place = np.array(told["position_m"])
        names, axles = self._model.wheel_names, self._model.axle_names
        ratio = load / self._static_n
        self._note("greatest_q_n", load, time_s, place, names)
        self._note("greatest_q_over_q0", ratio, time_s, place, names)
        self._note("smallest_q_over_q0", ratio, time_s, place, names, least=True)
        along, summed = place[:, ::2], guiding[:, ::2] + guiding[:, 1::2]
        self._note("greatest_sum_y_n", np.abs(summed), time_s, along, axles)
        quotient = outward_ratio(guiding, load, self._side)
        before = along[:1] if self._last_m is None else self._last_m
        moved = np.abs(np.diff(along, axis=0, prepend=before))
        self._last_m = along[-1:]
        for a, axle in enumerate(axles):
            values = np.column_stack([summed[:, a], quotient[:, 2 * a : 2 * a + 2]])
            rows, means = self._means[a].add(moved[:, a], values)
            if len(rows):
                here = time_s[rows], place[rows, 2 * a : 2 * a + 2]
                self._note("greatest_sum_y_2m_n", np.abs(means[:, :1]), here[0], here[1][:, :1], [axle])
                self._note("greatest_y_over_q_2m", means[:, 1:], *here, names[2 * a : 2 * a + 2])
        self._lifted(np.array(told["normal_n"]) <= 0.0, time_s, place)

    def summary(self) -> dict[str, Any]:
        """The extremes as plain values, each with its wheel or axle, place and time."""
        return {
            **self._found,
            "share_of_time_a_wheel_carries_nothing": self._rows_up / max(self._rows, 1),
            "samples": f"unfiltered, at {self._rate_hz:g} Hz",
        }

    def warnings(self) -> list[str]:
        """What of them is beyond sense, one line each."""
        lines = []
        most, longest = self._found.get("greatest_q_over_q0"), self._found.get("longest_without_load_s")
        if most is not None and most["value"] > MOST_LOAD:
            lines.append(
                f"wheel {most['name']} carried {most['value']:.1f} times its load at rest at "
                f"s = {most['position_m']:.1f} m, {most['time_s']:.2f} s; above {MOST_LOAD:g} times, a rigid "
                "track and a contact made for the load at rest mean little"
            )
        if longest is not None and longest["value"] > LONGEST_JUMP_S:
            lines.append(
                f"wheel {longest['name']} was in the air for {1e3 * longest['value']:.0f} ms until "
                f"s = {longest['position_m']:.1f} m, {longest['time_s']:.2f} s; see to speed and rails there"
            )
        return lines

    def _note(
        self,
        what: str,
        values: FloatArray,
        time_s: FloatArray,
        place_m: FloatArray,
        names: list[str],
        *,
        least: bool = False,
    ) -> None:
        """Keep the greatest, or the least, of values (n, k) if it is beyond what is kept."""
        row, column = divmod(int(values.argmin() if least else values.argmax()), values.shape[1])
        value = float(values[row, column])
        known = self._found.get(what)
        if known is None or (value < known["value"] if least else value > known["value"]):
            self._found[what] = {
                "value": value,
                "name": names[column],
                "position_m": float(place_m[row, column]),
                "time_s": float(time_s[row]),
            }

    def _lifted(self, up: npt.NDArray[np.bool_], time_s: FloatArray, place_m: FloatArray) -> None:
        """Count rows in which wheels carry nothing (n, w), and how long each does so at a stretch."""
        self._rows += len(up)
        self._rows_up += int(up.any(axis=1).sum())
        for w in np.flatnonzero(up.any(axis=0) | (self._up > 0)):
            since = np.where(up[:, w], 0, np.arange(1, len(up) + 1))
            # Rows since the last one with a load; those before this piece are carried on.
            run = np.arange(1, len(up) + 1) - np.maximum.accumulate(since)
            run[np.maximum.accumulate(since) == 0] += self._up[w]
            self._up[w] = run[-1]
            lasted = (run / self._rate_hz)[:, None]
            name = self._model.wheel_names[w]
            self._note("longest_without_load_s", lasted, time_s, place_m[:, w : w + 1], [name])


class _SlidingMean:
    """Means of some values over the last 2 m of way, over pieces that come one after the other."""

    def __init__(self, columns: int) -> None:
        self._way, self._total = np.zeros(1), np.zeros((1, columns))
        self._value: FloatArray | None = None

    def add(self, moved: FloatArray, values: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
        """Take the next rows: the way since the one before (n,), and values (n, k).

        Returns
        -------
        rows : ndarray (m,)
            Those of the new rows at which a millimetre has been made and 2 m lie behind.
        means : ndarray (m, k)
            Means there.
        """
        former = values[:1] if self._value is None else self._value
        middle = 0.5 * (values + np.concatenate([former, values[:-1]]))
        self._value = values[-1:]
        way = self._way[-1] + np.cumsum(moved)
        total = self._total[-1] + np.cumsum(middle * moved[:, None], axis=0)
        marks = np.floor(way / STEP_M)
        rows = np.flatnonzero(np.diff(marks, prepend=np.floor(self._way[-1] / STEP_M)) > 0.0)
        last = len(way) - 1
        if not len(rows):
            # What little way was made is not lost.
            self._way[-1], self._total[-1] = way[last], total[last]
            return rows, np.empty((0, values.shape[1]))
        self._way = np.concatenate([self._way, way[rows]])
        self._total = np.concatenate([self._total, total[rows]])
        new = slice(len(self._way) - len(rows), None)
        begin = self._way[new] - WINDOW_M
        whole = begin >= self._way[0]
        at = np.clip(np.searchsorted(self._way, begin, side="right") - 1, 0, len(self._way) - 2)
        share = (begin - self._way[at]) / (self._way[at + 1] - self._way[at])
        earlier = self._total[at] + share[:, None] * (self._total[at + 1] - self._total[at])
        means = (self._total[new] - earlier) / WINDOW_M
        first = max(int(np.searchsorted(self._way, self._way[-1] - WINDOW_M, side="right")) - 1, 0)
        self._way, self._total = self._way[first:].copy(), self._total[first:].copy()
        if rows[-1] < last:
            self._way[-1], self._total[-1] = way[last], total[last]
        return rows[whole], means[whole]
