"""``simrail spectra``: how a scenario's vehicles shake in octaves, against published spectra."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simrail.cli.options import DONE, Scenario, Seed, Settings
from simrail.core.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console


def spectra(
    scenario: Scenario,
    against: Annotated[
        list[str] | None,
        typer.Option(
            "--against",
            metavar="NAME|FILE",
            help="A published spectrum; all that are shipped if none is named. Repeatable.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write the table there as CSV, too.")
    ] = None,
    seed: Seed = None,
    settings: Settings = None,
) -> int:
    """Compare the vibration of axles, frames and floors with published spectra, octave by octave."""
    from rich.console import Console

    from simrail.campaign.progress import ProgressWatcher
    from simrail.campaign.spectra import scenario_spectra
    from simrail.core.atomic_files import write_whole
    from simrail.core.csv_files import csv_bytes
    from simrail.scenario.scenario import load_scenario
    from simrail.scoring.published_spectra import MOUNTS, read_spectrum, shipped_spectra
    from simrail.scoring.vibration_levels import verdicts

    read = load_scenario(scenario, overrides=settings or [], seed=seed)
    published = [read_spectrum(name) for name in against] if against else shipped_spectra()
    if out is not None and out.is_dir():
        raise InputError("is a folder", field="--out", value=out, remedy="name a file", limit="a file")
    with ProgressWatcher(Console(stderr=True)) as watcher:
        table = scenario_spectra(read, published, watcher=watcher)
    _show(Console(), table)
    for kind, verdict in verdicts(table).items():
        print(f"{MOUNTS[kind]}: {verdict}")
    if out is not None:
        content = csv_bytes(table, float_format="%.6g")
        print(f"wrote {write_whole(out, content, what='table')}")
    return DONE


def _show(console: Console, table: pd.DataFrame) -> None:
    """Print the table."""
    from rich.table import Table

    shown = Table(box=None, pad_edge=False)
    for title in ("mount", "m/s", "Hz", "simulated, m/s2", "published", "ratio", "spectrum"):
        shown.add_column(title, justify="left" if title in ("mount", "spectrum") else "right")
    for row in table.itertuples(index=False):
        known = row.published_kind != ""
        shown.add_row(
            str(row.mount),
            f"{row.speed_mps:g}",
            f"{row.octave_hz:g}",
            f"{row.simulated_mps2:.3g}",
            f"{row.published_mps2:.3g}" if known else "",
            f"{row.ratio:.2f}{'' if row.within else ' !'}" if known else "",
            f"{row.spectrum} ({row.published_kind})" if known else "",
        )
    console.print(shown)
