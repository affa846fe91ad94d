"""The file of a tuning: round trip, whole or not at all, and every fault by name."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import pytest
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.tuning.file import Search, Tuning, TuningResult
from simrail.estimators.tuning.space import FLAT, IDENTIFIED, LOWER, NAMES, SearchSpace

from simrail.core.errors import InputError

HAND = Hyperparameters(gyro_x_rad2ps2=1e-4 / 3.0, lateral_m2ps5=3.0)
WIDE = SearchSpace(box=(1e-8, 1e4), constrained=("z",), position_m2=3e-3)
FOUND = Hyperparameters(accel_z_m2ps4=2e-4)
SEARCH = Search(
    method="cml",
    objective=(-17.123456789012345, -16.5),
    unit="negative log-likelihood per sample",
    space=WIDE,
    seed=3,
    evaluations=1600,
    fitted_on=('a "quoted" ride', "Größe"),
    command="simrail tune mine --estimator smoother --method cml",
)
KNOWN = dict.fromkeys(NAMES, IDENTIFIED)


RESULT = TuningResult(
    method="cml",
    objective=SEARCH.objective,
    unit=SEARCH.unit,
    settings=asdict(WIDE),
    seed=3,
    evaluations=1600,
    fitted_on=SEARCH.fitted_on,
    command=SEARCH.command,
    finished=True,
    values=(asdict(FOUND),),
)
OTHER = replace(FOUND, roll_rad2ps3=0.2)


@pytest.mark.parametrize(
    ("result", "tuning"),
    [
        (RESULT, Tuning(FOUND, None, SEARCH)),
        (
            replace(RESULT, values=(asdict(FOUND), asdict(OTHER)), finished=False),
            Tuning(FOUND, OTHER, replace(SEARCH, finished=False)),
        ),
        (
            replace(
                RESULT,
                values=(asdict(FOUND), asdict(OTHER)),
                status=(KNOWN, KNOWN | {"roll_rad2ps3": LOWER}),
            ),
            Tuning(FOUND, OTHER, SEARCH, KNOWN, KNOWN | {"roll_rad2ps3": LOWER}),
        ),
        (
            replace(RESULT, settings=asdict(replace(WIDE, position_m2=None))),
            Tuning(FOUND, None, replace(SEARCH, space=replace(WIDE, position_m2=None))),
        ),
    ],
)
def test_round_trip(result: TuningResult, tuning: Tuning, tmp_path: Path) -> None:
    path = tmp_path / "tuned.toml"
    result.write(path)
    assert Tuning.from_file(path) == tuning
    assert [entry.name for entry in tmp_path.iterdir()] == ["tuned.toml"]
    assert path.read_text(encoding="utf-8").startswith("# Made by: simrail tune mine")


def test_one_set_by_hand_and_two(tmp_path: Path) -> None:
    path = tmp_path / "tuned.toml"
    path.write_text(table("hyperparameters", asdict(HAND)))
    assert Tuning.from_file(path) == Tuning(HAND)
    path.write_text(table("hyperparameters", asdict(HAND)) + table("curve_hyperparameters", asdict(FOUND)))
    assert Tuning.from_file(path) == Tuning(HAND, FOUND)


def test_a_former_file_survives_a_write_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "tuned.toml"
    RESULT.write(path)

    def broken(self: Path, target: Path) -> Path:
        raise OSError("disk full")

    monkeypatch.setattr(Path, "replace", broken)
    with pytest.raises(OSError, match="disk full"):
        replace(RESULT, values=(asdict(HAND),)).write(path)
    assert Tuning.from_file(path).hyperparameters == FOUND
    assert [entry.name for entry in tmp_path.iterdir()] == ["tuned.toml"]


def table(name: str, values: dict[str, object]) -> str:
    return f"[{name}]\n" + "".join(f"{key} = {value!r}\n" for key, value in values.items())


GOOD = asdict(Hyperparameters())
FITTED = RESULT.text()


def changed(old: str, new: str) -> str:
    assert FITTED.count(old) == 1, old
    return FITTED.replace(old, new)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense", ["not valid TOML"]),
        ("", ["hyperparameters", "is required"]),
        ("hyperparameters = 3", ["hyperparameters", "wrong type", "3"]),
        (table("hyperparameter", GOOD), ["hyperparameter:", "unknown key", "did you mean hyperparameters"]),
        (
            table("hyperparameters", {**GOOD, "accel_x_m2ps4": -1.0}),
            ["hyperparameters.accel_x_m2ps4", "-1.0"],
        ),
        (table("hyperparameters", {**GOOD, "accel_x_m2ps4": "much"}), ["accel_x_m2ps4", "much", "> 0"]),
        (table("hyperparameters", {**GOOD, "accel_w_m2ps4": 1.0}), ["accel_w_m2ps4", "no such", "remove it"]),
        (table("hyperparameters", dict(list(GOOD.items())[:-1])), ["vertical_position_m2", "is missing"]),
        (
            table("hyperparameters", GOOD) + table("curve_hyperparameters", {**GOOD, "yaw_rad2ps3": 0.0}),
            ["curve_hyperparameters.yaw_rad2ps3", "0.0", "> 0"],
        ),
        (
            changed("roll_rad2ps3 = 0.01", "roll_rad2ps3 = 2e4"),
            ["hyperparameters.roll_rad2ps3", "20000.0", "1e-08 to 10000", "simrail tune"],
        ),
        (changed("accel_z_m2ps4 = 0.0002", "accel_z_m2ps4 = 0.0004"), ["accel_z_m2ps4", "0.0004", "0.0003"]),
        (
            changed("lateral_position_m2 = 0.003", "lateral_position_m2 = 0.004"),
            ["lateral_position_m2", "0.004", "0.003"],
        ),
        (changed("seed = 3", "sead = 3"), ["search.sead", "unknown key", "seed"]),
        (changed("seed = 3\n", ""), ["search.seed", "is required"]),
        (changed("seed = 3", "seed = true"), ["search.seed", "True", "whole number"]),
        (changed("seed = 3", "seed = 3.5"), ["search.seed", "3.5", "whole number"]),
        (changed("box = [\n    1e-08,\n    10000.0,\n]", "box = [1e-8]"), ["search.box"]),
        (
            changed("box = [\n    1e-08,\n    10000.0,\n]", "box = [1e4, 1e-8]"),
            ["search.box", "least < greatest"],
        ),
        (changed('constrained = [\n    "z",\n]', 'constrained = ["x"]'), ["search.constrained", "y, z"]),
        (changed('method = "cml"', "method = 3"), ["search.method", "3", "in quotes"]),
        (
            FITTED + table("status", KNOWN | {"roll_rad2ps3": "sure"}),
            ["status.roll_rad2ps3", "sure", "one of identified, flat", "leave the table out"],
        ),
        (FITTED + table("status", KNOWN | {"roll_rad2ps3": [1]}), ["status.roll_rad2ps3", "[1]"]),
        (FITTED + table("status", KNOWN | {"roll": FLAT}), ["status.roll", "no such hyper-parameter"]),
        (
            FITTED + table("curve_status", dict(list(KNOWN.items())[1:])),
            ["curve_status.roll_rad2ps3", "is missing"],
        ),
    ],
)
def test_a_bad_file_is_named(tmp_path: Path, text: str, words: list[str]) -> None:
    path = tmp_path / "tuned.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        Tuning.from_file(path)
    for word in ["tuned.toml", *words]:
        assert word in str(caught.value)


@pytest.mark.parametrize("content", [b"\xff\xfe[hyperparameters]", b"\x00" * 64])
def test_not_text(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "tuned.toml").write_bytes(content)
    with pytest.raises(InputError, match=r"tuned\.toml"):
        Tuning.from_file(tmp_path / "tuned.toml")
    with pytest.raises(InputError, match=r"nowhere\.toml"):
        Tuning.from_file(tmp_path / "nowhere.toml")
