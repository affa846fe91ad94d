"""``simrail figure``: a figure of finished results as a file, without running anything again."""

import difflib
from pathlib import Path
from typing import Annotated

import typer

from simrail.cli.options import DONE
from simrail.core.errors import InputError

FORMS = (".svg", ".pdf", ".png")
PAGES = ("report.html", "estimate.html")


def figure(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="Folder of results, or of an estimate.")],
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which figure; all names are told without one.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="An .svg, .pdf or .png file.")
    ] = None,
) -> int:
    """Write a figure of results as a file: simrail figure results/go20a answer --out answer.pdf."""
    from simrail.report.figures import canvas

    if out is not None and out.suffix not in FORMS:
        raise InputError("no such form of a figure", field="--out", value=str(out), limit=", ".join(FORMS))
    if out is not None and name is None:
        raise InputError(
            "is for one figure, and none is named",
            field="--out",
            value=str(out),
            limit="RESULTS NAME --out FILE",
            remedy=f"name one of those that 'simrail figure {results}' lists, e.g. answer",
        )
    path = out or Path(f"{name}.svg")
    with canvas.only(name or "", path) as order:
        _offer(results)
    if name is None:
        print("\n".join(order.names))
        return DONE
    if not order.written:
        like = difflib.get_close_matches(name, order.names, n=1)
        raise InputError(
            "the results have no such figure",
            field="NAME",
            value=name,
            limit=", ".join(order.names),
            remedy=f"did you mean {like[0]}?" if like else "name one of these",
        )
    print(f"wrote {path}")
    return DONE


def _offer(results: Path) -> None:
    """Offer all figures of a folder to the one that is wanted."""
    from simrail.report.pages.explorer import ride_figures, stored_rides

    page = next((results / name for name in PAGES if (results / name).is_file()), None)
    if page is None:
        remedy = "run a scenario, or estimate a ride, first"
        raise InputError(
            "there is no page of results there",
            field="RESULTS",
            value=str(results),
            limit="a folder that holds " + " or ".join(PAGES),
            remedy=remedy,
        )
    views, looks = stored_rides(page.read_text(encoding="utf-8"))
    if page.name == PAGES[0]:
        import pandas as pd

        from simrail.campaign.stored_results import read_results
        from simrail.report.pages.page import sections_of
        from simrail.report.pages.section import PageData

        stored = read_results(results, field="RESULTS", remedy="run the scenario again")
        budgets = results / "budget.csv"
        sections_of(
            PageData(
                stored.scenario(),
                stored.scores,
                stored.cells,
                [],
                stored.manifest,
                budgets=pd.read_csv(budgets) if budgets.is_file() else None,
                stored_views=views,
            )
        )
    ride_figures(views, looks)
