"""What README says in Python runs as it stands there."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

import simrail

README = Path(__file__).parents[1] / "README.md"


def run_block() -> None:
    (block,) = re.findall(
        r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    exec(compile(block, str(README), "exec"), {})


def test_the_block_on_a_short_ride(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], own_cache: None
) -> None:
    """The same lines; the scenario that they load ends sooner, and its engine is the exact one."""
    load: Callable = simrail.load_scenario
    short = partial(load, overrides=["engine=kinematic", "ride.end_m=200.0"])
    monkeypatch.setattr(simrail, "load_scenario", short, raising=False)
    run_block()
    assert re.search(r"whole\s+0\.\d+\s+deg", capsys.readouterr().out)


@pytest.mark.slow
def test_the_block_as_it_stands(capsys: pytest.CaptureFixture[str]) -> None:
    run_block()
    assert re.search(r"curve\s+0\.\d+\s+deg", capsys.readouterr().out)
