"""One estimator on one recorded ride: what ``simrail estimate`` does. There is no truth, so no scores."""

import time
from collections.abc import Sequence
from pathlib import Path

from simrail.cli.options import say
from simrail.core.atomic_files import draft_of
from simrail.core.columns import ODOMETRY
from simrail.core.errors import InputError
from simrail.core.toml_files import blame, label
from simrail.estimation.estimate import Estimate, Estimator, description_of
from simrail.estimation.recorded_ride import judged_ride
from simrail.estimation.user_modules import class_named
from simrail.recording.evidence.judge import warnings_of
from simrail.recording.files.ride_writer import Format, write_frame
from simrail.recording.recording import Recording
from simrail.report.pages.estimate_page import write_estimate_page
from simrail.scenario.build_estimator import construct
from simrail.scenario.overrides import override

PAGE = "estimate.html"


def estimator_named(method: str, settings: Sequence[str]) -> Estimator:
    """The estimator that a command names, with its options.

    Raises
    ------
    InputError
        If there is no such estimator or option.
    """
    with blame("--estimator", method):
        estimator_class = class_named(method, None)
    with blame("--set", method):
        estimator: Estimator = construct(estimator_class, override({}, settings))
    return estimator


def ride_for(estimator: Estimator, method: str, ride: Path) -> Recording:
    """Read a ride for an estimator.

    Raises
    ------
    InputError
        If it cannot be read, or does not say where the train is, which the estimator has to be told.
    """
    recording, evidence = judged_ride(ride)
    for line in warnings_of(evidence):
        say(f"warning: {label(ride)}: {line}")
    if recording.odometry is None and "odometry" in description_of(estimator).needs:
        problem = f"{method} needs to know where the train is, and the ride does not say"
        limit = "[encoder], [odometer] or [odometry]"
        remedy = "add the table of the one that was recorded, or choose an estimator that needs none"
        raise InputError(problem, file=label(ride), field="encoder", limit=limit, remedy=remedy)
    return recording


def estimate_ride(
    ride: Path, method: str, folder: Path, *, settings: Sequence[str] = (), format: Format = "csv"
) -> tuple[Recording, Estimate]:
    """Read a ride, run an estimator on it, and write what it found.

    Parameters
    ----------
    ride : Path
        A ride file, or a folder with one.
    method : str
        Registered name, or ``"file.py:Class"``.
    folder : Path
        Where ``estimate.<format>``, ``innovations.<format>``, ``geometry.<format>`` (those that the method
        has) and ``estimate.html`` go. It appears, or replaces an earlier estimate, whole or not at all.
    settings : sequence of str
        Options of the estimator, ``option=value``.
    format : str
        ``"csv"`` or ``"parquet"``.

    Raises
    ------
    InputError
        If the ride cannot be read, there is no such estimator or option, or the folder holds other
        things.
    """
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / PAGE).is_file())):
        raise InputError(
            "holds other things than an estimate, and would be replaced",
            field="--out",
            value=str(folder),
            limit=f"a new folder, or one that holds an {PAGE}",
            remedy="choose another folder with --out",
        )
    estimator = estimator_named(method, settings)
    recording = ride_for(estimator, method, ride)
    begun = time.perf_counter()
    estimate = estimator.estimate(recording)
    us_per_sample = 1e6 * (time.perf_counter() - begun) / len(recording.imu)
    if not len(estimate.states.columns):
        raise InputError(
            "concludes nothing",
            field="--estimator",
            value=method,
            limit="an estimate with states",
            remedy="choose another estimator",
        )
    states = estimate.states
    if {*ODOMETRY} <= {*states.columns}:
        # A method that finds the place itself says where its figures belong.
        recording = recording.with_odometry(states[[*ODOMETRY]], method)
    if recording.odometry is not None:
        # Where each state belongs on the track stands beside it, as the odometry has it.
        place = [name for name in ("position_m", "speed_mps") if name not in states]
        states = states.join(recording.odometry[place])
    with draft_of(folder) as draft:
        write_frame(states, draft / f"estimate.{format}", format=format)
        for name in ("innovations", "geometry"):
            frame = getattr(estimate, name)
            if frame is not None:
                write_frame(frame, draft / f"{name}.{format}", format=format)
        write_estimate_page(
            draft / PAGE,
            recording,
            estimate,
            label=description_of(estimator).label,
            method=repr(estimator),
            us_per_sample=us_per_sample,
        )
    return recording, estimate
