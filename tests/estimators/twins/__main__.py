"""The filters by filterpy beside their kernels, on twelve seconds of a ride: what to read first, run.

    python tests/estimators/twins

filterpy's filters are a few lines of matrices: `attitude.py`, `veillard.py`, `zero_velocity.py` and
`trajectory.py` here. The kernels make the same numbers; this prints how far apart they are, and the time that
each takes for a sample.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from attitude import filterpy_ekf
from simrail.estimators.attitude.ekf import AttitudeEkf
from simrail.estimators.attitude.kernel import attitude_ekf
from simrail.estimators.attitude.veillard_ekf import VeillardEkf
from simrail.estimators.attitude.veillard_kernel import Found, Model, eleven_states, room
from simrail.estimators.kalman import room_for_history
from simrail.estimators.odometry import zero_velocity_kernel
from simrail.estimators.odometry.zero_velocity import ZeroVelocityOdometry
from simrail.estimators.trajectory.smoother import TrajectorySmoother
from trajectory import trace
from veillard import filterpy_eleven_states
from zero_velocity import filterpy_zero_velocity

from simrail.core.jit import FloatArray
from simrail.estimation.choose_odometry import with_odometry
from simrail.recording.recording import Recording, beginning
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.vehicle.speed_profile import SpeedProfile

SAMPLES = 3000


def ride() -> Recording:
    """The first samples of a train that leaves, as a small IMU and an encoder record it."""
    recording = measure(
        kinematic_truth(track_by_name("condequinto_olivar"), SpeedProfile(10.0, 100.0, 10.0, rest_s=4.0)),
        name="lesson",
        mount=Mount("axle", "body", (0.0, 0.0, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("wheel"),
        seed=1,
        draw=0,
    )
    return with_odometry(beginning(recording, samples=SAMPLES), "encoder")


def beside(name: str, ours: Callable[[], FloatArray], theirs: Callable[[], FloatArray]) -> None:
    """Print the largest difference of the states, and microseconds per sample."""
    ours()  # compiles
    states, us = [], []
    for run in (ours, theirs):
        start = time.perf_counter()
        states.append(run())
        us.append(1e6 * (time.perf_counter() - start) / SAMPLES)
    apart = np.abs(states[0] - states[1]).max()
    print(f"{name:20s} apart by {apart:.1e}; kernel {us[0]:.2f} us, filterpy {us[1]:.0f} us per sample")


def main() -> None:
    """Run each of them both ways."""
    recording = ride()
    arrays, _ = AttitudeEkf()._arrays(recording)

    def attitude(run: Callable[..., None]) -> FloatArray:
        states, covariance = np.empty((SAMPLES, 3)), np.empty((SAMPLES, 3, 3))
        run(*arrays, states, covariance, np.empty((SAMPLES, 4)))
        return states

    eleven = VeillardEkf(calibration="encoder")
    model = eleven.model(recording, eleven.spectral.frame_speeds(recording))

    def states_of(run: Callable[[Model, Found], None]) -> FloatArray:
        found = room(SAMPLES)
        run(model, found)
        return found.states

    beside("attitude EKF", lambda: attitude(attitude_ekf), lambda: attitude(filterpy_ekf))
    beside("EKF of 11 states", lambda: states_of(eleven_states), lambda: states_of(filterpy_eleven_states))
    stops = ZeroVelocityOdometry()
    # What passengers do is learnt from the ride, which is no Kalman filter's: here it is given.
    slow = stops.model(recording)._replace(rocking=0.0)
    rests = stops.trace(recording).found.log_odds > slow.surely

    no_past = room_for_history(0, zero_velocity_kernel.STATES, zero_velocity_kernel.UPDATES)

    def at_stops(run: Callable[..., None], *given: object) -> FloatArray:
        found = zero_velocity_kernel.room(len(slow.signals), 4)
        run(slow, *stops.start(recording, slow), *given, found, *([] if given else [no_past]))
        return found.states

    beside(
        "zero-velocity filter",
        lambda: at_stops(zero_velocity_kernel.zero_velocity),
        lambda: at_stops(filterpy_zero_velocity, rests),
    )
    for name, smoothed in (("trajectory filter", False), ("trajectory smoother", True)):
        method = TrajectorySmoother(smoothed=smoothed)
        beside(name, lambda m=method: m.trace(recording).states, lambda m=method: trace(m, recording).states)


if __name__ == "__main__":
    main()
