"""Model of the profile filter: what its kernel takes of a recording.

Hidalgo et al. (paper 004). Where the two axles are comes from the vehicle's drawing; gravity, and what the
design track does to accelerometer and gyro, are taken off first, which the paper, of a plane and a straight
line, need not say.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm
from simrail.estimators.attitude.compensation import design_frame, gravity_force, track_motion
from simrail.estimators.profile.kernel import ANGLE, ANGLE_RATE, BIAS_A, BIAS_G, OWN, RATE, H, Model, slots

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording, odometry_of

BIAS_CORRELATION_S = 300.0
"""Correlation time of the sensors' biases where the sheet has none: some minutes for MEMS."""

START_SLOPE_SD = 2e-3
"""Standard deviation of the profile's slope, for a ride that begins at speed."""

START_RATE_SD = 1e-3
"""m/s: of a train at rest."""

STILL_SD_MPS = 2e-3
"""Vertical speed that a sample at standstill may show: a body still swings."""

LEAST_GYRO_SD_RADPS, LEAST_ACCEL_SD_MPS2 = 2e-4, 2e-3
"""Of a sample of a perfect device: what it shakes by is not of the rails. Synthetic, far below any MEMS."""

OFF_AXLE = 0.1
"""Share of the wheelbase by which the IMU may stand off its axle."""


PRINTED_SLOWEST_MPS = 5.0
"""Speed down to which the paper's delay line over time reaches from axle to axle: it gives no n."""


@dataclass(frozen=True)
class Deviation:
    """How a mount leaves the chord from axle to axle: an oscillator that noise drives.

    d'' + 2 zeta omega d' + omega^2 d = w, of stationary standard deviation ``sd_rad``. What is slow against
    omega keeps to the chord. The defaults are synthetic, about the pitch of a wagon on its springs.

    Attributes
    ----------
    sd_rad : float
        Of the angle; 0 for a body without suspension.
    frequency_hz, damping : float
        omega / 2 pi, and zeta.
    """

    sd_rad: float = 0.0
    frequency_hz: float = 5.0
    damping: float = 0.4

    def over(self, step_s: float) -> tuple[FloatArray, FloatArray]:
        """F and Q (2, 2) of [d, d'] over a step: Q = S - F S F' of the stationary covariance S."""
        omega = 2.0 * math.pi * self.frequency_hz
        f = np.asarray(expm(np.array([[0.0, 1.0], [-(omega**2), -2.0 * self.damping * omega]]) * step_s))
        stationary = self.stationary
        return f, stationary - f @ stationary @ f.T

    @property
    def stationary(self) -> FloatArray:
        """Covariance (2, 2) of [d, d']."""
        return np.diag([1.0, (2.0 * math.pi * self.frequency_hz) ** 2]) * self.sd_rad**2


@dataclass(frozen=True)
class Profile:
    """What is known of the rails before.

    Attributes
    ----------
    sd_m, length_m : float
        Standard deviation of the vertical profile, and the length over which it hangs together.
    """

    sd_m: float
    length_m: float


class Axles(NamedTuple):
    """Where the nearest and the farthest axle of the body over them are, m forward from the IMU."""

    nearest_m: float
    farthest_m: float


def axles_under(recording: Recording) -> Axles | None:
    """Axles of the body that carries the IMU, or that rests on the axle which does.

    None where the drawing does not say: no drawing, or no body that rests on two axles or more by itself.
    """
    sheet = recording.vehicle_sheet
    here = None if sheet is None else sheet.body(recording.mount_body)
    if sheet is None or here is None:
        return None
    for carrier in [here] if here.supports else sheet.above(here.name):
        axles = [sheet.body(support.on) for support in carrier.supports]
        places = {axle.x_m for axle in axles if axle is not None and not axle.supports}
        if len(places) > 1:
            away = sorted((place - here.x_m - recording.mount_position_m[0] for place in places), key=abs)
            return Axles(away[0], away[-1])
    return None


def require_over_axle(recording: Recording, axles: Axles) -> None:
    """Refuse an IMU that stands over no axle.

    Raises
    ------
    InputError
        If it is off by more than `OFF_AXLE` of the wheelbase.
    """
    most = OFF_AXLE * abs(axles.farthest_m - axles.nearest_m)
    if abs(axles.nearest_m) > most:
        raise InputError(
            "the IMU stands over no axle: what it feels is not the height of one",
            field="imu.position_m",
            value=round(recording.mount_position_m[0], 3),
            limit=f"within {most:.2f} m of an axle",
            remedy=f"move it by {axles.nearest_m:+.2f} m along the vehicle, mount it on an axle, "
            "or leave the gyro aside by gyro = false",
        )


def relative_signals(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """Vertical acceleration and nose-up rate (n,) against the design track, m/s2 and rad/s.

    a = f_z - c_z - g cos(roll) cos(pitch) and -(w_y - V k_2) with the design's angles, acceleration c and
    curvature k_2 (EQUATIONS 1.1): a canted curve alone would be 0.05 m/s2 and 3 mrad/s.
    """
    frame = design_frame(recording)
    force = gravity_force(recording, compensated=True)[:, 2]
    vertical = force - recording.gravity_mps2 * np.cos(frame.roll_rad) * np.cos(frame.pitch_rad)
    turn = track_motion(recording).rate[:, 1]
    return vertical, turn - recording.imu["gyro_y_radps"].to_numpy(dtype=np.float64)


def _sample_variance(density: float, rate_hz: float, resolution: float, least: float) -> float:
    """Variance of a sample: white noise N sqrt(rate), the size of a count, what a perfect one leaves."""
    return density**2 * rate_hz + resolution**2 / 12.0 + least**2


def _reaches(place: FloatArray, wheelbase_m: float, step_s: float) -> npt.NDArray[np.bool_]:
    """Where (n,) the last samples of a delay line over time reach back to the other axle."""
    count = math.ceil(wheelbase_m / (PRINTED_SLOWEST_MPS * step_s))
    before = np.concatenate([np.full(count, place[0]), place[:-count]])[: len(place)]
    return np.asarray(place - before >= wheelbase_m)


def model_of(
    recording: Recording,
    *,
    other_m: float,
    step_m: float,
    profile: Profile,
    deviation: Deviation,
    gyro: bool,
    slowest_mps: float,
    independent_zeros: bool = False,
    over_time: bool = False,
) -> Model:
    """Gather what the filter takes.

    Parameters
    ----------
    recording : Recording
        With an odometry.
    other_m : float
        Where the other axle is, m forward from the IMU (`other_axle`).
    step_m : float
        Distance of the nodes.
    profile : Profile
        What is known of the rails before.
    deviation : Deviation
        How the body leaves the chord.
    gyro : bool
        Whether the gyro's row is used.
    slowest_mps : float
        The train stands below.
    independent_zeros, over_time : bool
        See `simrail.estimators.profile.profile_filter.ProfileFilter`; over time is ``printed``.
    """
    sheet, motion = recording.imu_sheet, odometry_of(recording)
    dt = 1.0 / sheet.rate_hz
    side = 1.0 if other_m < 0.0 else -1.0
    place, speed = (
        np.ascontiguousarray(side * motion[name].to_numpy(dtype=np.float64))
        for name in ("position_m", "speed_mps")
    )
    vertical, rate = relative_signals(recording)
    moves = np.abs(speed) >= slowest_mps
    white = 2.0 * profile.length_m / (dt * np.maximum(np.abs(speed), slowest_mps))
    zero = profile.sd_m**2 * (np.ones_like(speed) if independent_zeros else np.maximum(white, 1.0))
    instability = np.array([sheet.accel_bias_instability_mps2, sheet.gyro_bias_instability_radps])
    f, q = deviation.over(dt)
    start_covariance = _start_covariance(recording, place[0], speed[0], abs(other_m), step_m, profile)
    start_covariance[ANGLE : ANGLE_RATE + 1, ANGLE : ANGLE_RATE + 1] = deviation.stationary
    return Model(
        side=side,
        place=place,
        speed=speed,
        vertical=np.ascontiguousarray(vertical),
        rate=np.ascontiguousarray(side * rate),
        moves=moves,
        sees=_reaches(place, abs(other_m), dt) if gyro and over_time else np.full(len(place), gyro),
        zero_variance=zero,
        still_variance=STILL_SD_MPS**2,
        rate_variance=_sample_variance(
            sheet.gyro_noise_radpsqrts, sheet.rate_hz, sheet.gyro_resolution_radps, LEAST_GYRO_SD_RADPS
        ),
        accel_variance=_sample_variance(
            sheet.accel_noise_mpsqrts, sheet.rate_hz, sheet.accel_resolution_mps2, LEAST_ACCEL_SD_MPS2
        ),
        bias_walk=2.0 * instability**2 * dt / BIAS_CORRELATION_S,
        angle_step=f,
        angle_process=q,
        start=np.zeros(len(start_covariance)),
        start_covariance=start_covariance,
        wheelbase_m=abs(other_m),
        step_m=step_m,
        profile_variance=profile.sd_m**2,
        is_linear=over_time,
        step_s=dt,
    )


def _start_covariance(
    recording: Recording, place: float, speed: float, wheelbase_m: float, step_m: float, profile: Profile
) -> FloatArray:
    """Before the first sample: heights as an Ornstein-Uhlenbeck process, the biases by the sheet."""
    sheet, count = recording.imu_sheet, slots(wheelbase_m, step_m)
    low, high = math.floor((place - wheelbase_m) / step_m) - 1, math.floor(place / step_m)
    nodes = np.arange(low, high + 1)
    states, at = np.append(H, OWN + nodes % count), np.append(place, nodes * step_m)
    covariance = np.zeros((OWN + count, OWN + count))
    apart = np.abs(at[:, None] - at)
    covariance[np.ix_(states, states)] = profile.sd_m**2 * np.exp(-apart / profile.length_m)
    covariance[RATE, RATE] = START_RATE_SD**2 + (speed * START_SLOPE_SD) ** 2
    covariance[BIAS_A, BIAS_A] = sheet.accel_turn_on_bias_mps2**2 / 3.0 + sheet.accel_bias_instability_mps2**2
    covariance[BIAS_G, BIAS_G] = sheet.gyro_turn_on_bias_radps**2 / 3.0 + sheet.gyro_bias_instability_radps**2
    return covariance
