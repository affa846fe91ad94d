"""From a ride and its truth to what short waves add: inputs at every wheel, modes, motions of the bodies.

The vehicle runs over the short-wave surface of the rails at the places that the ride put it to, with wheels
that have turned as they did. All is linear: the ride's longer waves and this part add up. Work is done
piece by piece in bounded memory. Where the truth's rate is below that of the vibration, what it cannot hold
is taken off the inputs by a linear-phase low-pass, which commutes with the vehicle, so that rates and
accelerations stay derivatives.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import signal

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, IntArray
from simrail.ride.truth import Truth
from simrail.ride.vibration.floor import Floor
from simrail.ride.vibration.sources import Vibration
from simrail.track.rail_surface import RailSurface, lay_surface
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.vibration.car_bodies import car_bodies
from simrail.vehicle.vibration.linear_model import (
    BENDING,
    HEAVE,
    PITCH,
    ROLL,
    SWAY,
    Bending,
    LinearVehicle,
    linear_vehicle,
)
from simrail.vehicle.vibration.modal import ComplexArray, Modes, march_modes, modes_of
from simrail.vehicle.vibration.wheels import wheel_surface

_PIECE = 8192
"""Samples of a piece."""
_PASS, _STOP, _STOP_DB = 0.4, 0.5, 60.0
"""Edges of the low-pass before samples are left out, in output rates; its stop band, dB."""
_COARSE_S = 0.1
"""Distance of the samples that what follows the speed is made from."""


@dataclass(frozen=True, eq=False)
class Piece:
    """Short-wave motion over some rows of a truth.

    Attributes
    ----------
    first : int
        Its first row.
    motions : dict of str to ndarray (n, 12)
        Of each body, columns `simrail.ride.vibration.short_waves.COLUMNS`.
    bendings : dict of str to ndarray (n, 3)
        Modal coordinate of each body that bends, and its derivatives.
    loads : ndarray (n, w)
        Load of each wheel beyond that of the ride, N.
    """

    first: int
    motions: dict[str, FloatArray]
    bendings: dict[str, FloatArray]
    loads: FloatArray


def bendings_of(vibration: Vibration, model: VehicleModel) -> tuple[Bending, ...]:
    """What of a vehicle bends."""
    if vibration.bending is None:
        return ()
    wanted = (vibration.bending.frequency_hz, vibration.bending.damping_ratio)
    bent = (car.bending(*wanted) for car in car_bodies(model))
    return tuple(bending for bending in bent if bending is not None)


def linear_vehicle_of(
    vibration: Vibration, model: VehicleModel, *, gravity_mps2: float, speed_mps: float = 0.0
) -> LinearVehicle:
    """The linear model that a vibration shakes, at the speed of a ride; contacts hold if that is 0."""
    return linear_vehicle(
        model,
        vibration.support,
        bending=bendings_of(vibration, model),
        gravity_mps2=gravity_mps2,
        speed_mps=speed_mps if vibration.lateral_creep and speed_mps > 0.0 else None,
    )


class Shaker:
    """The vibration of one ride.

    Parameters
    ----------
    vibration : Vibration
        What shakes.
    truth : Truth
        The ride as its engine computed it.
    model : VehicleModel
        The vehicle.
    seed : int
        Root seed of the track draw.
    surface : RailSurface, optional
        Short waves of the rails, if not those that ``vibration.rails`` draws.

    Raises
    ------
    InputError
        If the rate of the vibration is no multiple of the truth's.
    """

    def __init__(
        self,
        vibration: Vibration,
        truth: Truth,
        model: VehicleModel,
        *,
        seed: int,
        surface: RailSurface | None = None,
    ) -> None:
        self.every = round(vibration.rate_hz / truth.rate_hz)
        if self.every < 1 or abs(self.every * truth.rate_hz - vibration.rate_hz) > 1e-6 * vibration.rate_hz:
            raise InputError(
                "is no multiple of the rate of the truth",
                field="vibration.rate_hz",
                value=vibration.rate_hz,
                limit=f"a whole multiple of {truth.rate_hz:g} Hz",
                remedy=f"try {truth.rate_hz * max(self.every, 1):g}",
            )
        self._vibration, self._truth, self._model, self._seed = vibration, truth, model, seed
        speed = _shaken_speed_mps(truth) if vibration.lateral_creep else 0.0
        self.vehicle = linear_vehicle_of(vibration, model, gravity_mps2=truth.gravity_mps2, speed_mps=speed)
        self.modes = modes_of(self.vehicle, step_s=1.0 / vibration.rate_hz)
        self.bendings = bendings_of(vibration, model)
        self._surface = surface or lay_surface(vibration.rails, truth.track, seed=seed)
        self._wheels = [
            None if vibration.wheels is None else wheel_surface(vibration.wheels, wheel.name, seed=seed)
            for wheel in model.wheels
        ]
        self._taps = _low_pass(self.every)
        self._reading = _Reading.of(self.vehicle, self.modes, model, self.bendings)

    def inputs(self, samples: IntArray) -> FloatArray:
        """What pushes wheel and rail apart at each wheel at numbers of samples: (n, w), m, not low-passed."""
        truth, model = self._truth, self._model
        at = np.clip(samples / self.every, 0.0, len(truth.time_s) - 1.0)
        low = np.minimum(at.astype(np.int64), len(truth.time_s) - 2)
        share = at - low
        first, last = int(low[0]), int(low[-1]) + 2

        def over(values: FloatArray) -> FloatArray:
            here = np.asarray(values[first:last])
            between: FloatArray = here[low - first] * (1.0 - share) + here[low - first + 1] * share
            return between

        place = over(truth.reference_position_m)
        out = np.empty((len(samples), len(model.wheels)))
        for w, wheel in enumerate(model.wheels):
            ahead = model.body(wheel.axle).position_m[0]
            out[:, w] = self._surface.height(0 if wheel.side > 0 else 1, place + ahead)
            tread = self._wheels[w]
            if tread is not None:
                out[:, w] += tread.height(over(truth.wheel_angles[wheel.name]))
        return out

    def filtered(self, samples: IntArray) -> FloatArray:
        """`inputs` at consecutive numbers of samples, less what the truth's rate cannot hold."""
        half = len(self._taps) // 2
        if half == 0:
            return self.inputs(samples)
        wide = self.inputs(np.arange(samples[0] - half, samples[-1] + half + 1))
        low: FloatArray = signal.oaconvolve(wide, self._taps[:, None], mode="valid", axes=0)
        return low

    def run(self) -> Iterator[Piece]:
        """The vibration over all rows of the truth, piece by piece, from rest on the rails."""
        modes, rows, every = self.modes, len(self._truth.time_s), self.every
        state = -(modes.drive @ self.filtered(np.arange(-1, 0))[0]) / modes.eigenvalues
        floors = self._floors()
        step = max(_PIECE // every, 1)
        for first in range(0, rows, step):
            count = min(step, rows - first)
            # The samples after the last row of the piece before, to the last row of this one.
            begin = 0 if first == 0 else (first - 1) * every + 1
            samples = np.arange(begin, (first + count - 1) * every + 1)
            push = self.filtered(np.arange(begin - 2, samples[-1] + 2))
            force = np.ascontiguousarray(push @ modes.drive.T)
            z = np.empty((len(samples), len(modes.decay)), dtype=np.complex128)
            march_modes(modes.decay, modes.weights, force, state, z)
            kept = slice((first * every) - begin, None, every)
            yield self._read(first, z[kept], push[2:-1][kept], floors)

    def _read(self, first: int, z: ComplexArray, push: FloatArray, floors: dict[str, Floor]) -> Piece:
        motions, bendings, loads = self._reading.read(z, push)
        share, extras = self._vibration.structure_borne, {}
        for car in car_bodies(self._model):
            extras[car.name] = floors[car.name].at(np.arange(first, first + len(z)))
            if share:
                extras[car.name] += share * np.mean([motions[name][:, :3] for name in car.carriers], axis=0)
        for name, extra in extras.items():
            motions[name][:, :3] += extra
        return Piece(first, motions, bendings, loads)

    def _floors(self) -> dict[str, Floor]:
        truth = self._truth
        skip = max(1, round(_COARSE_S * truth.rate_hz))
        time: FloatArray = np.asarray(truth.time_s[::skip])
        place: FloatArray = np.asarray(truth.reference_position_m[::skip])
        if len(time) < 3:
            time = np.array([0.0, 1.0, 2.0]) * _COARSE_S
            place = np.array([1.0, 1.0, 1.0]) * place[0]
        speed: FloatArray = np.asarray(np.gradient(place, time), dtype=np.float64)
        return {
            car.name: Floor(
                self._vibration,
                car.name,
                time_s=time,
                speed_mps=speed,
                acceleration_mps2=np.gradient(speed, time),
                rate_hz=truth.rate_hz,
                seed=self._seed,
            )
            for car in car_bodies(self._model)
        }


def _shaken_speed_mps(truth: Truth) -> float:
    """Speed of a ride where most shakes: the mean of the speed over the way, ``sum v^2 / sum v``."""
    skip = max(1, round(_COARSE_S * truth.rate_hz))
    steps = np.abs(np.diff(np.asarray(truth.reference_position_m[::skip], dtype=np.float64)))
    way = float(steps.sum())
    return float(np.sum(steps**2)) / (way * skip / truth.rate_hz) if way > 0.0 else 0.0


def _low_pass(every: int) -> FloatArray:
    """Coefficients of the low-pass before every ``every``-th sample is taken; 1 if all are."""
    if every == 1:
        return np.ones(1)
    taps, beta = signal.kaiserord(_STOP_DB, 2.0 * (_STOP - _PASS) / every)
    taps |= 1
    low: FloatArray = signal.firwin(taps, (_PASS + _STOP) / every, window=("kaiser", beta))
    return low


@dataclass(frozen=True, eq=False)
class _Reading:
    """How motions and loads are read off modes: real matrices on (Re z, Im z), and on the inputs."""

    bodies: tuple[str, ...]
    bent: tuple[str, ...]
    of_modes: FloatArray
    of_inputs: FloatArray

    @classmethod
    def of(
        cls, vehicle: LinearVehicle, modes: Modes, model: VehicleModel, bendings: tuple[Bending, ...]
    ) -> "_Reading":
        bodies, bent = tuple(model.body_names), tuple(bending.body for bending in bendings)
        take = np.array(
            [vehicle.row(body, motion) for body in bodies for motion in (HEAVE, ROLL, PITCH, SWAY)]
            + [vehicle.row(body, BENDING) for body in bent]
        )
        parts, inputs = [], []
        for row in take:
            parts += [row @ modes.place, row @ modes.rate, row @ modes.acceleration]
            inputs += [np.zeros(modes.direct.shape[1]), np.zeros(modes.direct.shape[1]), row @ modes.direct]
        parts += list(vehicle.load @ modes.place)
        inputs += list(np.diag(vehicle.contact_npm))
        matrix = np.array(parts)
        return cls(bodies, bent, np.hstack([matrix.real, -matrix.imag]).T.copy(), np.array(inputs).T.copy())

    def read(
        self, z: ComplexArray, push: FloatArray
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray], FloatArray]:
        """Motions of bodies, bendings, and loads (n, w), from modes (n, m) and inputs (n, w)."""
        signals = np.hstack([z.real, z.imag]) @ self.of_modes + push @ self.of_inputs
        motions = {body: signals[:, 12 * i : 12 * i + 12] for i, body in enumerate(self.bodies)}
        at = 12 * len(self.bodies)
        bendings = {body: signals[:, at + 3 * i : at + 3 * i + 3] for i, body in enumerate(self.bent)}
        return motions, bendings, signals[:, at + 3 * len(self.bent) :]
