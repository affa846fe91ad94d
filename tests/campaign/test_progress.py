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


def test_what_is_left_counts_what_a_stop_rule_may_still_ask_for(clock: list[float]) -> None:
    """A look at 20 of 60 cells, a second each: never less is left than it turns out to take at most."""
    watcher, stream = watched()
    with watcher:
        for done, count in ((0, 20), (20, 30)):
            watcher.may_come_to(60)
            watcher.cells_begin(done, count)
            clock[0] += count - done
            watcher.cells_done(count, count, 0, "here")
        watcher.cells_begin(0, 5)  # something else, after the rule has ended it
        clock[0] += 50.0
        watcher.cells_done(5, 5, 0, "here")
    first, second, other = stream.getvalue().splitlines()
    assert first.startswith("cells: 20 of 20 (at most 60)") and "0:00:00 left, at most 0:00:40" in first
    # At the pace of all that was run, not of the ten alone.
    assert second.startswith("cells: 30 of 30 (at most 60)") and "1 per second" in second
    assert "at most 0:00:30" in second
    assert "at most" not in other and "0.1 per second" in other


def test_what_is_left_follows_the_pace_of_late(clock: list[float]) -> None:
    """A hundred cells at a second each, then five minutes and more at eleven: ten more take 110 s."""
    watcher, stream = watched()
    with watcher:
        watcher.cells_begin(0, 140)
        for done in range(1, 131):
            clock[0] += 1.0 if done <= 100 else 11.0
            watcher.cells_done(done, 140, 0, "here")
    assert "130 of 140, 0 failed, 0.302 per second, 0:01:50 left" in stream.getvalue().splitlines()[-1]


def test_nothing_is_foretold_from_the_first_cell(clock: list[float]) -> None:
    """It waits for a ride and for kernels to compile: two minutes, where the others take a second each."""
    watcher, stream = watched()
    with watcher:
        watcher.cells_begin(0, 120)
        for done, after in ((1, 120.0), (2, 1.0), (14, 12.0)):
            clock[0] += after
            watcher.cells_done(done, 120, 0, "here")
    first, later = stream.getvalue().splitlines()
    assert first == "cells: 1 of 120, 0 failed, 0.00833 per second"
    assert "14 of 120" in later and " left" in later
