"""What the command line shows of long work: nothing of what is quick, a line now and then of what is not."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from simrail.campaign.progress import SILENT_S, ProgressWatcher


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr("simrail.campaign.progress.time.perf_counter", lambda: now[0])
    return now


def watched(width: int = 200) -> tuple[ProgressWatcher, io.StringIO]:
    stream = io.StringIO()
    return ProgressWatcher(Console(file=stream, width=width)), stream


def test_quick_work_is_not_told_and_long_work_every_ten_seconds(clock: list[float]) -> None:
    watcher, stream = watched()
    with watcher:
        for share in (0.0, 0.5, 0.9):
            watcher.works("page", share)
            clock[0] += 0.45 * SILENT_S
        assert stream.getvalue() == ""
        for share in (0.1, 0.2, 0.3, 0.4):
            watcher.works("root locus", share)
            clock[0] += 6.0
    # At once after two seconds, then again when ten have passed.
    assert stream.getvalue().splitlines() == ["root locus: 20 %", "root locus: 40 %"]


def test_a_search_says_before_how_long_it_will_take_and_what_is_left(clock: list[float]) -> None:
    watcher, stream = watched()
    with watcher:
        watcher.search_begins("all", 0.5, 240)
        for count in (40, 80, 120):
            clock[0] += 20.0
            watcher.search_goes("all", count, -1.25)
    first, *later = stream.getvalue().splitlines()
    assert first.startswith("search, all: some 240 evaluations of 0.5 s each: about 0:02:00")
    # 120 evaluations took a minute: the other half takes another.
    assert later[-1] == "search, all: 120 evaluations, -1.250000, some 0:01:00 left"
