"""``simrail export``: recordings of a scenario as files."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from simrail.cli.options import DONE, Scenario, Seed, Settings, number
from simrail.core.errors import one_of

if TYPE_CHECKING:
    from simrail.recording.files.ned import Frame
    from simrail.recording.files.ride_writer import RideFormat


def export(
    scenario: Scenario,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="A new folder for the recordings.")],
    form: Annotated[
        str, typer.Option("--format", metavar="csv|parquet|mcap", help="Form of the data files.")
    ] = "csv",
    draw: Annotated[int, typer.Option("--draw", min=0, max=999_999, help="Draw of the sensors.")] = 0,
    truth: Annotated[
        bool, typer.Option("--truth", help="Write the true motion beside each recording, too.")
    ] = False,
    contact: Annotated[
        bool,
        typer.Option("--contact", help="Write the forces between wheels and rails, a file per wheel, too."),
    ] = False,
    frame: Annotated[
        str,
        typer.Option(
            "--frame", metavar="flu|ned", help="Axes: forward, left, up, or FRD of the body and NED."
        ),
    ] = "flu",
    seed: Seed = None,
    settings: Settings = None,
) -> int:
    """Write the recordings of a scenario as files: one folder each, one file per sensor."""
    from rich.console import Console

    from simrail.campaign.export import export as export_scenario
    from simrail.campaign.progress import ProgressWatcher
    from simrail.scenario.scenario import load_scenario

    one_of(frame, ("flu", "ned"), "no such axes", field="--frame")
    one_of(form, ("csv", "parquet", "mcap"), "no such format", field="--format")
    axes, chosen = cast("Frame", frame), cast("RideFormat", form)
    read = load_scenario(scenario, overrides=settings or [], seed=seed)
    with ProgressWatcher(Console(stderr=True)) as watcher:
        names = export_scenario(
            read, out, format=chosen, draw=draw, truth=truth, contact=contact, axes=axes, watcher=watcher
        )
    print(f"wrote {number(len(names), 'recording')} into {out}:")
    for name in names:
        print(f"  {name}")
    print(f"next: simrail estimate {out / names[0]}")
    return DONE
