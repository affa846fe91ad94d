"""Recordings as public reports have them: each case with its own files, as its README says what is right."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.recording import Recording

CASES = Path(__file__).parent / "cases"


@pytest.fixture(scope="module")
def base() -> Recording:
    """The ride that all cases were made from."""
    return read_ride(CASES / "00-base")


def edited(case: str, folder: Path, *pairs: tuple[str, str]) -> Path:
    """A case whose ride file a user has mended."""
    shutil.copytree(CASES / case, folder, dirs_exist_ok=True)
    text = (folder / "ride.toml").read_text()
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    (folder / "ride.toml").write_text(text)
    return folder


def notes_of(recording: Recording) -> str:
    return "\n".join(recording.notes)


def assert_alike(found: Recording, base: Recording, *, start_s: float = 0.0) -> None:
    """The samples of the base, at times that may begin elsewhere, and its way."""
    np.testing.assert_allclose(found.imu.index - start_s, base.imu.index, rtol=0.0, atol=1e-6)
    np.testing.assert_array_equal(found.imu, base.imu)
    assert found.encoder is not None and base.encoder is not None
    counts, known = found.encoder["pulse_count"].to_numpy(), base.encoder["pulse_count"].to_numpy()
    np.testing.assert_array_equal(counts - counts[0], known - known[0])
    assert found.imu_sheet.rate_hz == pytest.approx(20.0, rel=1e-6) and found.gaps is None


def test_the_control_has_nothing_to_note(base: Recording) -> None:
    assert base.notes == () and base.gaps is None
    logged = pd.read_csv(CASES / "00-base" / "ride.csv")
    np.testing.assert_array_equal(base.imu.index, logged["t"])
    np.testing.assert_array_equal(base.imu[GYRO[0]], logged["wx"] * np.pi / 180.0)
    np.testing.assert_array_equal(base.imu[ACCEL[2]], -(logged["az"] * 9.80665))


def test_01_a_clock_that_jumps_is_refused_before_any_grid_is_made() -> None:
    with pytest.raises(InputError) as error:
        read_ride(CASES / "01-clock-jump")
    line = str(error.value)
    assert "clock jumps by 6.25 years" in line and "197235000 s after time_s = 19.95" in line
    assert "cut the recording there" in line and "\n" not in line


def test_08_bursts_are_spread_evenly_and_that_is_said(base: Recording) -> None:
    found = read_ride(CASES / "08-bursts-1-1-4")
    assert_alike(found, base)
    assert "imu: stamps of packets of 3 samples are spread evenly, at 20 Hz" in notes_of(found)


def test_13_a_magnetometer_of_10_hz_is_interpolated() -> None:
    found = read_ride(CASES / "13-mag-10Hz-jitter")
    assert found.magnetometer is not None and len(found.magnetometer) == 801
    logged = pd.read_csv(CASES / "13-mag-10Hz-jitter" / "mag.csv")
    expected = 1e-6 * np.interp(found.imu.index, logged["t"], logged["mx"])
    np.testing.assert_allclose(found.magnetometer["magnetic_x_t"], expected, rtol=1e-12)
    assert "magnetometer: 402 samples at 10.02 Hz are interpolated" in notes_of(found)


def test_14_the_common_time_is_used_and_said(base: Recording) -> None:
    found = read_ride(CASES / "14-mag-starts-late")
    pd.testing.assert_frame_equal(found.imu, base.imu.iloc[6:], check_exact=True)
    assert found.magnetometer is not None and found.magnetometer.index[0] == found.imu.index[0] == 0.3
    assert "only 0.3 to 40 s are used, of 0 to 40 s" in notes_of(found)
    assert found.start_position_m == 110.0  # it stands until then


def test_16_a_tunnel_is_bridged_where_the_ride_file_says_so(tmp_path: Path) -> None:
    found = read_ride(CASES / "16-gnss-tunnel")
    assert found.odometry is not None and found.gaps is None
    assert "odometer: silent from 19 to 26 s" in notes_of(found)
    sd = found.odometry["speed_sd_mps"]
    assert sd.loc[25.5] > 3.0 * sd.loc[18.5]  # and nobody is told that it was known
    without = edited("16-gnss-tunnel", tmp_path, ("longest_gap_s = 10.0", ""))
    with pytest.raises(
        InputError, match=r"7 s after time_s = 19.*longest_gap_s = 3 s.*odometer\.longest_gap_s"
    ):
        read_ride(without)
    of_its_own = edited(
        "16-gnss-tunnel",
        tmp_path,
        ("longest_gap_s = 10.0", ""),
        ("[odometer]\n", "[odometer]\nlongest_gap_s = 8.0\n"),
    )
    assert read_ride(of_its_own).odometry is not None


def test_20_a_counter_that_wraps_goes_on_and_that_is_said(base: Recording) -> None:
    found = read_ride(CASES / "20-counter-wraps")
    assert_alike(found, base)
    assert "begins anew after 65536 pulses, once" in notes_of(found)


def test_22_clock_times_are_seconds_since_midnight(base: Recording) -> None:
    assert_alike(read_ride(CASES / "22-clock-time"), base, start_s=43.4)


def test_23_samples_that_share_stamps_are_refused_with_a_remedy_that_works(
    base: Recording, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"samples differ.*leave time out and give rate_hz = 20$") as error:
        read_ride(CASES / "23-stamp-pairs")
    assert "drop" not in str(error.value)
    done = edited(
        "23-stamp-pairs",
        tmp_path,
        ('time = "t"\ngyro', "gyro"),
        ('time = "s"\ngyro', "gyro"),
        ('body = "front"', 'body = "front"\nrate_hz = 20'),
        ('time = "t", ', ""),
        ('units = { time = "s" }', "rate_hz = 20"),
    )
    assert_alike(read_ride(done), base)


def test_24_an_empty_field_at_the_end_is_none(base: Recording) -> None:
    found = read_ride(CASES / "24-trailing-comma")
    assert_alike(found, base)
    assert found.notes == ()


def test_25_a_row_of_units_is_passed_over_and_that_is_said(base: Recording, tmp_path: Path) -> None:
    found = read_ride(CASES / "25-unit-row")
    assert_alike(found, base)
    assert "row of units (s, deg/s," in notes_of(found)
    refused = edited("25-unit-row", tmp_path, ('file = "ride.csv"', 'file = "ride.csv"\nunits_row = false'))
    with pytest.raises(InputError, match=r"line 2.*units_row = true"):
        read_ride(refused)


def test_26_increments_without_names_apart_by_blanks(base: Recording, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no line of column names.*time = 1, gyro = \[2, 3, 4\]"):
        read_ride(CASES / "26-increments")
    pulses = pd.read_csv(CASES / "00-base" / "ride.csv")[["t", "pulses"]]
    done = edited(
        "26-increments",
        tmp_path,
        ('time = "t"\n', "time = 1\n"),
        ('gyro = ["dtx","dty","dtz"]', "gyro = [2, 3, 4]"),
        ('accel = ["dvx","dvy","dvz"]', "accel = [5, 6, 7]"),
        ('[encoder]\nfile = "ride.csv"', '[encoder]\nfile = "pulses.csv"'),
    )
    pulses.assign(t=pulses["t"] + 366000.0).to_csv(tmp_path / "pulses.csv", index=False)
    found, known = read_ride(done), base.imu.iloc[:600]
    np.testing.assert_allclose(found.imu.index, known.index + 366000.0, rtol=0.0, atol=1e-6)
    # Half a digit of the file, over 50 ms, beside half a digit of the base.
    np.testing.assert_allclose(found.imu[[*GYRO]], known[[*GYRO]], rtol=0.0, atol=1.1e-5)
    np.testing.assert_allclose(found.imu[[*ACCEL]], known[[*ACCEL]], rtol=0.0, atol=2e-4)
    assert "increments of gyro are taken as means over 50 ms" in notes_of(found)
    assert found.imu_sheet.lag_s == pytest.approx(0.025, rel=1e-6)  # a mean up to the stamp is half of it old


def test_27_gyroscope_and_accelerometer_in_files_of_their_own(base: Recording, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"Gyroscope\.csv has it"):
        read_ride(CASES / "27-two-files")
    done = edited(
        "27-two-files", tmp_path, ("[encoder]\n", '[imu.gyro]\nfile = "Gyroscope.csv"\n[encoder]\n')
    )
    found = read_ride(done)
    gyro = pd.read_csv(CASES / "27-two-files" / "Gyroscope.csv")
    accel = pd.read_csv(CASES / "27-two-files" / "ride.csv")
    assert found.imu_sheet.rate_hz == pytest.approx(20.0, rel=1e-6)
    expected = np.interp(found.imu.index, gyro["t"], gyro["wx"]) * np.pi / 180.0
    np.testing.assert_allclose(found.imu[GYRO[0]], expected, rtol=1e-12, atol=1e-15)
    expected = np.interp(found.imu.index, accel["t"], accel["ax"]) * 9.80665
    np.testing.assert_allclose(found.imu[ACCEL[0]], expected, rtol=1e-12, atol=1e-15)
    assert "is interpolated at the times of" in notes_of(found)
