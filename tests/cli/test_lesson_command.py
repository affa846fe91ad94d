"""What is told of a lesson's server, and when."""

import subprocess
import sys

from simrail.cli.lesson import _answers
from simrail.lessons.serve import free_port

_LATE = """
import socket, sys, time
time.sleep(0.4)
print("listens", flush=True)
with socket.create_server(("127.0.0.1", int(sys.argv[1]))) as server:
    server.accept()
"""


def test_an_address_is_told_only_when_the_server_answers() -> None:
    port = free_port()
    with subprocess.Popen([sys.executable, "-c", _LATE, str(port)], stdout=subprocess.PIPE) as server:
        assert _answers(port, server)
        assert server.stdout is not None and server.stdout.read() == b"listens\n"


def test_a_server_that_ends_at_once_is_not_waited_for() -> None:
    with subprocess.Popen([sys.executable, "-c", "raise SystemExit(3)"]) as server:
        assert not _answers(free_port(), server)
