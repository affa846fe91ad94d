"""A second IMU and the clock of a magnetometer: planted faults are found with their size, and alone."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import MAGNETIC
from simrail.core.errors import InputError
from simrail.estimation.choose_odometry import with_odometry
from simrail.recording.check_noise import noise_warnings
from simrail.recording.check_physics import check_plausible
from simrail.recording.check_sheet import check_ranges
from simrail.recording.evidence.devices import weigh_all
from simrail.recording.evidence.field_clock import _longer, weigh_field_clock
from simrail.recording.evidence.finding import Finding
from simrail.recording.evidence.judge import Evidence, weigh
from simrail.recording.evidence.second import _clock, _spacing
from simrail.recording.files.mend import mended
from simrail.recording.recording import Recording, second_alone
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.magnetometer import MagnetometerSpec, VehicleIron
from simrail.sensors.measure import measure
from simrail.sensors.second_imu import SecondImuSpec
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.vehicle.speed_profile import SpeedProfile
from tests.shared.planted_faults import PLANTS

SPACING = 15.0
TRACK = TrackDesign(
    "curves",
    -50.0,
    (
        Straight(100.0),
        Transition(40.0),
        Curve(80.0, 1.0 / 3.0e-3, 0.07),
        Transition(40.0),
        Straight(60.0),
        Transition(30.0),
        Curve(60.0, -1.0 / 2.5e-3, 0.05),
        Transition(30.0),
        Straight(120.0),
    ),
)


def ridden(start_m: float, second: SecondImuSpec | None = None) -> Recording:
    truth = kinematic_truth(
        TRACK, SpeedProfile(start_m=start_m, end_m=start_m + 400.0, speed_mps=12.0, rest_s=5.0)
    )
    return measure(
        truth,
        name="two",
        mount=Mount("front", "body", (0.0, 0.0, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("wheel", radius_error_sd=1e-3),
        magnetometer=MagnetometerSpec(iron=VehicleIron()),
        second_imu=second,
        seed=3,
        draw=0,
    )


@pytest.fixture(scope="module")
def sound() -> Recording:
    """Two IMUs of one train on bodies of their own: the second one meets each place of the track later."""
    spec = SecondImuSpec(
        Mount("rear", "body", (-SPACING, 0.0, 0.6)), load_grade("lord_3dm_gx4_25"), clock_offset_s=0.01
    )
    first, behind = ridden(20.0, spec), ridden(20.0 - SPACING)
    assert first.second_imu_sheet is not None
    late = behind.imu.copy()
    late.index = pd.Index(late.index.to_numpy() + 0.01, name="time_s")
    sheet = replace(
        first.second_imu_sheet, mount_body="other", mount_position_m=(0.0, 0.0, 0.6), spacing_m=SPACING
    )
    return replace(first, second_imu=late, second_imu_sheet=sheet)


def planted(sound: Recording, key: str, size: float) -> Recording:
    """The fault in the second IMU alone."""
    second = second_alone(sound)
    assert second is not None and sound.second_imu_sheet is not None
    if key == "spacing":
        return replace(sound, second_imu_sheet=replace(sound.second_imu_sheet, spacing_m=SPACING - size))
    if key in ("offset", "drift"):
        time = second.imu.index.to_numpy()
        time = time - size if key == "offset" else time * (1.0 - 1e-6 * size)
        return replace(sound, second_imu=second.imu.set_axis(pd.Index(time, name="time_s")))
    return replace(sound, second_imu=PLANTS[key](second, size).imu)


def test_the_second_imu_alone_is_behind_on_its_own_body(sound: Recording) -> None:
    """Its place is the first one's less the spacing, at the start and on the way; the rest is its own."""
    place = pd.DataFrame({"position_m": [20.0, 30.0], "speed_mps": [0.0, 5.0]}, index=[0.0, 3.0])
    alone = second_alone(replace(sound, odometry=place))
    sheet = sound.second_imu_sheet
    assert alone is not None and alone.odometry is not None and sheet is not None
    assert alone.start_position_m == sound.start_position_m - SPACING
    np.testing.assert_array_equal(alone.odometry, [[20.0 - SPACING, 0.0], [30.0 - SPACING, 5.0]])
    assert place["position_m"].tolist() == [20.0, 30.0]
    assert alone.imu.equals(sound.second_imu) and alone.imu_sheet == sheet.imu
    assert (alone.mount_body, alone.mount_position_m) == ("other", (0.0, 0.0, 0.6))
    assert second_alone(alone) is None


def test_a_sound_ride_is_left_alone_and_what_was_told_before_stays(sound: Recording) -> None:
    """To the bit: the fit of a ride with one IMU is as it was, that of two says the same of the first."""
    both = weigh_all(sound)
    beside = [finding.verdict for finding in both.findings[9:] if not finding.key.startswith("alone_")]
    assert not both.wrong and beside == ["sound"] * 9
    assert both.findings[:9] == weigh(sound).findings
    alone = replace(sound, second_imu=None, second_imu_sheet=None, magnetometer=None, magnetometer_sheet=None)
    assert weigh_all(alone).findings[:9] == weigh(alone).findings


@pytest.mark.parametrize(
    ("key", "size", "slack"),
    [
        ("pitch", 2.0, 0.3),
        ("offset", 0.3, 0.05),
        ("spacing", -30.0, 5.0),
        pytest.param("gyro", 0.5, 0.02, marks=pytest.mark.long),
        pytest.param("gyro", 2.0, 0.05, marks=pytest.mark.long),
        pytest.param("yaw", 5.0, 1.0, marks=pytest.mark.long),
        pytest.param("roll", -2.0, 0.3, marks=pytest.mark.long),
        pytest.param("offset", -2.0, 0.1, marks=pytest.mark.long),
    ],
)
def test_a_fault_of_the_second_imu_is_found_with_its_size_and_alone(
    key: str, size: float, slack: float, sound: Recording
) -> None:
    """Tolerances as of the first IMU's tests; and the setting that is named mends it."""
    evidence = weigh_all(planted(sound, key, size))
    (found,) = evidence.wrong
    assert found.key == (key if key == "spacing" else f"second_{key}")
    assert abs(found.value - (SPACING if key == "spacing" else size)) < slack
    assert found.setting.startswith("second_imu.")
    data = {"second_imu": {}, "imu": {}}
    (line,) = mended(data, evidence)
    assert line.startswith(found.setting if key != "gyro" else "second_imu.scale.gyro")


@pytest.mark.long
def test_faults_of_the_first_and_of_the_wheel_are_not_put_on_the_second(sound: Recording) -> None:
    for key, size in (("gyro", 2.0), ("offset", -1.0), ("wheel", 1.05)):
        evidence = weigh_all(PLANTS[key](sound, size))
        assert [finding.key for finding in evidence.wrong] == [key]


def test_the_form_of_the_second_imu_is_judged_as_the_first_ones(sound: Recording) -> None:
    assert sound.second_imu is not None and sound.second_imu_sheet is not None
    ride = with_odometry(sound, "encoder")
    check_plausible(ride)
    grams = sound.second_imu.copy()
    grams.iloc[:, 3:] /= 9.80665
    with pytest.raises(InputError, match=r"second_imu.accel: is not as large as gravity.*look like g"):
        check_plausible(replace(ride, second_imu=grams))
    down = sound.second_imu * [1.0, -1.0, -1.0, 1.0, -1.0, -1.0]
    with pytest.raises(InputError, match=r"second_imu.accel: points down"):
        check_plausible(replace(ride, second_imu=down))
    narrow = replace(sound.second_imu_sheet.imu, gyro_range_radps=1e-3)
    with pytest.raises(InputError, match=r"second_imu.gyro_.*beyond the range of its sheet"):
        check_ranges(replace(sound, second_imu_sheet=replace(sound.second_imu_sheet, imu=narrow)))
    own = sound.second_imu_sheet.imu
    loud = replace(own, gyro_noise_radpsqrts=20.0 * own.gyro_noise_radpsqrts)
    told = noise_warnings(replace(sound, second_imu_sheet=replace(sound.second_imu_sheet, imu=loud)))
    assert len(told) == 1 and told[0].startswith("second_imu.gyro: noise")


@pytest.mark.parametrize("size", [0.3, -2.0])
def test_a_magnetometer_whose_clock_is_off_is_told_by_the_gyro(size: float, sound: Recording) -> None:
    """Without map and way as well, and beside iron of the vehicle; the tolerance is three sds."""
    assert sound.magnetometer is not None
    time = sound.imu.index.to_numpy()
    late = {name: np.interp(time + size, time, sound.magnetometer[name]) for name in MAGNETIC}
    ride = replace(sound, magnetometer=pd.DataFrame(late, index=sound.imu.index))
    for one in (ride, replace(ride, encoder=None, encoder_sheet=None)):
        evidence = weigh_all(one)
        (found,) = evidence.wrong
        assert found.key == "magnetometer_offset" and found.value == pytest.approx(size, abs=0.04)
        assert found.sd < 0.02 and found.setting == "magnetometer.time_offset_s"


def test_what_a_gyro_is_late_by_its_response_is_none_of_the_magnetometers_clock(sound: Recording) -> None:
    """The same samples of a gyro whose sheet has them .3 s late: the field is that much late against them."""
    late = replace(sound, imu_sheet=replace(sound.imu_sheet, lag_s=sound.imu_sheet.lag_s + 0.3))
    own, moved = (weigh_field_clock(one)[0] for one in (sound, late))
    assert moved.value - own.value == pytest.approx(-0.3, abs=0.04)


def test_on_the_straight_a_magnetometer_tells_nothing_of_its_clock(sound: Recording) -> None:
    quiet = sound.imu * [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert sound.magnetometer is not None
    still = sound.magnetometer - sound.magnetometer + sound.magnetometer.iloc[0]
    found = weigh_all(replace(sound, imu=quiet, magnetometer=still)).of("magnetometer_offset")
    assert found.verdict == "could not be judged" and not found.wrong


@pytest.mark.parametrize(
    ("whole", "columns", "verdicts"),
    [
        ("sound", True, ["sound", "axis", "second", "clock"]),
        ("surely wrong", False, ["surely wrong", "second", "clock"]),
        ("surely wrong", True, ["could not be judged", "axis", "second", "clock"]),
    ],
)
def test_axes_are_judged_where_no_device_is_wrong_or_each_column_by_itself(
    whole: str, columns: bool, verdicts: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def found(verdict: str) -> Finding:
        return Finding("gyro", "the gyro", 1.0, 0.1, 0.0, "1", "curves", verdict)

    place = "simrail.recording.evidence.devices"
    monkeypatch.setattr(f"{place}.weigh", lambda *_: Evidence((found(whole),)))
    monkeypatch.setattr(f"{place}.weigh_axes", lambda *_: (found("axis"),))
    monkeypatch.setattr(f"{place}.are_columns", lambda *_: columns)
    monkeypatch.setattr(f"{place}.weigh_second", lambda *_: (found("second"),))
    monkeypatch.setattr(f"{place}.weigh_field_clock", lambda *_: (found("clock"),))
    monkeypatch.setattr(f"{place}.weigh_clipped", lambda *_: ())
    monkeypatch.setattr(f"{place}.weigh_exchange", lambda *_: None)
    told = weigh_all(None)  # type: ignore[arg-type]
    assert [finding.verdict for finding in told.findings] == verdicts


def test_residuals_that_hang_together_count_for_fewer() -> None:
    """Blocks of 1 s, ten lags with weights 1 - lag / 11: all alike 1 + 2 sum = 11, in turn no less than 1."""
    alike = np.full((80, 3), 0.5)
    assert _longer(alike, 1.0) == pytest.approx(0.5 * np.sqrt(11.0))
    assert _longer(alike * (-1.0) ** np.arange(80)[:, None], 1.0) == pytest.approx(0.5)
    # 2 s: five lags; of 8 blocks two.
    assert _longer(alike, 2.0) == pytest.approx(0.5 * np.sqrt(6.0))
    assert _longer(alike[:8], 1.0) == pytest.approx(0.5 * np.sqrt(3.0))


def test_clocks_and_distances_of_two_fits() -> None:
    """By their differences: of clocks in ppm as told, of places less what both mounts are apart already."""
    findings = {"drift": (130.0, 20.0, "ppm"), "offset": (0.5, 0.01, "s"), "shift": (2.0, 0.5, "m")}
    theirs = {"drift": (-70.0, 20.0, "ppm"), "offset": (0.2, 0.01, "s"), "shift": (5.0, 0.5, "m")}
    first, second = (
        Evidence(
            tuple(Finding(k, k, v, sd, 0.0, unit, "curves", "sound") for k, (v, sd, unit) in own.items())
        )
        for own in (findings, theirs)
    )
    # 200 ppm are 2.6 of what two fits (20 each) and two clocks (50 by the fits, 50 by the sheet) leave.
    drift = _clock("drift", first, second, 5e-5)
    assert (drift.value, drift.verdict) == (200.0, "sound") and drift.sd == pytest.approx(20.0 * np.sqrt(2.0))
    offset = _clock("offset", first, second, 0.01)
    assert offset.value == pytest.approx(0.3) and offset.verdict == "surely wrong"
    recording = SimpleNamespace(mount_body="front", mount_position_m=(1.0, 0.0, 0.0))
    sheet = SimpleNamespace(
        mount_body="rear", mount_position_m=(-0.5, 0.0, 0.0), spacing_m=15.0, spacing_sd_m=0.01
    )
    spacing = _spacing(first, second, recording, sheet)  # type: ignore[arg-type]
    assert spacing.value == pytest.approx(15.0 - (5.0 - 2.0) + 1.5) and spacing.verdict == "sound"
