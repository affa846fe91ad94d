"""``simrail sensitivity``: which of the values that a scenario draws decide a figure of its scores."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from simrail.cli.options import CELL_FAILED, DONE, Scenario, Seed, Settings, number, say
from simrail.core.errors import one_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd
    from rich.console import Console

    from simrail.campaign.sensitivity import Sensitivity
    from simrail.scenario.scenario import Scenario as ReadScenario

_USUAL = {"morris": 10, "saltelli": 256}
"""Trajectories of Morris, and Saltelli's blocks, where the scenario does not say how many."""


def sensitivity(
    scenario: Scenario,
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            metavar="morris|saltelli",
            help="Screen many values, or rank few by Sobol's indices (usual).",
        ),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option("--samples", min=2, metavar="N", help="Trajectories (10), or blocks (256)."),
    ] = None,
    quantity: Annotated[str, typer.Option("--of", metavar="QUANTITY", help="E.g. roll, position.")] = "roll",
    metric: Annotated[str, typer.Option("--metric", help="rms, p95, max, ...")] = "rms",
    window: Annotated[str, typer.Option("--window", help="whole, curve, straight, ...")] = "whole",
    reference: Annotated[str, typer.Option("--reference", help="truth or design.")] = "truth",
    band: Annotated[str, typer.Option("--band", help="full, or a band of rails, e.g. D1.")] = "full",
    estimator: Annotated[
        list[str] | None, typer.Option("--estimator", metavar="NAME", help="Only this one. Repeatable.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the results; results/<name>_<method>."),
    ] = None,
    workers: Annotated[int | None, typer.Option("--workers", min=1, metavar="N", help="Processes.")] = None,
    cluster: Annotated[
        str | None, typer.Option("--cluster", metavar="ADDRESS", help="A dask scheduler.")
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Run it all again.")] = False,
    seed: Seed = None,
    settings: Settings = None,
) -> int:
    """Find which sampled values (of an IMU's sheet, speed, map ...) decide an error, and by how much."""
    from rich.console import Console

    from simrail.campaign.sensitivity import FigureName, sensitivities, sensitivity_table
    from simrail.core.atomic_files import write_whole
    from simrail.core.csv_files import csv_bytes
    from simrail.report.figures.canvas import by_itself
    from simrail.report.figures.responses import responses_figure
    from simrail.scenario.distributions import dimensions

    read = _designed(scenario, method, samples, seed, settings or [])
    spec = read.spec
    folder = out or Path("results") / f"{read.name}_{spec.monte_carlo.method}"
    scores, cells, failures = _scores(read, folder, workers=workers, cluster=cluster, fresh=fresh)
    figure = FigureName(quantity, metric, window, reference, band)
    found = sensitivities(spec, scores, cells, figure, estimators=estimator or [])
    console = Console()
    for one in found:
        _print(console, one)
    draws = number(spec.monte_carlo.sensor_draws, "device")
    print(f"Of {draws}, the same in every sample; each index with the half of its 95 % interval (bootstrap).")
    name = f"sensitivity_{quantity}_{metric}_{window}"
    write_whole(
        folder / f"{name}.csv", csv_bytes(sensitivity_table(found), float_format="%.6g"), what="table"
    )
    drawn = dimensions(spec)
    for i, one in enumerate(found):
        case = f"_{i}" if one.case else ""
        file = folder / f"{name}_{re.sub(r'[^A-Za-z0-9_.-]+', '_', one.estimator)}{case}.svg"
        if one.indices.notna().any(axis=None):
            write_whole(file, by_itself(responses_figure(one, drawn)).encode(), what="figure")
    print(f"wrote {folder / name}.csv, and the responses beside it as .svg")
    return CELL_FAILED if failures else DONE


def _designed(
    scenario: str, method: str | None, samples: int | None, seed: int | None, settings: list[str]
) -> ReadScenario:
    """The scenario with a design in the place of its Monte Carlo method."""
    from simrail.scenario.designs import DESIGNS
    from simrail.scenario.scenario import load_scenario

    if method is not None:
        one_of(method, DESIGNS, "is no design of a sensitivity analysis", field="--method")
    read = load_scenario(scenario, seed=seed, overrides=settings).spec
    own = read.monte_carlo
    chosen = method or (own.method if own.method in DESIGNS else "saltelli")
    count = samples or (own.samples if own.method == chosen else _USUAL[chosen])
    design = [f'monte_carlo.method="{chosen}"', f"monte_carlo.samples={count}"]
    # Verdicts over devices are another question (`simrail grade`).
    left_out = ["require=[]"] if read.require else []
    return load_scenario(scenario, seed=seed, overrides=[*settings, *design, *left_out])


def _scores(
    read: ReadScenario, folder: Path, *, workers: int | None, cluster: str | None, fresh: bool
) -> tuple[pd.DataFrame, pd.DataFrame, int]:
    """Scores, cells and number of failures: of a former run of the same plan, or run now."""
    from rich.console import Console

    from simrail.campaign.campaign import key_of
    from simrail.campaign.progress import ProgressWatcher
    from simrail.campaign.stored_results import read_results
    from simrail.results import run
    from simrail.scenario.check import judge_scenario

    manifest = folder / "manifest.json"
    if manifest.is_file() and not fresh:
        former = json.loads(manifest.read_text(encoding="utf-8"))
        if former.get("key") == key_of(judge_scenario(read)):
            say(f"of the finished results in {folder}; --fresh runs them again")
            kept = read_results(folder, field="--out", remedy="run it with --fresh")
            return kept.scores, kept.cells, int(former.get("failed", 0))
    with ProgressWatcher(Console(stderr=True)) as watcher:
        start: Literal["auto", "fresh"] = "fresh" if fresh else "auto"
        results = run(read, out=folder, workers=workers, cluster=cluster, start=start, watcher=watcher)
    campaign = results.campaign
    return campaign.scores, campaign.cells, len(campaign.failures)


def _print(console: Console, one: Sensitivity) -> None:
    """Print the indices of one figure."""
    from rich.table import Table

    what = f"{one.figure.quantity} {one.figure.metric}, {one.figure.window}"
    title = f"{what}, of {one.estimator}" + (f" ({one.case})" if one.case else "")
    table = Table(box=None, pad_edge=False, title=title, title_justify="left")
    heads = (
        ("first order", "total")
        if one.method == "saltelli"
        else (f"mu*, {one.unit}", f"mu, {one.unit}", "sigma")
    )
    for head in ("value", *heads):
        table.add_column(head, justify="left" if head == "value" else "right", no_wrap=True)
    for name in one.order:
        table.add_row(name, *_cells(one, name))
    console.print(table)
    if one.dropped or one.note:
        block = "trajectories" if one.method == "morris" else "blocks"
        left_out = f"{one.dropped} of {one.blocks} {block} left out" if one.dropped else "no indices"
        console.print(f"{left_out}: {one.note}", highlight=False, markup=False, soft_wrap=True)


def _cells(one: Sensitivity, name: str) -> Sequence[str]:
    row: Any = one.indices.loc[name]
    if one.method == "saltelli":
        pairs = (("first", "first_pm"), ("total", "total_pm"))
        return [f"{row[value]:.3f} ± {row[half]:.3f}" for value, half in pairs]
    return [f"{row['mu_star']:.3g} ± {row['mu_star_pm']:.2g}", f"{row['mu']:.3g}", f"{row['sigma']:.3g}"]
