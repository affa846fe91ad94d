"""A real Chromium for tests of pages: Debian's, or another that is named; nothing is downloaded."""

import os
import shutil
from collections.abc import Iterator

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@pytest.fixture(scope="session")
def chromium() -> Iterator[object]:
    """A running browser. Where there is none a test fails, unless SIMRAIL_NO_BROWSER=1 switches it off."""
    if os.environ.get("SIMRAIL_NO_BROWSER") == "1":
        pytest.skip("SIMRAIL_NO_BROWSER=1")
    named = os.environ.get("SIMRAIL_BROWSER")
    path = named or next((place for name in NAMES if (place := shutil.which(name))), None)
    if path is None:
        pytest.fail("no Chromium: install one, name it in SIMRAIL_BROWSER, or set SIMRAIL_NO_BROWSER=1")
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs the extra test")
    with sync_api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()
