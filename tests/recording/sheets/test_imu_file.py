"""IMU files: every fault told at once, sheets without noise warned of, and a template with every key."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.cli.templates import IMU, imu_template
from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.recording.sheets.figures import FIGURES, MEANINGS, QUANTITIES
from simrail.recording.sheets.grades import ImuGrade, silent_noise
from simrail.recording.sheets.imu_file import ImuFile, ImuHead, load_grade

HEAD = 'title = "Mine"\nsource = "made up"\nrate_hz = 100.0\n'


def refusal(tmp_path: Path, text: str) -> InputError:
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        load_grade(str(path))
    return raised.value


def test_a_sheet_in_its_own_words_is_told_every_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is written after the message is a file that is fine, and means what the sheet says."""
    sheet = (
        'angle_random_walk = "0.34 deg/sqrt(h)"\n"velocity random walk" = "0.18 m/s/√h"\n'
        'gyro_in_run_bias_stability = "8 °/h"\naccel_bias_repeatability = "±3 mg"\n'
        "gyro_cutoff_frequency_hz = 40.0\n"
    )
    mine = tmp_path / "mine.toml"
    mine.write_text(HEAD + sheet, encoding="utf-8")
    assert call(["imu", str(mine)]) == BAD_INPUT
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 5
    mended = re.findall(r"write (\w+ = [0-9.]+)", said)
    mine.write_text(HEAD + "\n".join(mended), encoding="utf-8")
    assert call(["imu", str(mine)]) == DONE
    assert "warning" not in capsys.readouterr().out
    grade = load_grade(str(mine))
    assert grade == ImuGrade.from_datasheet(
        "mine",
        100.0,
        source="made up",
        gyro_noise_degpsqrth=0.34,
        accel_noise_mpspsqrth=0.18,
        gyro_bias_instability_degph=8.0,
        accel_turn_on_bias_mg=3.0,
        gyro_bandwidth_hz=40.0,
    )


def test_all_faults_are_named_at_once(tmp_path: Path) -> None:
    """Of form (unknown, missing, sign, type) and of what figures mean together."""
    error = refusal(
        tmp_path,
        'title = "Mine"\nrate_hz = 100.0\ngyro_range_degps = "300 deg/s"\naccel_range_g = -5.0\n'
        "arw_degpsqrth = 0.3\ngyro_turn_on_bias_degps = 0.1\ngyro_turn_on_bias_degph = 36.0\n"
        "gyro_scale_error_percent = 30.0\naccel_nonlinearity_ppmfs = 100.0\nclock_jitter_us = 5000.0\n",
    )
    said = str(error)
    lines = said.splitlines()
    assert all(line.startswith(f"{tmp_path}/mine.toml: ") for line in lines)
    for words in (
        ("arw_degpsqrth", "unknown key", "gyro_noise_degpsqrth = 0.3"),
        ("source", "is required"),
        ("gyro_range_degps", "wrong type", "gyro_range_degps = 300.0"),
        ("accel_range_g", "-5.0", "> 0"),
        ("gyro_turn_on_bias_degph", "given twice"),
        ("gyro_scale_error", "0.3", "< 0.2"),
    ):
        assert any(all(word in line for word in words) for line in lines), words
    assert len(lines) == 6


def test_what_figures_mean_together_is_told_at_once(tmp_path: Path) -> None:
    error = refusal(
        tmp_path,
        HEAD
        + "gyro_nonlinearity_percentfs = 0.1\naccel_nonlinearity_ppmfs = 100.0\nclock_jitter_us = 5000.0\n"
        'bias_process = "flicker"\nflicker_range_s = [10.0, 1.0]\n',
    )
    fields = [one.field.split(": ")[1] for one in error.each if one.field]
    assert fields == ["gyro_nonlinearity", "accel_nonlinearity", "clock_jitter_s", "flicker_range_s"]


@pytest.mark.parametrize(("word", "meant"), [("titel", "title"), ("bias_proces", "bias_process")])
def test_a_misspelt_word_of_the_head_is_guessed(word: str, meant: str, tmp_path: Path) -> None:
    assert f"did you mean {meant}?" in str(refusal(tmp_path, HEAD + f'{word} = "flicker"\n'))


def test_what_is_no_figure_is_sent_to_the_list(tmp_path: Path) -> None:
    said = str(refusal(tmp_path, HEAD + "supply_voltage_v = 5.0\n"))
    assert (
        "simrail new imu" in said and "did you mean" not in said and "write" not in said.replace("writes", "")
    )


@pytest.mark.parametrize(
    ("figures", "silent"),
    [
        ({}, []),
        ({"accel_range_g": 5.0, "bandwidth_hz": 40.0}, []),
        ({"gyro_noise_degpsqrth": 0.3, "accel_noise_ugpsqrthz": 100.0}, []),
        ({"gyro_random_walk_degphpsqrth": 0.3, "accel_noise_ugpsqrthz": 100.0}, ["angle random walk"]),
        ({"gyro_noise_degpsqrth": 0.3}, ["velocity random walk"]),
        ({"package_misalignment_deg": 0.1}, ["angle random walk", "velocity random walk"]),
    ],
)
def test_a_device_with_errors_and_without_noise_is_warned_of(
    figures: dict[str, float], silent: list[str]
) -> None:
    warnings = silent_noise(ImuGrade.from_datasheet("mine", 100.0, **figures))
    assert len(warnings) == len(silent)
    for word, warning in zip(silent, warnings, strict=True):
        assert word in warning


@pytest.mark.parametrize("name", sorted(shipped("imu")))
def test_no_shipped_imu_is_warned_of(name: str) -> None:
    assert silent_noise(load_grade(name)) == ()


def test_the_warning_stands_where_the_sheet_is_looked_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(HEAD + "gyro_turn_on_bias_degps = 0.1\naccel_noise_ugpsqrthz = 100.0\n", encoding="utf-8")
    assert call(["imu", str(mine), "--out", str(tmp_path)]) == DONE
    assert "warning: IMU mine has no white noise of the gyro" in capsys.readouterr().out
    assert "no white noise of the gyro" in (tmp_path / "mine.html").read_text(encoding="utf-8")
    assert call(["check", "quick_kinematic", "--set", f"imu.grade={mine}"]) == DONE
    assert "warning: IMU mine has no white noise of the gyro" in capsys.readouterr().err


def test_the_template_has_every_key_once_and_means_the_shipped_device(tmp_path: Path) -> None:
    text = imu_template("mine")
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    found = re.findall(r"^(?:# )?(\w+) = ", text, flags=re.MULTILINE)
    assert sorted(found) == sorted(ImuFile.model_fields)
    for meaning in MEANINGS.values():
        assert meaning in " ".join(text.replace("\n#", "").split())
    mine, its = load_grade(str(path)), load_grade(IMU)
    for field in ("gyro_noise_radpsqrts", "accel_turn_on_bias_mps2", "gyro_range_radps", "rate_hz"):
        assert getattr(mine, field) == getattr(its, field)


def test_every_line_of_the_template_is_one_that_a_file_may_have() -> None:
    """Uncommented by itself, in the place of the same quantity in another unit."""
    text = imu_template("mine")
    given = tomllib.loads(text)
    for line in re.findall(r"^# (\w+ = .*)$", text, flags=re.MULTILINE):
        entry = tomllib.loads(line)
        (key,) = entry
        quantity = key.rpartition("_")[0] if key in FIGURES else key
        others = {name: value for name, value in given.items() if name not in QUANTITIES.get(quantity, ())}
        ImuFile.model_validate_json(json.dumps(others | entry)).grade("mine")


def test_every_key_is_described() -> None:
    for fields in (ImuHead.model_fields, ImuFile.model_fields):
        assert all(field.description for field in fields.values())
    for name, figure in FIGURES.items():
        assert str(ImuFile.model_fields[name].description).endswith(figure.unit)
