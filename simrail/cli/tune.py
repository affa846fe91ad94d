"""The command ``simrail tune``: its arguments, its progress bar, and what it says of the result."""

from __future__ import annotations

import math
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from simrail.campaign.tune import Tuned
    from simrail.estimators.tuning.identify import Identification
    from simrail.estimators.tuning.space import SearchSpace


def tune(
    scenario: Annotated[
        str, typer.Argument(metavar="NAME|FILE", help="A shipped scenario, or the path of a TOML file.")
    ],
    estimator: Annotated[
        str,
        typer.Option(
            "--estimator",
            metavar="NAME",
            help="A trajectory smoother of the scenario, or TrajectorySmoother.",
        ),
    ],
    method: Annotated[
        str,
        typer.Option("--method", metavar="cml|kom", help="By likelihood, or against the rails as they lie."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="File of the tuning; <scenario>_<method>.toml if not given."
        ),
    ] = None,
    rides: Annotated[
        list[str] | None,
        typer.Option("--ride", metavar="NAME", help="Ride to fit on; all if none is named. Repeatable."),
    ] = None,
    draws: Annotated[
        int, typer.Option("--draws", metavar="N", help="Draws of each ride to fit on, new tracks first.")
    ] = 1,
    imu: Annotated[
        str | None, typer.Option("--imu", metavar="NAME", help="IMU of the scenario; the first if not given.")
    ] = None,
    box: Annotated[
        tuple[float, float],
        typer.Option("--box", metavar="LEAST GREATEST", help="Range of every hyper-parameter, SI."),
    ] = (1e-4, 1e4),
    constrain: Annotated[
        str,
        typer.Option(
            "--constrain",
            metavar="y|z|yz|none",
            help="Where the accelerometer counts as better known than the virtual position.",
        ),
    ] = "y",
    position: Annotated[
        float | None,
        typer.Option("--position", metavar="M2", help="Hold the virtual positions' variances at this value."),
    ] = None,
    by_kind: Annotated[
        bool, typer.Option("--by-kind", help="One set for straights, one for transitions and curves.")
    ] = False,
    band: Annotated[
        str | None, typer.Option("--band", metavar="NAME", help="KOM: compare in this band, e.g. D1.")
    ] = None,
    within: Annotated[
        tuple[float, float] | None,
        typer.Option("--within", metavar="FROM TO", help="KOM: compare between these places, m."),
    ] = None,
    step: Annotated[
        float, typer.Option("--step", metavar="M", min=0.001, help="KOM: distance of the places.")
    ] = 0.25,
    evaluations: Annotated[
        int, typer.Option("--evaluations", metavar="N", help="Of CMA-ES, before L-BFGS-B takes over.")
    ] = 480,
    at_most: Annotated[
        int | None,
        typer.Option("--at-most", metavar="N", help="Evaluations after which the search ends as it is."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Replace a value, e.g. --set ride.speed_kmh=70. Repeatable."
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="Replace the scenario's seed.")] = None,
) -> int:
    """Tune a trajectory smoother on rides of a scenario; interrupted, the same command goes on."""
    from rich.console import Console

    from simrail.campaign.tune import command_of, tune_scenario, unfinished
    from simrail.cli.progress_bar import ProgressWatcher
    from simrail.core.errors import InputError
    from simrail.core.toml_files import blame
    from simrail.estimators.tuning.space import SearchSpace
    from simrail.scenario.scenario import load_scenario

    axes = {"y": ("y",), "z": ("z",), "yz": ("y", "z"), "none": ()}
    if constrain not in axes:
        raise InputError(
            "no such constraint", field="--constrain", value=constrain, limit="one of " + ", ".join(axes)
        )
    with blame("--box, --constrain, --position", "search"):
        space = SearchSpace(box=box, constrained=axes[constrain], position_m2=position)
    read = load_scenario(scenario, overrides=settings or [], seed=seed)
    file = out or Path(f"{read.name}_{method}.toml")
    words = [scenario, "--estimator", estimator, "--method", method]
    given = {
        "draws": draws,
        "imu": imu,
        "box": box,
        "constrain": constrain,
        "position": position,
        "band": band,
    }
    given |= {"within": within, "step": step, "evaluations": evaluations, "at_most": at_most, "seed": seed}
    usual = signature(tune).parameters
    for name, value in given.items():
        if value != usual[name].default:
            parts = map(repr, value) if isinstance(value, tuple) else [str(value)]
            words += ["--" + name.replace("_", "-"), *parts]
    words += [word for ride in rides or [] for word in ("--ride", ride)]
    words += [word for setting in settings or [] for word in ("--set", setting)]
    words += ["--by-kind"] * by_kind

    best = unfinished(file)
    if best.is_file():
        print(f"going on from {best}")
    try:
        with ProgressWatcher(Console(stderr=True)) as watcher:
            done = tune_scenario(
                read,
                file,
                estimator=estimator,
                method=method,
                rides=rides or [],
                draws=draws,
                imu=imu,
                space=space,
                by_kind=by_kind,
                band=band,
                within_m=within,
                step_m=step,
                evaluations=evaluations,
                at_most=at_most,
                command=command_of(words),
                watcher=watcher,
            )
    except KeyboardInterrupt:
        if best.is_file():
            print(f"the best so far is in {best}; the same command goes on from there")
        raise
    _show(Console(), done)
    return 0


def _show(console: Console, done: Tuned) -> None:
    """Print what was found, one table per set, and where it was written."""
    from rich import box as boxes
    from rich.table import Table

    from simrail.estimators.tuning.identify import TOLERANCE

    search = done.tuning.search
    assert search is not None
    lower: list[str] = []
    for (name, known), reached in zip(done.identified.items(), search.objective, strict=True):
        table = Table(box=boxes.SIMPLE_HEAD, padding=0, show_edge=False)
        columns = (name, "value,\nSI", "", "a tenth\ncosts", "tenfold\ncosts", "known to\ndecades")
        for number, column in enumerate(columns):
            table.add_column(
                column, justify="left" if number in (0, 2) else "right", no_wrap=number in (0, 2)
            )
        for parameter, row in known.table.iterrows():
            span = "" if math.isnan(row["span_decades"]) else f"{row['span_decades']:.2g}"
            costs = []
            for column, factor in (("tenth", 0.1), ("tenfold", 10.0)):
                allowed = _is_allowed(known, str(parameter), factor, search.space)
                costs.append(f"{row[column]:.3g}" if allowed else f"({row[column]:.3g})")
                if allowed and row[column] < -TOLERANCE:
                    lower.append(str(parameter))
            table.add_row(str(parameter), f"{row['value']:.4g}", row["status"], *costs, span)
        console.print(f"{search.unit}: {reached:.6f}", highlight=False)
        console.print(table)
    console.print(
        "Costs: by how much the figure above rises if this one is a tenth or ten times as large and the "
        "others stay; in brackets where box, constraint or --position forbid it. Known to: how many powers "
        f"of ten it can go, the others following, until the figure has changed by {TOLERANCE:g}; beyond "
        "one it is flat, and these rides say nothing of it. At an edge: box or constraint ended the search "
        "there.",
        highlight=False,
    )
    if lower:
        console.print(
            f"not at the least: a tenth of or ten times {', '.join(dict.fromkeys(lower))} would be better; "
            "let it search longer (--evaluations, --at-most)",
            highlight=False,
        )
    print(f"{search.evaluations} evaluations; wrote {done.file}")


def _is_allowed(known: Identification, parameter: str, factor: float, space: SearchSpace) -> bool:
    """Whether a search may make a parameter so many times as large, the others being as they are."""
    from simrail.core.errors import InputError
    from simrail.estimators.trajectory.noise import Hyperparameters

    values = known.table["value"].copy()
    values[parameter] *= factor
    try:
        space.check(Hyperparameters.from_vector(values.to_numpy()))
    except InputError:
        return False
    return True
