"""Recordings survive the disk bit by bit, whole or not at all."""

from dataclasses import asdict, replace
from typing import get_type_hints

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simrail.core.errors import InputError
from simrail.core.toml_files import judge, load, parse_toml, shipped
from simrail.estimation.choose_odometry import with_odometry
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.check_form import check_recording
from simrail.recording.check_physics import check_plausible
from simrail.recording.files.asked import MeasuredPart
from simrail.recording.files.ride_file import ImuSignalPart, RideFile
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.files.ride_writer import write_ride
from simrail.recording.files.signal_part import SignalPart, VectorPart
from simrail.recording.recording import OdometerSheet, Recording, beginning
from simrail.recording.sheets.imu_file import load_grade
from simrail.recording.signals import SIGNALS
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.drawing import drawing
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.gnss import GnssSpec, Outage
from simrail.sensors.magnetometer import MagnetometerSpec
from simrail.sensors.measure import measure
from simrail.sensors.rail_sensor import RailSensorSpec
from simrail.sensors.second_imu import SecondImuSpec
from simrail.track.design import Curve, Gradient, Straight, TrackDesign, Transition
from simrail.track.file import TrackFile, track_by_name, track_text
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded()


def recorded(second_imu: SecondImuSpec | None = None, gnss: GnssSpec | None = None) -> Recording:
    track = TrackDesign(
        "curve",
        -50.0,
        (
            Straight(80.0),
            Transition(30.0),
            Curve(100.0, 1.0 / 3.0e-3, 0.07),
            Transition(30.0),
            Straight(100.0),
        ),
        gradients=(Gradient(0.0, 0.005), Gradient(90.0, -0.0123)),
        vertical_radius_m=1500.0,
    )
    model = load(VehicleFile, "vehicle", "manchester_1").model("coach")
    truth = kinematic_truth(track, SpeedProfile(start_m=0.0, end_m=150.0, speed_mps=8.0, rest_s=2.0))
    recording = measure(
        truth,
        name="Montequinto é",
        mount=Mount("axle", "body", (0.1, -0.2, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("wheel", radius_error_sd=1e-3, edge_times=True),
        magnetometer=MagnetometerSpec(),
        rail_sensor=RailSensorSpec(),
        rails=lay(track, Irregularity("erri_b176_low", fade_m=20.0), seed=1),
        second_imu=second_imu,
        gnss=gnss,
        seed=1,
        draw=0,
        vehicle_sheet=drawing(model),
    )
    return with_odometry(recording, "encoder")


FRAMES = [signal.name for signal in SIGNALS]


def assert_same(a: Recording, b: Recording) -> None:
    for part in FRAMES:
        left, right = getattr(a, part), getattr(b, part)
        if left is None:
            assert right is None
        else:
            pd.testing.assert_frame_equal(left, right, check_exact=True)
            assert left.to_numpy().tobytes() == right.to_numpy().tobytes()
            assert left.index.to_numpy().tobytes() == right.index.to_numpy().tobytes()
            assert right.index.name == (None if part == "gaps" else "time_s")
            assert left.dtypes.equals(right.dtypes)
    blank = dict.fromkeys(FRAMES)
    assert repr(asdict(replace(a, **blank))) == repr(asdict(replace(b, **blank)))


@pytest.mark.parametrize("format", ["csv", "parquet"])
def test_a_ride_in_frd_reads_as_it_was(recording, tmp_path, format):
    """Forward, right, down: named in the columns, Y and Z of the other sign, and read back bit by bit."""
    write_ride(recording, tmp_path / "ride", format=format, axes="ned")
    assert_same(recording, read_ride(tmp_path / "ride"))
    if format == "csv":
        imu = pd.read_csv(tmp_path / "ride" / "imu.csv", comment="#")
        assert list(imu)[:4] == ["time_s", "gyro_x_frd_radps", "gyro_y_frd_radps", "gyro_z_frd_radps"]
        np.testing.assert_array_equal(imu["accel_z_frd_mps2"], -recording.imu["accel_z_mps2"])
        np.testing.assert_array_equal(imu["accel_x_frd_mps2"], recording.imu["accel_x_mps2"])
        assert imu["accel_z_frd_mps2"].iloc[0] == pytest.approx(-9.81, abs=0.1)  # at rest, up is minus
        rails = pd.read_csv(tmp_path / "ride" / "rail_displacement.csv", comment="#")
        assert rails["rail_left_y_frd_m"].mean() < 0.0 < rails["rail_right_y_frd_m"].mean()


@pytest.mark.parametrize("format", ["csv", "parquet"])
def test_round_trip_is_exact(recording, tmp_path, format):
    write_ride(recording, tmp_path / "ride", format=format)
    assert sorted(path.name for path in (tmp_path / "ride").iterdir()) == [
        f"encoder.{format}",
        f"imu.{format}",
        f"magnetometer.{format}",
        f"odometry.{format}",
        f"rail_displacement.{format}",
        "ride.toml",
        "track.toml",
    ]
    again = read_ride(tmp_path / "ride")
    assert_same(recording, again)
    assert_same(recording, read_ride(tmp_path / "ride" / "ride.toml"))
    s = np.linspace(-40.0, 280.0, 50)
    np.testing.assert_array_equal(again.track.frame(s).k, recording.track.frame(s).k)


@pytest.fixture(scope="module")
def with_two() -> Recording:
    rear = Mount("rear", "body", (-14.0, 0.3, 0.6), roll_rad=0.01)
    return recorded(SecondImuSpec(rear, load_grade("lord_3dm_gx4_25"), clock_offset_s=0.0123456789))


@pytest.mark.parametrize("format", ["csv", "parquet"])
def test_a_second_imu_survives_with_its_clock_and_its_mount(recording, with_two, tmp_path, format):
    """And what else is recorded is the same to the bit, with it and without."""
    write_ride(with_two, tmp_path / "ride", format=format)
    again = read_ride(tmp_path / "ride")
    assert_same(with_two, again)
    assert again.second_imu_sheet.spacing_m == pytest.approx(14.1, abs=5e-3)  # along the slope
    assert again.second_imu.index[0] == with_two.imu.index[0] + 0.0123456789
    assert_same(recording, replace(with_two, second_imu=None, second_imu_sheet=None))
    short = beginning(with_two, samples=100)
    assert (
        short.second_imu.index[-1] <= short.imu.index[-1] < with_two.second_imu.index[len(short.second_imu)]
    )


@pytest.mark.parametrize("format", ["csv", "parquet"])
def test_a_receiver_survives_and_blank_cells_are_no_sample(recording, tmp_path, format):
    with_gnss = recorded(gnss=GnssSpec(rate_hz=5.0, outages=(Outage(30.0, 90.0),)))
    write_ride(with_gnss, tmp_path / "ride", format=format)
    again = read_ride(tmp_path / "ride")
    assert_same(with_gnss, again)
    blank = again.gnss["position_m"].isna()
    assert 0 < blank.sum() < len(blank) and (blank == again.gnss["speed_mps"].isna()).all()
    assert_same(recording, replace(with_gnss, gnss=None, gnss_sheet=None))
    if format == "csv":
        # A logger that has the speed alone, in km/h, and blanks for both.
        lines = (tmp_path / "ride" / "gnss.csv").read_text(encoding="utf-8").splitlines()
        assert any(line.endswith(",,") for line in lines)
        text = (tmp_path / "ride" / "ride.toml").read_text(encoding="utf-8")
        named = 'file = "gnss.csv"\ncolumns = { speed = "speed_mps" }\nunits = { speed = "km/h" }'
        (tmp_path / "ride" / "ride.toml").write_text(
            text.replace('file = "gnss.csv"', named), encoding="utf-8"
        )
        slow = read_ride(tmp_path / "ride").gnss["speed_mps"]
        np.testing.assert_allclose(slow, with_gnss.gnss["speed_mps"] / 3.6)
        (tmp_path / "ride" / "ride.toml").write_text(
            text.replace("speed_sd_mps = 0.05", "speed_sd_mps = 0.0"), encoding="utf-8"
        )
        with pytest.raises(InputError, match=r"gnss\.sheet.*speed_sd_mps"):
            read_ride(tmp_path / "ride")
    nothing = with_gnss.gnss.drop(columns=["position_m", "speed_mps"])
    with pytest.raises(InputError, match="neither a place nor a speed"):
        check_recording(replace(with_gnss, gnss=nothing))


def test_a_second_imu_that_cannot_be_is_refused(with_two, tmp_path):
    write_ride(with_two, tmp_path / "ride", format="parquet")
    text = (tmp_path / "ride" / "ride.toml").read_text(encoding="utf-8")
    spacing = next(line for line in text.splitlines() if line.startswith("spacing_m"))
    for stated, words in (
        ("spacing_m = 13.0", "is not the distance on the drawing"),
        ("spacing_m = -14.1", "is not the distance on the drawing"),
        ('mount = "x"', "unknown key"),
    ):
        (tmp_path / "ride" / "ride.toml").write_text(text.replace(spacing, stated), encoding="utf-8")
        with pytest.raises(InputError, match=words) as caught:
            read_ride(tmp_path / "ride")
        assert "second_imu" in str(caught.value) and "\n" not in str(caught.value)
    # By the drawing, where nobody has said it.
    (tmp_path / "ride" / "ride.toml").write_text(text.replace(spacing + "\n", ""), encoding="utf-8")
    assert read_ride(tmp_path / "ride").second_imu_sheet.spacing_m == pytest.approx(14.1, abs=1e-9)
    sheet = with_two.second_imu_sheet
    with pytest.raises(InputError, match="too near to the first IMU"):
        check_recording(replace(with_two, second_imu_sheet=replace(sheet, spacing_m=4.9)))
    slow = replace(sheet, imu=replace(sheet.imu, rate_hz=125.0))
    with pytest.raises(InputError, match="another rate than the first IMU"):
        check_recording(replace(with_two, second_imu=with_two.second_imu.iloc[::2], second_imu_sheet=slow))
    with pytest.raises(InputError, match="second_imu without its sheet"):
        check_recording(replace(with_two, second_imu_sheet=None))
    wild = with_two.second_imu.assign(accel_z_mps2=9810.0)
    with pytest.raises(InputError, match=r"second_imu\.accel_z_mps2"):
        check_recording(replace(with_two, second_imu=wild))


@pytest.mark.parametrize("format", ["csv", "parquet"])
def test_numbers_of_every_size_survive(recording, tmp_path, format):
    """Signed zeros, denormals, seventeen digits, whole numbers: in the noise of a sound recording."""
    imu = recording.imu.copy()
    hard = [-0.0, 5e-324, -1e-17, 0.1 + 0.2, 1.0, 2.0**-30, np.nextafter(1.0, 2.0), -1.2345678901234567e-5]
    imu.iloc[1000 : 1000 + len(hard), 0] = hard
    imu.iloc[:200, 1] = 0.0  # not all of it: an axis of zeros would be a dead one
    sheet = replace(recording.imu_sheet, gyro_noise_radpsqrts=0.0)
    gaps = pd.DataFrame({"start_s": [1.2 / 3.0, 5.0], "end_s": [1.6, 5.5 / 3.1], "missing": [4, 7]})
    for number, lost in enumerate((gaps, gaps.iloc[:0])):
        hostile = replace(recording, imu=imu, imu_sheet=sheet, gaps=lost, name='a "b" # \\ \t é')
        write_ride(hostile, tmp_path / str(number), format=format)
        assert_same(hostile, read_ride(tmp_path / str(number)))


@settings(max_examples=200, deadline=None)
@given(value=st.floats(-1.0, 1.0).map(lambda v: round(v, 9)))
def test_track_in_drawing_units_reads_back_bit_by_bit(value):
    sloped = TrackDesign(
        "a track",
        -3.0,
        (
            Straight(20.1),
            Transition(30.0),
            Curve(11.0, -317.7, abs(value) * 0.2),
            Transition(9.0),
            Straight(60.0),
        ),
        gradients=(Gradient(80.0, value * 0.01),),
        vertical_radius_m=(1134.5,),
        source="made up",
        synthetic=True,
        start_position_m=(1.0, 2.0 / 3.0, -3.0),
        start_yaw_rad=0.1 + 0.2,
    )
    try:
        text = track_text(sloped)
    except InputError as error:
        assert "no decimal" in str(error)  # a value of 17 digits may have no decimal in mm
    else:
        assert judge(TrackFile, parse_toml(text, file="t"), file="t").design("other") == sloped
    simple = replace(sloped, elements=(Straight(300.0),), gradients=(Gradient(80.0, round(0.02 * value, 3)),))
    assert judge(TrackFile, parse_toml(track_text(simple), file="t"), file="t").design("") == simple


def test_whatever_a_track_file_can_say_can_be_written_again():
    """Cants of seventeen digits, as a fit of measured track gives them: a file said them, so a file can."""
    for cant_mm in np.random.default_rng(4).uniform(1.0, 150.0, 300):
        design = TrackDesign(
            "t",
            0.0,
            (Straight(10.0), Transition(30.0), Curve(11.0, 300.0, cant_mm / 1000.0)),
        )
        assert judge(TrackFile, parse_toml(track_text(design), file="t"), file="t").design("") == design


@pytest.mark.parametrize("name", sorted(shipped("track")))
def test_every_shipped_track_can_be_written(name):
    design = track_by_name(name)
    assert judge(TrackFile, parse_toml(track_text(design), file="t"), file="t").design("") == design


def test_a_ride_without_a_drawing_has_none_when_read(recording, tmp_path):
    write_ride(replace(recording, vehicle_sheet=None), tmp_path / "ride")
    assert "vehicle_sheet" not in (tmp_path / "ride" / "ride.toml").read_text()
    assert read_ride(tmp_path / "ride").vehicle_sheet is None


def test_round_trip_without_an_encoder(recording, tmp_path):
    blind = replace(recording, encoder=None, encoder_sheet=None, odometry_source="truth")
    blind = replace(blind, magnetometer=None, magnetometer_sheet=None)
    blind = replace(blind, rail_displacement=None, rail_sensor_sheet=None)
    write_ride(blind, tmp_path / "deep" / "ride")
    assert_same(blind, read_ride(tmp_path / "deep" / "ride"))


@pytest.mark.parametrize("with_odometer", (False, True))
def test_round_trip_without_odometry(recording, tmp_path, with_odometer):
    """What was not recorded is not written, and what an odometer showed survives."""
    poor = replace(recording, encoder=None, encoder_sheet=None, odometry=None, odometry_source="")
    if with_odometer:
        odometer = recording.odometry[["speed_mps"]].iloc[::10]
        poor = replace(poor, odometer=odometer, odometer_sheet=OdometerSheet(0.03, 0.002))
    write_ride(poor, tmp_path / "ride")
    assert_same(poor, read_signals(tmp_path / "ride"))
    assert read_ride(tmp_path / "ride").odometry_source == ("odometer" if with_odometer else "")


def test_every_frame_of_a_recording_is_a_signal():
    """A new signal of `Recording` cannot be forgotten by reader and writer."""
    hints = get_type_hints(Recording)
    frames = {name for name, hint in hints.items() if "DataFrame" in str(hint)}
    assert frames == {signal.name for signal in SIGNALS}
    assert frames <= set(RideFile.model_fields)
    for signal in SIGNALS:
        form = next(
            p
            for part in (SignalPart, VectorPart, ImuSignalPart, MeasuredPart)
            for p in part.__subclasses__()
            if p not in (VectorPart, MeasuredPart) and p.signal is signal
        )
        assert form.signal is signal


def test_a_folder_in_use_is_not_overwritten(recording, tmp_path):
    write_ride(recording, tmp_path / "ride")
    with pytest.raises(ValueError, match="exists already"):
        write_ride(replace(recording, name="other"), tmp_path / "ride")
    assert read_ride(tmp_path / "ride").name == "Montequinto é"


def test_nothing_half_written_is_left(recording, tmp_path):
    broken = replace(recording, gravity_mps2=object())  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        write_ride(broken, tmp_path / "ride")
    extra = replace(recording, imu=recording.imu.assign(colour=1.0))
    with pytest.raises(InputError, match="colour"):
        write_ride(extra, tmp_path / "ride")
    assert list(tmp_path.iterdir()) == []


def test_the_judges_change_nothing(recording):
    before = recording.imu.copy(deep=True)
    check_recording(recording)
    check_plausible(recording)
    pd.testing.assert_frame_equal(recording.imu, before, check_exact=True)
