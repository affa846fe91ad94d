"""``simrail lesson``: serve a lesson on this machine, or tell which there are."""

import os
import secrets
import subprocess
import sys
import threading
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from simrail.cli.options import DONE
from simrail.core.atomic_files import write_whole
from simrail.core.errors import InputError, did_you_mean, one_of
from simrail.lessons import LESSONS, notebook, teacher_page
from simrail.lessons.serve import free_port, wait_for


def lesson(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Which one; lists them if not given.")
    ] = None,
    edit: Annotated[
        bool, typer.Option("--edit", help="Open its code, too, in a copy in this folder.")
    ] = False,
    headless: Annotated[
        bool, typer.Option("--headless", help="Open no browser: only say where it is served.")
    ] = False,
    port: Annotated[
        int | None, typer.Option("--port", metavar="NUMBER", min=1, max=65535, help="Port of the server.")
    ] = None,
    teacher: Annotated[bool, typer.Option("--teacher", help="Show what a teacher wants to know.")] = False,
) -> int:
    """Serve a lesson: a page with sliders, in the browser; it needs no network."""
    if teacher:
        from rich.console import Console
        from rich.markdown import Markdown

        Console().print(Markdown(teacher_page().read_text(encoding="utf-8")))
        return DONE
    if name is None:
        for number, (key, title) in enumerate(LESSONS.items(), start=1):
            print(f"{number}  {key:9}  {title}")
        return DONE
    one_of(name, LESSONS, "there is no such lesson", field="NAME", remedy=did_you_mean(name, LESSONS))
    if find_spec("marimo") is None:
        raise InputError(
            "lessons are served by marimo, which is not installed",
            field="NAME",
            value=name,
            limit="marimo installed",
            remedy="pip install 'simrail[lessons]'",
        )
    return serve(name, edit=edit, headless=headless, port=port)


def serve(name: str, *, edit: bool, headless: bool, port: int | None) -> int:
    """Serve a lesson until it is stopped; returns the exit code of the server."""
    path = own_copy(name) if edit else notebook(name)
    if not edit and port is None:
        port = free_port()  # who loads beforehand has to know it
    command = [
        sys.executable,
        "-m",
        "marimo" if edit else "simrail.lessons.serve",
        "-q" if headless else "-y",
        "edit" if edit else "run",
        str(path),
    ]
    command += ["--headless"] if headless else []
    command += ["--port", str(port)] if port is not None else []
    key = ""
    if edit and headless:
        # Whoever may edit runs code on this machine: only who is told the key may.
        password = secrets.token_urlsafe(12)
        command += ["--token-password", password]
        key = f"?access_token={password}"
    # No question whether there is a newer marimo leaves the machine; and a folder `simrail` in this one, as
    # a checkout has it, is not what is imported.
    environment = {**os.environ, "MARIMO_SKIP_UPDATE_CHECK": "1", "PYTHONSAFEPATH": "1"}
    ended = threading.Event()
    if headless and port is not None:
        told = f"serving {name} at http://127.0.0.1:{port}{key}"
        threading.Thread(target=_tell_once_served, args=(told, port, ended), daemon=True).start()
    try:
        return subprocess.call(command, env=environment) or DONE
    finally:
        ended.set()


def _tell_once_served(told: str, port: int, ended: threading.Event) -> None:
    """Print an address when its server answers: told too soon, it is refused to who opens it at once."""
    if wait_for(port, ended.is_set):
        print(told, flush=True)


def own_copy(name: str) -> Path:
    """A lesson's notebook as a file of this folder; the lesson of the package stays as it is.

    What is there already is one's own work, and is kept.

    Raises
    ------
    InputError
        If it cannot be written here.
    """
    own = Path(f"lesson_{name}.py")
    if own.exists():
        print(
            f"opens {own}, which is there already; for the lesson as it ships, give it another name",
            flush=True,
        )
        return own
    content = notebook(name).read_bytes()
    write_whole(own, content, what="copy of the lesson", field="NAME", remedy="go to another folder")
    print(f"wrote {own}, a copy of the lesson: change it as you like", flush=True)
    return own
