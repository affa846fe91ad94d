"""The page of each method: what it estimates and needs, equations, figures, options, and how to cite it.

Equations are written by hand (``method_equations/NAME.md``); figures and numbers come from `method_runs`;
all else is the estimator's own: its docstrings, its fields, what it says of itself.
"""

import re
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from importlib import import_module
from pathlib import Path
from typing import Any

from method_runs import shown
from numpydoc.docscrape import NumpyDocString

from simrail.cli.library import catalogue
from simrail.estimation.bibliography import SOURCES, Source
from simrail.estimation.estimate import Description, description_of, estimator_class, registered

NOT_AN_AVERAGE = """One device, one map, one short ride without the short waves that shake a train:
figures and numbers here show how a method behaves, made anew when this guide is built. How good it is
on average, on trains that shake, is what campaigns say (`simrail run track_relative`, `simrail run
odometry` and others)."""

ELSEWHERE = """Signs, axes and symbols: [Conventions](../conventions.md). All methods on one sheet,
in the form of the code, with every misprint found: [Equations](../equations.md). Papers are
numbered there, and in the program: 000 Briales et al. 2021, 001 Gonzalez-Carbajal et al. 2023, 003
Veillard et al. 2016, 004 Hidalgo et al."""

INDEX = """# The methods

Each page says what a method estimates and needs, its equations, what it is good and bad at on one short
ride, its options, and how to cite it. [Where the train is](../place.md) says which odometry is for what.

| method | is | estimates |
|:--|:--|:--|
{rows}

```{{toctree}}
:hidden:
{hidden}
```
"""

ROLES = {
    "method": "method under test",
    "baseline": "baseline: what every method has to beat",
    "general_purpose": "general-purpose filter: knows nothing of trains",
    "ablation": "ablation",
}


def names() -> list[str]:
    """The shipped methods, as `simrail list estimators` has them."""
    return [name for name in catalogue()["estimators"] if registered()[name].value.startswith("simrail.")]


def cell(text: str) -> str:
    """Text that can stand in a table of Markdown."""
    return text.replace("|", "\\|").replace("\n", " ").replace("<", "&lt;").replace("*", "\\*")


def code(text: str) -> str:
    """What reStructuredText and docstrings write as code, as Markdown does."""
    return re.sub(r"``(.+?)``", r"`\1`", text)


def options(name: str) -> str:
    """The options with their defaults: fields of the class, described by its docstring."""
    made = estimator_class(name)
    told: dict[str, tuple[str, str]] = {}
    for entry in NumpyDocString(_plain(made.__doc__ or ""))["Attributes"]:
        for one in entry.name.split(","):
            told[one.strip()] = (entry.type, code(" ".join(entry.desc)))
    items = []
    for field in fields(made):  # type: ignore[arg-type]
        kind, meaning = told[field.name]
        told_of = "; ".join(filter(None, (kind.removesuffix(", optional"), _default(field))))
        items.append(f"`{field.name}` ({told_of})\n: {meaning}")
    return "\n\n".join(items) or "It has none."


def _default(field: Field[Any]) -> str:
    """What an option is if nobody gives it."""
    if field.default_factory is not MISSING:
        return f"`{field.default_factory.__name__}()`"
    if field.default is None:
        return "none"
    return "must be given" if field.default is MISSING else f"`{_shown(field.default)}`"


def _plain(docstring: str) -> str:
    """A docstring without its indent."""
    lines = docstring.splitlines()
    return "\n".join([lines[0], *(line.removeprefix("    ") for line in lines[1:])])


def _shown(value: object) -> str:
    """A default as a scenario would write it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else repr(value).replace("'", '"')


def speaks_of(page: Mapping[str, Any]) -> str:
    """What it estimates: columns of its estimate."""
    columns = [column for column in page["columns"] if "_sd_" not in column]
    text = ", ".join(f"`{column}`" for column in columns)
    if any("_sd_" in column for column in page["columns"]):
        text += ", with standard deviations"
    rails = [column for column in page["rails"] if "_sd_" not in column]
    return text + (f"; rails: {', '.join(f'`{column}`' for column in rails)}" if rails else "")


def facts(name: str, about: Description, page: Mapping[str, Any], *, causal: bool) -> str:
    """What it estimates and needs, in a table."""
    needs = ["an IMU"] if about.uses_imu else []
    needs += [need.replace("_", " ") for need in about.needs]
    rows = {
        "estimates": speaks_of(page),
        "needs": ", ".join(needs) or "nothing",
        "causal": "yes: a state uses nothing recorded later"
        if causal
        else "no: it looks back from the end of the ride",
        "is a": ROLES[about.role],
        "source": f"`{registered()[name].value.partition(':')[0]}`",
    }
    lines = "\n".join(f"* - {key}\n  - {value}" for key, value in rows.items())
    return f"```{{list-table}}\n:stub-columns: 1\n:widths: auto\n:align: left\n\n{lines}\n```"


def figure(svg: str, caption: str) -> str:
    """A figure as raw HTML."""
    return f'```{{raw}} html\n<figure class="shown">{svg}<figcaption>{caption}</figcaption></figure>\n```'


def equations(here: Path, name: str) -> str:
    """The equations of a method."""
    shared = (here / "method_equations" / "_compensation.md").read_text().strip()
    return (here / "method_equations" / f"{name}.md").read_text().replace("{{compensation}}", shared).strip()


def example(name: str, page_options: Mapping[str, object]) -> str:
    """How a scenario names it."""
    lines = ["```toml", "[[estimator]]", 'name = "mine"', f'method = "{name}"']
    if page_options:
        lines.append("[estimator.options]")
        lines += [f"{key} = {_shown(value)}" for key, value in page_options.items()]
    return "\n".join([*lines, "```"])


def citations(about: Description) -> str:
    """BibTeX of what it rests on, with a link to each publication that has one.

    Raises
    ------
    ValueError
        If it cites what ``simrail.estimation.bibliography`` does not hold.
    """
    missing = [key for key in about.cites if key not in SOURCES]
    if missing:
        raise ValueError(f"simrail.estimation.bibliography lacks what a method cites: {missing}")
    if not about.cites:
        return "Nothing but simrail itself: see `CITATION.cff`."
    return "\n\n".join(_citation(SOURCES[key]) for key in dict.fromkeys(about.cites))


def _citation(source: Source) -> str:
    """A BibTeX entry, with a link to the paper where it has one."""
    doi = source.fields.get("doi")
    link = f"[doi:{doi}](https://doi.org/{doi})\n\n" if doi else ""
    return f"{link}```bibtex\n{source.bibtex}\n```"


def method_page(here: Path, name: str, title: str, page: Mapping[str, Any]) -> str:
    """The page of one method."""
    chosen = page["options"]
    estimator = estimator_class(name)(**chosen)
    about = description_of(estimator)
    module = registered()[name].value.partition(":")[0]
    band = " (the grey band is the full curve of the line, the coloured one the method's own 95 % interval)"
    no_interval = " (the grey band is the full curve; the method has no interval of it)"
    parts = [
        f"# {name}",
        title,
        facts(name, about, page, causal=estimator.causal),
        figure(
            page["shape"],
            f"Its {page['quantity']}, true and estimated{band if page['has_interval'] else no_interval}.",
        ),
        page["ride"] + " " + NOT_AN_AVERAGE,
        "## How it works",
        f"```{{eval-rst}}\n.. automodule:: {module}\n   :no-members:\n   :no-index:\n```"
        if (import_module(module).__doc__ or "").count("\n") > 3
        else "",
        "## Equations",
        equations(here, name),
        ELSEWHERE,
        "## Good at, bad at",
        figure(page["beside"], f"Its error of {page['compares']} beside others, on that ride.")
        if page["beside"]
        else "",
        "\n".join(
            [*(f"* **Good.** {one}" for one in page["good"]), *(f"* **Bad.** {one}" for one in page["bad"])]
        ),
        f"```{{table}}\n:class: scores\n\n{page['scores']}\n```",
        "## Options",
        example(name, chosen),
        options(name),
        "## To cite",
        citations(about),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def pages(here: Path) -> dict[str, str]:
    """Every page of ``methods/``, by its file's name.

    Raises
    ------
    ValueError
        If a method has no line in ``methods.toml``, or that file names one that there is not.
    """
    runs, titles = shown(here), catalogue()["estimators"]
    if set(runs) != set(names()):
        raise ValueError(f"methods.toml is not of the methods that there are: {set(runs) ^ set(names())}")
    made = {f"{name}.md": method_page(here, name, code(titles[name]), runs[name]) for name in names()}
    rows = "\n".join(
        f"| [{name}]({name}.md) | {cell(code(titles[name]))} | {cell(speaks_of(runs[name]))} |"
        for name in names()
    )
    made["index.md"] = INDEX.format(rows=rows, hidden="\n".join(names()))
    return made
