"""A scenario that names a tuning: found beside it, part of its content, and refused by name."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import pytest
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.tuning.file import Tuning

from simrail.core.errors import InputError
from simrail.core.toml_files import shipped, toml_text
from simrail.scenario.build import Parts
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, load_scenario

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
SMOOTHER = """
[[estimator]]
name = "smoother"
method = "TrajectorySmoother"
[estimator.options]
tuning = "tunings/mine.toml"
"""
MINE = Tuning(Hyperparameters(lateral_m2ps5=3.0))


def write(tuning: Tuning, path: Path) -> None:
    path.write_text(toml_text({"hyperparameters": asdict(tuning.hyperparameters)}))


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Scenario:
    """Read from a folder that is not the working one."""
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    folder = tmp_path / "scenarios"
    (folder / "tunings").mkdir(parents=True)
    (folder / "mine.toml").write_text(GOOD + SMOOTHER, encoding="utf-8")
    write(MINE, folder / "tunings" / "mine.toml")
    return load_scenario(folder / "mine.toml")


def test_found_beside_the_scenario(scenario: Scenario) -> None:
    made = judge_scenario(scenario).estimators["smoother"]
    assert made.tuning == MINE  # type: ignore[attr-defined]
    assert made.noise == (MINE.hyperparameters,)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["metro_geometry", "scale_track"])
def test_a_copy_of_a_shipped_scenario_finds_what_is_shipped(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    copy = tmp_path / f"{name}.toml"
    copy.write_bytes(shipped("scenario")[name].read_bytes())
    assert judge_scenario(load_scenario(copy)).estimators == judge_scenario(load_scenario(name)).estimators


def test_what_lies_beside_the_scenario_goes_before_what_is_shipped(scenario: Scenario) -> None:
    assert scenario.folder is not None
    write(MINE, scenario.folder / "tunings" / "scale_track_cml.toml")
    setting = "estimator.smoother.options.tuning=tunings/scale_track_cml.toml"
    made = judge_scenario(load_scenario(scenario.folder / "mine.toml", overrides=[setting])).estimators
    assert made["smoother"].tuning == MINE  # type: ignore[attr-defined]


def test_a_shipped_tuning_that_is_misspelt_is_guessed(scenario: Scenario) -> None:
    assert scenario.folder is not None
    setting = "estimator.smoother.options.tuning=tunings/scale_track_clm.toml"
    wrong = load_scenario(scenario.folder / "mine.toml", overrides=[setting])
    with pytest.raises(InputError, match=r"shipped: tunings/scale_track_cml\.toml"):
        judge_scenario(wrong)


@pytest.mark.parametrize(("base_m", "is_told"), [(3.0, False), (0.75, False), (3.1, True), (0.1, True)])
def test_a_base_of_the_twist_that_gives_none_is_told(
    scenario: Scenario, base_m: float, is_told: bool
) -> None:
    assert scenario.folder is not None
    settings = ['geometry.bands=["D1"]', f"geometry.twist_base_m={base_m}"]
    warnings = judge_scenario(load_scenario(scenario.folder / "mine.toml", overrides=settings)).warnings
    assert any("no multiple of geometry_step_m = 0.25 m of smoother" in one for one in warnings) is is_told


def test_its_content_is_in_the_hash(scenario: Scenario) -> None:
    assert scenario.folder is not None
    file = scenario.folder / "tunings" / "mine.toml"
    plain = judge_scenario(scenario).content_hash
    assert judge_scenario(scenario, Parts(scenario)).content_hash == plain
    file.write_text("# a comment does not count\n" + file.read_text())
    assert judge_scenario(scenario).content_hash == plain
    write(Tuning(replace(MINE.hyperparameters, yaw_rad2ps3=0.5)), file)
    assert judge_scenario(scenario).content_hash != plain


@pytest.mark.parametrize(
    ("new", "words"),
    [
        (None, ["options.tuning", "no such file", "tunings/mine.toml", "mend the path"]),
        ("lateral_m2ps5 = -3.0", ["hyperparameters.lateral_m2ps5", "-3.0", "> 0"]),
        ("lateral_m2ps5 = 3.0\nmine = 3.0", ["hyperparameters.mine", "no such hyper-parameter", "remove it"]),
    ],
)
def test_faults_are_named(scenario: Scenario, new: str | None, words: list[str]) -> None:
    assert scenario.folder is not None
    file = scenario.folder / "tunings" / "mine.toml"
    text = file.read_text()
    file.unlink()
    if new is not None:
        file.write_text(text.replace("lateral_m2ps5 = 3.0", new))
    with pytest.raises(InputError) as caught:
        judge_scenario(scenario)
    for word in ["mine.toml", *words]:
        assert word in str(caught.value)


def test_an_option_that_is_a_file_takes_a_path_only(scenario: Scenario) -> None:
    wrong = load_scenario(f"{scenario.folder}/mine.toml", overrides=["estimator.smoother.options.tuning=3.0"])
    with pytest.raises(InputError, match=r"options\.tuning: has the wrong type; found 3\.0"):
        judge_scenario(wrong)


def test_two_tunings_are_two_variants(scenario: Scenario) -> None:
    assert scenario.folder is not None
    write(MINE, scenario.folder / "other.toml")
    listed = 'estimator.smoother.options.tuning=["tunings/mine.toml", "other.toml"]'
    both = judge_scenario(load_scenario(f"{scenario.folder}/mine.toml", overrides=[listed]))
    names = [name for name in both.estimators if name.startswith("smoother")]
    assert names == ["smoother[tuning=tunings/mine.toml]", "smoother[tuning=other.toml]"]


def test_shipped_tunings_can_be_read_and_those_that_were_searched_say_how() -> None:
    found = sorted((shipped("scenario")["quick_kinematic"].parent / "tunings").glob("*.toml"))
    assert found
    for file in found:
        search = Tuning.from_file(file).search
        assert search is None or (search.finished and search.command.startswith("simrail tune "))
