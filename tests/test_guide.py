"""What the guide says can be done as it stands there."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
import typer

import simrail
from simrail.cli.main import app
from simrail.scenario.file_keys import keys_of

DOCS = Path(__file__).parents[1] / "docs"
PAGES = sorted(DOCS.glob("*.md"))


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)


COMMANDS = [
    (page.stem, line.removeprefix("$ "))
    for page in PAGES
    for block in blocks(page, "console")
    for line in block.splitlines()
    if line.startswith("$ simrail")
]


def test_there_are_commands_to_try() -> None:
    assert len(COMMANDS) > 10


@pytest.mark.parametrize(("page", "line"), COMMANDS)
def test_every_command_is_one_that_there_is(page: str, line: str) -> None:
    """Its name, its options and the number of its words; nothing is run."""
    name, *rest = shlex.split(line)[1:]
    group = typer.main.get_command(app)
    command = group.commands[name]  # type: ignore[attr-defined]
    context = command.make_context(name, list(rest), resilient_parsing=True)
    assert not context.args, f"{page}: {context.args}"
    known = {option for parameter in command.params for option in parameter.opts}
    assert {word.partition("=")[0] for word in rest if word.startswith("--")} <= known


def test_python_blocks_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str], own_cache: None
) -> None:
    """The same lines; the scenario that they load ends sooner."""
    load: Callable = simrail.load_scenario
    short = partial(load, overrides=["ride.end_m=60.0", "ride.rest_s=4.0"])
    monkeypatch.setattr(simrail, "load_scenario", short, raising=False)
    monkeypatch.chdir(tmp_path)
    for page in PAGES:
        for block in blocks(page, "python"):
            exec(compile(block, str(page), "exec"), {})
    assert "Estimate of IMU axle" in capsys.readouterr().out
    assert (tmp_path / "attitude.svg").is_file()


def test_keys_of_toml_blocks_are_known() -> None:
    known = {(key.table, key.name) for key in keys_of("scenario")}
    for block in blocks(DOCS / "choose_an_imu.md", "toml"):
        for table, entries in tomllib.loads(block).items():
            several = isinstance(entries, list)
            shown = f"[[{table}]]" if several else f"[{table}]"
            for entry in entries if several else [entries]:
                assert {(shown, name) for name in entry} <= known


def test_every_page_is_in_the_table_of_contents() -> None:
    listed = (DOCS / "index.md").read_text().rpartition("```{toctree}")[2].split()
    made = {"validation"}  # by docs/generated.py
    assert {page.stem for page in PAGES} | made <= {*listed, "index"}


@pytest.mark.slow
def test_the_guide_is_built_without_a_warning(tmp_path: Path) -> None:
    build = pytest.importorskip("sphinx.cmd.build", reason='pip install -e ".[docs]"')
    arguments = ["-q", "-W", "--keep-going", "-d", str(tmp_path / "trees"), str(DOCS), str(tmp_path / "html")]
    assert build.main(arguments) == 0
    assert "wavelengths_m" in (tmp_path / "html" / "keys" / "scenario.html").read_text()
