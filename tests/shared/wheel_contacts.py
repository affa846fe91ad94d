"""Contact forces of every wheel at one instant, for tests: the contact kernel called on an engine's rows."""

from typing import NamedTuple

import numpy as np

from simrail.vehicle.contact.contact import Motion, RailHere, wheel_force


class Contacts(NamedTuple):
    """What the wheels of some axles do at one instant.

    Attributes
    ----------
    shift_m, yaw_rad : ndarray (a,)
        Lateral shift of each axle from the middle of its rails; its yaw in the track's frame.
    force_n : ndarray (a, 2, 3)
        Longitudinal, lateral and vertical force on its left and its right wheel, axes of the track.
    """

    shift_m: np.ndarray
    yaw_rad: np.ndarray
    force_n: np.ndarray


def track_frame_at(track, position, guess_m):
    """Track frame whose cross-section holds a point."""
    s = guess_m
    for _ in range(20):
        frame = track.design.frame(np.array([s]))
        s += float((position - frame.position[0]) @ frame.rotation[0][:, 0])
    return frame


def contacts_at(engine, segment, row):
    """Contacts of all wheels at one output row of a compiled engine, not the first or the last."""
    data, track = engine.data, engine.setup.track
    spins = np.gradient(segment.spin_rad, segment.time_s, axis=0)[row]
    shift, yaw, force = [], [], []
    for a, axle in enumerate(data.axles):
        b, first = axle["body"], axle["first_wheel"]
        frame = track_frame_at(track, segment.position[row, b], engine.memory.axle_memos["s_m"][a])
        turn, (k1, k2, k3) = frame.rotation[0], frame.k[0]
        _, y, z = turn.T @ (segment.position[row, b] - frame.position[0])
        vx, vy, vz = turn.T @ segment.velocity[row, b]
        relative = turn.T @ segment.rotation[row, b]
        wx, _, wz = relative @ segment.rate[row, b]
        psi = np.arctan2(relative[1, 0], relative[0, 0])
        speed = vx / (1.0 / np.cos(frame.pitch_rad[0]) - k3 * y + k2 * z)
        rails, slopes = (track.rails(frame.s_m, derivative=n)[0] for n in (0, 1))
        for n, wheel in enumerate(data.wheels[first : first + 2]):
            motion = Motion(
                y, z - wheel["radius_m"], np.arctan2(relative[2, 1], relative[2, 2]), psi, speed, vx,
                vy + speed * k1 * z, vz - speed * k1 * y, wx - speed * k1, wz - speed * k3,
                spins[wheel["spin"]], k3,
            )  # fmt: skip
            const, of = data.const[wheel["table"]], 4 * (first + n)
            rail = RailHere(const["friction"], *rails[2 * n : 2 * n + 2], *slopes[2 * n : 2 * n + 2])
            zeta = np.ascontiguousarray(segment.states[row, of : of + 4])
            found = wheel_force(
                data.patches[wheel["table"]], const, float(wheel["side"]), motion, rail, zeta, np.zeros(4)
            )
            force.append((found.fx, found.fy, found.fz))
        shift.append(y - 0.5 * (rails[0] + rails[2]))
        yaw.append(psi)
    return Contacts(np.array(shift), np.array(yaw), np.reshape(force, (-1, 2, 3)))
