"""Pages that are made of the package: every key of every file, every method, every public name.

They are written into folders that git does not keep, when a build begins.
"""

import tomllib
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from method_pages import cell, pages
from sphinx.application import Sphinx

import simrail
from simrail.scenario.file_keys import FILES, Key, keys_of

WHAT = {
    "scenario": "A scenario says what is run: track, vehicle, rides, sensors, methods, and what is scored.",
    "track": "A track is its design: plan, cant and gradients.",
    "vehicle": "A vehicle is axles, bodies, and what lies between them.",
    "imu": "An IMU is what its data sheet says.",
    "ride": "A ride file says what a logger of a real train wrote, and how the devices sat.",
    "spectrum": "A published spectrum of vibration.",
}

VALIDATION = """Physics and noise are checked against closed forms, published figures and independent code,
not against our own last output. Each line names the test, or the command, that shows it; a command's page
says where a claim falls."""


def write(path: Path, text: str) -> None:
    """Write a page, unless it is there already: what did not change is not built again."""
    path.parent.mkdir(exist_ok=True)
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)


def drop_others(folder: Path, kept: Iterable[str]) -> None:
    """Remove pages of a folder that are made no more: a build would read them, too."""
    for page in folder.glob("*.*"):
        if page.name not in kept:
            page.unlink()


def table(keys: Iterable[Key]) -> str:
    """The keys of one table."""
    lines = ["| key | what is written there | if left out | meaning |", "|---|---|---|---|"]
    for key in keys:
        without = "must be there" if key.required else f"`{key.default}`" if key.default else ""
        lines.append(f"| `{key.name}` | {cell(key.form)} | {without} | {cell(key.meaning)} |")
    return "\n".join(lines)


def keys_page(kind: str) -> str:
    """Every key of a kind of file."""
    parts = [f"# Keys of a {kind} file", WHAT[kind]]
    parts.append(
        f"`simrail new {kind} NAME` writes one to start from; `simrail schema {kind}` is for editors."
    )
    for shown, keys in groupby(keys_of(kind), key=lambda key: key.table):
        parts += [f"## `{shown}`" if shown else "## Above all tables", table(keys)]
    return "\n\n".join(parts) + "\n"


def validation_page(here: Path) -> str:
    """What is claimed, and what shows it.

    Raises
    ------
    ValueError
        If a claim names a test that is not there.
    """
    claims = tomllib.loads((here / "claims.toml").read_text())["claim"]
    parts = ["# Validation", VALIDATION]
    for subject, group in groupby(claims, key=lambda claim: str(claim["subject"])):
        lines = [f"## {subject.capitalize()}", "", "| claim | checked against | shown by |", "|---|---|---|"]
        for claim in group:
            if "test" in claim:
                file, _, name = claim["test"].partition("::")
                source = here.parent / file
                if not source.is_file() or (name and f"def {name}(" not in source.read_text()):
                    raise ValueError(f"claims.toml names a test that is not there: {claim['test']}")
                shown = f"`pytest -n 0 -m '' {claim['test']}`"
            else:
                shown = f"`{claim['command']}`"
            lines.append(f"| {claim['says']} | {claim['against']} | {shown} |")
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def build(app: Sphinx) -> None:
    """Write all of them."""
    here = Path(app.srcdir)
    for kind in FILES:
        write(here / "keys" / f"{kind}.md", keys_page(kind))
    write(here / "validation.md", validation_page(here))
    toc = "\n".join(FILES)
    write(here / "keys" / "index.md", f"# Every key of every file\n\n```{{toctree}}\n{toc}\n```\n")
    drop_others(here / "methods", made := pages(here))
    for name, text in made.items():
        write(here / "methods" / name, text)
    public = "\n".join(f".. autoclass:: simrail.{name}\n   :no-index:\n" for name in classes())
    verbs = "\n".join(f".. autofunction:: simrail.{name}\n   :no-index:\n" for name in functions())
    head = "===\nAPI\n===\n\n.. automodule:: simrail\n   :no-members:\n"
    page = f"{head}\nVerbs\n=====\n\n{verbs}\nNouns\n=====\n\n{public}"
    write(here / "api" / "index.rst", page)


def classes() -> list[str]:
    """Public nouns."""
    return [name for name in simrail.__all__ if name[0].isupper() and name != "COLUMNS"]


def functions() -> list[str]:
    """Public verbs."""
    return [name for name in simrail.__all__ if name[0].islower()]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("builder-inited", build)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
