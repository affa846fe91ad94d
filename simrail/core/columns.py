"""Every data column, named once: its name, unit, frame and meaning.

Frames: *body* is the mount (X forward, Y left, Z up, fixed to the body, never turned when the train
runs backwards); *track* is the design track frame at the mount's own position; *global* is the flat,
non-rotating Earth. Euler angles are ZYX (yaw, pitch, roll), pitch positive nose down, roll positive
left side up (`estimators/EQUATIONS.md`, section 0; Briales et al. 2021, Eq. 2).

This module knows names only. It holds no data and reads no files.
"""

from collections.abc import Iterable
from typing import NamedTuple

import pandas as pd

from simrail.core.errors import InputError


class Column(NamedTuple):
    """What one column means."""

    name: str
    unit: str
    frame: str
    meaning: str


GYRO = ("gyro_x_radps", "gyro_y_radps", "gyro_z_radps")
ACCEL = ("accel_x_mps2", "accel_y_mps2", "accel_z_mps2")
IMU = GYRO + ACCEL
ATTITUDE = ("roll_rad", "pitch_rad", "yaw_rad")
ATTITUDE_SD = ("roll_sd_rad", "pitch_sd_rad", "yaw_sd_rad")
RELATIVE_ATTITUDE = ("relative_roll_rad", "relative_pitch_rad", "relative_yaw_rad")
POSITION = ("x_m", "y_m", "z_m")
VELOCITY = ("velocity_x_mps", "velocity_y_mps", "velocity_z_mps")
ACCELERATION = ("acceleration_x_mps2", "acceleration_y_mps2", "acceleration_z_mps2")
ODOMETRY = ("position_m", "speed_mps", "acceleration_mps2")
ODOMETRY_SD = ("position_sd_m", "speed_sd_mps", "acceleration_sd_mps2")
RELATIVE_POSITION = ("lateral_m", "vertical_m")
RELATIVE_POSITION_SD = ("lateral_sd_m", "vertical_sd_m")
BOUND = ("roll_bound_rad", "position_bound_m")
FAULT = "fault"
STANDSTILL = "standstill_probability"
ENCODER = ("pulse_count",)
EDGE_TIME = "edge_time_s"
RAIL_DISPLACEMENT = ("rail_left_y_m", "rail_left_z_m", "rail_right_y_m", "rail_right_z_m")
GNSS = ("position_m", "speed_mps")
MAGNETIC = ("magnetic_x_t", "magnetic_y_t", "magnetic_z_t")
MOTION = POSITION + VELOCITY + ATTITUDE + IMU + ODOMETRY + RELATIVE_POSITION + RELATIVE_ATTITUDE
INNOVATION = ("innovation_x_mps2", "innovation_y_mps2", "innovation_z_mps2", "nis")
RATE_INNOVATION = ("innovation_x_radps", "innovation_y_radps", "innovation_z_radps")
IRREGULARITY = ("alignment_m", "vertical_profile_m", "cross_level_m", "gauge_m")
CONTACT_FORCE = ("wheel_load_n", "guiding_force_n", "normal_force_n", "creep_force_x_n", "creep_force_y_n")
CREEPAGE = ("creepage_x", "creepage_y", "spin_creepage_1pm")
CONTACT_PLACE = ("rail_contact_m", "contact_angle_rad", "flange_contact")
CONTACT = ("position_m", *CONTACT_FORCE, *CREEPAGE, *CONTACT_PLACE)
IRREGULARITY_SD = ("alignment_sd_m", "vertical_profile_sd_m", "cross_level_sd_m", "gauge_sd_m")

_TABLE = [
    Column("time_s", "s", "-", "time since the start of the recording; the index of every signal frame"),
    Column("gyro_{axis}_radps", "rad/s", "body", "angular rate about the axis"),
    Column("accel_{axis}_mps2", "m/s2", "body", "specific force along the axis; at rest +g on Z"),
    Column("roll_rad", "rad", "global", "roll, positive left side up"),
    Column("pitch_rad", "rad", "global", "pitch, positive nose down"),
    Column("yaw_rad", "rad", "global", "yaw, positive to the left; unwrapped"),
    Column("{angle}_sd_rad", "rad", "global", "standard deviation of the angle"),
    Column("relative_{angle}_rad", "rad", "track", "angle of the body in the design track frame"),
    Column("{axis}_m", "m", "global", "position of the mount"),
    Column("velocity_{axis}_mps", "m/s", "global", "velocity of the mount"),
    Column("position_m", "m", "track", "distance s along the horizontal projection of the track"),
    Column("speed_mps", "m/s", "track", "ds/dt, negative when running towards smaller s"),
    Column("acceleration_mps2", "m/s2", "track", "d2s/dt2"),
    Column(
        "acceleration_{axis}_mps2",
        "m/s2",
        "body",
        "acceleration of the mount along the axis, without gravity",
    ),
    Column("lateral_m", "m", "track", "lateral position r_y of the mount, positive left"),
    Column("vertical_m", "m", "track", "vertical position r_z of the mount above the design rail plane"),
    Column("pulse_count", "1", "-", "signed encoder counts since the start"),
    Column("edge_time_s", "s", "-", "time of the last edge that the encoder passed; optional"),
    Column("magnetic_{axis}_t", "T", "body", "magnetic flux density along the axis"),
    Column("rail_left_y_m", "m", "body", "left rail seen from the IMU's place, along Y"),
    Column("rail_left_z_m", "m", "body", "left rail seen from the IMU's place, along Z"),
    Column("rail_right_y_m", "m", "body", "right rail seen from the IMU's place, along Y"),
    Column("rail_right_z_m", "m", "body", "right rail seen from the IMU's place, along Z"),
    Column("gyro_bias_{axis}_radps", "rad/s", "body", "estimated gyro bias"),
    Column("innovation_{axis}_mps2", "m/s2", "body", "measured minus predicted specific force"),
    Column("innovation_{axis}_radps", "rad/s", "body", "measured minus predicted angular rate"),
    Column("nis", "1", "-", "normalised innovation squared of all innovations of the sample together"),
    Column("alignment_m", "m", "track", "mean lateral deviation of the rails, positive left"),
    Column("vertical_profile_m", "m", "track", "mean vertical deviation of the rails, positive up"),
    Column("cross_level_m", "m", "track", "left minus right rail height"),
    Column("gauge_m", "m", "track", "left minus right lateral deviation, positive wider"),
    Column("wheel_load_n", "N", "track", "Q: vertical force of the rail on the wheel, positive up"),
    Column("guiding_force_n", "N", "track", "Y: lateral force of the rail on the wheel, positive left"),
    Column("normal_force_n", "N", "contact", "normal force, the sum over the patches of the wheel"),
    Column("creep_force_x_n", "N", "contact", "creep force on the wheel along the rail, positive forward"),
    Column("creep_force_y_n", "N", "contact", "creep force on the wheel across, in the contact's plane"),
    Column("creepage_x", "1", "contact", "longitudinal creepage: slip of the wheel forward over |speed|"),
    Column("creepage_y", "1", "contact", "lateral creepage, in the contact's plane, positive left"),
    Column("spin_creepage_1pm", "1/m", "contact", "rate of turn about the contact's normal over the speed"),
    Column(
        "rail_contact_m", "m", "rail", "contact on the rail, from the middle of its head to the field side"
    ),
    Column("roll_bound_rad", "rad", "-", "what the error of roll_rad exceeds in one of a thousand cases"),
    Column(
        "position_bound_m", "m", "track", "what the error of position_m exceeds in one of a thousand metres"
    ),
    Column("fault", "1", "-", "1 once a ride has contradicted its sheets: no bound holds from there on"),
    Column("standstill_probability", "1", "-", "probability that the train stands"),
    Column("contact_angle_rad", "rad", "rail", "angle of the contact, positive where the flange touches"),
    Column("flange_contact", "1", "rail", "1 where the flange touches its rail, else 0"),
]


def _expand() -> dict[str, Column]:
    values = {"{axis}": ("x", "y", "z"), "{angle}": ("roll", "pitch", "yaw")}
    columns: dict[str, Column] = {}
    for column in _TABLE:
        names = [column.name]
        for key, replacements in values.items():
            if key in column.name:
                names = [column.name.replace(key, word) for word in replacements]
        columns.update({name: column._replace(name=name) for name in names})
    known = (*ODOMETRY, *RELATIVE_POSITION, *IRREGULARITY)
    for name, sd in zip(known, (*ODOMETRY_SD, *RELATIVE_POSITION_SD, *IRREGULARITY_SD), strict=True):
        columns[sd] = columns[name]._replace(name=sd, meaning=f"standard deviation of {name}")
    return columns


COLUMNS: dict[str, Column] = _expand()
"""Every column by name."""


def require(frame: pd.DataFrame, columns: Iterable[str], *, what: str = "frame") -> None:
    """Refuse a frame that lacks columns.

    Parameters
    ----------
    frame : pandas.DataFrame
        The frame to judge.
    columns : iterable of str
        Names that must be present, each a key of `COLUMNS`.
    what : str
        How the message calls the frame.

    Raises
    ------
    InputError
        Naming every missing column with its unit.
    """
    missing = [name for name in columns if name not in frame.columns]
    if missing:
        listed = ", ".join(f"{name} [{COLUMNS[name].unit}]" for name in missing)
        raise InputError(
            f"missing column {listed}",
            field=what,
            value=sorted(map(str, frame.columns)),
            remedy="add the column or map it from the file's own name",
            limit=f"with {listed}",
        )
