"""A logger's file in its own units, axes and clock is read into the recording that SI would have given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.ahrs import Vqf
from simrail.estimators.attitude.ekf import AttitudeEkf
from simrail.estimators.attitude.gda import AttitudeGda
from simrail.estimators.odometry.encoder import EncoderOdometry

from simrail.core.columns import ACCEL, ATTITUDE, GYRO, IMU
from simrail.core.errors import InputError
from simrail.estimation.choose_odometry import with_odometry
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.files.ride_file import EncoderSignalPart
from simrail.recording.recording import EncoderSheet, OdometerSheet, Recording
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount, Truth
from simrail.sensors.encoder import EncoderSpec, sample_encoder
from simrail.track.file import track_by_name
from simrail.vehicle.speed_profile import SpeedProfile

MOUNT = Mount("axle", "body", (0.0, 0.0, 0.6))

HEAD = """name = "test"
track = "smooth_curve"
start_position_m = {start!r}

[imu]
file = "{imu}"
name = "axle"
body = "front"
position_m = [0.0, 0.0, 0.6]
grade = "lord_3dm_gx4_25"
{more}
"""

WHEEL = """
[encoder]
file = "encoder.csv"
[encoder.sheet]
wheel = "wheel"
pulses_per_revolution = 1024
wheel_radius_m = 0.29
rate_hz = 250.0
"""

LOGGER = """rate_hz = 100.0
axes = ["x", "-y", "-z"]
[imu.columns]
time = "Time (ms)"
gyro = ["gx", "gy", "gz"]
accel = ["ax", "ay", "az"]
[imu.units]
time = "ms"
gyro = "deg/s"
accel = "g"
"""


@pytest.fixture(scope="module")
def truth() -> Truth:
    profile = SpeedProfile(start_m=100.0, end_m=300.0, speed_mps=12.0, rest_s=3.0, final_rest_s=1.0)
    return kinematic_truth(track_by_name("smooth_curve"), profile)


@pytest.fixture(scope="module")
def motion(truth: Truth) -> pd.DataFrame:
    """True motion at 1 kHz: its time stamps are whole milliseconds."""
    return truth.motion(MOUNT)


def write_encoder(truth: Truth, folder: Path) -> None:
    counts = sample_encoder(truth.wheel_angle("wheel"), truth.time_s, EncoderSpec("wheel"), seed=1, draw=0)
    counts.to_csv(folder / "encoder.csv")


def write_head(folder: Path, start: float, more: str = "", *, imu: str = "imu.csv", way: str = WHEEL) -> Path:
    path = folder / "ride.toml"
    path.write_text(HEAD.format(start=start, imu=imu, more=more) + way)
    return path


def as_device(body: np.ndarray, axes: tuple[str, ...]) -> np.ndarray:
    """What a device would say (n, 3) of a vector in the body, by the meaning of `axes`."""
    device = np.empty_like(body)
    for column, axis in enumerate(axes):
        device[:, "xyz".index(axis[-1])] = -body[:, column] if axis[0] == "-" else body[:, column]
    return device


@pytest.fixture(scope="module")
def pair(truth: Truth, motion: pd.DataFrame, tmp_path_factory) -> tuple[Recording, Recording, float, float]:
    """The ride in SI at uniform times, and as a logger has it; bounds of the interpolation in each triad."""
    start = float(motion["position_m"].iloc[0])
    plain = tmp_path_factory.mktemp("si")
    motion.iloc[::10][list(IMU)].to_csv(plain / "imu.csv")
    write_encoder(truth, plain)
    count = len(motion.iloc[::10])
    late = np.random.default_rng(3).integers(0, 4, count)
    late[[0, -1]] = 0
    rows = 10 * np.arange(count) + late
    rows = np.delete(rows, [700, 701, 702, 1500])
    seen = motion.iloc[rows]
    columns = {"Time (ms)": rows.astype(np.int64)}
    axes = ("x", "-y", "-z")
    turned = as_device(seen[list(GYRO)].to_numpy(), axes) * 180.0 / np.pi
    columns |= dict(zip(("gx", "gy", "gz"), turned.T, strict=True))
    turned = as_device(seen[list(ACCEL)].to_numpy(), axes) / 9.80665
    columns |= dict(zip(("ax", "ay", "az"), turned.T, strict=True))
    logger = tmp_path_factory.mktemp("logger")
    pd.DataFrame(columns).to_csv(logger / "imu.csv", index=False)
    write_encoder(truth, logger)
    # A chord between stamps h apart keeps within h^2/8 max|f''|, and where f has a kink (the jerk of the
    # profile steps) within h/2 times the step of f'; here both are taken from the signal itself: the
    # largest distance of the signal from any chord of its own over the longest step.
    longest = int(np.diff(rows).max())
    bounds = []
    for names in (GYRO, ACCEL):
        f = motion[list(names)].to_numpy()
        chord = 0.0
        for h in range(2, longest + 1):
            for k in range(1, h):
                share = k / h
                between = (1.0 - share) * f[:-h] + share * f[h:]
                chord = max(chord, float(np.abs(f[k : k + len(between)] - between).max()))
        bounds.append(chord)
    si = read_ride(write_head(plain, start))
    odd = read_ride(write_head(logger, start, LOGGER))
    return si, odd, bounds[0], bounds[1]


def test_logger_file_gives_the_recording_of_si_within_interpolation(pair):
    si, logger, gyro_bound, accel_bound = pair
    assert si.gaps is None and logger.gaps is not None
    assert logger.gaps["missing"].tolist() == [3, 1]
    assert logger.imu_sheet == si.imu_sheet and logger.imu_sheet.rate_hz == 100.0
    np.testing.assert_allclose(logger.imu.index, si.imu.index, rtol=0.0, atol=1e-12)
    for names, bound in ((GYRO, gyro_bound), (ACCEL, accel_bound)):
        error = np.abs(logger.imu[list(names)].to_numpy() - si.imu[list(names)].to_numpy()).max()
        assert 0.05 * bound < error <= bound * (1.0 + 1e-9) + 1e-13, (names, error, bound)
    for name in ("mount", "mount_body", "mount_position_m", "track", "encoder_sheet", "start_position_m"):
        assert getattr(logger, name) == getattr(si, name)
    pd.testing.assert_frame_equal(logger.encoder, si.encoder, check_exact=True)


@pytest.mark.parametrize("estimator", [AttitudeEkf(), AttitudeGda()], ids=lambda e: type(e).__name__)
def test_estimators_say_the_same_of_both(pair, estimator):
    si, logger, gyro_bound, accel_bound = pair
    a, b = (estimator.estimate(record).states[list(ATTITUDE)].to_numpy() for record in (si, logger))
    # A stable filter: an error of the specific force shows as tilt f/g, one of the rate as rate times
    # the memory of the filter, here taken as the whole ride.
    seconds = float(si.imu.index[-1])
    bound = accel_bound / 9.81 + gyro_bound * seconds
    assert 0.0 < np.abs(a - b).max() < bound
    assert bound < np.deg2rad(0.5)  # and so the test can tell a wrong axis from a right one


def test_si_and_uniform_passes_bit_by_bit(motion, truth, tmp_path):
    sampled = motion.iloc[::4][list(IMU)]
    sampled.to_csv(tmp_path / "imu.csv")
    write_encoder(truth, tmp_path)
    found = read_ride(write_head(tmp_path, float(motion["position_m"].iloc[0])))
    assert found.imu.to_numpy().tobytes() == sampled.to_numpy().tobytes()
    assert found.imu.index.to_numpy().tobytes() == sampled.index.to_numpy().tobytes()
    assert found.imu_sheet.rate_hz == pytest.approx(250.0, rel=1e-12)


@pytest.mark.parametrize("unit", ["iso", "epoch_s", "epoch_ms", "us"])
def test_clocks_of_loggers(motion, truth, tmp_path, unit):
    """A date, a count since 1970 and a free-running clock give the same samples; a file without any too."""
    start = float(motion["position_m"].iloc[0])
    sampled = motion.iloc[::10][list(IMU)]
    write_encoder(truth, tmp_path)
    encoder = pd.read_csv(tmp_path / "encoder.csv", comment="#")
    zero = pd.Timestamp("2024-05-31T12:00:00Z")

    def clock(seconds: pd.Series) -> pd.Series:
        dates = zero + pd.to_timedelta((seconds * 1e3).round().astype("int64"), unit="ms")
        since = {"epoch_s": 1e3, "epoch_ms": 1.0, "us": 1e-3}
        if unit == "iso":
            return dates.dt.strftime("%Y-%m-%dT%H:%M:%S.%f+00:00")
        milliseconds = (seconds * 1e3).round() + (zero.timestamp() * 1e3 if unit != "us" else 0.0)
        return milliseconds / since[unit]

    plain = sampled.reset_index()
    plain["time_s"] = clock(plain["time_s"])
    plain.to_csv(tmp_path / "imu.csv", index=False)
    encoder["time_s"] = clock(encoder["time_s"])
    encoder.to_csv(tmp_path / "encoder.csv", index=False)
    units = f'units = {{ time = "{unit}" }}\n'
    way = WHEEL.replace("[encoder.sheet]", units + "[encoder.sheet]")
    found = read_ride(write_head(tmp_path, start, units, way=way))
    np.testing.assert_allclose(found.imu.index, sampled.index, rtol=0.0, atol=3e-7)
    np.testing.assert_allclose(found.imu, sampled, rtol=0.0, atol=2e-5)


def test_a_file_without_time_stamps(motion, truth, tmp_path):
    sampled = motion.iloc[::10][list(IMU)]
    sampled.to_csv(tmp_path / "imu.csv", index=False)
    write_encoder(truth, tmp_path)
    start = float(motion["position_m"].iloc[0])
    found = read_ride(write_head(tmp_path, start, "rate_hz = 100.0"))
    np.testing.assert_allclose(found.imu.index, sampled.index, rtol=0.0, atol=1e-12)
    with pytest.raises(InputError, match=r"no such column; found 'time_s'"):
        read_ride(write_head(tmp_path, start))


def test_speed_of_an_odometer(truth, motion, tmp_path):
    """Speed in whole tenths of a km/h, ten times a second: the way within its own standard deviation."""
    start = float(motion["position_m"].iloc[0])
    motion.iloc[::10][list(IMU)].to_csv(tmp_path / "imu.csv")
    speed = np.round(36.0 * motion["speed_mps"].to_numpy()[::100]) / 10.0
    pd.DataFrame({"t": motion.index[::100], "v": speed}).to_csv(tmp_path / "odo.csv", index=False)
    way = """
[odometer]
file = "odo.csv"
columns = { time = "t", speed = "v" }
units = { speed = "km/h" }
speed_sd_mps = 0.02
"""
    found = read_ride(write_head(tmp_path, start, way=way))
    assert found.encoder is None and found.odometry_source == "odometer"
    assert found.odometer is not None and found.odometer_sheet == OdometerSheet(0.02, 0.005)
    true = motion.iloc[::10]
    error = np.abs(found.odometry["position_m"] - true["position_m"])
    assert (error < 4.0 * found.odometry["position_sd_m"] + 0.01).all()
    assert error.max() < 0.5
    assert np.abs(found.odometry["speed_mps"] - true["speed_mps"]).max() < 0.15
    assert (found.odometry["speed_mps"].iloc[:250] == 0.0).all()  # at rest, exactly


def test_distance_of_an_odometer_is_an_encoder(truth, motion, tmp_path):
    start = float(motion["position_m"].iloc[0])
    motion.iloc[::10][list(IMU)].to_csv(tmp_path / "imu.csv")
    km = np.floor((motion["position_m"].to_numpy()[::50] - start) / 0.1) * 0.1 / 1000.0 + 17.0
    pd.DataFrame({"time_s": motion.index[::50], "km": km}).to_csv(tmp_path / "odo.csv", index=False)
    way = """
[odometer]
file = "odo.csv"
columns = { distance = "km" }
units = { distance = "km" }
resolution_m = 0.1
"""
    found = read_ride(write_head(tmp_path, start, way=way))
    assert found.encoder is not None and found.encoder_sheet is not None
    assert found.encoder["pulse_count"].iloc[-1] == pytest.approx(10.0 * 200.0, abs=1)
    assert found.odometry is not None and found.odometry_source == "encoder"
    error = np.abs(found.odometry["position_m"] - motion["position_m"].iloc[::10])
    assert error.max() < 0.5


def test_a_ride_may_not_know_where_it_is(truth, motion, tmp_path):
    """Neither encoder nor odometer nor odometry: what needs none runs, what needs one is refused by name."""
    motion.iloc[::10][list(IMU)].to_csv(tmp_path / "imu.csv")
    found = read_ride(write_head(tmp_path, float(motion["position_m"].iloc[0]), way=""))
    assert found.encoder is None and found.odometer is None and found.odometry is None
    assert np.isfinite(Vqf().estimate(found).states.to_numpy()).all()
    with pytest.raises(InputError, match=r"odometry: the recording has no odometry.*with_odometry"):
        AttitudeEkf().estimate(found)
    with pytest.raises(InputError, match=r"encoder: the recording has no encoder"):
        with_odometry(found, "encoder")


def test_speed_filter_is_causal_and_signed():
    time = np.arange(200) / 10.0
    speed = pd.DataFrame({"speed_mps": np.clip(time - 3.0, 0.0, 8.0)}, index=time)
    wanted, sheet = np.arange(1900) / 100.0, OdometerSheet(0.05, 0.0)
    whole = EncoderOdometry().from_speed(speed, sheet, wanted, 5.0)
    part = EncoderOdometry().from_speed(speed.iloc[:100], sheet, wanted[:900], 5.0)
    assert whole.iloc[:900].to_numpy().tobytes() == part.to_numpy().tobytes()
    back = EncoderOdometry().from_speed(-speed, sheet, wanted, -5.0)
    np.testing.assert_array_equal(back["position_m"], -whole["position_m"])
    # s = t^2/2 while the speed rises evenly, known to a small lag.
    assert whole["position_m"].iloc[-1] - 5.0 == pytest.approx(32.0 + 8.0 * 7.99, abs=0.3)


def test_how_well_a_radius_is_known_is_what_the_ride_says_of_it_or_the_sheet() -> None:
    sheet = EncoderSheet("wheel", 1024, 0.46, 20.0, radius_relative_sd=0.01)
    told = EncoderSignalPart.model_construct(sheet=sheet, radius_relative_sd=0.004)
    assert told.known == replace(sheet, radius_relative_sd=0.004)
    assert EncoderSignalPart.model_construct(sheet=sheet, radius_relative_sd=None).known == sheet
