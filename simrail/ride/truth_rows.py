"""Rows of a truth that an engine makes, written segment by segment into arrays on disk."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simrail.core.jit import FloatArray
from simrail.ride.abeam import abeam
from simrail.ride.contact_forces import contact_columns
from simrail.ride.mount_motion import give_back
from simrail.ride.truth import BODY_ARRAYS
from simrail.ride.truth_files import DOUBLE, SINGLE, create_arrays
from simrail.vehicle.engines.engine import Segment

if TYPE_CHECKING:
    from simrail.ride.ride import Ride


class TruthRows:
    """The arrays of one ride, and what goes on from segment to segment.

    Parameters
    ----------
    ride : Ride
        What is driven.
    folder : Path
        Where the arrays are made.
    """

    def __init__(self, ride: Ride, folder: Path) -> None:
        self._ride, model = ride, ride.vehicle
        self.duration_s = float(np.floor(ride.profile.duration_s * ride.rate_hz) / ride.rate_hz)
        self._arrays = create_arrays(
            folder,
            round(self.duration_s * ride.rate_hz) + 1,
            bodies=len(ride.kept_bodies),
            wheels=len(ride.kept_wheels),
            wheel_states=4 if ride.kept is None else 0,
            contact_every=ride.contact_every,
            contacts=len(model.wheels),
            compact=ride.kept is not None,
        )
        self._spins = list(model.spin_inertia_kgm2)
        self._done = 0
        self._place_m = ride.profile.start_m
        self._yaw_rad = np.zeros(len(model.bodies))
        self._turned_rad = np.zeros(len(model.wheels))
        # Pitch rate and acceleration of each body in the row before.
        self._pitch = np.zeros((0, len(model.bodies), 2))

    def add(self, segment: Segment) -> FloatArray:
        """Write the rows of a segment; returns their times (n,)."""
        arrays = self._arrays
        here = slice(self._done, self._done + len(segment.time_s))
        arrays["time_s"][here] = np.arange(here.start, here.stop) / self._ride.rate_hz
        times = np.array(arrays["time_s"][here])
        self._add_bodies(segment, here)
        # Where the wheels drive, the vehicle is where they have brought it.
        if self._ride.drive == "wheels":
            places = _places(self._ride, self._place_m, segment)
            self._place_m = float(places[-1])
        else:
            places = self._ride.profile.motion(times)[0]
        arrays["reference_position_m"][here] = places
        self._add_wheels(segment, here)
        self._done = here.stop
        give_back(arrays.values())
        return times

    def finish(self) -> None:
        """Count the wheels' angles from the first row, and bring everything to disk."""
        for w in range(len(self._ride.kept_wheels)):
            self._arrays[f"wheel_{w}"][:] -= self._arrays[f"wheel_{w}"][0]
            give_back(self._arrays.values())
        for array in self._arrays.values():
            array.flush()  # type: ignore[attr-defined]

    def _add_bodies(self, segment: Segment, here: slice) -> None:
        for i, b in enumerate(self._ride.kept_bodies):
            motion = segment.body(b)
            # The heading is continuous over the segments, too.
            motion[:, 11] += 2.0 * np.pi * np.round((self._yaw_rad[b] - motion[0, 11]) / (2.0 * np.pi))
            self._yaw_rad[b] = motion[-1, 11]
            if self._ride.kept is None:
                self._arrays[f"body_{i}"][here] = motion
            else:
                self._arrays[f"body_{i}"][here] = motion[:, _columns(DOUBLE)]
                self._arrays[f"rates_{i}"][here] = motion[:, _columns(SINGLE)]

    def _add_wheels(self, segment: Segment, here: slice) -> None:
        """Angles of the wheels in their axle boxes, which pitch; contact states; contacts that are kept."""
        arrays, model, every = self._arrays, self._ride.vehicle, self._ride.contact_every
        step_s = 1.0 / self._ride.rate_hz
        pitch = np.stack([segment.rate[:, :, 1], segment.angular_acceleration[:, :, 1]], axis=2)
        before = len(self._pitch)
        pitch = np.concatenate([self._pitch, pitch])
        self._pitch = pitch[-1:].copy()
        for i, w in enumerate(self._ride.kept_wheels):
            wheel = model.wheels[w]
            axle = pitch[:, model.body_names.index(wheel.axle)]
            box = self._turned_rad[w] + _integral(axle[:, 0], axle[:, 1], step_s)
            self._turned_rad[w] = box[-1]
            spin = self._spins.index(wheel.spin)
            arrays[f"wheel_{i}"][here] = segment.spin_rad[:, spin] - box[before:]
            if self._ride.kept is None:
                arrays[f"wheel_state_{i}"][here] = segment.states[:, 4 * w : 4 * w + 4]
        if every:
            for w in range(len(model.wheels)):
                kept = slice(-(-here.start // every), -(-here.stop // every))
                told = segment.contacts[kept.start * every - here.start :: every, w]
                arrays[f"contact_{w}"][kept] = contact_columns(told)


def _columns(names: tuple[str, ...]) -> list[int]:
    """Columns of some arrays of a body among all of them."""
    return [3 * BODY_ARRAYS.index(name) + j for name in names for j in range(3)]


def _places(ride: Ride, begin_m: float, segment: Segment) -> FloatArray:
    """Where the vehicle's reference point is, s (n,), from the guide's body; ``begin_m`` is just before."""
    model, step = ride.vehicle, 1.0 / ride.rate_hz
    led = model.body_names.index(model.guide.body)
    offset = model.bodies[led].position_m[0]
    ahead = np.einsum("nk,nk->n", segment.velocity[:, led], segment.rotation[:, led, :, 0])
    guess = begin_m + offset + np.cumsum(ahead) * step
    return abeam(ride.track, guess, segment.position[:, led])[4] - offset


def _integral(rate: FloatArray, slope: FloatArray, step_s: float) -> FloatArray:
    """Running integral (n,) of samples whose derivative is known: Hermite, fourth order."""
    pieces = step_s / 2.0 * (rate[:-1] + rate[1:]) + step_s**2 / 12.0 * (slope[:-1] - slope[1:])
    return np.concatenate([[0.0], np.cumsum(pieces)])
