"""Every fault of a recording gives one message with file, field, value, limit and remedy where they exist."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ENCODER, IMU, ODOMETRY, ODOMETRY_SD, RAIL_DISPLACEMENT
from simrail.core.errors import InputError
from simrail.core.toml_files import blame
from simrail.recording.check_form import check_recording
from simrail.recording.recording import EncoderSheet, ImuSheet, RailSensorSheet, Recording
from simrail.track.design import Straight, TrackDesign


def sound() -> Recording:
    """Four seconds of standstill, without any simulation."""
    time = pd.Index(0.028 + np.arange(1000) / 250.0, name="time_s")
    imu = pd.DataFrame(0.0, index=time, columns=list(IMU))
    imu["accel_z_mps2"] = 9.81
    odometry = pd.DataFrame(0.001, index=time, columns=[*ODOMETRY, *ODOMETRY_SD])
    return Recording(
        name="rest",
        imu=imu,
        imu_sheet=ImuSheet("ideal", 250.0, 0.028, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        mount="axle",
        mount_body="front",
        mount_position_m=(0.0, 0.0, 0.6),
        track=TrackDesign("line", 0.0, (Straight(100.0),)),
        encoder=pd.DataFrame(0, index=time, columns=list(ENCODER)),
        encoder_sheet=EncoderSheet("front.left", 1024, 0.29, 250.0),
        start_position_m=10.0,
        odometry=odometry,
        odometry_source="encoder",
    )


def rails_of(recording: Recording) -> pd.DataFrame:
    """What a rail sensor sees at rest, half a metre above the rails."""
    seen = pd.DataFrame(0.75, index=recording.imu.index, columns=list(RAIL_DISPLACEMENT))
    return seen.assign(rail_right_y_m=-0.75, rail_left_z_m=-0.5, rail_right_z_m=-0.5)


def with_index(frame: pd.DataFrame, change: Callable[[np.ndarray], None]) -> pd.DataFrame:
    time = frame.index.to_numpy().copy()
    change(time)
    return frame.set_axis(pd.Index(time, name="time_s"))


def with_value(frame: pd.DataFrame, column: str, row: int, value: object) -> pd.DataFrame:
    changed = frame.copy()
    changed[column] = changed[column].astype(object if isinstance(value, str) else float)
    changed.iloc[row, changed.columns.get_loc(column)] = value
    return changed


def swap(time: np.ndarray) -> None:
    time[[500, 501]] = time[[501, 500]]


def repeat(time: np.ndarray) -> None:
    time[501] = time[500]


def lose(time: np.ndarray) -> None:
    time[77] = np.nan


def gap(time: np.ndarray) -> None:
    time[600:] += 5.0


def wrong_rate(time: np.ndarray) -> None:
    time[:] = time[0] + (time - time[0]) * 1.001


FAULTS: dict[str, tuple[Callable[[Recording], Recording], list[str]]] = {
    "reversed": (
        lambda r: replace(r, imu=with_index(r.imu, swap)),
        ["imu.time_s", "reversed", "sample 501", "strictly increasing", "sort"],
    ),
    "duplicate": (
        lambda r: replace(r, imu=with_index(r.imu, repeat)),
        ["imu.time_s", "duplicate", "sample 501", "drop"],
    ),
    "nan_time": (lambda r: replace(r, imu=with_index(r.imu, lose)), ["imu.time_s", "NaN"]),
    "gap": (
        lambda r: replace(r, imu=with_index(r.imu, gap)),
        ["imu.time_s", "not uniform", "sample 600", "5.004 s", "0.004 s"],
    ),
    "rail_sensor_without_sheet": (
        lambda r: replace(r, rail_displacement=rails_of(r)),
        ["rail_sensor_sheet", "without its sheet", "nominal rails"],
    ),
    "rails_in_millimetres": (
        lambda r: replace(r, rail_displacement=1e3 * rails_of(r), rail_sensor_sheet=RailSensorSheet(1e-4)),
        ["rail_displacement.rail_left_y_m", "750", "10 m", "millimetres"],
    ),
    "rails_at_other_times": (
        lambda r: replace(r, rail_displacement=rails_of(r).iloc[1:], rail_sensor_sheet=RailSensorSheet(1e-4)),
        ["rail_displacement", "times"],
    ),
    "wrong_rate": (
        lambda r: replace(r, imu=with_index(r.imu, wrong_rate)),
        ["imu.time_s", "rate", "249.75", "250 Hz"],
    ),
    "encoder_reversed": (
        lambda r: replace(r, encoder=with_index(r.encoder, swap)),
        ["encoder.time_s", "reversed"],
    ),
    "nan": (
        lambda r: replace(r, imu=with_value(r.imu, "gyro_y_radps", 123, np.nan)),
        ["imu.gyro_y_radps", "0.52", "nan", "finite", "cut"],
    ),
    "infinite": (
        lambda r: replace(r, odometry=with_value(r.odometry, "speed_mps", 3, np.inf)),
        ["odometry.speed_mps", "inf"],
    ),
    "text": (
        lambda r: replace(r, imu=with_value(r.imu, "accel_x_mps2", 3, "n/a")),
        ["imu.accel_x_mps2", "numbers"],
    ),
    "missing_column": (
        lambda r: replace(r, imu=r.imu.drop(columns="gyro_z_radps")),
        ["imu", "missing column", "gyro_z_radps [rad/s]"],
    ),
    "missing_sd": (
        lambda r: replace(r, odometry=r.odometry.drop(columns="speed_sd_mps")),
        ["odometry", "speed_sd_mps [m/s]"],
    ),
    "degrees": (
        lambda r: replace(r, imu=r.imu.assign(gyro_z_radps=np.linspace(0.0, -20.5, 1000))),
        ["imu.gyro_z_radps", "-20.5", "20 rad/s", "degrees"],
    ),
    "one_sample_beyond": (
        lambda r: replace(r, imu=with_value(r.imu, "gyro_z_radps", 40, -20.5)),
        ["imu.gyro_z_radps", "-20.5", "20 rad/s", "no measurement", "drop"],
    ),
    "milli_g": (
        lambda r: replace(r, imu=r.imu.assign(accel_z_mps2=1000.0)),
        ["imu.accel_z_mps2", "1000", "500 m/s2", "mg"],
    ),
    "empty": (lambda r: replace(r, imu=r.imu.iloc[:1]), ["imu", "too short"]),
    "other_times": (
        lambda r: replace(r, odometry=r.odometry.iloc[:-1]),
        ["odometry.time_s", "999", "1000"],
    ),
    "no_time": (lambda r: replace(r, imu=r.imu.reset_index(drop=True)), ["imu", "time_s", "index"]),
    "no_sheet": (lambda r: replace(r, encoder_sheet=None), ["encoder_sheet"]),
}


def test_a_sound_recording_passes():
    check_recording(sound())
    almost = sound()
    check_recording(replace(almost, imu=almost.imu.assign(gyro_x_radps=19.9)))


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_refused_by_name(fault):
    damage, words = FAULTS[fault]
    with pytest.raises(InputError) as caught, blame("ride_7"):
        check_recording(damage(sound()))
    message = str(caught.value)
    assert message.startswith("ride_7: ")
    assert "\n" not in message
    for word in words:
        assert word in message, message
