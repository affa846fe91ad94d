"""Templates: ``simrail new estimator NAME`` writes one file that works, to be changed into one's own.

An estimator and an odometry are written from the templates here; a track, vehicle, IMU or scenario is a copy
of a shipped file, so the template is always one that runs. A ride has its data beside it: simulated, and
written as a logger might have, of a device upside down, in deg/s and g, with time stamps in milliseconds that
jitter, and a few samples lost.
"""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from simrail.core.errors import InputError
from simrail.core.toml_files import label, shipped

if TYPE_CHECKING:
    import pandas as pd

    from simrail.core.jit import FloatArray

SHIPPED = {
    "track": ("smooth_curve", 'track = "./{file}"', ""),
    "vehicle": ("metro_irw_bogie", 'vehicle = "./{file}"', "look at it: simrail vehicle {path}\n"),
    "imu": ("lord_3dm_gx4_25", 'grade = "./{file}" in an [[imu]]', "look at it: simrail imu {path}\n"),
}
KINDS = ("estimator", "odometry", *SHIPPED, "scenario", "ride")

_ESTIMATOR = Template('''"""$Class: what it is for, in one line.

Then what it is not for, and the source of its equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL, ATTITUDE, GYRO
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording


@dataclass(frozen=True)
class $Class:
    """Complementary filter: the gyro is integrated, and drawn to the accelerometer's tilt.

    With a = dt / (time_constant_s + dt), and the tilt of the specific force f,
    roll_f = atan2(f_y, f_z), pitch_f = atan2(-f_x, hypot(f_y, f_z)):

    roll  += (1 - a) roll' dt  + a (roll_f - roll)      (pitch alike)
    yaw   += yaw' dt

    where roll', pitch', yaw' are the Euler rates of the measured body rate. It knows nothing of curves:
    see `simrail.estimators.attitude.compensation` for what a train can do about them.

    Attributes
    ----------
    time_constant_s : float
        How long the gyro is trusted.
    """

    time_constant_s: float = 5.0

    causal = True  # the estimate at a time uses nothing recorded later; check_estimator tests it
    needs = ()  # ("odometry",) if it must know where the train is
    role = "method"  # or "baseline", "general_purpose", "ablation": how tables mark it

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw from a recording and nothing else."""
        gyro = recording.imu[list(GYRO)].to_numpy()
        force = recording.imu[list(ACCEL)].to_numpy()
        dt = 1.0 / recording.imu_sheet.rate_hz
        gain = dt / (self.time_constant_s + dt)
        tilt_roll = np.arctan2(force[:, 1], force[:, 2])
        tilt_pitch = np.arctan2(-force[:, 0], np.hypot(force[:, 1], force[:, 2]))
        angles = np.empty((len(gyro), 3))
        # The train knows where it starts, so it knows its heading: that of the design track.
        yaw = float(recording.track.frame(recording.start_position_m).yaw_rad)
        roll, pitch = tilt_roll[0], tilt_pitch[0]
        for i, (p, q, r) in enumerate(gyro):
            turn = q * np.sin(roll) + r * np.cos(roll)
            roll_rate = p + turn * np.tan(pitch)
            pitch_rate = q * np.cos(roll) - r * np.sin(roll)
            roll += (1.0 - gain) * roll_rate * dt + gain * (tilt_roll[i] - roll)
            pitch += (1.0 - gain) * pitch_rate * dt + gain * (tilt_pitch[i] - pitch)
            yaw += turn / np.cos(pitch) * dt
            angles[i] = roll, pitch, yaw
        states = pd.DataFrame(angles, index=recording.imu.index, columns=list(ATTITUDE))
        return Estimate(states=states, mount=recording.mount)
''')


_ODOMETRY = Template('''"""$Class: what it is for, in one line.

Then what it is not for, and the source of its equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.core.columns import ODOMETRY, ODOMETRY_SD
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording


@dataclass(frozen=True)
class $Class:
    """Counts pulses: way, and its first and second difference over a window.

    Attributes
    ----------
    window_s : float
        Length of the window.
    """

    window_s: float = 1.0

    causal = True  # the answer at a time uses nothing recorded later; check_odometry tests it
    needs = ("encoder",)
    uses_imu = False

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate position, speed and acceleration along the track at the times of the IMU."""
        sheet, times = recording.encoder_sheet, recording.imu.index.to_numpy()
        pulse = 2.0 * np.pi * sheet.wheel_radius_m / sheet.pulses_per_revolution
        read_at = recording.encoder.index.to_numpy()
        counts = recording.encoder["pulse_count"].to_numpy()

        def way(at: np.ndarray) -> np.ndarray:
            """Way at the last reading before each time."""
            last = np.searchsorted(read_at, at, side="right") - 1
            return pulse * (counts[np.maximum(last, 0)] - counts[0])

        now, before, long_before = (way(times - k * self.window_s) for k in (0.0, 1.0, 2.0))
        speed = (now - before) / self.window_s
        acceleration = (now - 2.0 * before + long_before) / self.window_s**2
        scale = sheet.radius_relative_sd  # how well the radius of the wheel is known
        states = pd.DataFrame(index=recording.imu.index, columns=[*ODOMETRY, *ODOMETRY_SD], dtype=float)
        states["position_m"] = recording.start_position_m + now
        states["speed_mps"], states["acceleration_mps2"] = speed, acceleration
        states["position_sd_m"] = np.hypot(scale * now, pulse)
        states["speed_sd_mps"] = np.hypot(scale * speed, pulse / self.window_s)
        states["acceleration_sd_mps2"] = np.hypot(scale * acceleration, 2.0 * pulse / self.window_s**2)
        return Estimate(states=states, mount=recording.mount)
''')

_RIDE = Template("""# $name: a ride of a train, as its logger wrote it. Change it into your own, then
#     simrail estimate $name.toml --estimator AttitudeEkf
name = "$name"
track = "smooth_curve"          # a shipped track, or your own: simrail new track my_line, "./my_line.toml"
start_position_m = $start        # where on the track the IMU stood at its first sample
gravity_mps2 = 9.81
longest_gap_s = 0.1             # lost samples up to here become a straight line, on record; more is refused

[imu]
file = "$name.csv"              # or .parquet; for other CSV: separator = ";", decimal = ",", skip_lines = 3
body = "front"                  # what carries it, and where: forward, left, above the rails
position_m = [0.0, 0.0, 0.6]
axes = ["x", "-y", "-z"]        # axes of the device that point forward, left, up: this one is upside down
roll_deg = 0.0                  # and its angles there, where it does not sit square
pitch_deg = 0.0
yaw_deg = 0.0
grade = "lord_3dm_gx4_25"       # its data sheet: a shipped one, "./my_imu.toml", or a table [imu.datasheet]

[imu.columns]                   # names in the file; of the device's own axes x, y, z
time = "t_ms"
gyro = ["wx", "wy", "wz"]
accel = ["ax", "ay", "az"]

[imu.units]
time = "ms"                     # s, ms, us, ns; iso for date-times; epoch_s, epoch_ms, ...
gyro = "deg/s"                  # rad/s, deg/s, deg/h
accel = "g"                     # m/s2, g, mg; "-g" if the logger writes gravity and not specific force

[encoder]                       # or [odometer], with a column of speed or distance and its unit
file = "$name.csv"
columns = { time = "t_ms", count = "pulses" }
units = { time = "ms" }
reverse = false                 # true if it counts up while the train runs towards smaller s

[encoder.sheet]
wheel = "front.left"
pulses_per_revolution = 1024
wheel_radius_m = 0.29
rate_hz = 100.0
""")


def write_template(kind: str, name: str, *, folder: Path = Path()) -> tuple[Path, str]:
    """Write a template.

    Parameters
    ----------
    kind : str
        ``estimator``, ``odometry``, ``track``, ``vehicle``, ``imu``, ``scenario`` or ``ride``.
    name : str
        Name of the part: a word of letters, digits and ``_``, e.g. ``my_filter``.
    folder : Path, optional
        Where to write it.

    Returns
    -------
    Path, str
        The file, and what to do next.

    Raises
    ------
    InputError
        If there is no such kind, the name is none, or the file exists.
    """
    if kind not in KINDS:
        near = difflib.get_close_matches(kind, KINDS, n=1)
        raise InputError(
            "there is no template of this kind",
            field="KIND",
            value=kind,
            limit="one of " + ", ".join(KINDS),
            remedy=f"did you mean {near[0]}?" if near else None,
        )
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(
            "is no name for a file",
            field="NAME",
            value=name,
            limit="letters, digits and _, a letter first",
            remedy="e.g. my_filter",
        )
    if not folder.is_dir():
        raise InputError("there is no such folder", field="--in", value=str(folder), remedy="make it first")
    path = folder / f"{name}.{'py' if kind in ('estimator', 'odometry') else 'toml'}"
    data = folder / f"{name}.csv" if kind == "ride" else None
    for file in (path, data):
        if file is not None and file.exists():
            raise InputError(
                "the file exists", file=label(file), remedy="choose another name, or move the file away"
            )
    if data is not None:
        text, logged = ride_template(name)
        data.write_text(logged, encoding="utf-8")
        next_step = f"its data: {label(data)}\ntry it: simrail estimate {label(path)} --estimator AttitudeEkf"
    elif kind in ("estimator", "odometry"):
        text, next_step = _of_class(kind, name, path)
    elif kind == "scenario":
        text, next_step = _copy("scenario", "quick_kinematic", name), f"run it: simrail run {label(path)}"
    else:
        source, use, look = SHIPPED[kind]
        text = _copy(kind, source, name)
        next_step = look.format(path=label(path))
        next_step += f"use it in a scenario beside it: {use.format(file=path.name)}"
    path.write_text(text, encoding="utf-8")
    return path, next_step


def _of_class(kind: str, name: str, path: Path) -> tuple[str, str]:
    class_name = "".join(word[:1].upper() + word[1:] for word in name.split("_") if word)
    if kind == "odometry":
        return _ODOMETRY.substitute(Class=class_name), (
            f'use it in a scenario beside it: odometry = "./{path.name}:{class_name}"\n'
            f"or try it at once: simrail run quick_kinematic --set 'odometry=\"{label(path)}:{class_name}\"'"
        )
    text = _ESTIMATOR.substitute(Class=class_name)
    next_step = (
        f'use it in a scenario beside it:\n\n    [[estimator]]\n    name = "{name}"\n'
        f'    method = "{path.name}:{class_name}"\n\n'
        f"or try it at once: simrail run quick_kinematic "
        # Quoted: some shells take brackets for a pattern of file names.
        f"--set 'estimator[0].method={label(path)}:{class_name}' "
        f"--set 'estimator[0].name={name}' --set 'estimator[0].options={{}}'"
    )
    return text, next_step


def _copy(kind: str, source: str, name: str) -> str:
    text = shipped(kind)[source].read_text(encoding="utf-8")
    return f"# {name}: a copy of the shipped {kind} {source!r}, to be changed.\n\n{text}"


def ride_template(name: str) -> tuple[str, str]:
    """Text of a ride file, and of the logger's file that it names (``<name>.csv``)."""
    # It simulates: too heavy for the other templates.
    from simrail.recording.sheets.imu_file import load_grade
    from simrail.ride.kinematic import kinematic_truth
    from simrail.ride.truth import Mount
    from simrail.sensors.encoder import EncoderSpec
    from simrail.sensors.measure import measure
    from simrail.track.file import track_by_name
    from simrail.vehicle.speed_profile import SpeedProfile

    track = track_by_name("smooth_curve")
    profile = SpeedProfile(start_m=110.0, end_m=330.0, speed_mps=12.0, rest_s=5.0, final_rest_s=2.0)
    truth = kinematic_truth(track, profile)
    recording = measure(
        truth,
        name=name,
        mount=Mount("imu", truth.body_names[0], (0.0, 0.0, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec(truth.wheel_names[0], radius="calibrated"),
        seed=1,
        draw=0,
    )
    text = _RIDE.substitute(name=name, start=f"{recording.start_position_m:.1f}")
    assert recording.encoder is not None and recording.encoder_sheet is not None
    text = text.replace(
        "wheel_radius_m = 0.29\n", f"wheel_radius_m = {recording.encoder_sheet.wheel_radius_m:.4f}\n"
    )
    return text, _logged(recording.imu, recording.encoder)


def _logged(imu: pd.DataFrame, encoder: pd.DataFrame) -> str:
    """A logger's CSV, at 100 Hz, of what IMU and encoder recorded."""
    import numpy as np
    import pandas as pd

    from simrail.core.columns import ACCEL, GYRO
    from simrail.core.seeds import stream
    from simrail.recording.sheets.datasheet import STANDARD_GRAVITY_MPS2

    time = imu.index.to_numpy()
    generator = stream(1, "template", "ride")
    count = int((time[-1] - time[0]) * 100.0) - 1
    stamps = time[0] + (np.arange(count) + generator.uniform(0.0, 0.3, count)) / 100.0
    stamps = np.round(np.delete(stamps, [1200, 1201, 1707]), 4)

    columns: dict[str, FloatArray] = {"t_ms": np.round(1e3 * stamps, 1)}
    for names, letter, scale in ((GYRO, "w", np.pi / 180.0), (ACCEL, "a", STANDARD_GRAVITY_MPS2)):
        for name, axis, sign in zip(names, "xyz", (1.0, -1.0, -1.0), strict=True):
            columns[letter + axis] = np.round(sign * np.interp(stamps, time, imu[name]) / scale, 5)
    counted = np.interp(stamps, encoder.index.to_numpy(), encoder["pulse_count"].to_numpy())
    columns["pulses"] = np.floor(counted).astype(np.int64)
    return str(pd.DataFrame(columns).to_csv(index=False, lineterminator="\n"))
