"""Finished results read back: tables, manifest and the scenario that they are of.

For what sets new results beside former ones, or goes on with them. It judges that the files are there and
belong together, not whether the code that made them is today's: who needs that compares the keys.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from simrail.core.atomic_files import restore
from simrail.core.errors import InputError
from simrail.scenario.scenario import Scenario, read_scenario
from simrail.scoring.table import SCORE_COLUMNS


@dataclass(frozen=True)
class StoredResults:
    """What a results folder holds.

    Attributes
    ----------
    folder : Path
        Where it is.
    manifest : dict
        As `simrail.results.describe` makes it.
    scores, cells : pandas.DataFrame
        The score table, and one row per cell.
    """

    folder: Path
    manifest: dict[str, Any]
    scores: pd.DataFrame
    cells: pd.DataFrame

    def scenario(self) -> Scenario:
        """The scenario as it was run, settings applied; files that it names are not looked for.

        Raises
        ------
        InputError
            If today's simrail does not read it any more.
        """
        manifest = self.manifest
        name, settings = str(manifest["scenario"]), [*manifest["settings"], f"seed={manifest['seed']}"]
        file = f"{self.folder / 'manifest.json'}, scenario_text"
        return read_scenario(str(manifest["scenario_text"]), name=name, file=file, overrides=settings)


def read_results(folder: Path, *, field: str, remedy: str) -> StoredResults:
    """Read a results folder.

    Parameters
    ----------
    folder : Path
        Folder of finished results.
    field, remedy : str
        What asked for them, and what to do if they are not there, for the message.

    Raises
    ------
    InputError
        If one of the files is missing, cannot be read, or lacks what today's simrail writes into it.
    """
    restore(folder)
    try:
        manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        scores, cells = (pd.read_parquet(folder / f"{name}.parquet") for name in ("scores", "cells"))
    except (OSError, ValueError) as error:
        problem = "there are no finished results there"
        raise InputError(
            problem, field=field, value=str(folder), remedy=remedy, limit="a folder of finished results"
        ) from error
    if "map" not in scores:
        # Written before trains had maps of their own: each knew the line as it was laid.
        scores["map"], cells["map"] = "exact", "exact"
    if "vibration" not in scores:
        # Written before tables said so: no scenario but one of vibration itself had any.
        scores["vibration"], cells["vibration"] = "off", "off"
    for what, names, needed in (
        ("manifest", manifest, ("scenario", "settings", "seed", "scenario_text")),
        ("score table", scores, SCORE_COLUMNS),
        ("table of cells", cells, ("cell", "case")),
    ):
        missing = [name for name in needed if name not in names]
        if missing:
            problem = f"its {what} does not say {missing[0]}"
            raise InputError(
                problem, field=field, value=str(folder), remedy=remedy, limit="a folder of finished results"
            )
    return StoredResults(folder, manifest, scores, cells)
