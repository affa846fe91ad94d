"""The fast engine: the equations of the reference engine, every step of them compiled.

Forces, contact, track and output rows are those of `simrail.vehicle.engines.exudyn_engine`; only who
integrates differs (`simrail.vehicle.engines.stepper`). At the same step both agree far below a millionth of
m/s2, so each is the test of the other. It needs no Exudyn.
"""

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from simrail.core.jit import FloatArray
from simrail.vehicle.contact.contact import CONTACT
from simrail.vehicle.engines.derailment import refuse_derailed
from simrail.vehicle.engines.engine import (
    Segment,
    Setup,
    start_memory,
    start_poses,
    stretches,
)
from simrail.vehicle.engines.force_data import states_of
from simrail.vehicle.engines.records import POSE, WRENCH, RecordArray
from simrail.vehicle.engines.stepper import BODY, march


class CompiledEngine:
    """One vehicle on one laid track, ready to run.

    Parameters
    ----------
    setup : Setup
        What runs, where and how.
    """

    def __init__(self, setup: Setup) -> None:
        self.setup, model = setup, setup.model
        self.data = setup.pack()
        self.memory = start_memory(setup)
        self._turned = BODY * len(model.bodies)
        self._first_state = self._turned + 2 * len(self.data.spins)
        self.state = np.zeros(self._first_state + states_of(self.data))
        bodies = len(model.bodies)
        self._scratch = np.zeros((3, len(self.state))), np.zeros(bodies, POSE), np.zeros(bodies, WRENCH)
        poses = start_poses(setup)
        for body, (position, rotation) in zip(self._bodies(self.state), poses, strict=True):
            body[:3] = position
            body[3:7] = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
        # Contacts of rows that are still to be put out, and of the last ones that were.
        self._contacts = self._earlier = np.zeros((0, len(self.data.wheels)), CONTACT)
        # Compiled now, so that no clock of a ride counts it.
        self._march(0, np.zeros((0, len(self.state))), self._contacts)

    def run(self, duration_s: float, *, segment_s: float = 5.0) -> Iterator[Segment]:
        """Simulate from rest; yields the output segment by segment (also the way to see progress).

        Raises
        ------
        DerailedError
            If a wheel leaves its rail.
        """
        for time_s, rows, slopes in stretches(
            self.setup,
            self._solve,
            self._halt,
            lambda steps: self._bodies(steps)[:, :, 7:],
            duration_s=duration_s,
            segment_s=segment_s,
        ):
            bodies = self._bodies(rows)
            told, self._contacts = np.split(self._contacts, [len(time_s)])
            self._earlier = told
            turn = Rotation.from_quat(bodies[:, :, 3:7].reshape(-1, 4), scalar_first=True).as_matrix()
            yield Segment(
                time_s=time_s,
                position=bodies[:, :, :3],
                velocity=bodies[:, :, 7:10],
                acceleration=slopes[:, :, :3],
                rotation=turn.reshape(*bodies.shape[:2], 3, 3),
                rate=bodies[:, :, 10:],
                angular_acceleration=slopes[:, :, 3:],
                spin_rad=rows[:, self._turned : self._turned + len(self.data.spins)],
                states=rows[:, self._first_state :],
                contacts=told,
            )

    def _bodies(self, states: FloatArray) -> FloatArray:
        """The bodies' part of states (..., n), as (..., b, 13)."""
        return states[..., : self._turned].reshape(*states.shape[:-1], -1, BODY)

    def _until_now(self) -> RecordArray:
        """Contacts (k, w) at the output rows that were reached, of this stretch and of the one before."""
        reached = self._contacts[self._contacts["wanted"].any(axis=1)]
        return np.concatenate([self._earlier, reached])

    def _march(self, first: int, rows: FloatArray, contacts: RecordArray) -> int:
        setup, scratch = self.setup, self._scratch
        return march(
            first, setup.step_s, self.state, rows, *scratch, self.memory, self.data, setup.every, contacts
        )

    def _halt(self) -> None:
        """Stop all bodies and spins."""
        self._bodies(self.state)[:, 7:] = 0.0
        self.state[self._turned + len(self.data.spins) : self._first_state] = 0.0

    def _solve(self, first: int, last: int) -> FloatArray:
        """Integrate from the present state; the state (steps + 1, n) at every step."""
        rows = np.empty((last - first + 1, len(self.state)))
        rows[0] = self.state
        every = self.setup.every
        output = range(-(-max(first, 0) // every) * every, last, every)
        # Records are slow to copy (some 60 ns each): new ones go behind the few that are still to be put out.
        left = len(self._contacts)
        told = np.zeros((left + len(output), len(self.data.wheels)), CONTACT)
        told[:left], self._contacts = self._contacts, told
        made = self._march(first, rows[1:], told[left:])
        refuse_derailed(self.memory, self.setup, lambda _time_s: self._until_now())
        if made < last - first or not np.isfinite(self.state).all():
            begin, end = first * self.setup.step_s, last * self.setup.step_s
            raise RuntimeError(f"the integrator stopped between {begin:g} and {end:g} s")
        return rows
