"""A plugin of pytest for the mutation run: ends tests that take too long, on the processor.

A loaded machine shall change no verdict, so that no time of a clock is asked for. Under `coverage run` it
also tells coverage which test is run, and whether it is the test or its fixtures.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Generator

import pytest
from coverage import Coverage

MOST_S = float(os.environ.get("MUTATION_TEST_S", "0"))


class TooLong(BaseException):
    """Not an `Exception`: nothing on the way shall take it for an error of its own."""


def _ended(*_: object) -> None:
    raise TooLong


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, object, object]:
    return (yield from _limited(f"{item.nodeid}|setup"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    return (yield from _limited(f"{item.nodeid}|call"))


def _limited(context: str) -> Generator[None, object, object]:
    coverage = Coverage.current()
    if coverage is not None:
        coverage.switch_context(context)
    if not MOST_S:
        return (yield)
    before = signal.signal(signal.SIGPROF, _ended)
    signal.setitimer(signal.ITIMER_PROF, MOST_S)
    try:
        return (yield)
    except TooLong:
        pytest.fail("took too long", pytrace=False)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
