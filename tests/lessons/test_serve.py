"""What a lesson needs is loaded while the browser loads the page: once the server answers, and not before."""

import runpy
import socket
import sys
import threading
import time

from simrail.lessons import serve


def test_loads_once_the_server_answers_and_leaves_threads_as_they_were(tmp_path):
    notebook, port = tmp_path / "notebook.py", serve.free_port()
    notebook.write_text(f"from pathlib import Path\nPath({str(tmp_path / 'loaded')!r}).touch()\n")
    interval = sys.getswitchinterval()
    beside = threading.Thread(target=serve.load_once_served, args=(notebook, port))
    beside.start()
    time.sleep(0.1)
    assert not (tmp_path / "loaded").exists()
    with socket.create_server(("127.0.0.1", port)):
        beside.join(timeout=20.0)
    assert (tmp_path / "loaded").exists()
    assert sys.getswitchinterval() == interval


def test_a_notebook_that_cannot_be_loaded_is_left_to_marimo(tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text("import no_such_module_at_all\n")
    serve.load(broken)
    serve.load(tmp_path / "not_there.py")


def test_a_server_that_never_answers_is_not_waited_for_for_ever(tmp_path, monkeypatch):
    monkeypatch.setattr(serve, "LONGEST_WAIT_S", 0.05)
    monkeypatch.setattr(serve, "load", lambda notebook: 1 / 0)
    serve.load_once_served(tmp_path / "notebook.py", serve.free_port())


def test_marimo_gets_its_arguments_as_they_are(monkeypatch):
    begun, told = [], []
    monkeypatch.setattr(serve, "load_once_served", lambda *where: begun.append(where))
    monkeypatch.setattr(runpy, "run_module", lambda name, **more: told.append((name, sys.argv)))
    monkeypatch.setattr(sys, "argv", sys.argv)
    arguments = ["-q", "run", "lesson.py", "--headless", "--port", "2718"]
    serve.main(arguments)
    assert told == [("marimo", ["marimo", *arguments])]
    assert [(path.name, port) for path, port in begun] == [("lesson.py", 2718)]
