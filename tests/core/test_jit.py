"""The cache of compiled kernels holds nothing that an edited source has made old."""

import ast
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
