"""A real Chromium for tests of pages: the system's, or another that is named; nothing is downloaded."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@pytest.fixture(scope="session")
def chromium() -> Iterator[object]:
    """A running browser. Where there is none a test fails, unless SIMRAIL_NO_BROWSER=1 switches it off."""
    if os.environ.get("SIMRAIL_NO_BROWSER") == "1":
        pytest.skip("SIMRAIL_NO_BROWSER=1")
    from playwright.sync_api import sync_playwright  # of the extra test: where it is missing, this fails, too

    named = os.environ.get("SIMRAIL_BROWSER")
    with sync_playwright() as play:
        places = [named] if named else [shutil.which(name) for name in NAMES]
        # One that `playwright install chromium` has put there, where the system has none.
        own = play.chromium.executable_path
        path = next((place for place in (*places, own) if place and Path(place).exists()), None)
        if path is None:
            pytest.fail("no Chromium: install one, name it in SIMRAIL_BROWSER, or set SIMRAIL_NO_BROWSER=1")
        browser = play.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()
