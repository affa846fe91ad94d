"""Folders that are replaced as a whole: also by a process that is killed between the two renames."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from simrail.core import atomic_files
from simrail.core.atomic_files import draft_of, restore, write_whole
from simrail.core.errors import InputError

KILLED = """
import os, signal, sys
from pathlib import Path
from simrail.core.atomic_files import draft_of

real = Path.replace

def replace(self, target):
    moved = real(self, target)
    if str(target).endswith(".former"):
        os.kill(os.getpid(), signal.SIGKILL)
    return moved

Path.replace = replace
with draft_of(Path(sys.argv[1])) as draft:
    (draft / "new").touch()
"""


@pytest.fixture
def torn(tmp_path: Path) -> Path:
    """A folder of results whose process was killed between the two renames."""
    folder = tmp_path / "re[s]ults"
    folder.mkdir()
    (folder / "manifest.json").write_text("former")
    killed = subprocess.run([sys.executable, "-c", KILLED, str(folder)], check=False)
    assert killed.returncode == -signal.SIGKILL and not folder.exists()
    return folder


def test_what_was_moved_away_is_put_back_at_the_next_start(torn: Path) -> None:
    assert restore(torn)
    assert (torn / "manifest.json").read_text() == "former"
    assert not restore(torn)


def test_a_new_draft_puts_it_back_first(torn: Path) -> None:
    """One that then fails leaves it as it was; one that succeeds takes its place; nothing else is left."""
    with pytest.raises(KeyError), draft_of(torn):
        raise KeyError
    assert (torn / "manifest.json").read_text() == "former"
    with draft_of(torn) as draft:
        (draft / "manifest.json").write_text("new")
    assert (torn / "manifest.json").read_text() == "new"
    leftovers = [path.name for path in torn.parent.iterdir() if path.name.endswith(".former")]
    assert leftovers == []


def test_a_former_one_beside_the_new_one_goes(tmp_path: Path) -> None:
    """Killed after the second rename."""
    (tmp_path / "results").mkdir()
    (tmp_path / ".results.1.former").mkdir()
    (tmp_path / ".results_b.1.former").mkdir()
    assert not restore(tmp_path / "results")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".results_b.1.former", "results"]


def test_of_two_former_ones_the_last_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed twice between the renames: the numbers of processes say nothing of which was first."""
    monkeypatch.setattr(atomic_files, "_IN_MOTION_S", 0.0)
    for name, seconds in (("7", 2000.0), ("123", 3000.0), ("5", 1000.0)):
        former = tmp_path / f".results.{name}.former"
        former.mkdir()
        (former / "made_by").write_text(name)
        os.utime(former, (seconds, seconds))
    assert restore(tmp_path / "results")
    assert (tmp_path / "results" / "made_by").read_text() == "123"


def test_another_process_between_its_renames_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, former = tmp_path / "results", tmp_path / ".results.1.former"
    former.mkdir()
    monkeypatch.setattr(atomic_files.time, "sleep", lambda _: folder.mkdir(exist_ok=True))
    assert not restore(folder)
    assert folder.exists()
    assert list(folder.iterdir()) == []


def test_what_was_asked_for_is_written_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "new" / "page.html"
    assert write_whole(file, b"first", what="page") == file
    assert file.read_bytes() == b"first"

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="the page cannot be written: No space left") as refused:
        write_whole(file, b"second, and longer", what="page")
    assert refused.value.field == "--out"
    assert file.read_bytes() == b"first"
    assert [one.name for one in file.parent.iterdir()] == ["page.html"], "no draft is left"


def test_a_place_below_a_file_is_refused_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError) as refused:
        write_whole(tmp_path / "file" / "page.html", b"", what="page", field="--gif", remedy="elsewhere")
    assert str(refused.value).count("\n") == 0
    assert str(refused.value).startswith("--gif: the page cannot be written")
    assert (tmp_path / "file").read_text() == "mine"
