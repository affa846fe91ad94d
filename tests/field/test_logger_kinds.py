"""Kinds of faults that loggers and their users make, planted in the sound ride: told by what they are."""

from __future__ import annotations

import functools
import operator
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.core.errors import InputError
from simrail.estimation.choose_odometry import with_odometry
from simrail.recording.check_physics import check_plausible
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording

BASE = Path(__file__).parent / "cases" / "00-base"


def written(
    folder: Path, text: str, *pairs: tuple[str, str], file: str = "ride.csv", encoding: str = "utf-8"
) -> Path:
    """The ride file of the sound ride, beside another data file."""
    (folder / file).write_bytes(text.encode(encoding))
    ride = (BASE / "ride.toml").read_text().replace('"ride.csv"', f'"{file}"')
    for old, new in pairs:
        assert old in ride
        ride = ride.replace(old, new)
    (folder / "ride.toml").write_text(ride)
    return folder


def logged() -> pd.DataFrame:
    return pd.read_csv(BASE / "ride.csv")


@pytest.fixture(scope="module")
def sound() -> Recording:
    return read_signals(BASE)


def assert_as_sound(found: Recording, sound: Recording) -> None:
    np.testing.assert_array_equal(found.imu.to_numpy(), sound.imu.to_numpy())
    step = np.diff(found.imu.index.to_numpy())
    np.testing.assert_allclose(step, 0.05, rtol=0.0, atol=1e-6)
    assert found.encoder is not None and sound.encoder is not None
    np.testing.assert_array_equal(found.encoder.to_numpy(), sound.encoder.to_numpy())


def test_the_seconds_of_a_week_that_begin_anew_go_on(sound: Recording, tmp_path: Path) -> None:
    frame = logged()
    week = (frame["t"] + 604_780.0) % 604_800.0
    found = read_signals(written(tmp_path, frame.assign(t=week.round(6)).to_csv(index=False)))
    assert_as_sound(found, sound)
    assert any("seconds of the week begin anew" in note for note in found.notes)


def test_the_end_of_summer_time_goes_on_and_another_jump_does_not(sound: Recording, tmp_path: Path) -> None:
    frame = logged()
    iso = ('time = "s"', 'time = "iso"')
    for hours, good in ((1.0, True), (2.0, False)):
        seconds = frame["t"] - 3600.0 * hours * (frame["t"] >= 15.0)
        dates = pd.Timestamp("2024-10-27T02:59:45") + pd.to_timedelta(seconds, unit="s")
        text = frame.assign(t=dates.dt.strftime("%Y-%m-%dT%H:%M:%S.%f")).to_csv(index=False)
        if good:
            found = read_signals(written(tmp_path, text, iso))
            assert_as_sound(found, sound)
            assert any("summer time ends" in note for note in found.notes)
        else:
            with pytest.raises(InputError, match="the clock jumps back"):
                read_signals(written(tmp_path, text, iso))


def test_counts_of_each_reading_are_told_and_summed_up_where_that_is_said(
    sound: Recording, tmp_path: Path
) -> None:
    frame = logged()
    text = frame.assign(pulses=np.diff(frame["pulses"], prepend=0)).to_csv(index=False)
    with pytest.raises(InputError, match=r"counted in each reading.*per_reading = true"):
        check_plausible(with_odometry(read_signals(written(tmp_path, text)), "encoder"))
    told = read_signals(written(tmp_path, text, ("[encoder]\n", "[encoder]\nper_reading = true\n")))
    assert_as_sound(told, sound)


def times(column: str, factor: float) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda frame: frame.assign(**{column: factor * frame[column]})


def swapped(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(wx=frame["wy"], wy=frame["wx"])


@pytest.mark.parametrize(
    ("plant", "said"),
    [
        (times("ax", 9.80665), r"accel_x_mps2: is many times.*one axis alone"),
        (times("ay", 9.80665), r"accel_y_mps2: is many times.*9.8.*one axis alone"),
        (times("ay", -1.0), r"accel_y_mps2: goes against what speed and cant leave.*that column alone"),
        (times("wx", -1.0), r"gyro_x_radps: goes against the roll rate.*that column alone"),
        (swapped, r"gyro_x_radps: does not roll in the transitions, but its Y does.*columns.gyro"),
        (lambda frame: frame.assign(az=frame["az"] + 1.0), r"imu.accel: .*gravity has been taken off"),
    ],
)
def test_single_axes_of_another_unit_sign_or_place_are_told(
    plant: Callable[[pd.DataFrame], pd.DataFrame], said: str, tmp_path: Path
) -> None:
    folder = written(tmp_path, plant(logged()).to_csv(index=False))
    with pytest.raises(InputError, match=said) as refused:
        check_plausible(with_odometry(read_signals(folder), "encoder"))
    assert "\n" not in str(refused.value)


def thousands(text: str) -> str:
    frame = logged()
    return frame.assign(pulses=[f"{count:,}" for count in frame["pulses"]]).to_csv(index=False)


def again(text: str) -> str:
    lines = text.split("\n")
    return "\n".join([*lines[:400], lines[0], *lines[400:]])


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (thousands, "without separators of thousands"),
        (again, "the line of names stands there again"),
        (lambda text: text[:-20], "drop the last line, which was cut"),
        (lambda text: text.replace("wx", "q1", 1), r"found 'wx'.*what no column holds cannot be read"),
    ],
)
def test_a_remedy_is_that_of_the_fault(spoil: Callable[[str], str], said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said) as refused:
        read_signals(written(tmp_path, spoil((BASE / "ride.csv").read_text())))
    assert "did you mean 'ax'" not in str(refused.value)


def test_a_packed_file_is_to_be_unpacked_and_a_radius_in_inches_is_known(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unpack it first"):
        read_signals(written(tmp_path, "", file="ride.csv.zip"))
    inches = ("wheel_radius_m = 0.2900", "wheel_radius_m = 22.83")
    with pytest.raises(InputError, match=r"0\.2899 from a diameter in inches"):
        read_signals(written(tmp_path, (BASE / "ride.csv").read_text(), inches))


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig"])
@pytest.mark.parametrize("head", [True, False])
def test_text_of_other_widths_is_read(encoding: str, head: bool, sound: Recording, tmp_path: Path) -> None:
    """Windows' "Unicode" with its mark and without, and a mark before a file without names."""
    numbers = [('"t"', "1"), ('["wx","wy","wz"]', "[2, 3, 4]"), ('["ax","ay","az"]', "[5, 6, 7]")]
    text = logged().to_csv(index=False, header=head)
    pairs = [] if head else [*numbers, ('"pulses"', "8")]
    assert_as_sound(read_signals(written(tmp_path, text, *pairs, encoding=encoding)), sound)


def test_a_fault_in_a_wide_text_is_told_by_its_line(tmp_path: Path) -> None:
    text = (BASE / "ride.csv").read_text().replace("\n20.0,", "\nabc,", 1)
    line = text.split("\nabc,")[0].count("\n") + 2
    with pytest.raises(InputError, match=rf"holds no number in line {line}: |in line {line};"):
        read_signals(written(tmp_path, text, encoding="utf-16"))


def in_long_form(frame: pd.DataFrame) -> pd.DataFrame:
    molten = frame.melt(id_vars="t", var_name="channel", value_name="value")
    return molten.sort_values("t", kind="stable")


@pytest.mark.parametrize("time", ["t", "time"])
def test_long_form_is_told_and_its_remedy_makes_it_wide(
    time: str, sound: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = in_long_form(logged()).rename(columns={"t": time}).to_csv(index=False)
    stamped = ('time = "t"', f'time = "{time}"')
    folder = written(tmp_path, text, stamped)
    with pytest.raises(InputError, match=r"long form.*'channel'.*wx, wy, wz") as refused:
        read_signals(folder)
    code = re.search('python -c "([^"]*)"', str(refused.value))
    assert code is not None and "\n" not in str(refused.value)
    monkeypatch.chdir(tmp_path)
    exec(code[1], {})
    ride = (tmp_path / "ride.toml").read_text().replace('"ride.csv"', '"ride_wide.csv"')
    (tmp_path / "ride.toml").write_text(ride)
    assert_as_sound(read_signals(folder), sound)


def sentence(words: str) -> str:
    """A line as NMEA 0183 has it."""
    return f"${words}*{functools.reduce(operator.xor, words.encode()):02X}"


def test_sentences_with_checksums_are_told_and_the_remedy_makes_a_table_of_them(
    sound: Recording, tmp_path: Path
) -> None:
    rows = logged().to_csv(index=False, header=False).split()
    fix = sentence("GPGGA,121530.00,4807.03,N,01131.00,E,1,08,0.9,545.4,M,46.9,M,,")
    text = "\n".join(line for row in rows for line in (sentence(f"PIMU,{row}"), fix)[: 1 + (row[-1] == "0")])
    folder = written(tmp_path, text)
    with pytest.raises(InputError, match=r"sentences with checksums") as refused:
        read_signals(folder)
    command = re.search(r"(sed -n .*\.csv),", str(refused.value))
    assert command is not None and "\n" not in str(refused.value)
    subprocess.run(command[1], shell=True, cwd=tmp_path, check=True)
    numbers = [('"t"', "1"), ('["wx","wy","wz"]', "[2, 3, 4]"), ('["ax","ay","az"]', "[5, 6, 7]")]
    ride = (BASE / "ride.toml").read_text().replace('"ride.csv"', '"ride_PIMU.csv"')
    for old, new in [*numbers, ('"pulses"', "8")]:
        ride = ride.replace(old, new)
    (tmp_path / "ride.toml").write_text(ride)
    assert_as_sound(read_signals(folder), sound)
