"""How the vehicles of a scenario shake, mount by mount and speed by speed, against published spectra."""

from collections.abc import Sequence

import pandas as pd

from simrail.campaign.cell import simulated
from simrail.campaign.progress import Watcher
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells
from simrail.scenario.scenario import Scenario
from simrail.scoring.published_spectra import MountKind, PublishedSpectrum
from simrail.scoring.vibration_levels import compare, mount_kind, steady_levels


def scenario_spectra(
    scenario: Scenario, spectra: Sequence[PublishedSpectrum], *, watcher: Watcher | None = None
) -> pd.DataFrame:
    """Simulate the rides of a scenario that shake, and compare the octaves of every mount.

    Parameters
    ----------
    scenario : Scenario
        As read. Of every ride the first draw counts; rides without vibration are left out.
    spectra : sequence of PublishedSpectrum
        What to compare with.
    watcher : Watcher, optional
        Is told how it goes.

    Returns
    -------
    DataFrame
        `simrail.scoring.vibration_levels.compare`; of rides at one speed the last counts.

    Raises
    ------
    InputError
        If no ride shakes, or the truth's rate is too low.
    """
    watcher, parts = watcher or Watcher(), Parts(scenario)
    chosen: dict[tuple[int, str], Cell] = {}
    for cell in cells(scenario):
        shakes = cell.spec.vibration is not None and not cell.spec.vibration.off
        if shakes and cell.sample == cell.track_draw == 0:
            chosen.setdefault((cell.ride_number, cell.imu.name), cell)
    if not chosen:
        raise InputError(
            "has no ride that shakes",
            file=scenario.file,
            field="vibration",
            remedy="add the table [vibration]; its defaults will do",
            limit="a scenario with a table [vibration]",
        )
    numbers = sorted({number for number, _ in chosen})
    levels: dict[tuple[str, MountKind, float], FloatArray] = {}
    for count, number in enumerate(numbers, start=1):
        of_ride = [cell for (ride, _), cell in chosen.items() if ride == number]
        truth = simulated(of_ride[0], parts, watcher, count, len(numbers))
        vehicle = parts.ride(of_ride[0]).vehicle
        for cell in of_ride:
            mount = parts.resolve(cell).mount
            kind = mount_kind(mount.body, vehicle)
            for speed, level in steady_levels(truth, mount).items():
                levels[cell.imu.name, kind, speed] = level
    return compare(levels, spectra)
