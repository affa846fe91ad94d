"""Commands of README, CONTRIBUTING and the guide, run as they stand; what is not is listed with a reason."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from guide_commands import ELSEWHERE, LONG_RUNS, PARTS_ONLY, PATTERNS, TOO_LONG, Command, commands

from simrail import load_scenario
from simrail.cli.main import app, call
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells

ALL = commands()
LEFT_OUT = {**PATTERNS, **TOO_LONG, **ELSEWHERE, **PARTS_ONLY}
OURS = [one for one in ALL if one.line.startswith("simrail ")]
RUN = list(dict.fromkeys(one.line for one in ALL if one.line not in LEFT_OUT))
READ = [line for line in RUN if re.match(rf"simrail run (?:{'|'.join(LONG_RUNS)})\b(?!.*--plan)", line)]
DONE = [line for line in RUN if line not in READ]

FIRST = tuple(
    f"simrail new {one}" for one in ("scenario mine", "imu my_imu", "ride my_ride", "estimator my_filter")
)
"""What others go on with."""


def words_of(line: str) -> list[str]:
    return Command("", line).words[1:]


def test_commands_are_found_and_none_is_listed_that_there_is_not() -> None:
    assert len(DONE) > 20
    assert len(READ) > 12
    assert set(LEFT_OUT) <= {one.line for one in ALL}
    assert set(FIRST) <= set(DONE)


@pytest.mark.parametrize(
    "one", [one for one in OURS if one.line not in PARTS_ONLY], ids=lambda one: f"{one.page}: {one.line}"
)
def test_every_command_is_one_that_there_is(one: Command) -> None:
    """Its name, its options and the number of its words; nothing is run."""
    name, *rest = one.words[1:]
    group = typer.main.get_command(app)
    command = group.commands[name]  # type: ignore[attr-defined]
    context = command.make_context(name, list(rest), resilient_parsing=True)
    assert not context.args, context.args
    known = {option for parameter in command.params for option in parameter.opts}
    assert {word.partition("=")[0] for word in rest if word.startswith("--")} <= known


@pytest.mark.long
@pytest.mark.parametrize("line", READ)
def test_a_long_run_is_one_that_its_settings_fit(line: str) -> None:
    name, *rest = words_of(line)[1:]
    settings = [rest[i + 1] for i, word in enumerate(rest) if word == "--set"]
    seed = [int(rest[i + 1]) for i, word in enumerate(rest) if word == "--seed"]
    scenario = load_scenario(name, overrides=settings, seed=seed[0] if seed else None)
    assert Parts(scenario).resolve(next(iter(cells(scenario)))).ride.vehicle.bodies


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory, own_cache: None) -> Iterator[Path]:
    """A folder that holds what the guide has a reader make first."""
    folder = tmp_path_factory.mktemp("desk")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for line in FIRST:
            assert call(words_of(line)) == 0
    yield folder


HEAVY = (
    "simrail vehicle manchester_1 --out results/vehicle",
    "simrail run validation --plan",
    "simrail film quick_kinematic --gif quick.gif",
)


@pytest.mark.parametrize(
    "line",
    [
        pytest.param(line, marks=pytest.mark.slow if line in HEAVY else pytest.mark.long)
        for line in DONE
        if line not in FIRST
    ],
)
def test_a_command_runs_as_it_stands(
    line: str, desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(desk)
    # A lesson would be served until it is stopped: tests/browser opens all of them.
    monkeypatch.setattr(subprocess, "call", lambda *_, **__: 0)
    code = call(words_of(line))
    shown = capsys.readouterr()
    assert code == 0, shown.err
    for file in re.findall(r"^wrote (?!into )(\S+?)[:,]?(?: |$)", shown.out, re.MULTILINE):
        assert (desk / file).exists(), file


@pytest.mark.long
def test_a_figure_of_what_the_guide_ran_first(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``simrail figure results/go20a answer --out a.pdf``, of the run that takes seconds."""
    monkeypatch.chdir(desk)
    if not (desk / "results" / "quick_kinematic").is_dir():
        assert call(["run", "quick_kinematic"]) == 0
    assert call(["figure", "results/quick_kinematic", "answer", "--out", "a.pdf"]) == 0
    assert (desk / "a.pdf").read_bytes().startswith(b"%PDF")
