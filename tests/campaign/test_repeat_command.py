"""The command in a manifest makes the same results again, whatever stands in names, paths and settings."""

from __future__ import annotations

import html
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from shortest_ride import DESIGN, SHORTEST_RIDE

from simrail import results
from simrail.cli.main import DONE, call
from simrail.report.pages import frame
from simrail.scenario.scenario import Scenario, load_scenario

pytestmark = pytest.mark.long

SCENARIO = SHORTEST_RIDE + DESIGN
NAMES = [
    "my line.toml",
    "it's $HOME `id`.toml",
    'a "b" \\ c;d&e.toml',
    "Größe_線.toml",
    "-x.toml",
    "*[a].toml",
]
SETTINGS = ['title="it\'s $HOME; `id` & \\"so\\" --beside x"', "imu.grade=['consumer', 'ideal']"]


@pytest.mark.parametrize("name", NAMES)
def test_a_shell_reads_the_words_back(name: str, here: Path) -> None:
    """By a real shell, in a folder with other files that a pattern would match."""
    folder = here / "a folder"
    folder.mkdir()
    (folder / name).write_text(SCENARIO)
    scenario = load_scenario(f"a folder/{name}", overrides=SETTINGS)
    shell = 'simrail() { for word in "$@"; do printf "%s\\0" "$word"; done; }; ' + scenario.command
    read = subprocess.run(["sh", "-c", shell], capture_output=True, check=True).stdout.decode()
    run, called, *settings = read.removesuffix("\0").split("\0")
    assert (run, called) == ("run", f"a folder/{name}")
    assert settings == [word for setting in SETTINGS for word in ("--set", setting)]
    again = load_scenario(called, overrides=settings[1::2])
    assert again.spec == scenario.spec


def test_a_name_that_looks_like_an_option_is_called_by_its_path(here: Path) -> None:
    (here / "-x.toml").write_text(SCENARIO)
    assert load_scenario("-x.toml").command == "simrail run ./-x.toml"


def test_the_command_of_manifest_and_page_runs(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SIMRAIL_RIDES", str(here / "rides"))

    def page(path: Path, *, scenario: Scenario, manifest: dict[str, object], **keywords: object) -> None:
        """The one section that shows the command."""
        text = frame._environment().get_template("pages/sections/again.html.j2")
        path.write_text(text.render(manifest=manifest, scenario=scenario, facts=[]), encoding="utf-8")

    monkeypatch.setattr(results, "write_report", page)
    name = "it's a 線 $HOME.toml"
    (here / name).write_text(SCENARIO)
    assert call(["run", name, "--set", SETTINGS[0], "--seed", "4"]) == DONE
    folder = here / "results" / Path(name).stem
    command = json.loads((folder / "manifest.json").read_text())["command"]
    shown = html.unescape((folder / "report.html").read_text())
    assert f"<pre>{command}</pre>" in shown
    first = (folder / "scores.csv").read_text()
    program = f'simrail() {{ "{sys.executable}" -m simrail "$@"; }}; {command}'
    done = subprocess.run(["sh", "-c", program], check=False, capture_output=True, text=True)
    assert done.returncode == DONE, done.stderr
    again = json.loads((folder / "manifest.json").read_text())
    assert again["command"] == command and again["seed"] == 4

    def values(text: str) -> list[str]:
        return [line for line in text.splitlines() if "us_per_sample" not in line]

    assert values((folder / "scores.csv").read_text()) == values(first)


def test_former_results_that_a_kill_left_elsewhere_come_back(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Between the two renames: the next run, also one that does not come to its end, has them in place."""
    monkeypatch.setenv("SIMRAIL_RIDES", str(here / "rides"))
    monkeypatch.setattr(results, "write_report", lambda path, **keywords: path.write_text("<html></html>"))
    (here / "mine.toml").write_text(SCENARIO)
    assert call(["run", "mine.toml"]) == DONE
    former = (here / "results" / "mine" / "manifest.json").read_text()
    real, parent = Path.replace, os.getpid()

    def replace(self: Path, target: Path) -> Path:
        moved = real(self, target)
        if str(target).endswith(".former") and os.getpid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)
        return moved

    monkeypatch.setattr(Path, "replace", replace)
    child = os.fork()
    if child == 0:
        call(["run", "mine.toml"])
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    assert not (here / "results" / "mine").exists()
    capsys.readouterr()
    assert call(["run", "mine.toml", "--set", "ride.speed_kmh=-3"]) != DONE
    with monkeypatch.context() as patch:
        patch.setattr(results, "judge_scenario", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
        call(["run", "mine.toml"])
    assert "put back" in capsys.readouterr().err
    assert (here / "results" / "mine" / "manifest.json").read_text() == former
