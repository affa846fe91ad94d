"""Ctrl-C that no library can swallow.

A C++ solver that calls back into Python turns a `KeyboardInterrupt` into an error of its own. Here the
interrupt is remembered, and raised again wherever a loop has caught an exception.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

Check = Callable[[], None]
"""Raises `KeyboardInterrupt` if there was one."""


@contextmanager
def interruptible() -> Iterator[Check]:
    """Remember Ctrl-C within a block; outside the main thread, which gets no signals, do nothing.

    Yields a `Check`, to be called wherever an exception has been caught.
    """
    interrupted = False

    def check() -> None:
        if interrupted:
            raise KeyboardInterrupt

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield check
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield check
        check()
    finally:
        signal.signal(signal.SIGINT, before)
