"""The cache of compiled kernels holds nothing that an edited source has made old."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from simrail.core import jit
from simrail.core.source_hash import source_folders

HERE, ESTIMATORS = source_folders()


def taken_by_kernels(source: str) -> set[str]:
    """Modules of simrail whose names stand inside the compiled functions of a source."""
    tree = ast.parse(source)
    imported = {
        alias.asname or alias.name: node.module
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("simrail.")
        for alias in node.names
    }
    kernels = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and any("njit" in ast.unparse(d) for d in node.decorator_list)
    ]
    names = {name.id for kernel in kernels for name in ast.walk(kernel) if isinstance(name, ast.Name)}
    return {imported[name] for name in names & imported.keys()}


@pytest.mark.parametrize("folder", [HERE, ESTIMATORS], ids=["simrail", "estimators"])
def test_what_is_compiled_into_a_kernel_counts_for_the_cache(folder: Path) -> None:
    sources = {path: path.read_text(encoding="utf-8") for path in folder.rglob("*.py")}
    kernels = {path: text for path, text in sources.items() if "@njit" in text}
    assert len(kernels) > 3
    for path, text in kernels.items():
        own = "estimators" if folder == ESTIMATORS else path.relative_to(HERE).parts[0]
        folders = {own, *(module.split(".")[1] for module in taken_by_kernels(text))}
        assert folders <= set(jit.KERNEL_FOLDERS), path


def test_another_layout_of_a_record_is_another_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """The layouts stand in modules without a kernel of their own."""
    before = jit.kernel_hash()
    read = Path.read_bytes

    def edited(path: Path) -> bytes:
        return read(path) + (b"\n# a field more" if path.name == "contact_geometry.py" else b"")

    monkeypatch.setattr(Path, "read_bytes", edited)
    jit.source_hash.cache_clear()
    try:
        assert jit.kernel_hash() != before
    finally:
        monkeypatch.undo()
        jit.source_hash.cache_clear()
    assert jit.kernel_hash() == before


LATER = """
import os, sys
from simrail.core import jit
os.environ["NUMBA_DISABLE_INTEL_SVML"] = "1"  # any of numba's own
sys.path.insert(0, sys.argv[1])
import late_kernel
late_kernel.twice(3.0)
"""


def test_a_setting_of_numba_after_the_import_leaves_the_cache_where_it_is(tmp_path: Path) -> None:
    """numba reads its settings anew before it compiles the first kernel; the second is decorated later."""
    sources = tmp_path / "sources"
    sources.mkdir()
    kernels = (
        "from simrail.core.jit import njit\n\n\n@njit\ndef once(x):\n    return x + 1.0\n\n\nonce(1.0)\n\n\n"
        "@njit\ndef twice(x):\n    return 2.0 * x\n"
    )
    (sources / "late_kernel.py").write_text(kernels)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    environment |= {"XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", LATER, str(sources)]
    subprocess.run(command, check=True, env=environment, capture_output=True, timeout=120)
    assert [path.name for path in sources.rglob("*")] == ["late_kernel.py"]
    kept = {path.name.partition("-")[0] for path in (tmp_path / "cache").rglob("*.nbi")}
    assert kept == {"late_kernel.once", "late_kernel.twice"}


def test_kernels_of_a_cache_that_cannot_be_written_go_into_a_temporary_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not beside their sources, where numba would put them and they go stale."""
    monkeypatch.delenv(jit._SPARE, raising=False)
    monkeypatch.setattr(jit.atexit, "register", lambda *arguments, **keywords: None)
    (tmp_path / "no folder").touch()
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path / "no folder")
    monkeypatch.setattr(jit.tempfile, "tempdir", str(tmp_path))
    spare = jit._kernel_folder()
    assert spare.parent == tmp_path and spare.is_dir()
    assert jit._kernel_folder() == spare, "found again, also by a process that this one starts"
    monkeypatch.delenv(jit._SPARE)
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path / "cache")
    assert jit._kernel_folder().is_relative_to(tmp_path / "cache")
