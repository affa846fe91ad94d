"""A recorded ride, ready for estimators: its signals, an odometry, and whether all that can be true."""

import warnings
from dataclasses import dataclass, replace
from pathlib import Path

from simrail.core.toml_files import blame, label
from simrail.estimation.choose_odometry import with_odometry
from simrail.recording.check_field import check_hard_iron
from simrail.recording.check_physics import check_plausible
from simrail.recording.check_sheet import check_ranges
from simrail.recording.evidence.judge import Evidence, warnings_of
from simrail.recording.files.asked import RideReference
from simrail.recording.files.ride_file import RideFile
from simrail.recording.files.ride_reader import read_whole, ride_file
from simrail.recording.recording import Recording


def read_ride(path: Path) -> Recording:
    """Read a ride, of a real train or one that `write_ride` wrote.

    Where the file has no odometry, the recording gets that of its encoder or odometer
    (`simrail.estimators.odometry.encoder`); without either it has none.

    Parameters
    ----------
    path : Path
        A ride file, or a folder that holds a ``ride.toml``.

    Raises
    ------
    InputError
        If a file is missing or unreadable, or says something impossible, or the recording passes neither
        `check_recording` nor `check_plausible`, or its samples are not those of its sheets.

    Warns
    -----
    UserWarning
        Of each figure that is likely wrong.
    """
    recording, evidence = judged_ride(path)
    for line in warnings_of(evidence):
        warnings.warn(line, stacklevel=2)
    return recording


def judged_ride(path: Path) -> tuple[Recording, Evidence]:
    """As `read_ride`, with what the ride says of itself, and without a warning."""
    ride = whole_ride(path)
    return ride.recording, ride.evidence


@dataclass(frozen=True)
class RecordedRide:
    """All that a ride file brings.

    Attributes
    ----------
    recording : Recording
        What methods may see.
    evidence : Evidence
        What the ride says of itself.
    spec : RideFile
        The file: methods and limits that it names.
    reference : RideReference, optional
        What estimates are compared with; no method sees it.
    """

    recording: Recording
    evidence: Evidence
    spec: RideFile
    reference: RideReference | None = None


def whole_ride(path: Path) -> RecordedRide:
    """As `judged_ride`, with what its file asks for.

    Raises
    ------
    InputError
        As `read_ride`.
    """
    recording, spec, reference = read_whole(path)
    if recording.odometry is None and (recording.encoder is not None or recording.odometer is not None):
        source = "encoder" if recording.odometer is None else "odometer"
        # The ride is over: where it begins at speed, its first seconds are answered by later ones.
        recording = with_odometry(recording, "encoder_hindsight", source=source)
        recording = replace(recording, notes=(*recording.notes, *_begun(recording)))
    with blame(label(ride_file(path))):
        evidence = check_plausible(recording)
        check_ranges(recording)
        check_hard_iron(recording)
    return RecordedRide(recording, evidence, spec, reference)


def _begun(recording: Recording) -> tuple[str, ...]:
    """A note of a ride that begins at speed, by its odometry."""
    if recording.odometry is None or recording.encoder is None:
        return ()
    first = recording.odometry.iloc[0]
    if first["speed_mps"] == 0.0:
        return ()
    return (
        f"the ride begins at speed, {first['speed_mps']:.2f} +- {first['speed_sd_mps']:.2f} m/s: the wheel's "
        "first seconds are answered by later readings, which no causal method can do",
    )
