"""When a lesson's address is told."""

import socket
import threading
import time

import pytest

from simrail.cli.lesson import _tell_once_served
from simrail.lessons.serve import free_port


def test_an_address_is_told_when_the_server_answers_and_not_before(
    capsys: pytest.CaptureFixture[str],
) -> None:
    port, ended = free_port(), threading.Event()
    teller = threading.Thread(target=_tell_once_served, args=("here", port, ended))
    teller.start()
    time.sleep(0.3)
    assert capsys.readouterr().out == ""
    with socket.create_server(("127.0.0.1", port)):
        teller.join()
    assert capsys.readouterr().out == "here\n"


def test_a_server_that_ends_is_not_waited_for(capsys: pytest.CaptureFixture[str]) -> None:
    ended = threading.Event()
    ended.set()
    _tell_once_served("here", free_port(), ended)
    assert capsys.readouterr().out == ""
