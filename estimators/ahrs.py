"""General-purpose AHRS: what a good filter that knows nothing of trains makes of the same signals."""

from dataclasses import dataclass

import imufusion
import numpy as np
from simrail.estimators.attitude.compensation import gravity_force, needs_of, role_of, start_frame
from simrail.estimators.attitude.quaternions import to_euler
from simrail.estimators.attitude.rest_bias import rest_bias
from vqf import VQF

from simrail.core.columns import ATTITUDE, GYRO, MAGNETIC
from simrail.core.errors import InputError
from simrail.estimation.estimate import Estimate, states_only
from simrail.recording.recording import Recording


@dataclass(frozen=True)
class Vqf:
    """VQF (Laidig and Seel 2023) through the `vqf` package, with its own default parameters.

    It stands in for the commercial AHRS that Briales et al. 2021 compare with. Its estimate of the gyro bias
    at rest takes long, slow, steady curves for standstill, which spoils yaw at 20 km/h.

    Attributes
    ----------
    compensated : bool
        Take the design track's acceleration off the accelerometer first; a general-purpose AHRS
        cannot, so this is off unless asked for.
    magnetometer : bool
        Take the heading from the magnetometer (VQF's nine-axis filter), in place of the design track's at the
        start and the gyro from there on. VQF lowers the weight of a field that is not as strong or as
        steep as it was used to; it cannot tell the iron of its own vehicle from the Earth.
    rest_bias : bool
        Subtract the gyro's mean over the rests so far, as every method does.
    """

    compensated: bool = False
    magnetometer: bool = False
    rest_bias: bool = True

    causal = True
    role = property(role_of)
    label = "VQF"
    cites = ("laidig_2023",)

    @property
    def needs(self) -> tuple[str, ...]:
        """The magnetometer, and the odometry for the compensation, if they are asked for."""
        return (*needs_of(self), "magnetometer") if self.magnetometer else needs_of(self)

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw.

        Yaw starts at the design track's; with the magnetometer it is the magnetic heading's.

        Raises
        ------
        InputError
            If the magnetometer is asked for and the recording has none.
        """
        sheet = recording.magnetometer_sheet
        if self.magnetometer and (recording.magnetometer is None or sheet is None):
            raise InputError(
                "the recording has no magnetometer",
                field="magnetometer",
                value=recording.name,
                remedy="add a [magnetometer] to the scenario, or set magnetometer = false",
                limit="a recording with a magnetometer",
            )
        gyro = recording.imu[list(GYRO)].to_numpy(dtype=np.float64)
        gyro = np.ascontiguousarray(gyro - rest_bias(recording, enabled=self.rest_bias).bias)
        force = gravity_force(recording, compensated=self.compensated)
        vqf = VQF(1.0 / recording.imu_sheet.rate_hz)
        start_yaw = float(start_frame(recording).yaw_rad[0])
        if self.magnetometer and recording.magnetometer is not None and sheet is not None:
            field = recording.magnetometer[list(MAGNETIC)].to_numpy(dtype=np.float64)
            # Its level axes are magnetic east and north; ours begin at X.
            east = sheet.north_rad - 0.5 * np.pi
            found = vqf.updateBatch(gyro, force, np.ascontiguousarray(field))["quat9D"]
            angles = to_euler(found, start_yaw_rad=start_yaw - east)
            angles[:, 2] += east
        else:
            angles = to_euler(vqf.updateBatch(gyro, force)["quat6D"], start_yaw_rad=0.0)
            # Its heading starts anywhere: turned so that the first sample is the design track's.
            angles[:, 2] += start_yaw - angles[0, 2]
        return states_only(recording, angles, ATTITUDE)


@dataclass(frozen=True)
class Imufusion:
    """The revised Madgwick filter through the `imufusion` package, its rejection of acceleration off.

    A complementary filter with a fixed gain, which the package raises during its first three seconds. The
    package counts in single precision. Its default convention (north, west, up) is ours with yaw from X.

    Attributes
    ----------
    gain : float
        Speed of the correction towards the accelerometer's vertical: the package's own default.
    compensated : bool
        Take the design track's acceleration off the accelerometer first; see `Vqf`.
    rest_bias : bool
        Subtract the gyro's mean over the rests so far, as every method does.
    """

    gain: float = 0.5
    compensated: bool = False
    rest_bias: bool = True

    causal = True
    needs = property(needs_of)
    role = property(role_of)
    label = "imufusion"
    cites = ("madgwick_2020",)

    def __post_init__(self) -> None:
        if not 0.0 <= self.gain < np.inf:
            raise InputError("must be a finite number", field="gain", value=self.gain, limit=">= 0")

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw; yaw starts at the design track's."""
        gyro = recording.imu[list(GYRO)].to_numpy(dtype=np.float64)
        rates_degps = np.rad2deg(gyro - rest_bias(recording, enabled=self.rest_bias).bias)
        force_g = gravity_force(recording, compensated=self.compensated) / recording.gravity_mps2
        ahrs = imufusion.Ahrs()
        settings = imufusion.AhrsSettings()
        settings.gain = self.gain
        ahrs.set_settings(settings)
        ahrs.set_sample_period(1.0 / recording.imu_sheet.rate_hz)
        update, quaternion = ahrs.update_no_magnetometer, ahrs.get_quaternion
        found = np.empty((len(force_g), 4))
        for k in range(len(force_g)):
            update(rates_degps[k], force_g[k])
            found[k] = quaternion()
        angles = to_euler(found, start_yaw_rad=0.0)
        angles[:, 2] += float(start_frame(recording).yaw_rad[0]) - angles[0, 2]
        return states_only(recording, angles, ATTITUDE)
