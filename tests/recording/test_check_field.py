"""Zeros, stuck values, other units and hard iron of a magnetometer are told from the field of the Earth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ACCEL, IMU, MAGNETIC
from simrail.core.errors import InputError
from simrail.core.rotation import rotation_matrix
from simrail.recording.check_field import check_field, check_hard_iron, field_offset, field_warnings
from simrail.recording.recording import ImuSheet, MagnetometerSheet, Recording
from simrail.track.file import track_by_name

EARTH = MagnetometerSheet(noise_tpsqrthz=1e-8, intensity_t=45e-6, inclination_rad=0.96, north_rad=1.2)


def ride(iron_ut: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Recording:
    """A ride through the curve of a shipped track, at 10 Hz."""
    track = track_by_name("smooth_curve")
    time = pd.Index(np.arange(400) / 10.0, name="time_s")
    odometry = pd.DataFrame({"position_m": 100.0 + 10.0 * time.to_numpy()}, index=time)
    frame = track.frame_extended(odometry["position_m"].to_numpy())
    level, down = EARTH.intensity_t * np.cos(0.96), EARTH.intensity_t * np.sin(0.96)
    earth = np.array([level * np.cos(1.2), level * np.sin(1.2), -down])
    turns = rotation_matrix(np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad]))
    field = turns.transpose(0, 2, 1) @ earth + 1e-6 * np.array(iron_ut)
    field += np.random.default_rng(1).standard_normal(field.shape) * 3e-8
    imu = pd.DataFrame(0.0, index=time, columns=list(IMU)).assign(**{ACCEL[2]: 9.81})
    return Recording(
        name="ride",
        imu=imu,
        imu_sheet=ImuSheet("mine", 10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        mount="imu",
        mount_body="front",
        mount_position_m=(0.0, 0.0, 0.6),
        track=track,
        encoder=None,
        encoder_sheet=None,
        start_position_m=100.0,
        odometry=odometry,
        magnetometer=pd.DataFrame(field, index=time, columns=list(MAGNETIC)),
        magnetometer_sheet=EARTH,
    )


def test_the_field_of_the_earth_passes() -> None:
    sound = ride((4.0, -3.0, 5.0))
    check_field(sound)
    check_hard_iron(sound)
    assert field_warnings(sound) == ()


def test_hard_iron_is_found_and_named() -> None:
    """The curve turns the Earth's field on the axes, the iron stays: its median is that of the noise."""
    offset = field_offset(ride((20.0, -10.0, 15.0)))
    assert offset is not None
    np.testing.assert_allclose(1e6 * offset, [20.0, -10.0, 15.0], atol=5 * 0.03 * 1.25 / np.sqrt(400))
    (warning,) = field_warnings(ride((20.0, -10.0, 15.0)))
    assert "[20.0, -10.0, 15.0] uT" in warning
    with pytest.raises(InputError, match=r"hard iron.*found '\[40.0, -10.0, 25.0\] uT.*take that offset off"):
        check_hard_iron(ride((40.0, -10.0, 25.0)))


def test_a_bridge_on_the_way_is_no_iron_of_the_vehicle() -> None:
    """Steel beside a quarter of the ride: by the mean it would be 10 uT of the vehicle's own."""
    sound = ride((20.0, -10.0, 15.0))
    assert sound.magnetometer is not None
    field = sound.magnetometer.copy()
    field.iloc[100:200] += 40e-6
    offset = field_offset(replace(sound, magnetometer=field))
    assert offset is not None
    # A quarter above moves the median to the noise's 67 % point, 0.43 standard deviations, and its error.
    np.testing.assert_allclose(1e6 * offset, [20.0, -10.0, 15.0], atol=(0.44 + 5 * 1.5 / np.sqrt(300)) * 0.03)


def test_without_odometry_its_dip_is_told() -> None:
    told = field_warnings(replace(ride((30.0, 0.0, 30.0)), odometry=None))
    assert len(told) == 1 and "dips by" in told[0]
    assert field_warnings(replace(ride(), odometry=None)) == ()


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (0.0, ("zero throughout", "45 uT")),
        (1e-3, ("not as large", '"uT"')),
        (0.01, ("not as large", '"G"')),
        (6.0, ("not as large", "hard iron")),
        (0.2, ("not as large", "9.001 uT", "unit or the scale")),
    ],
)
def test_a_field_of_another_size_is_refused(factor: float, words: tuple[str, ...]) -> None:
    sound = ride()
    assert sound.magnetometer is not None
    with pytest.raises(InputError) as raised:
        check_field(replace(sound, magnetometer=sound.magnetometer * factor))
    for word in words:
        assert word in str(raised.value)


def test_iron_that_drowns_the_earth_is_named() -> None:
    with pytest.raises(InputError, match=r"not as large as the Earth's.*about \[100.0, 0.0, -20.0\] uT"):
        check_field(ride((100.0, 0.0, -20.0)))


def test_a_stuck_field_is_refused() -> None:
    sound = ride()
    assert sound.magnetometer is not None
    stuck = sound.magnetometer.copy()
    stuck.iloc[:] = stuck.iloc[0].to_numpy()
    with pytest.raises(InputError, match="one and the same throughout"):
        check_field(replace(sound, magnetometer=stuck))


def test_a_field_of_no_place_on_the_earth_is_told() -> None:
    sheet = replace(EARTH, intensity_t=4.5e-6)
    told = field_warnings(replace(ride(), magnetometer_sheet=sheet))
    assert any("no place on the Earth" in one for one in told)
