"""Folders of their own for tests that run scenarios; how the tests are collected."""

import gc
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Look for no garbage while tests are collected, and afterwards not among what was collected.

    Collecting makes millions of objects that stay: looking through them takes a fifth of its time.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture(scope="module")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Rides of a module's tests go into a cache of their own."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setattr("simrail.ride.cache.cache_folder", lambda: folder)
        yield


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder of a test, empty."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


FIRST = ("campaign/test_passes.py", "campaign/test_export.py")
"""Modules that compile most kernels of the estimators and of the engine: others load these from the disk."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let each of two workers compile what the other need not."""

    def place(item: pytest.Item) -> int:
        ends = [i for i, name in enumerate(FIRST) if item.path.as_posix().endswith(name)]
        return ends[0] if ends else len(FIRST)

    items.sort(key=place)
