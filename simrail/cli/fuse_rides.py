"""One estimator on several recorded rides over the same rails, fused: ``simrail estimate --fuse``."""

from collections.abc import Sequence
from pathlib import Path

from simrail.core.atomic_files import draft_of
from simrail.core.errors import InputError
from simrail.core.toml_files import blame, label
from simrail.estimation.estimate import Estimate, description_of
from simrail.estimation.recorded_ride import read_ride
from simrail.estimation.user_modules import class_named
from simrail.estimators.rails.fuse import Fused, fuse, rails_and_place_of
from simrail.recording.files.ride_writer import Format, refuse_existing, write_frame
from simrail.scenario.build_estimator import construct
from simrail.scenario.overrides import override


def fuse_rides(
    rides: Sequence[Path], method: str, folder: Path, *, settings: Sequence[str] = (), format: Format = "csv"
) -> Fused:
    """Read rides, run an estimator on each, fuse their rails, and write what was found.

    Parameters
    ----------
    rides : sequence of Path
        Ride files, or folders with one, over the same stretch of one line.
    method : str
        Registered name, or ``"file.py:Class"``.
    folder : Path
        Where ``geometry.<format>``, ``shifts.<format>`` and ``passes.csv`` go; must not exist yet.
    settings : sequence of str
        Options of the estimator, ``option=value``.
    format : str
        ``"csv"`` or ``"parquet"``.

    Raises
    ------
    InputError
        If a ride cannot be read, there is no such estimator or option, it says nothing of the rails, the
        rides share too little of a line, or the folder exists.
    """
    refuse_existing(folder)
    with blame("--estimator", method):
        estimator_class = class_named(method, None)
    with blame("--set", method):
        estimator = construct(estimator_class, override({}, settings))
    estimates: list[Estimate] = []
    for ride in rides:
        recording = read_ride(ride)
        if recording.odometry is None and "odometry" in description_of(estimator).needs:
            raise InputError(
                f"{method} needs to know where the train is, and the ride does not say",
                file=label(ride),
                field="encoder",
                limit="[encoder], [odometer] or [odometry]",
                remedy="add the table of the one that was recorded, or choose an estimator that needs none",
            )
        estimates.append(rails_and_place_of(estimator.estimate(recording), recording))
    with blame("--fuse", method):
        fused = fuse(estimates)
    with draft_of(folder) as draft:
        write_frame(fused.geometry, draft / f"geometry.{format}", format=format)
        write_frame(fused.shifts, draft / f"shifts.{format}", format=format)
        table = fused.passes.assign(ride=[label(ride) for ride in rides])
        table.to_csv(draft / "passes.csv")
    return fused
