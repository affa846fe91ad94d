"""One estimator on several recorded rides over the same rails, fused: ``simrail estimate --fuse``."""

from collections.abc import Collection, Sequence
from pathlib import Path

from simrail.cli.estimate_ride import Method, estimator_named, judge_needs, ride_with_warnings
from simrail.core.atomic_files import draft_of
from simrail.core.csv_files import write_csv
from simrail.core.toml_files import blame, label
from simrail.estimation.estimate import Estimate
from simrail.estimators.rails.fuse import Fused, fuse, rails_and_place_of
from simrail.recording.files.frame_file import Format, write_frame
from simrail.recording.files.ride_writer import refuse_existing


def fuse_rides(
    rides: Sequence[Path],
    method: str,
    folder: Path,
    *,
    settings: Sequence[str] = (),
    format: Format = "csv",
    units: Collection[str] = (),
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
    units : collection of str
        ``"mm"``: the unit of the rails beside SI.

    Raises
    ------
    InputError
        If a ride cannot be read, there is no such estimator or option, it says nothing of the rails, the
        rides share too little of a line, or the folder exists.
    """
    refuse_existing(folder)
    estimator = estimator_named(method, settings)
    estimates: list[Estimate] = []
    for ride in rides:
        recording = ride_with_warnings(ride).recording
        judge_needs(Method(method, method, estimator), recording, label(ride))
        estimates.append(rails_and_place_of(estimator.estimate(recording), recording))
    with blame("--fuse", method):
        fused = fuse(estimates)
    with draft_of(folder) as draft:
        about = f"rails of {len(rides)} passes, fused by {method}"
        write_frame(fused.geometry, draft / f"geometry.{format}", format=format, about=about, units=units)
        about = "by pass, how much further on the same rails lie in it, m"
        write_frame(fused.shifts, draft / f"shifts.{format}", format=format, about=about)
        table = fused.passes.assign(ride=[label(ride) for ride in rides])
        write_csv(table.reset_index(), draft / "passes.csv", float_format=None)
    return fused
