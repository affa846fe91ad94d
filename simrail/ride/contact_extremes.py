"""The extremes of the forces between wheels and rails over a ride, by name, and warnings of them.

Of every output row, unfiltered: what a standard's filter and windows make of forces is in
`simrail.scoring`. They are gathered in `simrail.vehicle.engines.contact_extremes`.
"""

from typing import Any

import numpy as np

from simrail.core.jit import FloatArray
from simrail.vehicle.contact.contact import CONTACT
from simrail.vehicle.engines.contact_extremes import KINDS, gather, gathered_of
from simrail.vehicle.engines.records import RecordArray
from simrail.vehicle.model import VehicleModel

MOST_LOAD = 3.0
"""Over its load at rest: a rigid track and a contact made for that load say little of more."""
LONGEST_JUMP_S = 5e-3
"""A wheel may leave its rail for so long, as one does over a joint."""


class ContactExtremes:
    """What is said of the forces of every ride, whether or not they are kept.

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
        self._side = np.array([wheel.side for wheel in model.wheels], dtype=np.float64)
        self._gathered = gathered_of(len(model.axle_names))
        # Compiled now, so that no clock of a ride counts it.
        self.add(np.zeros(0), np.zeros((0, len(model.wheels)), CONTACT))

    def add(self, time_s: FloatArray, told: RecordArray) -> None:
        """Take the next rows (n,), records `simrail.vehicle.contact.contact.CONTACT` (n, w)."""
        gather(time_s, told, self._static_n, self._side, self._rate_hz, self._gathered)

    def summary(self) -> dict[str, Any]:
        """The extremes as plain values, each with its wheel or axle, place and time.

        What has not occurred (a wheel without load, 2 m of way) is left out.
        """
        said: dict[str, Any] = {}
        for kind, found in zip(KINDS, self._gathered.found, strict=True):
            if np.isfinite(found["value"]):
                names = self._model.axle_names if "sum_y" in kind else self._model.wheel_names
                said[kind] = {
                    "value": float(found["value"]),
                    "name": names[int(found["which"])],
                    "position_m": float(found["position_m"]),
                    "time_s": float(found["time_s"]),
                }
        rows, lifted = self._gathered.rows
        said["share_of_time_a_wheel_carries_nothing"] = float(lifted / max(rows, 1.0))
        said["samples"] = f"unfiltered, at {self._rate_hz:g} Hz"
        return said

    def warnings(self) -> list[str]:
        """What of them is beyond sense, one line each."""
        said, lines = self.summary(), []
        most, longest = said.get("greatest_q_over_q0"), said.get("longest_without_load_s")
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
