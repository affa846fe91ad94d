"""The frame of every page: one self-contained HTML file, in which nothing is fetched when it is opened."""

from functools import cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from simrail.core.atomic_files import write_whole
from simrail.report.figures.canvas import day_and_night
from simrail.report.words.sentences import FILTERS


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("simrail.report", "."),
        autoescape=select_autoescape(default=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= FILTERS | {"swatch": partial(day_and_night, "background")}
    return environment


def page_text(template: str, **data: Any) -> str:
    """Fill a template, which extends ``pages/frame.html.j2``."""
    return _environment().get_template(template).render(data, script=_script())


@cache
def _script() -> Markup:
    """What explores rides, saves figures and opens folded parts."""
    return Markup(files("simrail.report").joinpath("pages/page.js").read_text(encoding="utf-8"))


def write_page(folder: Path, name: str, text: str) -> Path:
    """Write ``<folder>/<name>.html`` and return its path; the folder is made if it is not there.

    Raises
    ------
    InputError
        If the folder is a file, or cannot be written.
    """
    return write_whole(folder / f"{name}.html", text.encode(), what="page")
