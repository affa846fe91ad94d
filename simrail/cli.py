"""The command line: ``simrail run | list | check | export | estimate | tune | vehicle | imu | new | cache``.

Exit codes: 0 done, 1 a cell failed, 2 bad input (one message, no traceback), 130 interrupted. Heavy
imports stand inside the commands, so that those that need little answer at once.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from simrail.errors import InputError
from simrail.tune_command import tune

app = typer.Typer(
    name="simrail",
    help="A testbed for inertial sensors on trains: simulate a ride, record it, estimate, score.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

# typer carries its own copy of click, or not, as its version has it: find the class that it raises.
UsageFault: type[Any] = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")

DONE, CELL_FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def main() -> None:
    """Entry point of the command ``simrail``."""
    sys.exit(call(sys.argv[1:]))


def call(arguments: list[str]) -> int:
    """Run the command line and return its exit code."""
    try:
        code = app(arguments, standalone_mode=False)
    except InputError as error:
        _say(f"simrail: {error}")
        return BAD_INPUT
    except UsageFault as error:
        error.show()
        return BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED  # newer versions of typer return this code by themselves
    except OSError as error:
        place = f" ({Path(str(error.filename)).name})" if error.filename else ""
        _say(
            f"simrail: {error.strerror or error}{place}; former results are as they were, "
            "and a run goes on from where it was"
        )
        return CELL_FAILED
    if code == INTERRUPTED:
        _say("simrail: interrupted; former results are as they were, and a run goes on from where it was")
    return int(code or DONE)


def _say(message: str) -> None:
    print(message, file=sys.stderr)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"simrail {version('simrail')}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


Scenario = Annotated[
    str, typer.Argument(metavar="NAME|FILE", help="A shipped scenario, or the path of a TOML file.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Replace a value, e.g. --set ride.speed_kmh=70. Repeatable."
    ),
]
Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Replace the scenario's seed.")]


@app.command()
def run(
    scenario: Scenario,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the results; results/<name> if not given."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers", min=1, metavar="N", help="Processes; all cores for many cells, if not given."
        ),
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", metavar="ADDRESS", help="A dask scheduler, e.g. tcp://host:8786."),
    ] = None,
    cell: Annotated[
        int | None,
        typer.Option("--cell", min=0, metavar="NUMBER", help="Run this one cell and print its scores."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Only go on with an unfinished run (which a run does by itself).")
    ] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Drop an unfinished run of the same plan.")] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Run the failed cells of finished results again.")
    ] = False,
    seed: Seed = None,
    settings: Settings = None,
    plan: Annotated[
        bool, typer.Option("--plan", help="Only say what would be run, and about what it takes.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Run more than a million cells.")] = False,
) -> int:
    """Simulate, record, estimate and score a scenario; write its results."""
    from rich.console import Console

    if plan:
        return _plan(scenario, seed, settings or [], many=yes)

    from simrail.progress import ProgressWatcher, print_cell, print_scores
    from simrail.results import run as run_scenario
    from simrail.results import run_cell

    starts = {"resume": resume, "fresh": fresh, "retry-failed": retry_failed}
    wanted = [name for name, is_wanted in starts.items() if is_wanted]
    if len(wanted) > 1 or (cell is not None and (wanted or cluster or workers)):
        raise InputError(
            "these options do not go together",
            field=" ".join(f"--{name}" for name in wanted) + (" --cell" if cell is not None else ""),
            remedy="choose one of them; --cell runs in this process",
        )
    console = Console()
    with ProgressWatcher(Console(stderr=True)) as watcher:
        if cell is not None:
            alone = run_cell(scenario, cell, out=out, seed=seed, overrides=settings or [], watcher=watcher)
        else:
            results = run_scenario(
                scenario,
                out=out,
                seed=seed,
                overrides=settings or [],
                workers=workers,
                cluster=cluster,
                start=cast("Any", wanted[0] if wanted else "auto"),
                watcher=watcher,
                many=yes,
            )
    if cell is not None:
        print_cell(console, alone)
        return CELL_FAILED if alone.failures else DONE
    print_scores(console, results)
    return CELL_FAILED if results.campaign.failures else DONE


def _plan(name: str, seed: int | None, settings: list[str], *, many: bool) -> int:
    """Show what a scenario would run."""
    import os

    from rich.console import Console

    from simrail.plan import forecast, print_forecast
    from simrail.scenario.scenario import load_scenario

    read = load_scenario(name, overrides=settings, seed=seed)
    with Console(stderr=True).status("rehearsing"):
        told = forecast(read, many=many)
    print_forecast(Console(), read, told, cores=os.cpu_count() or 1)
    return DONE


@app.command()
def check(scenario: Scenario, seed: Seed = None, settings: Settings = None) -> int:
    """Judge a scenario without running it."""
    from simrail.scenario.check import judge_scenario
    from simrail.scenario.scenario import load_scenario

    read = load_scenario(scenario, overrides=settings or [], seed=seed)
    plan = judge_scenario(read)
    for warning in plan.warnings:
        _say(f"warning: {warning}")
    print(f"{read.name}: fine. {read.title}")
    print(
        f"{_number(plan.rides, 'ride')} of {plan.simulated_s:.0f} s in all, "
        f"{_number(plan.cells, 'recording')}, {_number(len(plan.estimators), 'estimator')} "
        f"each: {', '.join(plan.estimators)}"
    )
    return DONE


Form = Annotated[str, typer.Option("--format", metavar="csv|parquet", help="Form of the data files.")]


@app.command()
def export(
    scenario: Scenario,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="A new folder for the recordings.")],
    form: Form = "csv",
    draw: Annotated[int, typer.Option("--draw", min=0, help="Draw of the sensors.")] = 0,
    truth: Annotated[
        bool, typer.Option("--truth", help="Write the true motion beside each recording, too.")
    ] = False,
    seed: Seed = None,
    settings: Settings = None,
) -> int:
    """Write the recordings of a scenario as files: one folder each, one file per sensor."""
    from rich.console import Console

    from simrail.export import export as export_scenario
    from simrail.export import format_of
    from simrail.progress import ProgressWatcher
    from simrail.scenario.scenario import load_scenario

    chosen, read = format_of(form), load_scenario(scenario, overrides=settings or [], seed=seed)
    with ProgressWatcher(Console(stderr=True)) as watcher:
        written = export_scenario(read, out, format=chosen, draw=draw, truth=truth, watcher=watcher)
    print(f"wrote {_number(len(written.recordings), 'recording')} into {out}:")
    for name in written.recordings:
        print(f"  {name}")
    print(f"next: simrail estimate {out / written.recordings[0]} --estimator AttitudeEkf")
    return DONE


@app.command()
def estimate(
    ride: Annotated[
        Path, typer.Argument(metavar="RIDE.toml", help="A ride file, or a folder that holds a ride.toml.")
    ],
    estimator: Annotated[
        str, typer.Option("--estimator", metavar="NAME", help="A registered estimator, or FILE.py:CLASS.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Its folder; results/<ride>_<estimator> if not given."),
    ] = None,
    form: Form = "csv",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="OPTION=VALUE", help="Option of the estimator. Repeatable."),
    ] = None,
) -> int:
    """Run an estimator on a recorded ride, of a real train or exported; without truth, without scores."""
    from simrail.export import format_of
    from simrail.report.estimate_page import design_difference_deg, ride_facts
    from simrail.ride_estimate import estimate_ride

    stem = ride.stem if ride.suffix == ".toml" and ride.stem != "ride" else ride.absolute().stem
    stem = ride.absolute().parent.name if stem == "ride" else stem
    folder = out or Path("results") / f"{stem}_{estimator.rpartition(':')[2]}"
    done = estimate_ride(ride, estimator, folder, settings=settings or [], format=format_of(form))
    for fact in ride_facts(done.recording):
        print(fact)
    for angle in ("roll_rad", "pitch_rad"):
        if angle in done.estimate.states:
            rms = design_difference_deg(done.recording, done.estimate, angle)
            print(f"{angle.removesuffix('_rad')} less design: {rms:.3f} deg rms")
    print("there is no truth beside a recording, hence no scores")
    print(f"wrote {folder / f'estimate.{form}'} and {folder / 'estimate.html'}")
    return DONE


@app.command(name="list")
def list_parts() -> int:
    """Show the scenarios, tracks, vehicles, IMUs and estimators that are there."""
    from rich.console import Console

    from simrail.catalogue import catalogue

    console = Console(highlight=False)
    for kind, entries in catalogue().items():
        console.print(f"[bold]{kind}[/bold]")
        width = max((len(name) for name in entries), default=0)
        for name, title in entries.items():
            console.print(f"  [cyan]{name:{width}}[/cyan]  ", end="")
            console.print(title, markup=False, overflow="ignore", crop=False, no_wrap=True)
    return DONE


@app.command()
def vehicle(
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE", help="A shipped vehicle, or the path of a TOML file.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Write an HTML page with figures there, too.")
    ] = None,
    speed: Annotated[
        float, typer.Option("--speed", metavar="KMH", min=1.0, max=1000.0, help="Speed of the mode table.")
    ] = 80.0,
    top: Annotated[
        float, typer.Option("--to", metavar="KMH", min=10.0, max=1000.0, help="Highest speed searched.")
    ] = 400.0,
) -> int:
    """Show a vehicle: masses, wheel loads, natural frequencies, conicity and critical speed."""
    from rich.console import Console

    from simrail.report.vehicle_study import study_vehicle
    from simrail.report.vehicle_text import print_study
    from simrail.scenario.files import blame, find, judge, label, read_toml
    from simrail.scenario.vehicle_file import VehicleFile

    path = find("vehicle", name)
    model = judge(VehicleFile, read_toml(path), file=label(path)).model(path.stem)
    console = Console(stderr=True)
    with console.status("") as status, blame(label(path), "vehicle"):
        study = study_vehicle(
            model,
            running_mps=speed / 3.6,
            top_mps=top / 3.6,
            progress=lambda what, share: status.update(f"{what} {100 * share:.0f} %"),
        )
    print_study(Console(), study)
    if out is not None:
        from simrail.report.vehicle_page import write_vehicle_page

        print(f"wrote {write_vehicle_page(out, study)}")
    return DONE


@app.command()
def imu(
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE", help="A shipped IMU, or the path of a TOML file.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Write an HTML page with its Allan deviation there, too."),
    ] = None,
) -> int:
    """Show an IMU grade in the units of data sheets, and what was assumed."""
    from rich.console import Console

    from simrail.report.imu_text import print_imu
    from simrail.scenario.imu_file import load_imu

    file, grade = load_imu(name)
    print_imu(Console(), file, grade)
    if out is not None:
        from simrail.report.imu_page import write_imu_page

        print(f"wrote {write_imu_page(out, file, grade)}")
    return DONE


@app.command()
def new(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="estimator, track, vehicle, imu, scenario, ride.")
    ],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Its name, e.g. my_filter.")],
    folder: Annotated[Path, typer.Option("--in", metavar="DIR", help="Where to write it.")] = Path(),
) -> int:
    """Write a working template: one file, to be changed into your own part."""
    from simrail.new import write_template

    written, next_step = write_template(kind, name, folder=folder)
    print(f"wrote {written}\n{next_step}")
    return DONE


app.command()(tune)


@app.command()
def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Drop all simulated rides.")] = False,
) -> int:
    """Show the cache of simulated rides, or clear it."""
    from simrail import ride_cache

    if clear:
        print(f"freed {ride_cache.clear() / 1e6:.0f} MB")
        return DONE
    rides = ride_cache.rides()
    for ride in rides:
        print(f"{ride.size_bytes / 1e6:8.0f} MB  {ride.key[:12]}  {ride.name}")
    total = sum(ride.size_bytes for ride in rides)
    print(
        f"{_number(len(rides), 'ride')}, {total / 1e6:.0f} MB of at most "
        f"{ride_cache.limit_bytes() / 1e9:g} GB (SIMRAIL_CACHE_GB), in {ride_cache.folder()}"
    )
    return DONE


def _number(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


if __name__ == "__main__":
    main()
