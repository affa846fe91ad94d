"""A vehicle in steady running on smooth straight level track, and its equations linearised there.

The right-hand side is the one that the engines integrate (`simrail.vehicle.engines.forces`), so what is
linearised is what rides. It is written in a frame that travels with the driver's point at the speed V:
per body the displacement from its nominal place, the turn from its equilibrium (a rotation vector in
track axes), their rates; then the rate of every spin; then the first-order states (creep, inner states
of suspensions). In this frame nothing depends on the place s nor on the angle of a wheel, and the
integrals of the creep states do not occur: there are no ignorable coordinates, and the zero
eigenvalues that a full set of coordinates would have are absent.

Accelerations follow from Newton and Euler. Derivatives are central differences. The guide that drives
a ride takes part: it stands for the neighbouring modules and the motors.

Not here: loci over the speed and critical speeds (`simrail.vehicle.stability`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.track.design import TrackDesign
from simrail.track.elements import Straight
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.contact.contact_tables import rest_drops_m
from simrail.vehicle.engines.force_data import ForceData, memory_of, pack, states_of
from simrail.vehicle.engines.forces import forces
from simrail.vehicle.engines.records import DRIVE, POSE, WRENCH
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile

ComplexArray = npt.NDArray[np.complex128]

_MIDDLE_M = 256.0
"""Where the vehicle stands: far from both ends of a track of twice this length."""
_STEPS = {"place": 1e-6, "turn": 1e-6, "velocity": 1e-5, "rate": 1e-5, "spin": 1e-5, "inner": 1e-7}
"""Difference steps (m, rad, m/s, rad/s): small against a contact patch's penetration (0.1 mm) and the
creepage that saturates it (3e-3), large against rounding."""
_PITCH = 4
"""Number of the turn about y among the six motions of a body."""
_FULL_SIZE_RADIUS_M = 0.25
"""No full-size wheel is smaller. A smaller one is a scale vehicle's: of like build, its contact gives way by
the 5/3rd power of its size, and places step by less."""
_BALANCED_MPS2 = 1e-6
"""Acceleration that an equilibrium may leave: far above rounding, far below any motion. A stiffer contact,
as that of a scale vehicle, makes more of the same error of place."""


def state_matrix(
    rates: Callable[[FloatArray], FloatArray], state: FloatArray, steps: FloatArray
) -> FloatArray:
    """Jacobian (n, n) of a right-hand side ``rates(state)`` by central differences of the given steps."""
    matrix = np.empty((state.size, state.size))
    for i, step in enumerate(steps):
        ahead, behind = state.copy(), state.copy()
        ahead[i] += step
        behind[i] -= step
        matrix[:, i] = (rates(ahead) - rates(behind)) / (2.0 * step)
    return matrix


@dataclass(frozen=True, eq=False)
class RunningVehicle:
    """A vehicle laid out for steady running; made by `running_vehicle`.

    The state (n,) with b bodies, p spins and d first-order states, n = 12 b + p + d: displacement and
    turn per body (6 b), velocity less V and angular rate per body (6 b), spins, first-order states.

    Attributes
    ----------
    model : VehicleModel
        The vehicle.
    data : ForceData
        Its constants; the driver's point moves at V = 1 m/s (`rates` puts in the speed that it is asked
        for).
    inner_states : int
        Number d of first-order states.
    """

    model: VehicleModel
    data: ForceData
    inner_states: int
    _nominal: FloatArray = field(repr=False)
    _drops_m: FloatArray = field(repr=False)

    @property
    def bodies(self) -> int:
        """Number of bodies."""
        return len(self.model.bodies)

    @property
    def size(self) -> int:
        """Number of states."""
        return 12 * self.bodies + len(self.data.spins) + self.inner_states

    @property
    def steps(self) -> FloatArray:
        """Difference step (n,) of each state."""
        b = self.bodies
        place = np.tile([_STEPS["place"]] * 3 + [_STEPS["turn"]] * 3, b) * self._fineness
        motion = np.tile([_STEPS["velocity"]] * 3 + [_STEPS["rate"]] * 3, b)
        spins = np.full(len(self.data.spins), _STEPS["spin"])
        return np.concatenate([place, motion, spins, np.full(self.inner_states, _STEPS["inner"])])

    @property
    def _fineness(self) -> float:
        """1 for a full-size vehicle, less for a scale one: how much less its contacts give way."""
        smallest = min(wheel.radius_m for wheel in self.model.wheels)
        return float(min(1.0, smallest / _FULL_SIZE_RADIUS_M) ** (5.0 / 3.0))

    def rates(self, state: FloatArray, speed_mps: float, *, base: FloatArray | None = None) -> FloatArray:
        """d(state)/dt (n,) at a speed.

        Parameters
        ----------
        state : ndarray (n,)
            The state.
        speed_mps : float
            Speed V of the frame and of the driver.
        base : ndarray (b, 3, 3), optional
            Rotations that the turns of the state start from; identity if not given. The rate of a turn
            is the angular rate only where the turn is small, hence an equilibrium is its own base.
        """
        b, spins = self.bodies, len(self.data.spins)
        places = state[: 6 * b].reshape(b, 6)
        motion = state[6 * b : 12 * b].reshape(b, 6)
        turn = Rotation.from_rotvec(places[:, 3:]).as_matrix()
        rotation = turn if base is None else turn @ base
        pose, wrench = np.zeros(b, POSE), np.zeros(b, WRENCH)
        rows = pose.view(np.float64).reshape(b, -1)  # in the order of POSE's fields
        rows[:, :3] = self._nominal + places[:, :3]
        rows[:, 3:6] = motion[:, :3]
        rows[:, 3] += speed_mps
        rows[:, 6:15] = rotation.reshape(b, 9)
        rows[:, 15:] = motion[:, 3:]
        torque, inner = np.zeros(spins), np.zeros(self.inner_states)
        memory = memory_of(len(self.data.axles))
        memory.axle_memos["s_m"] = self._nominal[self.data.axles["body"], 0]
        drive = np.array([(0.0, (0.0, 0.0, speed_mps, _MIDDLE_M), 1.0)], DRIVE)
        spin = np.ascontiguousarray(state[12 * b : 12 * b + spins])
        zeta = np.ascontiguousarray(state[12 * b + spins :])
        forces(0.0, pose, spin, zeta, self.data._replace(drive=drive), wrench, torque, inner, memory)
        loads = wrench.view(np.float64).reshape(b, -1)
        # Euler, in the body's axes: I w' = M - w x I w.
        moment = np.einsum("bji,bj->bi", rotation, loads[:, 3:])
        omega = np.einsum("bji,bj->bi", rotation, motion[:, 3:])
        # The cross product by columns: np.cross takes a third of the time of everything here.
        inertia = self.data.bodies["inertia"]
        turned = inertia * omega
        gyro = omega[:, [1, 2, 0]] * turned[:, [2, 0, 1]] - omega[:, [2, 0, 1]] * turned[:, [1, 2, 0]]
        slope = (moment - gyro) / inertia
        out = np.empty((b, 6))
        out[:, :3] = loads[:, :3] / self.data.bodies["mass_kg"][:, None]
        out[:, 3:] = np.einsum("bij,bj->bi", rotation, slope)
        return np.concatenate([motion.ravel(), out.ravel(), torque / self.data.spins["inertia"], inner])

    def equilibrium(self, speed_mps: float, *, start: FloatArray | None = None) -> FloatArray:
        """State (n,) of steady running at a speed, by Newton's method.

        Parameters
        ----------
        speed_mps : float
            Speed, > 0 (at rest the creep states are where the past has left them).
        start : ndarray (n,), optional
            Where to begin, e.g. the equilibrium at a speed nearby.

        Raises
        ------
        InputError
            If the vehicle finds no steady running there.
        """
        state = self._at_rest(speed_mps)
        if start is not None:
            state[: 12 * self.bodies] = start[: 12 * self.bodies]  # the wheels' spins go with the speed
        # The inverse is kept while the steps shrink quickly: a Jacobian costs 150 evaluations.
        inverse, before, fresh = self._inverse(state, speed_mps), np.inf, True
        fine = self._fineness
        for _ in range(60):
            slope = self.rates(state, speed_mps)
            step = -inverse @ slope
            largest = np.abs(step[: 6 * self.bodies]).max()
            state = state + step * min(1.0, 1e-3 / max(largest, 1e-12))
            # Places that hold still are not enough: from a start nearby it is the spins that are found.
            balanced = np.abs(slope[6 * self.bodies : 12 * self.bodies]).max() < _BALANCED_MPS2 / fine
            still = largest < 1e-11 * fine or (largest < 1e-9 * fine and largest > 0.5 * before)
            if still and balanced:
                break
            if largest > 0.2 * before and not fresh:
                inverse, fresh = self._inverse(state, speed_mps), True
            else:
                fresh = False
            before = largest
        left = np.abs(self.rates(state, speed_mps))[6 * self.bodies : 12 * self.bodies].max()
        if not left < _BALANCED_MPS2 / fine:
            raise InputError(
                "does not run steadily on straight level track",
                file=f"vehicle {self.model.name}",
                field="speed",
                value=f"{3.6 * speed_mps:.1f} km/h, {left:.1e} m/s2 left",
                remedy="look for a body that nothing holds",
                limit="a steady state",
            )
        return state

    def linearised(self, speed_mps: float, *, at: FloatArray | None = None) -> FloatArray:
        """State matrix A (n, n) of x' = A x at a speed, about the equilibrium (``at`` if it is known)."""
        state = self.equilibrium(speed_mps) if at is None else at.copy()
        places = state[: 6 * self.bodies].reshape(-1, 6)
        base = Rotation.from_rotvec(places[:, 3:]).as_matrix()
        places[:, 3:] = 0.0
        return state_matrix(lambda x: self.rates(x, speed_mps, base=base), state, self.steps)

    def held(self, matrix: FloatArray) -> tuple[FloatArray, tuple[int, ...]]:
        """What is left of a state matrix when the wheelsets are held: the vehicle on its springs.

        The rails hold an axle in all but pitch: its body (bridge, axle boxes) turns in the bearings of its
        wheels, and does so as the frame above it bounces on trailing arms.

        Returns
        -------
        matrix : ndarray
            Rows and columns of the free motions and of the inner states of suspensions.
        motions : tuple of int
            The free motions: number of the body times 6, plus that of the motion (x, y, z, roll, pitch, yaw).
        """
        axles = set(self.data.axles["body"])
        free = tuple(6 * i + k for i in range(self.bodies) for k in range(6) if i not in axles or k == _PITCH)
        first = np.array(free, dtype=int)
        creep = 12 * self.bodies + len(self.data.spins) + 4 * len(self.model.wheels)
        states = np.concatenate([first, 6 * self.bodies + first, np.arange(creep, self.size)]).astype(int)
        return matrix[np.ix_(states, states)], free

    def _inverse(self, state: FloatArray, speed_mps: float) -> FloatArray:
        """Inverse of the Jacobian, scaled by the difference steps and by rows before it is inverted."""
        steps = self.steps
        matrix = state_matrix(lambda at: self.rates(at, speed_mps), state, steps) * steps
        rows = 1.0 / np.maximum(np.abs(matrix).max(axis=1), 1e-30)
        scaled = matrix * rows[:, None]
        try:
            inverse = np.linalg.inv(scaled)
        except np.linalg.LinAlgError:  # a motion that nothing holds stays where it is
            inverse = np.linalg.pinv(scaled, rcond=1e-12)
        turned: FloatArray = steps[:, None] * inverse * rows
        return turned

    def _at_rest(self, speed_mps: float) -> FloatArray:
        """Every body at its nominal height less the wheels' penetration, the wheels rolling."""
        state = np.zeros(self.size)
        state[2 : 6 * self.bodies : 6] = self._drops_m
        names = list(self.model.spin_inertia_kgm2)
        for wheel in self.model.wheels:
            state[12 * self.bodies + names.index(wheel.spin)] = speed_mps / wheel.radius_m
        return state


def running_vehicle(model: VehicleModel, *, gravity_mps2: float = 9.81) -> RunningVehicle:
    """Lay a vehicle out on smooth straight level track."""
    length = 2.0 * _MIDDLE_M
    design = TrackDesign("level", 0.0, (Straight(length),))
    track = lay(design, Irregularity("none", fade_m=1.0), seed=0)
    profile = SpeedProfile(_MIDDLE_M, _MIDDLE_M + 10.0, 1.0)  # replaced by a constant speed in `rates`
    data = pack(model, track, profile, gravity_mps2=gravity_mps2)
    nominal = np.array([body.position_m for body in model.bodies])
    nominal[:, 0] += _MIDDLE_M
    return RunningVehicle(
        model=model,
        data=data,
        inner_states=states_of(data),
        _nominal=nominal,
        _drops_m=rest_drops_m(model, gravity_mps2=gravity_mps2),
    )
