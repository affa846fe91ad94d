"""Model of the trajectory smoother: what its kernels take of a recording.

Gonzalez-Carbajal et al. 2023 (paper 001), sections 2 and 3 and appendix 1, with the errata of EQUATIONS 1.3.
The state is

    x = [roll, roll', pitch, pitch', yaw, yaw', y, y', y'', z, z', z'']

with the angles of the body in the global frame, its place (0, y, z) in the design track frame, ' for d/dt.

Not here: the loops (`simrail.estimators.trajectory.kernel`), and the noise
(`simrail.estimators.trajectory.noise`).
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag
from simrail.estimators.attitude.compensation import design_frame, track_motion
from simrail.estimators.attitude.rest_bias import rest_bias
from simrail.estimators.trajectory.kernel import STATES, TERMS, Model
from simrail.estimators.trajectory.model_kernel import beyond, less_bias, terms
from simrail.estimators.trajectory.noise import Hyperparameters

from simrail.core.columns import IMU
from simrail.core.jit import FloatArray, IntArray
from simrail.recording.recording import Recording, odometry_of, rows_of
from simrail.track.design import STRAIGHT, TrackFrame


def process_noise(parameters: Hyperparameters, step_s: float) -> FloatArray:
    """Q (12, 12): white angular acceleration, and white jerk, over one step."""
    dt = step_s
    pair = np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    triple = np.array(
        [
            [dt**5 / 20, dt**4 / 8, dt**3 / 6],
            [dt**4 / 8, dt**3 / 3, dt**2 / 2],
            [dt**3 / 6, dt**2 / 2, dt],
        ]
    )
    values = parameters.vector()
    return np.asarray(block_diag(*(q * pair for q in values[:3]), *(q * triple for q in values[3:5])))


def with_noise(model: Model, *parameters: Hyperparameters) -> Model:
    """The model with other noise: one set for all samples, or one for each kind of them."""
    kinds = model.kinds if len(parameters) > 1 else np.zeros_like(model.kinds)
    noise = np.array([values.vector()[5:] for values in parameters])
    process = np.array([process_noise(values, model.step_s) for values in parameters])
    return model._replace(kinds=kinds, process=process, noise=noise)


def kinds_of(recording: Recording) -> IntArray:
    """0 on straights of the design track and 1 in its transitions and curves, (n,), by the odometry."""
    track, place = recording.track, odometry_of(recording)["position_m"].to_numpy(dtype=np.float64)
    kind = track.kind(np.clip(place, track.start_m, track.end_m))
    return np.ascontiguousarray(kind != STRAIGHT, dtype=np.int64)


def model_of(
    recording: Recording,
    parameters: Sequence[Hyperparameters],
    *,
    use_rest_bias: bool = True,
    second_order: bool = True,
    printed: bool = False,
    start_sd: FloatArray,
    around: FloatArray | None = None,
) -> Model:
    """Gather what the filter takes.

    Parameters
    ----------
    recording : Recording
        The recording.
    parameters : sequence of Hyperparameters
        Noise: one set, or one for straights and one for transitions and curves (`kinds_of`).
    use_rest_bias, second_order, printed : bool
        See `simrail.estimators.trajectory.smoother.TrajectorySmoother`.
    start_sd : ndarray (12,)
        Standard deviations about the start that is assumed: the design's angles and rates, centred.
    around : ndarray (n, 12), optional
        States about which `second_order` is taken; the design's angles and rates if not given.
    """
    sheet = recording.imu_sheet
    frame = design_frame(recording)
    signals = np.empty((len(recording.imu), 6))
    less_bias(rows_of(recording.imu, IMU), rest_bias(recording, enabled=use_rest_bias).bias, signals)
    speed = odometry_of(recording)["speed_mps"].to_numpy(dtype=np.float64)
    if second_order and not printed:
        if around is None:
            angles, rates = np.array([frame.roll_rad, frame.pitch_rad, frame.yaw_rad]).T, frame.rates
            rates = speed[:, None] * rates
        else:
            angles, rates = around[:, [0, 2, 4]], around[:, [1, 3, 5]]
        signals -= beyond_first_order(angles, rates, recording.gravity_mps2)
    _, lateral, height = recording.mount_position_m
    start = np.zeros(STATES)
    start[[0, 2, 4]] = frame.roll_rad[0], frame.pitch_rad[0], frame.yaw_rad[0]
    start[[1, 3, 5]] = speed[0] * frame.rates[0]
    start[[6, 9]] = lateral, height
    model = Model(
        signals=signals,
        track=track_terms(recording, frame, printed=printed),
        slips=jacobian_slips(frame, speed) if printed else np.empty((0, 3)),
        kinds=kinds_of(recording),
        process=np.empty((0, STATES, STATES)),
        noise=np.empty((0, 8)),
        virtual=np.array([lateral, height]),
        start=start,
        start_variance=start_sd**2,
        step_s=1.0 / sheet.rate_hz,
        gravity=recording.gravity_mps2,
    )
    return with_noise(model, *parameters)


def track_terms(recording: Recording, frame: TrackFrame, *, printed: bool = False) -> FloatArray:
    """`simrail.estimators.trajectory.kernel.TERMS` at every sample, (n, 15)."""
    motion = track_motion(recording, printed=printed)
    found = np.empty((motion.rows.shape[1], len(TERMS)))
    terms(frame.roll_rad, frame.pitch_rad, frame.yaw_rad, motion.rows, printed, found)
    return found


def beyond_first_order(angles: FloatArray, rates: FloatArray, gravity: float) -> FloatArray:
    """What the equations, of first order in roll and pitch as they are, leave out of rates and gravity.

    C' g e_z and the body's rate at these angles, less their first order: 0.05 m/s2 along Z at 0.1 rad of
    roll, which the filter would take for a body that rises.

    Parameters
    ----------
    angles, rates : ndarray (n, 3)
        Roll, pitch and yaw, and their derivatives by time.
    gravity : float
        m/s2.

    Returns
    -------
    ndarray (n, 6)
        rad/s and m/s2.
    """
    roll, pitch, pitch_rate, yaw_rate = (np.ascontiguousarray(row) for row in (*angles.T[:2], *rates.T[1:]))
    found = np.empty((len(angles), 6))
    beyond(roll, pitch, pitch_rate, yaw_rate, gravity, found)
    return found


def jacobian_slips(frame: TrackFrame, speed: FloatArray) -> FloatArray:
    """Paper 001's misprints, (n, 3); see `simrail.estimators.trajectory.kernel.linearise`."""
    _, v, h = frame.rates.T
    return np.column_stack([v * speed - v * speed**2, h**2, h**2 * speed**2])
