"""``simrail estimate``: methods on recorded rides; what is printed of them."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simrail.cli.options import DONE, Form, form_of
from simrail.core.errors import InputError, one_of

if TYPE_CHECKING:
    from rich.console import Console

    from simrail.recording.files.frame_file import Format
    from simrail.report.pages.estimate_page import RideEstimates
    from simrail.report.tables.recorded import TextTable

WIDEST = 110
"""Characters of a line that tables keep to where the terminal does not say how wide it is."""

MOST_PLACES = 8
"""Places beyond a limit that are printed; the file has all."""


def estimate(
    rides: Annotated[
        list[Path],
        typer.Argument(metavar="RIDE.toml", help="A ride file, or a folder that holds a ride.toml."),
    ],
    estimators: Annotated[
        list[str] | None,
        typer.Option(
            "--estimator",
            metavar="NAME",
            help="A registered estimator, one of the ride file, or FILE.py:CLASS; several stand side by "
            "side. Those of the ride file, or TrackRelativeSmoother, if not given. Repeatable.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Its folder; results/<ride>_<estimator> if not given."),
    ] = None,
    form: Form = "csv",
    units: Annotated[
        str,
        typer.Option("--units", metavar="deg,mm", help="Degrees, millimetres or both in the tables."),
    ] = "",
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="OPTION=VALUE",
            help="Option of the estimator; of several ESTIMATOR.OPTION=VALUE. Repeatable.",
        ),
    ] = None,
    limits: Annotated[
        list[str] | None,
        typer.Option(
            "--limit",
            metavar="QUANTITY.BAND=LIMIT",
            help="What rails are held against, e.g. --limit vertical_profile.D1=6mm, in place of that of the "
            "ride file. Repeatable.",
        ),
    ] = None,
    fused: Annotated[
        bool, typer.Option("--fuse", help="Fuse the rails of several rides over the same line.")
    ] = False,
) -> int:
    """Run estimators on a recorded ride, of a real train or exported: states, rails, a page."""
    from rich.console import Console

    from simrail.campaign.progress import ProgressWatcher
    from simrail.cli.estimate_ride import DEFAULT, chosen_methods, estimate_ride, ride_with_warnings
    from simrail.core.toml_files import blame, label
    from simrail.recording.doubts import doubts
    from simrail.recording.files.ride_reader import ride_file

    chosen, wanted, named = form_of(form), _units(units), list(estimators or [])
    if fused:
        if limits:
            raise InputError(
                "is not asked of fused rails",
                field="--limit",
                value=limits[0],
                limit="a single ride",
                remedy="leave out --limit or --fuse",
            )
        if len(named) > 1:
            raise InputError(
                "fuses the rails of one method",
                field="--estimator",
                value=len(named),
                limit="1 with --fuse",
                remedy="name one of them",
            )
        method = named[0] if named else DEFAULT
        folder = out or Path("results") / f"{_stem(rides[0])}_{method.rpartition(':')[2]}_fused"
        return _fuse(rides, method, folder, settings or [], chosen, wanted)
    if len(rides) > 1:
        raise InputError(
            "are several rides, of which one is estimated at a time",
            field="RIDE.toml",
            value=len(rides),
            limit="1",
            remedy="give one, or add --fuse to fuse their rails",
        )
    ride, file = rides[0], ride_file(rides[0])
    whole = ride_with_warnings(ride, limits or [])
    with blame(label(file)) if not named else blame(None):
        methods = chosen_methods(whole.spec.estimator, named, settings or [], file.parent)
    name = "_".join(method.name for method in methods[:3]) + "_and_more" * (len(methods) > 3)
    folder = out or Path("results") / f"{_stem(ride)}_{name}"
    with ProgressWatcher(Console(stderr=True)) as watcher:
        found, files = estimate_ride(
            whole, methods, folder, file=label(file), format=chosen, units=wanted, watcher=watcher
        )
    for warning in doubts(whole.recording):
        print(f"warning: {warning}", file=sys.stderr)
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, WIDEST)
    show(console, found)
    show_files(console, folder, files)
    return DONE


def _units(text: str) -> tuple[str, ...]:
    """The units that a text asks for."""
    from simrail.recording.files.frame_file import UNITS

    words = tuple(word.strip() for word in text.split(",") if word.strip())
    for word in words:
        one_of(word, UNITS, "is no unit that tables can be written in", field="--units")
    return words


def _stem(ride: Path) -> str:
    """What a ride is called in the name of a folder."""
    stem = ride.stem if ride.suffix == ".toml" and ride.stem != "ride" else ride.absolute().stem
    return ride.absolute().parent.name if stem == "ride" else stem


def show(console: "Console", found: "RideEstimates") -> None:
    """Print what was found: the ride, each method's attitude and rails, and what they differ by."""
    from simrail.report.pages.estimate_page import design_differences, ride_facts
    from simrail.report.tables.recorded import (
        BAND_WORDS,
        OPEN_WORDS,
        beside_each_other,
        difference_table,
        differences,
        exceedance_table,
        exceedance_words,
        rails_table,
        reference_table,
    )
    from simrail.track.rail_limits import exceedances, rail_summary

    results, several = found.results, len(found.results) > 1
    for fact in ride_facts(results[0].recording):
        console.print(fact, markup=False, soft_wrap=True)
    for result in results:
        whose = f"{result.name}: " if several else ""
        for angle, rms in design_differences(result).items():
            console.print(f"{whose}{angle} less design: {rms:.3f} deg rms")
    for result in results:
        if not result.lines:
            continue
        console.print(f"\nrails by {result.name}; {BAND_WORDS}", soft_wrap=True)
        _print(console, rails_table(rail_summary(result.lines, found.limits)))
        console.print(OPEN_WORDS, soft_wrap=True)
        places = exceedances(result.lines, found.limits)
        console.print(exceedance_words(places, found.limits, result.lines), markup=False, soft_wrap=True)
        if len(places):
            _print(console, exceedance_table(places, most=MOST_PLACES))
            if len(places) > MOST_PLACES:
                console.print(f"and {len(places) - MOST_PLACES} more, in the file of the exceedances")
    if several:
        console.print()
        _print(console, beside_each_other(results))
        _print(console, difference_table(differences(results)))
    if found.scores is None:
        console.print("\nthere is no truth beside a recording, hence no scores")
        return
    console.print("\nbeside the reference, which errs as well (no truth is known)")
    _print(console, reference_table(found.scores))


def show_files(console: "Console", folder: Path, files: Sequence[Path]) -> None:
    """Print what was written, and what each file holds."""
    from simrail.cli.estimate_ride import CONTENTS

    console.print(f"wrote into {folder}:", markup=False, soft_wrap=True)
    names = [file.relative_to(folder).as_posix() for file in files]
    width = max(map(len, names))
    for file, name in zip(files, names, strict=True):
        words = CONTENTS.get(file.stem, "") if file.suffix != ".html" else "the page: open it in a browser"
        console.print(f"  {name:{width}}  {words}", markup=False, soft_wrap=True)


def _print(console: "Console", table: "TextTable") -> None:
    """Print a table: its first column to the left, figures to the right."""
    from rich import box
    from rich.table import Table

    if not table.rows:
        return
    shown = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    for number, column in enumerate(table.columns):
        shown.add_column(column, justify="left" if number == 0 else "right", overflow="fold")
    for row in table.rows:
        shown.add_row(*row)
    console.print(shown)


def _fuse(
    rides: list[Path],
    estimator: str,
    folder: Path,
    settings: list[str],
    form: "Format",
    units: tuple[str, ...],
) -> int:
    """Fuse the rails of rides, and tell what each was worth."""
    from simrail.cli.fuse_rides import fuse_rides

    fused = fuse_rides(rides, estimator, folder, settings=settings, format=form, units=units)
    place = fused.geometry.index
    print(f"{'one pass' if len(rides) == 1 else f'{len(rides)} passes'} over {place[0]:g} to {place[-1]:g} m")
    for ride, row in zip(rides, fused.passes.to_dict("records"), strict=True):
        print(f"  {ride}: moved by {row['shift_m']:+.2f} m{': ' if row['told'] else ''}{row['told']}")
    sd = 1e3 * fused.geometry.filter(like="_sd_m").mean()
    for name, value in sd.dropna().items():
        print(f"{str(name).removesuffix('_sd_m').replace('_', ' ')}: sd {value:.2f} mm, unfiltered")
    print(f"wrote {folder / f'geometry.{form}'}, {folder / f'shifts.{form}'} and {folder / 'passes.csv'}")
    return DONE
