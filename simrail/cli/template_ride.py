"""The template of a ride: a ride file with every kind of mapping, and a logger's file that fits it.

The logger's file is simulated, and then written as a logger might have: a device upside down, in deg/s and
g, with time stamps in milliseconds that jitter, and a few samples lost.
"""

from __future__ import annotations

from string import Template

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.recording.sheets.datasheet import STANDARD_GRAVITY_MPS2
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.vehicle.speed_profile import SpeedProfile

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


def ride_template(name: str) -> tuple[str, str]:
    """Text of a ride file, and of the logger's file that it names (``<name>.csv``)."""
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
    time = imu.index.to_numpy()
    generator = stream(1, "template", "ride")
    count = int((time[-1] - time[0]) * 100.0) - 1
    stamps = time[0] + (np.arange(count) + generator.uniform(0.0, 0.3, count)) / 100.0
    stamps = np.round(np.delete(stamps, [1200, 1201, 1707]), 4)

    def at(values: FloatArray) -> FloatArray:
        found: FloatArray = np.interp(stamps, time, values)
        return found

    columns: dict[str, FloatArray] = {"t_ms": np.round(1e3 * stamps, 1)}
    for names, letter, scale in ((GYRO, "w", np.pi / 180.0), (ACCEL, "a", STANDARD_GRAVITY_MPS2)):
        for name, axis, sign in zip(names, "xyz", (1.0, -1.0, -1.0), strict=True):
            columns[letter + axis] = np.round(sign * at(imu[name].to_numpy()) / scale, 5)
    counted = np.interp(stamps, encoder.index.to_numpy(), encoder["pulse_count"].to_numpy())
    columns["pulses"] = np.floor(counted).astype(np.int64)
    return str(pd.DataFrame(columns).to_csv(index=False, lineterminator="\n"))
