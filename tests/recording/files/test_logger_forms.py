"""One ride in the forms that loggers have: read as the same ride, or refused in one line that helps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.cli.main import BAD_INPUT, call
from simrail.core.errors import InputError
from simrail.recording.files import text_file
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording

BASE = Path(__file__).parents[2] / "field" / "cases" / "00-base"
LINES = (BASE / "ride.csv").read_text().splitlines()
NAMES, ROWS = LINES[0], LINES[1:]
FILE = 'file = "ride.csv"'
UNITS = "s,deg/s,deg/s,deg/s,g,g,g,-"
BY_NUMBER = (
    (
        'time = "t"\ngyro = ["wx","wy","wz"]\naccel = ["ax","ay","az"]',
        "time = 1\ngyro = [2,3,4]\naccel = [5,6,7]",
    ),
    ('time = "t", count = "pulses"', "time = 1, count = 8"),
)
TICKS = (('time = "s"', 'time = "ticks"'), (FILE, FILE + "\ntick_rate_hz = 32768.0"))

Pairs = tuple[tuple[str, str], ...]
Change = Callable[[pd.DataFrame], pd.DataFrame]


@pytest.fixture(scope="module")
def base() -> Recording:
    return read_signals(BASE)


def laid(folder: Path, text: str | bytes | pd.DataFrame, *pairs: tuple[str, str]) -> Path:
    """The ride with other data, and a ride file that says so."""
    said = (BASE / "ride.toml").read_text()
    for old, new in pairs:
        assert old in said, old
        said = said.replace(old, new)
    (folder / "ride.toml").write_text(said)
    if isinstance(text, pd.DataFrame):
        text.to_csv(folder / "ride.csv", index=False)
    else:
        (folder / "ride.csv").write_bytes(text.encode() if isinstance(text, str) else text)
    return folder


def lines(*above: str, rows: list[str] = ROWS, end: str = "\n") -> str:
    return end.join([*above, *rows]) + end


def between(separator: str, *above: str, decimal: str = ".", after: str = "") -> str:
    text = lines(*above, rows=[row + after for row in ROWS])
    return (
        text.replace(".", decimal).replace(",", separator)
        if decimal == "."
        else text.replace(",", separator).replace(".", decimal)
    )


TEXTS: dict[str, tuple[str | bytes, Pairs]] = {
    "semicolons": (between(";", NAMES), ((FILE, FILE + '\nseparator = ";"'),)),
    "tabs": (between("\t", NAMES, after=","), ((FILE, FILE + '\nseparator = "\\t"'),)),
    "several_blanks": (between("   ", NAMES), ((FILE, FILE + '\nseparator = " "'),)),
    "decimal_comma": (between(";", NAMES, decimal=","), ((FILE, FILE + '\nseparator = ";"\ndecimal = ","'),)),
    "comments": (lines("# logger 3", "%", NAMES, rows=[*ROWS[:9], "# restart", "", "// on", *ROWS[9:]]), ()),
    "names_in_a_comment": (lines("# logger 3", "# " + NAMES), ()),
    "mark_of_utf8": (("\ufeff" + lines(NAMES, end="\r\n")).encode(), ()),
    "two_fields_at_the_end": (lines(NAMES, rows=[row + ",," for row in ROWS]), ()),
    "some_lines_end_in_a_comma": (lines(NAMES, rows=[row + "," * (i % 2) for i, row in enumerate(ROWS)]), ()),
    "names_end_in_a_comma": (lines(NAMES + ","), ()),
    "units": (lines(NAMES, "[s],[°/s],[°/s],[°/s],[g],[g],[g],[1]"), ()),
    "units_and_kinds": (lines(NAMES, UNITS, "float,float,float,float,float,float,float,int"), ()),
    "text_above": (lines("Logger", "no 5", NAMES), ((FILE, FILE + "\nskip_lines = 2"),)),
    "no_names": (lines(), BY_NUMBER),
    "numbers_beside_names": (lines(NAMES), BY_NUMBER),
}


@pytest.mark.parametrize("form", TEXTS)
def test_forms_of_text(form: str, base: Recording, tmp_path: Path) -> None:
    text, pairs = TEXTS[form]
    found = read_signals(laid(tmp_path, text, *pairs))
    pd.testing.assert_frame_equal(found.imu, base.imu, check_exact=True)
    pd.testing.assert_frame_equal(found.encoder, base.encoder, check_exact=True)


def counts(frame: pd.DataFrame) -> pd.DataFrame:
    gyro, accel = ["wx", "wy", "wz"], ["ax", "ay", "az"]
    frame[gyro], frame[accel] = (frame[gyro] * 100).round(), (frame[accel] * 10000).round()
    return frame


def gaining(frame: pd.DataFrame) -> pd.DataFrame:
    gyro, accel = ["wx", "wy", "wz"], ["ax", "ay", "az"]
    frame[gyro], frame[accel] = np.radians(frame[gyro]) / 20.0, frame[accel] * 9.80665 / 20.0
    return frame


def at(time: Callable[[pd.Series], pd.Series | np.ndarray]) -> Change:
    return lambda frame: frame.assign(t=time(frame["t"]))


DATA: dict[str, tuple[Change, Pairs]] = {
    "raw_counts": (counts, (("axes =", "lsb_per_unit = { gyro = 100, accel = 10000 }\naxes ="),)),
    "increments": (
        gaining,
        (('gyro = "deg/s"\naccel = "g"', ""), ("axes =", 'output = "increments"\naxes =')),
    ),
    "increments_by_unit": (gaining, (('gyro = "deg/s"\naccel = "g"', 'gyro = "rad"\naccel = "m/s"'),)),
    "ticks": (at(lambda t: (t * 32768).round()), TICKS),
    "ticks_of_16_bit": (at(lambda t: ((t * 32768).round() + 40000) % 2**16), TICKS),
    "microseconds_of_32_bit": (
        at(lambda t: ((t * 1e6).round() + 2**32 - 10**7) % 2**32),
        (('time = "s"', 'time = "us"'),),
    ),
    "date_beside_time": (
        lambda frame: frame.assign(
            d="31.05.2024", t=[f"12:{int(t // 60):02}:{t % 60:06.3f}" for t in frame["t"]]
        ),
        (('time = "s"', 'time = "iso"'), ('time = "t"', 'time = ["d", "t"]')),
    ),
    "a_line_twice": (lambda frame: frame.loc[[*range(400), *range(399, 801)]], ()),
}


@pytest.mark.parametrize("form", DATA)
def test_forms_of_numbers(form: str, base: Recording, tmp_path: Path) -> None:
    change, pairs = DATA[form]
    found = read_signals(laid(tmp_path, change(pd.read_csv(BASE / "ride.csv")), *pairs))
    np.testing.assert_allclose(found.imu, base.imu, rtol=0.0, atol=1e-12)
    # A tick is 30 us, and so is the error of the rate that comes of it, in all.
    np.testing.assert_allclose(found.imu.index - found.imu.index[0], base.imu.index, rtol=0.0, atol=4e-5)
    np.testing.assert_array_equal(found.encoder["pulse_count"], base.encoder["pulse_count"])


def test_a_signal_has_samples_only_where_its_cells_are_filled(base: Recording, tmp_path: Path) -> None:
    frame = pd.read_csv(BASE / "ride.csv")
    frame.loc[100, ["wx", "wy", "wz", "ax", "ay", "az", "pulses"]] = np.nan
    found = read_signals(laid(tmp_path, frame))
    assert found.gaps["missing"].tolist() == [1] and len(found.encoder) == 800
    # Gyroscope and accelerometer in rows of their own, 20 ms apart.
    first, second = pd.read_csv(BASE / "ride.csv"), pd.read_csv(BASE / "ride.csv")
    first[["ax", "ay", "az"]], second[["wx", "wy", "wz", "pulses"]] = np.nan, np.nan
    mixed = pd.concat([first, second.assign(t=second["t"] + 0.02)]).sort_values("t")
    found = read_signals(laid(tmp_path, mixed))
    np.testing.assert_array_equal(found.imu["gyro_x_radps"], base.imu["gyro_x_radps"].iloc[1:])
    expected = np.interp(base.imu.index[1:], base.imu.index + 0.02, base.imu["accel_z_mps2"])
    np.testing.assert_allclose(found.imu["accel_z_mps2"], expected, rtol=1e-12)


def test_a_way_that_begins_late_shortens_the_ride_and_moves_its_start(
    base: Recording, tmp_path: Path
) -> None:
    frame = pd.read_csv(BASE / "ride.csv")
    own = ('[encoder]\nfile = "ride.csv"', '[encoder]\nfile = "pulses.csv"')
    frame.iloc[60:].to_csv(tmp_path / "pulses.csv", index=False)
    found = read_signals(laid(tmp_path, frame, own))
    assert found.imu.index[0] == 2.5 and "only 2.5 to 40 s are used" in found.notes[0]
    # While the train moves nobody knows where it is then.
    frame.iloc[260:].to_csv(tmp_path / "pulses.csv", index=False)
    with pytest.raises(InputError, match=r"the train moves when it begins.*start_position_m"):
        read_signals(tmp_path)
    # With a way of its own, a magnetometer that begins late moves the start along it.
    field = pd.DataFrame({"t": frame["t"][200:], "x": 2e-5, "y": 0.0, "z": -4e-5})
    field["x"] += 1e-7 * np.sin(np.arange(len(field)))  # a device that shows one number throughout is stuck
    field.to_csv(tmp_path / "mag.csv", index=False)
    table = (
        '[magnetometer]\nfile = "mag.csv"\ncolumns = { time = "t", field = ["x", "y", "z"] }\n'
        "[magnetometer.sheet]\nnoise_tpsqrthz = 1e-7\nintensity_t = 44e-6\ninclination_rad = 0.9\n"
        "north_rad = 0.0\n[encoder]\n"
    )
    found = read_signals(laid(tmp_path, frame, ("[encoder]\n", table)))
    way = frame["pulses"][200] * 2.0 * np.pi * 0.29 / 1024
    assert found.start_position_m == pytest.approx(110.0 + way, abs=1e-9) and way > 1.0
    assert found.encoder.index[0] == found.imu.index[0] == 10.0


def test_no_other_columns_than_those_needed_are_held(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also not those of text, which could not be numbers."""
    held: list[str] = []
    read = text_file._blocks_read
    monkeypatch.setattr(text_file, "_blocks_read", lambda *given: [held.extend(given[4]), read(*given)][1])
    frame = pd.read_csv(BASE / "ride.csv").assign(note="words", **{f"more_{i}": 1.5 for i in range(20)})
    read_signals(laid(tmp_path, frame))
    assert sorted(held) == sorted(["t", "wx", "wy", "wz", "ax", "ay", "az", "t", "pulses"])


def jumped(at_row: int, seconds: float) -> Change:
    return lambda frame: frame.assign(t=frame["t"] + seconds * (frame.index >= at_row))


WRONG: dict[str, tuple[Change, Pairs, list[str]]] = {
    "clock_set_back": (jumped(400, -3600.0), (), ["clock jumps back", "-3599.95 s after 19.95 s", "cut"]),
    "clock_set_forward": (jumped(400, 9e9), (), ["clock jumps by 285 years", "19.95", "cut"]),
    "milliseconds_as_seconds": (at(lambda t: t * 1e3), (), ["0.02 Hz", "imu.units.time", "ms"]),
    "tenth_lost": (
        lambda frame: frame[np.random.default_rng(1).random(len(frame)) > 0.1],
        (("110.0", "110.0\nlongest_gap_s = 1.0"),),
        ["9.25 % of all", "limit: 5 %", "rate_hz"],
    ),
    "coarse_stamps": (at(lambda t: np.floor(t)), (), ["samples differ", "rate_hz = 20"]),
    "disorder": (lambda frame: frame.sample(frac=1.0, random_state=1), (), ["reversed", "sort the samples"]),
    "counter_set_to_zero": (
        lambda frame: frame.assign(pulses=frame["pulses"] - frame["pulses"][500] * (frame.index >= 500)),
        (),
        ["encoder.count", "counter jumps at time_s = 25", "-62227 pulses", "counter_modulus"],
    ),
    "ticks_of_no_clock": (
        at(lambda t: t),
        (('[encoder]\nfile = "ride.csv"', '[encoder]\nfile = "ride.csv"\ntick_rate_hz = 9.0'),),
        ["encoder.tick_rate_hz", "ticks"],
    ),
    "increments_in_rates": (
        lambda f: f,
        (("axes =", 'output = "increments"\naxes ='),),
        ["imu.output", "units"],
    ),
    "scale_of_nothing": (
        lambda f: f,
        (("axes =", "lsb_per_unit = { gyr = 9 }\naxes ="),),
        ["did you mean 'gyro'"],
    ),
    "number_of_no_column": (
        lambda f: f,
        (('count = "pulses"', "count = 9"),),
        ["encoder.columns", "'9'", "pulses"],
    ),
    "file_of_no_sensor": (
        lambda f: f,
        (("[encoder]\n", '[imu.gyro]\nfile = "g.csv"\n[encoder]\n'),),
        ["imu.gyro.file", "no such file", "g.csv"],
    ),
    "too_late": (
        lambda f: f,
        (("[encoder]\n", "[encoder]\nlongest_gap_s = 1e9\n"),),
        ["encoder.longest_gap_s", "<= 600"],
    ),
    "text_above": (lambda f: f, (), ["imu.skip_lines", "line 3", "set skip_lines = 2"]),
}


@pytest.mark.parametrize("fault", WRONG)
def test_what_cannot_be_read_is_said_in_one_line(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    change, pairs, words = WRONG[fault]
    monkeypatch.chdir(tmp_path)
    laid(tmp_path, change(pd.read_csv(BASE / "ride.csv")), *pairs)
    if fault == "text_above":
        laid(tmp_path, lines("Logger, no 5", "", NAMES))
    assert call(["estimate", ".", "--estimator", "DesignAngles", "--out", "out"]) == BAD_INPUT
    message = capsys.readouterr().err.strip()
    assert len(message.splitlines()) == 1, message
    for word in words:
        assert word in message, message
    assert not (tmp_path / "out").exists()
