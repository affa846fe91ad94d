"""Kinds of faults that loggers and their users make, planted in the sound ride: told by what they are."""

from __future__ import annotations

import functools
import operator
import re
import subprocess
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.cli.main import call
from simrail.core.errors import InputError
from simrail.estimation.choose_odometry import with_odometry
from simrail.recording.check_physics import check_plausible
from simrail.recording.evidence.axes import weigh_axes
from simrail.recording.evidence.judge import weigh
from simrail.recording.files.mend import write_mended
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording
from simrail.track.design import Straight

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


def assert_told_in_a_line(folder: Path, said: str) -> None:
    """A ride is refused, in one line that says so."""
    with pytest.raises(InputError, match=said) as refused:
        check_plausible(with_odometry(read_signals(folder), "encoder"))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("plant", "said"),
    [
        (times("ax", 9.80665), r"accel_x_mps2: is many times.*one axis alone"),
        (times("ay", 9.80665), r"accel_y_mps2: is many times.*9\.[789]\d \+- 0\.1.*one axis alone"),
        (times("ay", -1.0), r"accel_y_mps2: goes against what speed and cant leave.*that column alone"),
        (times("wx", -1.0), r"gyro_x_radps: goes against the roll rate.*that column alone"),
        (swapped, r"columns.gyro: its columns stand in another order \(X stands as Y, Y stands as X\)"),
        (lambda frame: frame.assign(az=frame["az"] + 1.0), r"imu.accel: .*gravity has been taken off"),
    ],
)
def test_single_axes_of_another_unit_sign_or_place_are_told(
    plant: Callable[[pd.DataFrame], pd.DataFrame], said: str, tmp_path: Path
) -> None:
    assert_told_in_a_line(written(tmp_path, plant(logged()).to_csv(index=False)), said)


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


@pytest.mark.parametrize(
    ("flipped", "told"),
    [
        (["wy"], ["gyro_y_radps: goes against the pitch rate"]),
        (["ax"], ["accel_x_mps2: goes against the change of speed"]),
        (["wz"], ["gyro_z_radps: goes against the curves"]),
        pytest.param(
            ["wx", "wz", "ay"],
            ["gyro_x_radps: goes", "gyro_z_radps: goes", "accel_y_mps2: goes"],
            marks=pytest.mark.long,
        ),
        pytest.param(["ax", "ay"], ["accel_x_mps2: goes", "accel_y_mps2: goes"], marks=pytest.mark.long),
        pytest.param(["ax", "ay", "wx", "wy"], ["imu.yaw_deg: pushes backwards"], marks=pytest.mark.long),
        pytest.param(["wx", "wy", "wz"], ["gyro_z_radps: turns against"], marks=pytest.mark.long),
    ],
)
def test_columns_of_the_other_sign_are_named_and_a_device_that_is_turned_is_one(
    flipped: list[str], told: list[str], tmp_path: Path
) -> None:
    """Left-handed axes, too; what is a device as a whole is mended as one."""
    frame = logged()
    folder = written(tmp_path, frame.assign(**{name: -frame[name] for name in flipped}).to_csv(index=False))
    with pytest.raises(InputError) as refused:
        check_plausible(with_odometry(read_signals(folder), "encoder"))
    lines = str(refused.value).splitlines()
    assert len(lines) == len(told)
    assert all(words in line for words, line in zip(told, lines, strict=True))


def axis_verdicts(recording: Recording) -> dict[str, str]:
    return {finding.key.removeprefix("alone_"): finding.verdict for finding in weigh_axes(recording)}


def test_each_axis_of_the_sound_ride_is_sound_and_on_a_level_straight_line_not_judged(
    sound: Recording,
) -> None:
    assert set(axis_verdicts(sound).values()) == {"sound"}
    straight = replace(sound.track, elements=(Straight(sound.track.length_m),))
    assert axis_verdicts(replace(sound, track=straight)) == {
        "gyro_x_radps": "could not be judged",
        "gyro_y_radps": "could not be judged",
        "gyro_z_radps": "could not be judged",
        "accel_x_mps2": "sound",
        "accel_y_mps2": "could not be judged",
        "accel_z_mps2": "sound",
    }


TRIADS = ["wx", "wy", "wz", "ax", "ay", "az"]


def held(frame: pd.DataFrame, rows: Iterable[int]) -> pd.DataFrame:
    """Samples of the IMU that a logger wrote again."""
    frame = frame.copy()
    for row in sorted(rows):
        frame.loc[row, TRIADS] = frame.loc[row - 1, TRIADS].to_numpy()
    return frame


def stopped(frame: pd.DataFrame, row: int) -> pd.DataFrame:
    return frame.assign(pulses=frame["pulses"].where(frame.index < row, frame.loc[row, "pulses"]))


@pytest.mark.parametrize(
    ("plant", "said"),
    [
        (lambda frame: held(frame, range(11, 800, 13)), r"wx, wy, wz: repeats the sample before.*7\.6%.*5%"),
        (lambda frame: held(frame, range(1, 801, 2)), r"reads faster than.*50\.1%.*some 9\.98 Hz"),
        (lambda frame: held(frame, range(300, 320)), r"nothing was measured there.*20 times"),
        (lambda frame: stopped(frame, 0), "encoder: stands still while the train turns"),
        (lambda frame: stopped(frame, 300), "encoder: stands still while the train turns"),
        (lambda frame: frame.assign(wz=frame["wz"].clip(lower=-1.0)), r"wz: .*saturated.*wider range"),
        (times("wx", np.pi / 180.0), r"gyro_x_radps: has next to nothing of the roll rate.*one axis alone"),
    ],
)
def test_what_a_logger_held_and_what_has_stopped_is_told(
    plant: Callable[[pd.DataFrame], pd.DataFrame], said: str, tmp_path: Path
) -> None:
    assert_told_in_a_line(written(tmp_path, plant(logged()).to_csv(index=False)), said)


def test_a_lost_sample_now_and_then_and_a_slow_magnetometer_may_be_held(
    sound: Recording, tmp_path: Path
) -> None:
    text = held(logged(), range(20, 800, 40)).to_csv(index=False)
    assert len(read_signals(written(tmp_path, text)).imu) == len(sound.imu)


@pytest.mark.parametrize(
    ("period_s", "first_s", "word"),
    [(1.0, 0.0, "second"), (60.0, 40.0, "minute"), (3600.0, 3590.0, "hour"), (86_400.0, 86_390.0, "day")],
)
def test_a_clock_that_shows_a_part_of_the_time_goes_on(
    period_s: float, first_s: float, word: str, sound: Recording, tmp_path: Path
) -> None:
    frame = logged()
    shown = ((frame["t"] + first_s) % period_s).round(6) % period_s
    found = read_signals(written(tmp_path, frame.assign(t=shown).to_csv(index=False)))
    assert_as_sound(found, sound)
    assert any(f"the seconds of the {word} begin anew" in note for note in found.notes)


def whole(values: np.ndarray) -> np.ndarray:
    return np.rint(values).astype(np.int64)


@pytest.mark.parametrize(
    ("unit", "shown", "word"),
    [
        ("us", lambda t: whole(1e6 * (t + 0.3)) % 1_000_000, "seconds of the second"),
        ("ms", lambda t: whole(1e3 * (t + 86_385.0)) % 86_400_000, "seconds of the day"),
        ("s", lambda t: ((t + 43_185.0) % 43_200.0).round(3), "seconds of the half day"),
        ("us", lambda t: whole(1e6 * t + 2**32 - 15e6) % 2**32, r"2^32"),
        ("s", lambda t: (whole(1e6 * t + 2**32 - 15e6) % 2**32 / 1e6).round(6), "2^32 x 1e-06"),
        ("ms", lambda t: whole(1e3 * t + 2**24 - 15e3) % 2**24, "2^24"),
        ("ns", lambda t: whole(1e9 * t + 2**48 - 15e9) % 2**48, "2^48"),
        ("ms", lambda t: whole(1e3 * t) % 10_000, "10^4, 4 times"),
    ],
)
def test_a_counter_of_time_goes_on_by_the_period_that_leaves_even_steps(
    unit: str, shown: Callable[[np.ndarray], np.ndarray], word: str, sound: Recording, tmp_path: Path
) -> None:
    """Of 10^6 and 2^20 microseconds the first one leaves steps of 50 ms, the second one of 99."""
    text = logged().assign(t=shown(logged()["t"].to_numpy())).to_csv(index=False)
    found = read_signals(written(tmp_path, text, ('time = "s"', f'time = "{unit}"')))
    assert_as_sound(found, sound)
    assert any(word in note for note in found.notes)


def as_numbers(form: str, digits: int) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def plant(frame: pd.DataFrame) -> pd.DataFrame:
        dates = pd.Timestamp("2024-01-01T23:59:45") + pd.to_timedelta(frame["t"], unit="s")
        return frame.assign(t=dates.dt.strftime(form).str[:digits].astype(float))

    return plant


@pytest.mark.parametrize(
    ("plant", "said"),
    [
        (as_numbers("%H%M%S.%f", 13), r"written as one number.*with colons"),
        (as_numbers("%y%m%d%H%M%S.%f", 19), r"written as one number.*with colons"),
        (
            lambda frame: frame.assign(t=(frame["t"] % 17.3).round(3)),
            r"begins anew after some 17\.3 s, 2 times",
        ),
        (lambda frame: frame.assign(t=(frame["t"] % 0.0655).round(6)), r"leave time out and give rate_hz"),
        (lambda frame: frame[::-1], r"steps back.*sort the samples"),
        (lambda frame: frame.assign(t=frame["t"].where(frame.index != 400)), "drop the lines without a time"),
        (lambda frame: frame.assign(t=frame["t"] / 60.0), r"faster than any train.*units\.time"),
        (
            lambda frame: frame.assign(pulses=[f"{count:,}".replace(",", "'") for count in frame["pulses"]]),
            "separators of thousands",
        ),
        (lambda frame: frame.assign(pulses=[f"'{count}'" for count in frame["pulses"]]), "without quotes"),
    ],
)
def test_a_clock_or_a_count_that_is_none_is_told_with_its_own_remedy(
    plant: Callable[[pd.DataFrame], pd.DataFrame], said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=said) as refused:
        read_signals(written(tmp_path, plant(logged()).to_csv(index=False)))
    assert "\n" not in str(refused.value)


@pytest.mark.long
@pytest.mark.parametrize(
    ("plant", "said"),
    [
        (lambda frame: frame.assign(wy=25.0 + 0.01 * frame["t"]), r"gyro_y_radps: shows a turn at rest"),
        (lambda frame: frame.assign(wy=1013.0 + 0.1 * frame["wx"]), r"gyro_y_radps: shows a turn at rest"),
        (lambda frame: frame.assign(wz=0.05 * frame["wz"].cumsum()), r"does not follow the curves.*angles"),
        (lambda frame: frame.assign(ax=frame["ax"].round(1)), r"ax: has steps of 0\.1 g"),
        (lambda frame: frame.assign(wz=frame["wz"].round(0)), r"wz: has steps of 1 deg/s"),
        (lambda frame: frame.assign(wy=1.0 * (frame["t"] > 10.0)), r"wy: has steps of 1 deg/s"),
    ],
)
def test_a_column_of_another_sensor_and_numbers_without_decimals_are_told(
    plant: Callable[[pd.DataFrame], pd.DataFrame], said: str, tmp_path: Path
) -> None:
    assert_told_in_a_line(written(tmp_path, plant(logged()).to_csv(index=False)), said)


def test_two_decimals_of_g_are_enough(tmp_path: Path) -> None:
    text = logged().assign(**{name: logged()[name].round(2) for name in TRIADS}).to_csv(index=False)
    check_plausible(with_odometry(read_signals(written(tmp_path, text)), "encoder"))


@pytest.mark.long
@pytest.mark.parametrize(("factor", "unit"), [(3.6, "km/h"), (2.236936, "miles an hour")])
def test_a_speed_of_another_unit_is_named(factor: float, unit: str, sound: Recording, tmp_path: Path) -> None:
    frame = logged()
    speed = np.gradient(frame["pulses"], frame["t"]) * 2.0 * np.pi * 0.29 / 1024.0
    smooth = np.convolve(speed, np.ones(9) / 9.0, mode="same")
    ride = (BASE / "ride.toml").read_text().partition("[encoder.sheet]")[0]
    ride = ride.replace("[encoder]", "[odometer]").replace('count = "pulses"', 'speed = "v"')
    frame.assign(v=(factor * smooth).round(1)).to_csv(tmp_path / "ride.csv", index=False)
    (tmp_path / "ride.toml").write_text(ride)
    assert_told_in_a_line(tmp_path, f"its speeds look like {unit}")


def test_a_late_gyro_is_refused_and_its_setting_mends_it(sound: Recording, tmp_path: Path) -> None:
    """By two seconds: the accelerometer, the wheel and the place stay as they are."""
    frame = logged()
    # The first two seconds stand before themselves, in the other order: the train is at rest then.
    late = {name: np.concatenate([frame[name][40:0:-1], frame[name][:-40]]) for name in ("wx", "wy", "wz")}
    folder = written(tmp_path, frame.assign(**late).to_csv(index=False))
    assert_told_in_a_line(folder, r"stamps of the gyro are (1\.9|2\.0)\d s late.*imu\.gyro\.time_offset_s")
    out = tmp_path / "mended.toml"
    (change,) = write_mended(folder, weigh(read_signals(folder)), out)
    assert change.startswith("imu.gyro.time_offset_s = -")
    found = read_signals(out)
    time = found.imu.index.to_numpy()
    rate = np.interp(time, sound.imu.index.to_numpy(), sound.imu["gyro_z_radps"])
    assert np.sqrt(np.mean((found.imu["gyro_z_radps"] - rate) ** 2)) < 0.002
    check_plausible(with_odometry(found, "encoder"))


@pytest.mark.parametrize(("day", "goes_on"), [("2024-03-31", True), ("2024-04-02", False)])
def test_the_begin_of_summer_time_goes_on_and_an_hour_of_another_day_does_not(
    day: str, goes_on: bool, sound: Recording, tmp_path: Path
) -> None:
    frame = logged()
    seconds = frame["t"] + 3600.0 * (frame["t"] >= 15.0)
    dates = (pd.Timestamp(f"{day}T01:59:45") + pd.to_timedelta(seconds, unit="s")).dt
    text = frame.assign(t=dates.strftime("%Y-%m-%dT%H:%M:%S.%f")).to_csv(index=False)
    folder = written(tmp_path, text, ('time = "s"', 'time = "iso"'))
    if goes_on:
        found = read_signals(folder)
        assert_as_sound(found, sound)
        assert any("summer time begins" in note for note in found.notes)
    else:
        with pytest.raises(InputError, match="the clock jumps by 1 hours"):
            read_signals(folder)


def test_a_block_that_stands_twice_is_told_by_its_samples(tmp_path: Path) -> None:
    frame = logged()
    twice = pd.concat([frame[:400], frame[300:]])
    with pytest.raises(InputError, match=r"has 100 samples twice: samples 401 to 500.*drop the second"):
        read_signals(written(tmp_path, twice.to_csv(index=False)))


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda frame: frame.to_csv(index=False, sep=";", decimal=","), r'separator = ";" and decimal = ","'),
        (lambda frame: frame.to_csv(index=False, sep=";"), r'separator = ";"$'),
        (lambda frame: frame.to_csv(index=False) + "Mean,0,0,0,0,0,0,0\n", "drop the last line, which holds"),
        (
            lambda frame: frame.assign(pulses=[hex(count) for count in frame["pulses"]]).to_csv(index=False),
            "write numbers to base ten",
        ),
        (
            lambda frame: frame.rename(columns={"t": "t [s]", "wx": "wx [deg/s]"}).to_csv(index=False),
            r"did you mean 't \[s\]'",
        ),
    ],
)
def test_what_stands_beside_the_numbers_is_told(
    spoil: Callable[[pd.DataFrame], str], said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=said):
        read_signals(written(tmp_path, spoil(logged())))


def test_a_row_of_units_that_the_ride_file_contradicts_is_noted(sound: Recording, tmp_path: Path) -> None:
    names, rest = logged().to_csv(index=False).split("\n", 1)
    found = read_signals(written(tmp_path, f"{names}\n[s],rad/s,°/s,deg/s,g,m/s^2,g,-\n{rest}"))
    assert_as_sound(found, sound)
    odd = [note for note in found.notes if "by its row of units" in note]
    assert ["wx is in rad/s" in odd[0], "ay is in m/s2" in odd[1], len(odd)] == [True, True, 2]


@pytest.mark.parametrize("hours", [2.0, -5.5])
def test_a_file_of_another_time_zone_is_told_with_the_setting_that_mends_it(
    hours: float, sound: Recording, tmp_path: Path
) -> None:
    frame = logged()
    frame.assign(t=frame["t"] + 3600.0 * hours)[["t", "pulses"]].to_csv(tmp_path / "wheel.csv", index=False)
    wheel = ('[encoder]\nfile = "ride.csv"', '[encoder]\nfile = "wheel.csv"')
    folder = written(tmp_path, frame.to_csv(index=False), wheel)
    with pytest.raises(InputError, match="another time zone") as refused:
        read_signals(folder)
    setting = re.search(r"set encoder\.(time_offset_s = \S+)$", str(refused.value))
    assert setting is not None
    ride = (folder / "ride.toml").read_text().replace("[encoder]\n", f"[encoder]\n{setting[1]}\n")
    (folder / "ride.toml").write_text(ride)
    assert_as_sound(read_signals(folder), sound)


@pytest.mark.parametrize(
    ("plant", "said"),
    [
        (lambda frame, draw: frame["az"] + 0.05 * draw, "noise of 0.58 m/s2 a sample at rest is 13"),
        (lambda frame, draw: (frame["az"] / 0.016).round() * 0.016, "stands in steps of 0.157 m/s2"),
        (lambda frame, draw: frame["az"], ""),
    ],
)
def test_check_tells_noise_and_steps_that_the_sheet_does_not_have(
    plant: Callable[[pd.DataFrame, np.ndarray], pd.Series],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The ride stands for 4.8 s at first: 96 samples."""
    frame = logged()
    spoiled = frame.assign(az=plant(frame, np.random.default_rng(4).standard_normal(len(frame))).round(6))
    folder = written(tmp_path, spoiled.to_csv(index=False))
    assert call(["check", str(folder / "ride.toml")]) == 0
    shown = capsys.readouterr().out
    assert ("warning: imu.accel: " + said in shown) if said else ("warning" not in shown), shown
    assert ("fine, but for the warnings" in shown) == bool(said)
