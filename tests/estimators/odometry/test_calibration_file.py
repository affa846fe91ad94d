"""Calibration of the spectral speed as a file: by mount, as the two numbers, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.attitude.veillard_ekf import VeillardEkf
from simrail.estimators.odometry.calibration_file import SpectralCalibration
from simrail.estimators.odometry.spectral import SpectralOdometry

from simrail.core.columns import ACCEL, ACCELERATION, IMU
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.core.toml_files import shipped_folder
from simrail.recording.recording import Recording

TEXT = """
rides = ["one"]
[mount.frame]
slope = 0.4
intercept_mps = -5.0
rms_mps = 3.0
[mount.axle]
slope = 0.9
intercept_mps = -16.0
rms_mps = 2.0
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "line.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


@pytest.fixture
def shaking(exactly, bend) -> Recording:
    """At rest, then shaking; mounted on the axle."""
    ride: Recording = exactly(bend(15.0, 1))
    assert ride.mount == "axle"
    index = pd.Index(np.arange(5000) / 250.0, name="time_s")
    imu = pd.DataFrame(0.0, index=index, columns=list(IMU))
    louder = np.where(np.arange(5000) < 2000, 0.05, 0.5)
    imu[ACCEL[2]] = 9.81 + louder * stream(1, "shaking").standard_normal(5000)
    return replace(ride, imu=imu, odometry=None, odometry_source="")


@pytest.mark.parametrize("kind", [SpectralOdometry, VeillardEkf])
@pytest.mark.parametrize("calibration", ["given", "standstill"])
def test_a_file_is_as_its_two_numbers(kind, calibration: str, file: Path, shaking: Recording) -> None:
    numbers = {"slope": 0.9} | ({"intercept_mps": -16.0} if calibration == "given" else {})
    by_file = kind(calibration=calibration, calibration_file=SpectralCalibration.from_file(file))
    by_number = kind(calibration=calibration, **numbers)
    pd.testing.assert_frame_equal(by_file.estimate(shaking).states, by_number.estimate(shaking).states)
    assert (by_file.estimate(shaking).states["position_sd_m"] >= 0.05).all()
    assert by_file.causal and by_file.needs == () and by_file.role == "method"


def test_the_filter_tells_its_acceleration_in_body_axes(file: Path, shaking: Recording) -> None:
    """It stands level: no acceleration, but what shakes along Z, of which the filter follows a part."""
    method = VeillardEkf(calibration="given", calibration_file=SpectralCalibration.from_file(file))
    states = method.estimate(shaking).states
    np.testing.assert_array_equal(states[ACCELERATION[0]], states["acceleration_mps2"])
    assert states[ACCELERATION[1]].abs().max() < 1e-6
    assert states[ACCELERATION[2]].iloc[2500:].std() > 3.0 * states[ACCELERATION[2]].iloc[500:1900].std()


def test_another_mount_is_refused_by_name(file: Path, shaking: Recording) -> None:
    method = SpectralOdometry(calibration="given", calibration_file=SpectralCalibration.from_file(file))
    with pytest.raises(InputError, match=r"calibration_file\.mount.*floor.*axle") as caught:
        method.estimate(replace(shaking, mount="floor"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("number", ["slope", "intercept_mps"])
def test_a_file_beside_a_number_is_refused(number: str, file: Path) -> None:
    with pytest.raises(InputError, match=f"{number}.*calibration_file"):
        SpectralOdometry(calibration_file=SpectralCalibration.from_file(file), **{number: 1.0})


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("slope = 0.9", "slope = -0.9"),
        ("rms_mps = 2.0", "rms = 2.0"),
        ("[mount.axle]\nslope = 0.9", "[mount.axle]"),
        ("0.9", '"0.9"'),
    ],
)
def test_a_broken_file_is_told(before: str, after: str, file: Path) -> None:
    file.write_text(TEXT.replace(before, after), encoding="utf-8")
    with pytest.raises(InputError, match=r"line\.toml") as caught:
        SpectralCalibration.from_file(file)
    assert all("line.toml: mount.axle" in line for line in str(caught.value).splitlines())


def test_rougher_rails_have_the_smaller_slope_on_the_frame() -> None:
    """The same speed shakes more there, so that a unit of sqrt(S) is less speed."""
    found = {
        name: SpectralCalibration.from_file(shipped_folder() / "calibrations" / f"metro_{name}.toml")
        for name in ("smooth", "average", "rough")
    }
    slopes = [found[name].of("frame").slope for name in ("smooth", "average", "rough")]
    assert slopes[0] > 1.15 * slopes[1] > 1.15**2 * slopes[2]
