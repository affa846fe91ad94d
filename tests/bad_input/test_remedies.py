"""A remedy must fit its fault: no unit for a count, no quotes for a list, no magnetometer out of nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from simrail.cli.main import BAD_INPUT, call
from simrail.core.toml_files import shipped

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
NINE_AXES = 'method = "Vqf"\n[estimator.options]\nmagnetometer = true\n'


def refusal(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What ``simrail check`` says of a faulty scenario, in one line."""
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    assert call(["check", str(folder / "mine.toml")]) == BAD_INPUT
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    return said


@pytest.mark.parametrize(
    ("good", "bad", "remedy"),
    [
        ("sensor_draws = 2", "sensor_draws = 0", "give a number within the limit"),
        ("speed_kmh = 50.0", "speed_kmh = -50.0", "mind the unit"),
        ('name = "out"', 'name = ["out", "back"]', "give one value, not a list"),
        ('name = "out"', "name = 3", "write it in quotes"),
        ("position_m = [0.0, 0.0, 0.6]", "position_m = 0.6", "an array"),
        ("seed = 1", 'seed = 1\ngeometry = { bands = "D1" }', 'write it in brackets: ["D1"]'),
        (
            "seed = 1",
            'seed = 1\ngeometry = { own_bands = { "a b" = [3.0, 9.0] } }',
            "is no name; found 'a b'",
        ),
    ],
)
def test_the_remedy_fits(
    good: str, bad: str, remedy: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert good in GOOD
    said = refusal(GOOD.replace(good, bad), tmp_path, capsys)
    assert remedy in said
    others = {"mind the unit", "within the limit", "write it in quotes", "not a list"}
    assert not any(other in said for other in others if other not in remedy)


def test_a_magnetic_heading_needs_a_magnetometer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Said by the check, not by every cell of the run."""
    nine = GOOD.replace('method = "DesignAngles"\n', NINE_AXES)
    said = refusal(nine, tmp_path, capsys)
    for part in ("estimator[2].options.magnetometer", "found True", "add a [magnetometer]"):
        assert part in said
    (tmp_path / "mine.toml").write_text(nine + "\n[magnetometer]\n", encoding="utf-8")
    assert call(["check", str(tmp_path / "mine.toml")]) == 0
    capsys.readouterr()
    (tmp_path / "mine.toml").write_text(nine.replace("magnetometer = true", "magnetometer = false"))
    assert call(["check", str(tmp_path / "mine.toml")]) == 0


def test_a_setting_of_a_name_that_is_misspelt_is_guessed(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["check", "quick_kinematic", "--set"]
    assert call([*words, "estimator.ekf_compensate.options.compensated=false"]) == 2
    assert "nothing is called so; found 'ekf_compensate'" in (said := capsys.readouterr().err)
    assert "did you mean ekf_compensated?" in said
    assert call([*words, "estimator.ekf_compensated.options.compensated=false"]) == 0
    assert call([*words, "imu.calibration.temperature_c=20"]) == 2
    assert "nothing is called so" not in capsys.readouterr().err, "a key that no name is near"
