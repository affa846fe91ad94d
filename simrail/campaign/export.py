"""A scenario's recordings as files, for work outside of simrail: one folder each, in the form of a ride.

Simulates (or finds in the cache) the rides of a scenario, draws the sensors as a campaign would, and writes
what they recorded. Nothing is estimated here.
"""

from dataclasses import replace
from itertools import groupby
from pathlib import Path

import pandas as pd

from simrail.campaign.cell import record_cell, simulated
from simrail.campaign.progress import Watcher
from simrail.core.atomic_files import draft_of
from simrail.core.csv_files import write_csv
from simrail.core.errors import InputError
from simrail.core.interrupts import interruptible
from simrail.recording.files.frame_file import write_frame
from simrail.recording.files.mcap_file import Topic, needs_mcap, write_mcap
from simrail.recording.files.ned import Frame, in_ned
from simrail.recording.files.ride_writer import MCAP_FILE, RideFormat, refuse_existing, write_parts
from simrail.ride.truth import Truth
from simrail.scenario.cells import Cell, cell_record, first_cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario
from simrail.scoring.score import truth_at_imu

INDEX_FILE = "recordings.csv"
TRUTH_STEM = "truth_not_part_of_the_recording"
CONTACT_FOLDER = "contact_not_part_of_the_recording"
OF_A_RUN = ("cell", "case", "sample", "track_draw")
"""Labels of a cell that say something within a campaign only."""


def export(
    scenario: Scenario,
    folder: Path,
    *,
    format: RideFormat = "csv",
    draw: int = 0,
    truth: bool = False,
    contact: bool = False,
    axes: Frame = "flu",
    watcher: Watcher | None = None,
) -> list[str]:
    """Write every recording of a scenario, for one draw of track and sensors.

    Parameters
    ----------
    scenario : Scenario
        As read; its estimators are not used.
    folder : Path
        Must not exist yet; it appears whole or not at all.
    format : str
        ``"csv"``, ``"parquet"`` or ``"mcap"`` (one file a recording, as `simrail.recording.files.mcap_file`).
    draw : int
        Draw of the sensors, one of the scenario's; the track is that of its first draw.
    truth : bool
        Writes the true motion of the mount at the IMU's times beside each recording, too.
    contact : bool
        Writes the forces between wheels and rails beside each recording, too: one file per wheel.
    axes : {"flu", "ned"}
        Axes of body and ground: simrail's own, or FRD and NED (`simrail.recording.files.ned`), named in the
        columns.
    watcher : Watcher, optional
        Is told of the progress.

    Returns
    -------
    list of str
        Names of the recordings: the folder holds one folder for each, and an index, ``recordings.csv``, with
        the values of the scenario's axes.

    Raises
    ------
    InputError
        If the folder exists, there is no such draw, the scenario cannot be run, or what writes MCAP is not
        installed; nothing is written then.
    """
    watcher = watcher or Watcher()
    refuse_existing(folder)
    if format == "mcap":
        needs_mcap(folder / MCAP_FILE)
    draws = scenario.spec.monte_carlo.sensor_draws
    if draw >= draws:
        raise InputError(
            "the scenario has no such draw",
            file=scenario.file,
            field="--draw",
            value=draw,
            limit=f"0 to {draws - 1}",
            remedy=f"take one of these, or add --set monte_carlo.sensor_draws={draw + 1}",
        )
    parts = judge_scenario(scenario).parts
    if contact and not scenario.spec.contact_rate_hz:
        raise InputError(
            "the scenario keeps no forces between wheels and rails",
            file=scenario.file,
            field="contact_rate_hz",
            value=0.0,
            limit="> 0 Hz",
            remedy="add --set contact_rate_hz=200.0, or another rate that divides truth_rate_hz",
        )
    chosen = [replace(cell, sensor_draw=draw) for cell in first_cells(scenario)]
    rides = len({cell.ride_number for cell in chosen})
    names = _names(chosen)
    records = []
    with interruptible(), draft_of(folder) as draft:
        for number, (_, group) in enumerate(groupby(chosen, key=lambda cell: cell.ride_number), start=1):
            ride_cells = list(group)
            motion = simulated(ride_cells[0], parts, watcher, number, rides)
            for cell in ride_cells:
                recording = record_cell(cell, motion, parts)
                name = names[cell.number]
                (draft / name).mkdir()
                write_parts(recording, draft / name, format=format, axes=axes)
                if truth:
                    true = truth_at_imu(motion, recording)
                    _write_truth(true, draft / name / f"{TRUTH_STEM}.{format}", format, recording.mount, axes)
                if contact:
                    _write_contact(motion, draft / name / CONTACT_FOLDER, format=format)
                labels = cell_record(cell).items()
                records.append(
                    {"folder": name} | {key: value for key, value in labels if key not in OF_A_RUN}
                )
                watcher.recording_written(len(records), len(chosen), name)
        write_csv(pd.DataFrame.from_records(records), draft / INDEX_FILE, float_format=None)
    return list(names.values())


def _write_truth(truth: pd.DataFrame, path: Path, format: RideFormat, mount: str, axes: Frame) -> None:
    """Write the true motion of a mount."""
    if format == "mcap":
        write_mcap(path, [Topic("truth", truth, mount)], axes=axes)
    else:
        about = f"true motion of {mount!r}, part of no recording"
        turned = truth if axes == "flu" else in_ned(truth)
        write_frame(turned, path, format=format, about=about, axes=axes)


def _write_contact(truth: Truth, folder: Path, *, format: RideFormat) -> None:
    """Write the forces of every wheel, a file each."""
    folder.mkdir()
    for wheel in truth.contacts or truth.wheel_names:
        forces, path = truth.contact(wheel), folder / f"{wheel}.{format}"
        if format == "mcap":
            write_mcap(path, [Topic(wheel, forces)])
        else:
            write_frame(forces, path, format=format, about=f"forces between the wheel {wheel} and its rail")


def _names(chosen: list[Cell]) -> dict[int, str]:
    """Folder of each cell: ride, IMU and grade, and a number where that is not enough."""
    plain = {cell.number: f"{cell.ride.name}_{cell.imu.name}_{Path(cell.imu.grade).stem}" for cell in chosen}
    taken = list(plain.values())
    width = len(str(len(chosen) - 1))
    return {
        number: name if taken.count(name) == 1 else f"{name}_{i:0{width}d}"
        for i, (number, name) in enumerate(plain.items())
    }
