"""Folders of their own for tests that run scenarios; how the tests are collected."""

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest


def pytest_configure() -> None:
    """Collecting the tests makes millions of objects that stay: looking for garbage among them is a fifth
    of its time, in each worker."""
    gc.disable()


def pytest_collection_finish() -> None:
    """From here on garbage is looked for as ever, but not among what was collected."""
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
