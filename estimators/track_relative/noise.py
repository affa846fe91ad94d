"""How much a body moves in its track, by the class of its mount.

The sizes are synthetic: of simrail's `metro_irw_bogie` and `manchester_1` on good rails at 20 to 73 km/h,
chosen by hand near the largest likelihood of rides that are not those of any shipped scenario (roll and pitch
of a body on bogies: of `manchester_1` in `bounds_multibody`). Likelihood alone drives the processes of y and
z to nothing where a mount shakes, and the rails with them; a yaw that it finds, half as large on a frame,
makes the place worse by a tenth.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from simrail.estimators.odometry.pointing import OTHER_BODY, chord_of, kind_of, section_of
from simrail.estimators.odometry.scale import scale_of

from simrail.core.errors import InputError, did_you_mean
from simrail.recording.recording import Recording

AT_MPS = 70.0 / 3.6
"""Speed at which `Motion.gyro` and `Motion.accel` hold; they grow with its power of 1.5."""


SLOW_M = 150.0 / (2.0 * math.pi)
"""Irregularities of rails are measured in waves of up to 150 m (EN 13848-1: D3 ends there): what is slower is
a deviation from the map, of which the map's sheet speaks. Of a wave of that length half the power is left, of
a kilometre two percent."""


@dataclass(frozen=True)
class Motion:
    """How a body moves in its track.

    Attributes
    ----------
    roll_sd, pitch_sd, yaw_sd : float
        Standard deviations of its angles, rad.
    roll_length, pitch_length, yaw_length : float
        Lengths over which they change, m.
    y_sd, y_length, z_sd, z_length : float
        Of the place of the mount beside the nominal one, m.
    sway_hz, damping : float
        Natural frequency and damping ratio of a roll that sways in time; 0 Hz: it is over the distance.
    gyro, accel_x, accel_y, accel_z : float
        White motion that the model lacks, per sample of 125 Hz at `AT_MPS`, rad/s and m/s2.
    rocking : float
        White rates of roll and pitch per step, rad/s: at a stop a body rocks on, where what goes by the
        distance cannot.
    heaving : float
        White force along Z per step where the train stands, m/s2: passengers walk about.
    tilt, tilt_sd : float
        Roll flexibility: rad of roll per rad of cant deficiency, its mean and standard deviation.
    tilt_rate_sd : float
        Of TILT_RATE, s: by so long the suspension follows late, times its flexibility.
    squat_sd, torsion_sd : float
        rad of pitch per g; rad of roll per rad by which the body above rolls more than the track here.
    y_tilt_sd, y_bend_sd : float
        Lateral place per rad of cant deficiency, m, and per curvature, m2.

    Raises
    ------
    InputError
        If a value is negative, a length or damping 0, or a damping 1 or more.
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
    damping: float = 0.3
    gyro: float = 1e-3
    accel_x: float = 0.14
    accel_y: float = 0.11
    accel_z: float = 0.08
    rocking: float = 1e-4
    heaving: float = 0.0
    tilt: float = 0.0
    tilt_sd: float = 0.1
    tilt_rate_sd: float = 0.0
    squat_sd: float = 0.01
    torsion_sd: float = 0.0
    y_tilt_sd: float = 0.05
    y_bend_sd: float = 1.0

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            divides = entry.name == "damping" or entry.name.endswith("_length")
            most = 1.0 if entry.name == "damping" else 1e6
            if not 0.0 <= value < most or (divides and value == 0.0):
                limit = f"{'>' if divides else '>='} 0, < {most:g}"
                raise InputError("is out of range", field=entry.name, value=value, limit=limit)


AXLE = Motion(
    pitch_sd=7.3e-4,
    pitch_length=1.8,
    yaw_sd=6.6e-4,
    yaw_length=3.9,
    gyro=3e-4,
    accel_x=0.32,
    accel_y=0.1,
    accel_z=0.25,
)
"""What runs on the rails by itself."""

FRAME = Motion(
    roll_sd=3e-3,
    roll_length=8.0,
    pitch_sd=7.3e-4,
    yaw_sd=1.2e-3,
    yaw_length=6.3,
    gyro=3e-4,
    accel_x=0.16,
    torsion_sd=0.15,
)
"""A bogie frame."""

WAGON = Motion(
    roll_sd=3e-3,
    sway_hz=0.51,
    pitch_sd=6e-4,
    pitch_length=3.0,
    yaw_sd=1e-3,
    yaw_length=10.0,
    y_length=8.0,
    z_sd=8e-3,
    z_length=8.0,
    accel_x=0.3,
    accel_y=0.15,
    accel_z=0.05,
    rocking=4e-4,
    heaving=0.02,
    tilt=0.2,
    tilt_sd=0.3,
    tilt_rate_sd=0.05,
    squat_sd=0.03,
    y_tilt_sd=0.3,
    y_bend_sd=5.0,
)
"""What rests on axles with nothing upon it, which one stage of springs shakes more; and a body of which there
is no drawing."""

BODY = replace(WAGON, roll_sd=2e-3, sway_hz=0.55, damping=0.2, pitch_length=12.0)
"""What rests on two bogies."""

JOINTED = replace(
    WAGON,
    pitch_sd=5e-4,
    pitch_length=8.0,
    yaw_sd=4e-3,
    yaw_length=25.0,
    y_sd=8e-3,
    y_length=11.0,
    torsion_sd=0.5,
    y_tilt_sd=1.0,
)
"""A body of a section, on one bogie or between other bodies: joints make its neighbours turn, pitch and
shift it, and it swings on after a transition. Of a section of three modules that is 1.2 times as heavy as
`metro_irw_train`, 1.6 times as stiff in its springs and half as damped in its joints: pitch and place by
likelihood, yaw a third larger than that so that a swing passes for no fault, the torsion by regression on
its truth (0.65 to 0.68 of how much more the track rolls under its neighbour)."""

LONE = replace(JOINTED, pitch_sd=8e-4, yaw_sd=3e-3, yaw_length=21.0)
"""A body on one bogie that hangs on no other: nothing but its own springs hold its pitch."""

CLASSES = {
    "axle": AXLE,
    "frame": FRAME,
    "body": BODY,
    "wagon": WAGON,
    "jointed": JOINTED,
    "lone": LONE,
}
"""Classes of mounts, by the word that a tuned size begins with, e.g. ``axle_yaw_sd``."""

MOST_DAMPING = 0.7
"""Of a body that sways, as a ratio."""

MODEL_BODY = {"roll_sd": 5.0, "pitch_sd": 2.5, "yaw_sd": 2.0, "y_sd": 5.0, "z_sd": 2.5} | {
    "pitch_length": 0.5,
    "yaw_length": 0.5,
    "damping": 2.5,
    "rocking": 0.0,
    "heaving": 0.0,
}
"""By so much more than by its scale a body of a model moves that rests on springs. Rails of a model are
rougher than its scale makes them, and nobody walks about in it. Synthetic: by hand on twelve rides of the
1:10 car of `scale_greatest`, whose body rolls by 10 mrad, by the greatest error of its rails."""


def motion_of(recording: Recording, tuned: Mapping[Motion, Motion] | None = None) -> Motion:
    """That of the mount's class, by the vehicle's drawing; lengths by the gauge of a model track.

    ``tuned`` has, by the motion of a class, what is to be taken in its place.
    """
    motion, scale = class_of(recording), scale_of(recording)
    motion = (tuned or {}).get(motion, motion)
    if scale == 1.0:
        return motion
    return at_scale(model_body(motion, scale) if motion.sway_hz > 0.0 else motion, scale)


def slow_m_of(recording: Recording) -> float:
    """Way in which ROLL_SLOW follows ROLL, m."""
    return SLOW_M * scale_of(recording)


def tuned_motions(sizes: Mapping[str, float]) -> dict[Motion, Motion]:
    """Motion of each of `CLASSES`, by that, with some sizes that differ.

    Parameters
    ----------
    sizes : mapping of str to float
        By a word of `CLASSES`, ``_`` and a name of `Motion`, e.g. ``axle_yaw_sd``; at full size.

    Raises
    ------
    InputError
        If there is no such class or size, or a value is out of range.
    """
    names = [entry.name for entry in fields(Motion)]
    tuned = dict(CLASSES)
    for name, value in sizes.items():
        kind, _, size = name.partition("_")
        if kind not in CLASSES or size not in names:
            every = [f"{word}_{entry}" for word in CLASSES for entry in names]
            raise InputError(
                "is no size of a class of mounts",
                field=name,
                value=value,
                limit=f"{'_, '.join(CLASSES)}_ and behind that one of {', '.join(names)}",
                remedy=did_you_mean(name, every) or "remove it",
            )
        try:
            tuned[kind] = replace(tuned[kind], **{size: value})
        except InputError as error:
            error.field = name
            raise
    return {CLASSES[kind]: motion for kind, motion in tuned.items()}


def at_scale(motion: Motion, scale: float) -> Motion:
    """The motion of a model of another scale, with the same angles."""
    longer: dict[str, Any] = {}
    for entry in fields(motion):
        value = getattr(motion, entry.name)
        if entry.name.endswith("_length") or entry.name in ("y_sd", "z_sd", "y_tilt_sd"):
            longer[entry.name] = scale * value
    return replace(motion, y_bend_sd=scale**2 * motion.y_bend_sd, **longer)


def model_body(motion: Motion, scale: float) -> Motion:
    """That of a body that sways, on a model: by `MODEL_BODY`, and faster by the root of the scale."""
    sizes: dict[str, Any] = {name: factor * getattr(motion, name) for name, factor in MODEL_BODY.items()}
    sizes["damping"] = min(sizes["damping"], MOST_DAMPING)
    return replace(motion, sway_hz=motion.sway_hz / math.sqrt(scale), **sizes)


def class_of(recording: Recording) -> Motion:
    """That of the mount's class at full size."""
    sheet = recording.vehicle_sheet
    here = None if sheet is None else sheet.body(recording.mount_body)
    if sheet is None or here is None:
        return WAGON
    if not here.supports:
        return AXLE
    if kind_of(recording, chord_of(recording)) is OTHER_BODY:
        return LONE if section_of(recording) is None else JOINTED
    below = [sheet.body(support.on) for support in here.supports]
    on_axles = all(body is None or not body.supports for body in below)
    if on_axles:
        return FRAME if sheet.above(here.name) else WAGON
    return BODY
