"""How much a body moves in its track, by the class of its mount, and what the sheets say of the rest.

The sizes are synthetic: of simrail's vehicles on good rails at 20 to 100 km/h.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Motion:
    """How a body moves in its track.

    Attributes
    ----------
    roll_sd, roll_length, pitch_sd, pitch_length, yaw_sd, yaw_length : float
        rad and m.
    y_sd, y_length, z_sd, z_length : float
        m.
    sway_hz, damping : float
        Of a roll that sways in time; 0 Hz: it is over the distance.
    gyro, accel : float, tuple of float
        White motion that the model lacks, at `AT_MPS`, rad/s and m/s2.
    tilt, tilt_sd, squat_sd, y_tilt_sd, y_bend_sd : float
        Of TILT, SQUAT, Y_TILT (m), Y_BEND (m2).
    """

    roll_sd: float = 1.3e-3
    roll_length: float = 4.4
    pitch_sd: float = 6.5e-4
    pitch_length: float = 2.6
    yaw_sd: float = 1.5e-3
    yaw_length: float = 5.6
    y_sd: float = 4e-3
    y_length: float = 4.9
    z_sd: float = 3.7e-3
    z_length: float = 5.1
    sway_hz: float = 0.0
    damping: float = 0.1
    gyro: float = 1e-3
    accel: tuple[float, float, float] = (0.14, 0.11, 0.08)
    tilt: float = 0.0
    tilt_sd: float = 0.1
    squat_sd: float = 0.01
    y_tilt_sd: float = 0.05
    y_bend_sd: float = 1.0


AT_MPS = 70.0 / 3.6
"""Speed at which `Motion.gyro` and `Motion.accel` hold; they grow with its power of 1.5."""

AXLE = Motion()
FRAME = Motion()
BODY = Motion(
    roll_sd=3e-3,
    sway_hz=0.51,
    damping=0.3,
    pitch_sd=6e-4,
    pitch_length=3.0,
    yaw_sd=1e-3,
    yaw_length=10.0,
    y_sd=4e-3,
    y_length=8.0,
    z_sd=2.5e-3,
    z_length=8.0,
    accel=(0.3, 0.15, 0.05),
    tilt=0.2,
    tilt_sd=0.3,
    squat_sd=0.1,
    y_tilt_sd=0.3,
    y_bend_sd=5.0,
)
