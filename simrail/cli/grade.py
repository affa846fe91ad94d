"""``simrail grade``: whether an IMU is good enough for what is asked of it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simrail.cli.options import CELL_FAILED, DONE, Seed, Settings
from simrail.core.errors import InputError, one_of

if TYPE_CHECKING:
    from simrail.scenario.scenario import Scenario

DEFAULT_SCENARIO = "which_imu"

BUDGET_DRAWS = 8
"""Draws of which the error is taken apart, where one IMU is asked for: each costs some twenty estimates."""

MOST_IN_TITLE = 3
"""IMUs that the title of a page names."""

LEAST_DRAWS = 20
"""Of the first look at the verdicts: what is far from enough is known by then."""


def grade(
    name: Annotated[
        str,
        typer.Argument(
            metavar="IMU", help="A shipped grade, an IMU file, several with commas between them, or 'all'."
        ),
    ],
    wanted: Annotated[
        list[str],
        typer.Option(
            "--for",
            metavar="REQUIREMENT",
            help="What is asked, e.g. 'roll<0.1deg in curves at 60km/h' or 'alignment D1<0.5mm for 90%'.",
        ),
    ],
    scenario: Annotated[
        str,
        typer.Option(
            "--scenario", metavar="NAME", help="A shipped scenario, or your own: its rides and mounts."
        ),
    ] = DEFAULT_SCENARIO,
    mount: Annotated[
        str | None,
        typer.Option("--mount", metavar="NAME", help="One of the mounts of the scenario; all if not given."),
    ] = None,
    devices: Annotated[
        int | None,
        typer.Option(
            "--devices",
            min=2,
            metavar="N",
            help="Draw at most so many devices of each IMU; as many as the scenario has if not given.",
        ),
    ] = None,
    budget: Annotated[
        int | None,
        typer.Option(
            "--budget",
            min=0,
            max=1000,
            metavar="N",
            help="Over how many devices the error of each IMU is taken apart, where it is mounted worst; "
            f"{BUDGET_DRAWS} of one IMU, none of several, if not given.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the results; results/grade_<imu> if not given."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, metavar="N", help="Processes; all cores if not given.")
    ] = None,
    seed: Seed = None,
    settings: Settings = None,
) -> int:
    """Say whether an IMU is good enough: draw devices of its sheet until that is settled."""
    from rich.console import Console

    from simrail.campaign.progress import ProgressWatcher
    from simrail.cli.score_tables import print_scores
    from simrail.cli.verdict_tables import print_budgets, print_coarsest, print_pairs
    from simrail.results import run
    from simrail.scenario.scenario import load_scenario

    grades = grades_of(name)
    asked = load_scenario(scenario)
    draws = (BUDGET_DRAWS if len(grades) == 1 else 0) if budget is None else budget
    overrides = [
        *requirement_settings(wanted, draws),
        imu_setting(asked.text, asked.file, grades, mount),
        *scope_settings(asked, wanted),
        *device_settings(asked, devices),
        *title_setting(grades),
    ]
    read = load_scenario(scenario, overrides=[*overrides, *(settings or [])], seed=seed)
    folder = out or Path("results") / ("grade_" + re.sub(r"\W+", "_", Path(name).stem))
    with ProgressWatcher(Console(stderr=True)) as watcher:
        results = run(read, out=folder, workers=workers, watcher=watcher)
    console = Console()
    print_scores(console, results)
    print_budgets(console, results.budgets)
    if len(grades) > 1:
        print_pairs(console, results)
        print_coarsest(console, results)
    return CELL_FAILED if results.campaign.failures else DONE


def grades_of(name: str) -> list[str]:
    """Grades that a word names: shipped ones, files, or with ``all`` the ladder of the shipped scenario.

    Raises
    ------
    InputError
        If it names nothing, or there is no such grade.
    """
    from simrail.core.toml_files import find
    from simrail.scenario.axes import each
    from simrail.scenario.scenario import load_scenario

    if name == "all":
        first, *_ = load_scenario(DEFAULT_SCENARIO).spec.imu
        return [str(one) for one in each(first.grade)]
    names = [part.strip() for part in name.split(",") if part.strip()]
    if not names:
        raise InputError(
            "names no IMU",
            field="IMU",
            value=name,
            remedy="name a grade, a file, or all",
            limit="a grade, a file, or all",
        )
    # A file is named as seen from here, not from the scenario's folder.
    return [str(find("imu", one).resolve()) if _is_file(one) else one for one in names if find("imu", one)]


def title_setting(grades: list[str]) -> list[str]:
    """Setting that entitles the page by what was asked; none of more names than a title holds."""
    names = [Path(grade).name.removesuffix(".toml").removesuffix(".imu") for grade in grades]
    title = " or ".join(names) + ": good enough?"
    return [f"title={json.dumps(title)}"] if len(names) <= MOST_IN_TITLE else []


def _is_file(name: str) -> bool:
    return name.endswith(".toml") or "/" in name


def imu_setting(text: str, file: str, grades: list[str], mount: str | None) -> str:
    """Setting that puts grades on the mounts of a scenario, or on one of them.

    Raises
    ------
    InputError
        If there is no such mount.
    """
    from simrail.core.toml_files import parse_toml

    tables = parse_toml(text, file=file).get("imu", [])
    names = [str(table.get("name")) for table in tables]
    if mount is not None:
        one_of(mount, names, f"is no [[imu]] of {file}", field="--mount")
    kept = [table | {"grade": grades} for table in tables if mount in (None, table.get("name"))]
    return f"imu=[{', '.join(_inline(table) for table in kept)}]"


def _inline(table: dict[str, Any]) -> str:
    """A table of plain values in one line of TOML."""
    return "{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in table.items()) + " }"


def requirement_settings(lines: list[str], budget_draws: int = 0) -> list[str]:
    """Settings of a scenario that ask for what these lines do, and draw until it is settled."""
    from simrail.scoring.requirement import read_requirement

    read = [read_requirement(line) for line in lines]
    speeds = {one.speed_kmh for one in read}
    if len(speeds) > 1:
        raise InputError(
            "are asked at different speeds",
            field="--for",
            value=", ".join("the scenario's" if one is None else f"{one:g} km/h" for one in speeds),
            limit="one speed for all of them",
            remedy="ask for each by a command of its own",
        )
    tables = []
    for one, _ in read:
        pairs: dict[str, Any] = {
            "quantity": one.quantity,
            "limit": f"{one.limit:.12g} {one.unit}",
            "metric": one.metric,
        }
        pairs |= {"band": one.band, "window": one.window, "share": one.share}
        tables.append(_inline(pairs | {"budget_draws": budget_draws, "budget_at": "worst"}))
    settings = [f"require=[{', '.join(tables)}]"]
    (speed,) = speeds
    return settings if speed is None else [*settings, f"ride.speed_kmh={speed:.12g}"]


def scope_settings(scenario: Scenario, lines: list[str]) -> list[str]:
    """Settings that score what these lines ask for, and leave out rails where none does.

    A smoother's rails take a third of its time; what it says beside them is the same without.
    """
    from simrail.estimation.estimate import estimator_class, registered
    from simrail.scoring.requirement import RAILS, read_requirement

    asked = [read_requirement(line).requirement for line in lines]
    settings = []
    for name, kept, more in (
        ("windows", scenario.spec.score.windows, [one.window for one in asked]),
        ("metrics", scenario.spec.score.metrics, [one.metric for one in asked]),
    ):
        if kept is not None:
            settings.append(f"score.{name}={json.dumps(list(dict.fromkeys((*kept, *more))))}")
    if any(one.quantity in RAILS for one in asked):
        return settings
    known = registered()
    for part in scenario.spec.estimator:
        method = estimator_class(part.method) if part.method in known else None
        makes_rails = "geometry_step_m" in getattr(method, "__dataclass_fields__", {})
        if makes_rails and not {"geometry_step_m", "draws"}.intersection(part.options):
            settings.append(f"estimator.{part.name}.options.geometry_step_m=0")
    return settings


def device_settings(scenario: Scenario, devices: int | None) -> list[str]:
    """Settings that draw at most so many devices of each IMU, and look at the verdicts on the way."""
    from simrail.scenario.stop_rule import draws_of, level_of

    of = {"track_draw": "track_draws", "sample": "samples", "sensor_draw": "sensor_draws"}
    level, draws, settings = level_of(scenario.spec), draws_of(scenario.spec), []
    if devices is not None:
        # Devices that share a draw of the upper level stay as many: the draws become fewer.
        within = 1 if level == "sensor_draw" else scenario.spec.monte_carlo.sensor_draws
        draws = max(2, -(-devices // within))
        settings.append(f"monte_carlo.{of[level]}={draws}")
    return [f"stop={{ verdicts = true, least_draws = {max(2, min(LEAST_DRAWS, draws))} }}", *settings]
