"""``simrail list | vehicle | imu | new | cache``: what there is, and parts of your own.

What there is, is read without importing any of it, so that the answer comes at once.
"""

import ast
import tomllib
from importlib.metadata import EntryPoint, entry_points
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from simrail.cli.options import DONE, finite, judge_out, number
from simrail.core.errors import InputError

FOLDERS = {
    "scenarios": "",
    "tracks": "tracks",
    "vehicles": "vehicles",
    "imus": "imus",
    "spectra": "spectra",
}
"""Where the shipped files of each kind lie among the scenarios."""


def list_parts(
    kind: Annotated[
        str, typer.Argument(metavar="[KIND]", help=f"One of {', '.join((*FOLDERS, 'estimators'))}.")
    ] = "",
    bibtex: Annotated[
        bool, typer.Option("--bibtex", help="Of estimators: BibTeX of what they rest on, to copy.")
    ] = False,
) -> int:
    """Show the scenarios, tracks, vehicles, IMUs, published spectra and estimators that are there."""
    from rich.console import Console

    from simrail.core.errors import one_of

    kinds = (*FOLDERS, "estimators")
    wanted = f"{kind}s" if f"{kind}s" in kinds else kind
    if wanted:
        one_of(wanted, kinds, "there is no such kind", field="KIND")
    if bibtex:
        if wanted not in ("", "estimators"):
            raise InputError(
                "belongs to estimators",
                field="--bibtex",
                limit="simrail list estimators --bibtex",
                remedy="leave it out, or list estimators",
            )
        print(_bibtex())
        return DONE
    console = Console(highlight=False)
    shown = {name: entries for name, entries in catalogue().items() if wanted in ("", name)}
    for kind, entries in shown.items():
        console.print(f"[bold]{kind}[/bold]")
        width = max((len(name) for name in entries), default=0)
        for name, title in entries.items():
            console.print(f"  [cyan]{name:{width}}[/cyan]  ", end="")
            console.print(title, markup=False, overflow="ignore", crop=False, no_wrap=True)
    return DONE


def _bibtex() -> str:
    """What all registered estimators rest on: who cites what as comments, then the entries."""
    from simrail.estimation.bibliography import citations, entries
    from simrail.estimation.estimate import estimator_class, registered

    cites: dict[str, tuple[str, ...]] = {}
    for name in registered():
        try:
            told = getattr(estimator_class(name), "cites", ())
        except ImportError:  # of a package that lacks what it needs
            continue
        cites[name] = told if isinstance(told, tuple) else ()
    lines = [f"% {one.method}: {one.words}" for one in citations(cites.items())]
    return "\n".join([*lines, "", entries(cites.values())])


def open_page(
    place: Annotated[
        Path | None,
        typer.Argument(
            metavar="[DIR|FILE]", help="Results or a page; the newest under results/ if not given."
        ),
    ] = None,
) -> int:
    """Open the page of results in the browser."""
    from simrail.core.errors import InputError

    if place is None:
        pages = sorted(Path("results").glob("*/report.html"), key=lambda page: page.stat().st_mtime)
        page = pages[-1] if pages else Path("results") / "report.html"
    else:
        page = place / "report.html" if place.is_dir() or not place.suffix else place
    if not page.is_file():
        raise InputError(
            "there is no page",
            field="DIR|FILE",
            value=page.as_posix(),
            limit="a folder with report.html, or a page",
            remedy="run a scenario first, e.g. simrail run quick_kinematic",
        )
    print(f"opens {page}")
    typer.launch(page.resolve().as_uri())
    return DONE


def catalogue() -> dict[str, dict[str, str]]:
    """Return name -> title for each kind: scenarios, tracks, vehicles, imus, spectra, estimators."""
    home = Path(str(files("simrail.scenarios")))
    titles = {
        kind: {path.stem: _toml_title(path) for path in sorted((home / folder).glob("*.toml"))}
        for kind, folder in FOLDERS.items()
    }
    entries = sorted(entry_points(group="simrail.estimators"), key=lambda entry: entry.name)
    titles["estimators"] = {entry.name: _class_title(entry) for entry in entries}
    return titles


def _toml_title(path: Path) -> str:
    try:
        title = tomllib.loads(path.read_text(encoding="utf-8")).get("title", "")
    except (OSError, ValueError):
        return "(cannot be read)"
    return str(title)


def _class_title(entry: EntryPoint) -> str:
    """First line of a class's docstring, read from its source."""
    try:
        spec = find_spec(entry.module)
        source = Path(spec.origin).read_text(encoding="utf-8") if spec and spec.origin else ""
    except (ImportError, OSError, ValueError):
        return "(not installed)"
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ClassDef) and node.name == entry.attr:
            return (ast.get_docstring(node) or "").split("\n")[0]
    return ""


def vehicle(
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE", help="A shipped vehicle, or the path of a TOML file.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Write an HTML page with figures there, too.")
    ] = None,
    speed: Annotated[
        float,
        typer.Option(
            "--speed", metavar="KMH", min=1.0, max=1000.0, callback=finite, help="Speed of the mode table."
        ),
    ] = 80.0,
    top: Annotated[
        float,
        typer.Option(
            "--to", metavar="KMH", min=10.0, max=1000.0, callback=finite, help="Highest speed searched."
        ),
    ] = 400.0,
) -> int:
    """Show a vehicle: masses, wheel loads, natural frequencies, conicity and critical speed."""
    from rich.console import Console

    from simrail.campaign.progress import ProgressWatcher
    from simrail.core.toml_files import blame, find, judge, label, read_toml
    from simrail.report.tables.vehicle_text import print_study
    from simrail.vehicle.file import VehicleFile
    from simrail.vehicle.study import study_vehicle

    judge_out(out)
    path = find("vehicle", name)
    model = judge(VehicleFile, read_toml(path), file=label(path)).model(path.stem)
    page = None
    with ProgressWatcher(Console(stderr=True)) as watcher:
        with blame(label(path), "vehicle"):
            study = study_vehicle(model, running_mps=speed / 3.6, top_mps=top / 3.6, progress=watcher.works)
        if out is not None:
            from simrail.report.pages.vehicle_page import write_vehicle_page

            watcher.works("page")
            page = write_vehicle_page(out, study)
    print_study(Console(), study)
    if page is not None:
        print(f"wrote {page}")
    return DONE


def imu(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME|FILE", help="A shipped IMU, or the path of a TOML file.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Write an HTML page with its Allan deviation there, too."),
    ] = None,
    from_rest: Annotated[
        Path | None,
        typer.Option(
            "--from-rest",
            metavar="RECORDING",
            help="Fit noise, bias instability, random walk and counts to your own recording at rest: a ride "
            "file (of which \\[imu] alone counts) or a CSV. With --out, the sheet is written there, too.",
        ),
    ] = None,
) -> int:
    """Show an IMU grade in the units of data sheets, and what was assumed; or fit one to a rest."""
    from rich.console import Console

    if (name is None) == (from_rest is None):
        raise InputError(
            "needs either a name or a recording",
            field="NAME",
            value=name,
            limit="NAME or --from-rest, not both",
            remedy="e.g. simrail imu lord_3dm_gx4_25, or simrail imu --from-rest rest.csv",
        )
    if from_rest is not None:
        from simrail.cli.imu_from_rest import imu_from_rest

        return imu_from_rest(from_rest, out)
    assert name is not None

    from simrail.recording.sheets.imu_file import load_imu
    from simrail.report.tables.imu_text import print_imu

    judge_out(out)
    file, grade = load_imu(name)
    print_imu(Console(), file, grade)
    if out is not None:
        from simrail.report.pages.imu_page import write_imu_page

        print(f"wrote {write_imu_page(out, file, grade)}")
    return DONE


def new(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="estimator, odometry, track, vehicle, imu, scenario, ride.")
    ],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Its name, e.g. my_filter.")],
    folder: Annotated[Path, typer.Option("--in", metavar="DIR", help="Where to write it.")] = Path(),
    source: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="FILE", help="Of a track: LandXML, IFC 4.3 or a CSV of curvature and cant."
        ),
    ] = None,
    alignment: Annotated[
        str | None, typer.Option(metavar="NAME", help="Which one, of a LandXML or IFC file with several.")
    ] = None,
    step_smoothing: Annotated[
        float | None,
        typer.Option(
            metavar="M", help="Length over which its steps of curvature are smoothed; 5 m if not said."
        ),
    ] = None,
) -> int:
    """Write a working template: one file, to be changed into your own part."""
    from simrail.cli.templates import write_template, write_track

    if kind == "track" and source is not None:
        path, notes = write_track(
            name, source, folder=folder, alignment=alignment, step_smoothing_m=step_smoothing
        )
        print(
            "\n".join([f"wrote {path}", *notes, f'use it in a scenario beside it: track = "./{path.name}"'])
        )
        return DONE
    for option, value in (
        ("--from", source),
        ("--alignment", alignment),
        ("--step-smoothing", step_smoothing),
    ):
        if value is not None:
            remedy = "simrail new track NAME --from FILE"
            raise InputError(
                "belongs to a track from a file",
                field=option,
                value=str(value),
                limit="only for simrail new track with --from",
                remedy=remedy,
            )
    written, next_step = write_template(kind, name, folder=folder)
    print(f"wrote {written}\n{next_step}")
    return DONE


def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Drop all simulated rides.")] = False,
) -> int:
    """Show the cache of simulated rides, or clear it."""
    from simrail.ride import cache as ride_cache

    if clear:
        print(f"freed {ride_cache.clear() / 1e6:.0f} MB")
        return DONE
    rides = ride_cache.rides()
    for ride in rides:
        print(f"{ride.size_bytes / 1e6:8.0f} MB  {ride.key[:12]}  {ride.name}")
    total = sum(ride.size_bytes for ride in rides)
    print(
        f"{number(len(rides), 'ride')}, {total / 1e6:.0f} MB of at most "
        f"{ride_cache.limit_bytes() / 1e9:g} GB (SIMRAIL_CACHE_GB), in {ride_cache.folder()}"
    )
    return DONE
