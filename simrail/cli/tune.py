"""The command ``simrail tune``: its arguments, its progress bar, and what it says of the result."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simrail.cli.options import DONE, Seed, Settings, finite
from simrail.cli.tune_ride import refuse_of_scenarios, tune_rides
from simrail.core.errors import InputError, one_of

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

    from simrail.estimators.tuning.file import TuningResult


CONSTRAINED = {"y": ("y",), "z": ("z",), "yz": ("y", "z"), "none": ()}
"""Axes that are constrained, by the words of ``--constrain``."""


def tune(
    context: typer.Context,
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE", help="A shipped scenario, the path of one, or that of a recorded ride."
        ),
    ],
    estimator: Annotated[
        str | None,
        typer.Option(
            "--estimator",
            metavar="NAME",
            help="An estimator of the scenario or ride file, a registered one, or FILE.py:CLASS. Of a "
            "recorded ride TrackRelativeSmoother, if not given.",
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            metavar="cml|kom",
            help="By likelihood, or against the rails as they lie, which nobody knows of a recorded ride.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="File of the tuning; <scenario>_<method>.toml if not given."
        ),
    ] = None,
    draws: Annotated[
        int, typer.Option("--draws", metavar="N", help="Draws of each ride to fit on, new tracks first.")
    ] = 1,
    imu: Annotated[
        str | None, typer.Option("--imu", metavar="NAME", help="IMU of the scenario; the first if not given.")
    ] = None,
    box: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--box",
            metavar="LEAST GREATEST",
            help="Range of every parameter. Trajectory smoother: SI; 1e-4 to 1e4 if not given. "
            "Track-relative: times what it is now; 0.1 to 10.",
        ),
    ] = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            "--parameter",
            metavar="NAME",
            help="Track-relative smoother: what to search, a class of mount and a size, e.g. axle_yaw_sd. "
            "Repeatable.",
        ),
    ] = None,
    constrain: Annotated[
        str | None,
        typer.Option(
            "--constrain",
            metavar="y|z|yz|none",
            help="Smoother: where the accelerometer counts as better known than the virtual position; y if "
            "not given.",
        ),
    ] = None,
    position: Annotated[
        float | None,
        typer.Option(
            "--position", metavar="M2", help="Smoother: hold the virtual positions' variances there."
        ),
    ] = None,
    band: Annotated[
        str | None, typer.Option("--band", metavar="NAME", help="KOM: compare in this band, e.g. D1.")
    ] = None,
    within: Annotated[
        tuple[float, float] | None,
        typer.Option("--within", metavar="FROM TO", help="KOM: compare between these places, m."),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            "--step",
            metavar="M",
            min=0.001,
            callback=finite,
            help="KOM: distance of places; 0.25 if not given.",
        ),
    ] = None,
    evaluations: Annotated[
        int, typer.Option("--evaluations", metavar="N", help="Of CMA-ES, before L-BFGS-B takes over.")
    ] = 480,
    at_most: Annotated[
        int | None,
        typer.Option("--at-most", metavar="N", help="Evaluations after which the search ends as it is."),
    ] = None,
    seed: Seed = None,
    rides: Annotated[
        list[str] | None,
        typer.Option(
            "--ride",
            metavar="NAME",
            help="Ride to fit on; all if none is named. Beside a recorded ride another one. Repeatable.",
        ),
    ] = None,
    settings: Settings = None,
    by_kind: Annotated[
        bool,
        typer.Option("--by-kind", help="Smoother: one set for straights, one for transitions and curves."),
    ] = False,
) -> int:
    """Search an estimator's parameters, on a scenario's or recorded rides; the same command goes on."""
    from rich.console import Console

    from simrail.campaign.progress import ProgressWatcher
    from simrail.campaign.tune import tune_scenario, unfinished
    from simrail.cli.check_ride import is_ride
    from simrail.scenario.scenario import load_scenario

    if constrain is not None:
        one_of(constrain, CONSTRAINED, "no such constraint", field="--constrain")
    recorded = is_ride(scenario)
    if not recorded:
        estimator, method = _required("--estimator", estimator), _required("--method", method)
        read = load_scenario(scenario, overrides=settings or [], seed=seed)
        file = out or Path(f"{read.name}_{method}.toml")
    else:
        method = "cml" if method is None else method
        of_scenarios = {"--imu": imu, "--band": band, "--within": within, "--step": step}
        of_scenarios["--draws"] = None if draws == 1 else draws
        refuse_of_scenarios(of_scenarios, method)
        stem = Path(scenario).stem if Path(scenario).suffix else Path(scenario).absolute().name
        file = out or Path(f"{stem}_{method}.toml")
    # Settings of an estimator's own search: the option of each, and its value if it was given.
    own: dict[str | None, tuple[str, Any]] = {
        "box": ("--box", box),
        "parameters": ("--parameter", parameters and tuple(parameters)),
        "constrained": ("--constrain", constrain and CONSTRAINED[constrain]),
        "position_m2": ("--position", position),
        "by_kind": ("--by-kind", by_kind or None),
        "band": ("--band", band),
        "step_m": ("--step", step),
    }
    given = {str(name): value for name, (_, value) in own.items() if value is not None}
    best = unfinished(file)
    search: dict[str, Any] = {"settings": given, "evaluations": evaluations, "at_most": at_most}
    with _going_on(best, own), ProgressWatcher(Console(stderr=True)) as watcher:
        if recorded:
            result, identified, use = tune_rides(
                [Path(scenario), *map(Path, rides or [])],
                file,
                estimator=estimator,
                options=settings or [],
                seed=1 if seed is None else seed,
                command=_command(context),
                watcher=watcher,
                **search,
            )
        else:
            result, identified = tune_scenario(
                read,
                file,
                estimator=str(estimator),
                method=str(method),
                rides=rides or [],
                draws=draws,
                imu=imu,
                within_m=within,
                command=_command(context),
                watcher=watcher,
                **search,
            )
    _show(Console(), result, identified)
    print(f"{result.evaluations} evaluations; wrote {file}")
    if recorded:
        print(f"use it: {use}")
    return DONE


@contextmanager
def _going_on(best: Path, own: Mapping[str | None, tuple[str, Any]]) -> Iterator[None]:
    """Say from where a search goes on, and where it would, if it is broken off; faults by their options."""
    if best.is_file():
        print(f"going on from {best}")
    try:
        yield
    except InputError as error:
        error.field = own.get(error.field, (error.field,))[0]
        raise
    except KeyboardInterrupt:
        if best.is_file():
            print(f"the best so far is in {best}; the same command goes on from there")
        raise


def _required(option: str, value: str | None) -> str:
    """An option that a scenario needs."""
    if value is None:
        raise InputError(
            "is required for a scenario",
            field=option,
            limit="--estimator NAME and --method cml or kom",
            remedy="e.g. --estimator TrackRelativeSmoother --method cml --parameter axle_yaw_sd",
        )
    return value


def _command(context: typer.Context) -> str:
    """The command line, quoted where a shell needs it: what differs from the defaults, but for --out."""
    words = ["simrail", "tune"]
    for parameter in context.command.params:
        value: Any = context.params[str(parameter.name)]
        if parameter.name == "out" or not value or value == parameter.default:
            continue
        option = [parameter.opts[0]] if parameter.param_type_name == "option" else []
        if value is True:
            words += option
        elif isinstance(value, list):
            words += [word for item in value for word in (*option, item)]
        else:
            words += [*option, *(map(repr, value) if isinstance(value, tuple) else [str(value)])]
    return shlex.join(words)


def _show(console: Console, search: TuningResult, identified: dict[str, pd.DataFrame]) -> None:
    """Print what was found, one table per set of parameters."""
    from rich import box as boxes
    from rich.table import Table

    from simrail.estimators.tuning.identify import TOLERANCE

    lower: list[str] = []
    for (name, identification), reached in zip(identified.items(), search.objective, strict=True):
        table = Table(box=boxes.SIMPLE_HEAD, padding=0, show_edge=False)
        columns = (name, "value,\nSI", "", "a tenth\ncosts", "tenfold\ncosts", "known to\ndecades")
        for number, column in enumerate(columns):
            table.add_column(
                column, justify="left" if number in (0, 2) else "right", no_wrap=number in (0, 2)
            )
        for parameter, row in identification.iterrows():
            span = "" if math.isnan(row["span_decades"]) else f"{row['span_decades']:.2g}"
            costs = []
            for column in ("tenth", "tenfold"):
                allowed = row[f"{column}_allowed"]
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
