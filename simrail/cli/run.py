"""``simrail run | check``."""

from pathlib import Path
from typing import Annotated, Any, cast

import typer

from simrail.cli.options import CELL_FAILED, DONE, Scenario, Seed, Settings, number, say
from simrail.core.errors import InputError


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
    beside: Annotated[
        Path | None,
        typer.Option(
            "--beside",
            metavar="DIR",
            help="Results that the page sets beside these, e.g. full size and 1:10.",
        ),
    ] = None,
    budget: Annotated[
        int,
        typer.Option(
            "--budget",
            min=0,
            max=1000,
            metavar="DRAWS",
            help="Find out over so many draws what the error of the first method is made of; each takes as "
            "long as some 20 recordings.",
        ),
    ] = 0,
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

    from simrail.campaign.progress import ProgressWatcher
    from simrail.cli.score_tables import print_cell, print_scores
    from simrail.cli.verdict_tables import print_budgets
    from simrail.results import run as run_scenario
    from simrail.results import run_cell

    starts = {"resume": resume, "fresh": fresh, "retry-failed": retry_failed}
    wanted = [name for name, is_wanted in starts.items() if is_wanted]
    others = {"cluster": cluster, "workers": workers, "beside": beside, "budget": budget or None}
    named = [] if cell is None else ["cell", *(name for name, given in others.items() if given)]
    if len(wanted) > 1 or len(named) > 1 or (wanted and named):
        raise InputError(
            "these options do not go together",
            field=" ".join(f"--{name}" for name in [*wanted, *named]),
            remedy="choose one of them; --cell runs in this process",
            limit="one of them",
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
                beside=beside,
                watcher=watcher,
                many=yes,
                budget_draws=budget,
            )
    if cell is not None:
        print_cell(console, alone)
        return CELL_FAILED if alone.failures else DONE
    print_scores(console, results)
    print_budgets(console, results.budgets)
    for note in results.campaign.plan.notes:
        console.print(note)
    return CELL_FAILED if results.campaign.failures else DONE


def _plan(name: str, seed: int | None, settings: list[str], *, many: bool) -> int:
    """Show what a scenario would run."""
    from rich.console import Console

    from simrail.campaign.forecast import forecast, print_forecast
    from simrail.scenario.scenario import load_scenario

    read = load_scenario(name, overrides=settings, seed=seed)
    with Console(stderr=True).status("running one cell"):
        expected = forecast(read, many=many)
    print_forecast(Console(), expected)
    return DONE


def check(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE", help="A shipped scenario, the path of a TOML file, or a recorded ride's."
        ),
    ],
    plugins: Annotated[
        bool,
        typer.Option(
            "--plugins/--no-plugins",
            help="Load Python files that the scenario names, which runs their code; or judge the rest.",
        ),
    ] = True,
    write: Annotated[
        Path | None,
        typer.Option(
            "--write", metavar="NEW.toml", help="Of a ride: write its file with what is wrong mended."
        ),
    ] = None,
    seed: Seed = None,
    settings: Settings = None,
) -> int:
    """Judge a scenario without running it, or say what a recorded ride shows of itself."""
    from rich.console import Console

    from simrail.campaign.progress import ProgressWatcher
    from simrail.cli.check_ride import check_ride, is_ride, refuse_ride_option

    if is_ride(scenario):
        for option, given in (
            ("--set", settings),
            ("--seed", seed is not None),
            ("--no-plugins", not plugins),
        ):
            if given:
                refuse_ride_option(option)
        return check_ride(Path(scenario), write)
    if write is not None:
        raise InputError(
            "is for recorded rides",
            field="--write",
            value=str(write),
            limit="only for recorded rides",
            remedy="leave it out",
        )
    from simrail.scenario.check import judge_scenario
    from simrail.scenario.scenario import load_scenario

    read = load_scenario(scenario, overrides=settings or [], seed=seed)
    files = read.own_files
    if files and plugins:
        say(f"loading {', '.join(files)}, which runs its code (--no-plugins judges without)")
    elif files:
        read = read.without_own_files()
        say(f"judged without {', '.join(files)}, and without the methods in it")
    with ProgressWatcher(Console(stderr=True)) as watcher:
        plan = judge_scenario(read, progress=watcher.judging)
    for warning in plan.warnings:
        say(f"warning: {warning}")
    for note in plan.notes:
        print(note)
    print(f"{read.name}: fine. {read.title}")
    print(
        f"{number(plan.rides, 'ride')} of {plan.simulated_s:.0f} s in all, "
        f"{number(plan.cells, 'recording')}, {number(len(plan.estimators), 'estimator')} "
        f"each: {', '.join(plan.estimators)}"
    )
    return DONE
