"""A folder with former results, and what a command says that must end with code 2."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from simrail.cli.main import BAD_INPUT, call


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    former = tmp_path / "results" / "mine"
    former.mkdir(parents=True)
    (former / "manifest.json").write_text("{}")
    return tmp_path


@pytest.fixture
def message_of(capsys: pytest.CaptureFixture[str]) -> Callable[[list[str]], str]:
    """Message of a command that must end with code 2; it is one line, without a traceback."""

    def message(arguments: list[str]) -> str:
        assert call(arguments) == BAD_INPUT
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.count("\n") == 1 and captured.err.startswith("simrail: ")
        return captured.err

    return message
