"""Folders of their own for tests that run scenarios; how the tests are collected."""

import gc
import os
import shutil
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


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@pytest.fixture(scope="session")
def chromium() -> Iterator[object]:
    """A running browser. Where there is none a test fails, unless SIMRAIL_NO_BROWSER=1 switches it off."""
    if os.environ.get("SIMRAIL_NO_BROWSER") == "1":
        pytest.skip("SIMRAIL_NO_BROWSER=1")
    from playwright.sync_api import sync_playwright  # of the extra test: where it is missing, this fails, too

    named = os.environ.get("SIMRAIL_BROWSER")
    with sync_playwright() as play:
        places = [named] if named else [shutil.which(name) for name in BROWSERS]
        # One that `playwright install chromium` has put there, where the system has none.
        own = play.chromium.executable_path
        path = next((place for place in (*places, own) if place and Path(place).exists()), None)
        if path is None:
            pytest.fail("no Chromium: install one, name it in SIMRAIL_BROWSER, or set SIMRAIL_NO_BROWSER=1")
        browser = play.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


FIRST = ("campaign/test_passes.py", "campaign/test_export.py")
"""Modules that compile most kernels of the estimators and of the engine: others load these from the disk."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let each of two workers compile what the other need not."""

    def place(item: pytest.Item) -> int:
        ends = [i for i, name in enumerate(FIRST) if item.path.as_posix().endswith(name)]
        return ends[0] if ends else len(FIRST)

    items.sort(key=place)
