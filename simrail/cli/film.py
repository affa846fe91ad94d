"""``simrail film``: a piece of a ride as a page that plays it, or as a moving picture for slides."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simrail.cli.options import DONE, Seed, Settings
from simrail.core.errors import InputError

if TYPE_CHECKING:
    from simrail.report.film.film import Film


def film(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE|DIR", help="A shipped scenario, a TOML file, or a folder of results."
        ),
    ],
    from_m: Annotated[
        float | None, typer.Option("--from", metavar="M", help="Begin at this place along the track.")
    ] = None,
    to_m: Annotated[
        float | None,
        typer.Option("--to", metavar="M", help="End there; without both, a minute about the sharpest curve."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.html", help="<scenario>_film.html if not given.")
    ] = None,
    gif: Annotated[
        Path | None,
        typer.Option("--gif", metavar="FILE.gif", help="Write a moving picture for slides instead."),
    ] = None,
    method: Annotated[
        str | None, typer.Option("--method", metavar="NAME", help="The method that is shown first.")
    ] = None,
    cell: Annotated[
        int, typer.Option("--cell", metavar="NUMBER", min=0, help="Which recording of the scenario.")
    ] = 0,
    forces: Annotated[
        bool, typer.Option("--forces/--no-forces", help="Show the forces between wheels and rails.")
    ] = True,
    seed: Seed = None,
    settings: Settings = None,
) -> int:
    """Make a film of a ride: the vehicle on its rails, wheels and forces, horizon and signals in step."""
    from rich.console import Console

    from simrail.campaign.progress import ProgressWatcher
    from simrail.report.film.film import film_of, scenario_of

    _judge_places(out, gif)
    scenario = scenario_of(name, overrides=settings or [], seed=seed)
    with ProgressWatcher(Console(stderr=True)) as watcher:
        made = film_of(
            scenario, cell=cell, from_m=from_m, to_m=to_m, method=method, forces=forces, watcher=watcher
        )
    _write(made, gif or out or Path(f"{scenario.name}_film.html"), moving=gif is not None)
    return DONE


def _write(made: Film, path: Path, *, moving: bool) -> None:
    """Write the page, or the moving picture, and say what it holds."""
    from simrail.report.film.gif import pace, write_gif
    from simrail.report.film.page import write_film

    times = pace(made) if moving else 1.0
    (write_gif if moving else write_film)(path, made)
    first, last = made.reference_m[0], made.reference_m[-1]
    print(
        f"wrote {path}: {made.duration_s:.0f} s of ride {made.ride}, "
        f"{first:.0f} to {last:.0f} m, {path.stat().st_size / 1e6:.1f} MB"
        + ("" if times == 1.0 else f", plays {times:.3g} times as fast")
    )


def _judge_places(out: Path | None, gif: Path | None) -> None:
    """Refuse both at once, and files of another kind."""
    _check_ending("--out", out, ".html")
    _check_ending("--gif", gif, ".gif")
    if out is not None and gif is not None:
        raise InputError(
            "these options do not go together",
            field="--out --gif",
            limit="one of --out, --gif",
            remedy="choose one of them",
        )


def _check_ending(field: str, path: Path | None, ending: str) -> None:
    """Refuse a file of another kind, or a folder."""
    if path is not None and (path.suffix.lower() != ending or path.is_dir()):
        raise InputError("is no name of such a file", field=field, value=str(path), limit=f"FILE{ending}")
