"""Serve a lesson by marimo, and load what it needs while the browser still loads the page.

    python -m simrail.lessons.serve run NOTEBOOK --port NUMBER [what else marimo takes]

marimo runs a notebook when a browser is connected, seconds after the server answers; it runs it in a thread
of the server, so that modules which another thread has loaded by then are there.
"""

import gc
import importlib.util
import runpy
import socket
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

POLL_S = 0.02
"""Between two looks whether a server answers."""

LONGEST_WAIT_S = 60.0
"""For the server to answer; one that has not by then has nothing to be made ready for."""

SWITCH_S = 0.0005
"""Between threads: python's usual 5 ms would hold up the hundreds of small files that a browser asks for."""


def answers(port: int) -> bool:
    """Whether a server listens on a port of this machine."""
    with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
        return True
    return False


def wait_for(port: int, gives_up: Callable[[], bool]) -> bool:
    """Wait until a server answers; whether it does, before ``gives_up`` says to wait no longer."""
    while not answers(port):
        if gives_up():
            return False
        time.sleep(POLL_S)
    return True


def load(notebook: Path) -> None:
    """Load what a notebook's setup loads, in its order; what is wrong with it, it tells when it is run.

    (In its order, since two threads that load the same modules one after the other wait for each other and
    cannot lock each other out.)
    """
    spec = importlib.util.spec_from_file_location(f"_{notebook.stem}_beforehand", notebook)
    if spec is not None and spec.loader is not None:
        with suppress(Exception):
            spec.loader.exec_module(importlib.util.module_from_spec(spec))


def load_once_served(notebook: Path, port: int) -> None:
    """Wait for the server, then `load`: before, it would only make the server late."""
    until = time.monotonic() + LONGEST_WAIT_S
    if not wait_for(port, lambda: time.monotonic() > until):
        return
    usual = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    gc.disable()  # of modules that stay nothing is garbage: to search them takes a tenth of the time
    load(notebook)
    gc.enable()
    sys.setswitchinterval(usual)


def free_port() -> int:
    """A port that nothing on this machine listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def main(arguments: list[str]) -> None:
    """Run marimo with these arguments, and load the notebook that they name beside it."""
    notebook = Path(arguments[arguments.index("run") + 1])
    port = int(arguments[arguments.index("--port") + 1])
    threading.Thread(target=load_once_served, args=(notebook, port), daemon=True).start()
    sys.argv = ["marimo", *arguments]
    runpy.run_module("marimo", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main(sys.argv[1:])
