"""Methods on one recorded ride: what ``simrail estimate`` does. There is no truth to score against."""

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from simrail.campaign.progress import Watcher
from simrail.cli.options import say
from simrail.core.atomic_files import draft_of
from simrail.core.columns import ODOMETRY
from simrail.core.errors import InputError
from simrail.core.toml_files import blame, label
from simrail.estimation.estimate import Estimator, description_of
from simrail.estimation.recorded_ride import RecordedRide, whole_ride
from simrail.estimation.user_modules import class_named
from simrail.recording.evidence.judge import warnings_of
from simrail.recording.files.asked import MethodPart
from simrail.recording.files.frame_file import Format, write_frame
from simrail.recording.recording import Recording
from simrail.report.pages.estimate_page import RideEstimates, write_estimate_page
from simrail.report.tables.recorded import MethodResult, differences, rails_over_distance
from simrail.scenario.build_estimator import construct
from simrail.scenario.overrides import override
from simrail.scoring.measured_reference import score_reference
from simrail.track.rail_limits import exceedances, rail_lines, rail_sections

PAGE = "estimate.html"

DEFAULT = "TrackRelativeSmoother"
"""Method of a ride where neither command nor file names one."""

DRAWS = 20
"""Of a method that can draw its error and was not told how often: without draws no chance is known."""

CONTENTS = {
    "estimate": "states at each sample of the IMU",
    "innovations": "what was measured less what was predicted",
    "geometry": "rails, unfiltered",
    "rails_in_bands": "rails in bands of wavelengths, and twist",
    "sections": "standard deviation and peak of each section",
    "exceedances": "places beyond a limit, and how sure that is",
    "differences": "methods less the first of them",
    "scores": "methods less the reference",
}
"""What the files hold, by stem."""


@dataclass(frozen=True)
class Method:
    """A method under its name."""

    name: str
    method: str
    estimator: Estimator


def estimator_named(
    method: str,
    settings: Sequence[str],
    options: dict[str, Any] | None = None,
    *,
    folder: Path | None = None,
    draws: int | None = None,
) -> Estimator:
    """The estimator that a command or a ride file names, with its options.

    Parameters
    ----------
    method : str
        A registered name, or FILE.py:CLASS.
    settings : sequence of str
        ``option=value``, in place of what `options` says.
    options : dict, optional
        Options by name.
    folder : Path, optional
        Where files are looked for before the working folder.
    draws : int, optional
        How often a method that can draw its error does so, where nobody has said it.

    Raises
    ------
    InputError
        If there is no such estimator or option.
    """
    with blame("--estimator", method):
        estimator_class = class_named(method, folder)
    with blame("--set", method):
        chosen = override(dict(options or {}), settings)
        kind: object = estimator_class
        can_draw = is_dataclass(kind) and any(entry.name == "draws" for entry in fields(kind))
        if draws is not None and can_draw and "draws" not in chosen:
            try:
                return construct(estimator_class, {**chosen, "draws": draws}, folder=folder)
            except InputError as error:
                if error.field != "draws":  # a filter, or a method without rails, has none to draw
                    raise
        estimator: Estimator = construct(estimator_class, chosen, folder=folder)
    return estimator


def chosen_methods(
    asked: Sequence[MethodPart], named: Sequence[str], settings: Sequence[str], folder: Path
) -> list[Method]:
    """Methods that a command names, or else the ride file, or else `DEFAULT`.

    Parameters
    ----------
    asked : sequence of MethodPart
        Those of the ride file, which a command may name as well.
    named, settings : sequence of str
        ``--estimator`` and ``--set`` of the command.
    folder : Path
        Of the ride file.

    Raises
    ------
    InputError
        If one is not there, is named twice, or an option belongs to none.
    """
    by_name = {part.called: part for part in asked}
    parts = [by_name.get(name) or MethodPart(method=name) for name in named] or list(asked)
    parts = parts or [MethodPart(method=DEFAULT)]
    names = [part.called for part in parts]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise InputError(
                "is named twice",
                field="--estimator",
                value=name,
                limit="each method once",
                remedy="name two variants in the ride file, as [[estimator]] with a name and options",
            )
    shared: dict[str, list[str]] = {name: [] for name in names}
    for setting in settings:
        owner, dot, rest = setting.partition(".")
        if dot and owner in shared and "=" not in owner:
            shared[owner].append(rest)
        elif len(names) == 1:
            shared[names[0]].append(setting)
        else:
            raise InputError(
                "does not say whose option it is",
                field="--set",
                value=setting,
                limit=f"METHOD.OPTION=VALUE, of {', '.join(names)}",
                remedy=f"e.g. --set {names[0]}.{setting}",
            )
    return [
        Method(
            part.called,
            part.method,
            estimator_named(
                part.method,
                shared[part.called],
                part.options,
                folder=folder if part in asked else None,
                draws=DRAWS,
            ),
        )
        for part in parts
    ]


def judge_needs(method: Method, recording: Recording, file: str) -> None:
    """Refuse a method that has to be told where the train is, on a ride that does not say.

    Raises
    ------
    InputError
        Naming what would tell it.
    """
    if recording.odometry is None and "odometry" in description_of(method.estimator).needs:
        problem = f"{method.method} needs to know where the train is, and the ride does not say"
        limit = "[encoder], [odometer] or [odometry]"
        remedy = "add the table of the one that was recorded, or choose an estimator that needs none"
        raise InputError(problem, file=file, field="encoder", limit=limit, remedy=remedy)


def ride_with_warnings(ride: Path, limits: Sequence[str] = ()) -> RecordedRide:
    """Read a ride, and tell what is likely wrong with it; limits that a command names replace its own."""
    whole = whole_ride(ride)
    for line in warnings_of(whole.evidence):
        say(f"warning: {label(ride)}: {line}")
    if not limits:
        return whole
    own = whole.spec.limits.replaced(limits, option="--limit")
    return replace(whole, spec=whole.spec.model_copy(update={"limits": own}))


def estimate_ride(
    whole: RecordedRide,
    methods: Sequence[Method],
    folder: Path,
    *,
    file: str,
    format: Format = "csv",
    units: Collection[str] = (),
    watcher: Watcher | None = None,
) -> tuple[RideEstimates, list[Path]]:
    """Run methods on a ride, and write what they found.

    Parameters
    ----------
    whole : RecordedRide
        The ride, its limits and its reference.
    methods : sequence of Method
        The first is what others are compared with.
    folder : Path
        Where the files of `CONTENTS` that there are and ``estimate.html`` go; with several methods, those of
        each in a folder of its name. It appears, or replaces an earlier estimate, whole or not at all.
    file : str
        Name of the ride file, for messages.
    format : str
        ``"csv"`` or ``"parquet"``.
    units : collection of str
        ``"deg"``, ``"mm"``: units of the tables beside SI.
    watcher : Watcher, optional
        Is told of the progress.

    Returns
    -------
    estimates : RideEstimates
        What was found.
    files : list of Path
        What was written.

    Raises
    ------
    InputError
        If a method cannot run on the ride, or the folder holds other things.
    """
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / PAGE).is_file())):
        raise InputError(
            "holds other things than an estimate, and would be replaced",
            field="--out",
            value=str(folder),
            limit=f"a new folder, or one that holds an {PAGE}",
            remedy="choose another folder with --out",
        )
    for method in methods:
        judge_needs(method, whole.recording, file)
    results, watcher = [], watcher or Watcher()
    for done, method in enumerate(methods):
        watcher.works("estimate", done / (len(methods) + 1))
        results.append(_run(method, whole))
    watcher.works("estimate", len(methods) / (len(methods) + 1))
    limits = whole.spec.limits.limits()
    scores = None
    if whole.reference is not None:
        reference, base = whole.reference, limits.twist_base_m
        scored = [score_reference(r.estimate, r.recording, reference, twist_base_m=base) for r in results]
        named = [table.assign(estimator=r.name) for table, r in zip(scored, results, strict=True)]
        scores = pd.concat(named, ignore_index=True)
    found = RideEstimates(whole.recording, tuple(results), limits, whole.reference, scores)
    written: list[Path] = []
    with draft_of(folder) as draft:
        for result in results:
            place = draft / result.name if len(results) > 1 else draft
            place.mkdir(exist_ok=True)
            written += _write_method(result, found, place, format, units)
        beside = {
            "differences": differences(results) if len(results) > 1 else None,
            "scores": scores,
        }
        for stem, frame in beside.items():
            if frame is not None:
                about = f"{CONTENTS[stem]}, recorded ride {whole.recording.name!r}"
                plain = frame.astype(dict.fromkeys(frame.select_dtypes("category"), str))
                write_frame(plain, draft / f"{stem}.{format}", format=format, about=about)
                written.append(draft / f"{stem}.{format}")
        write_estimate_page(draft / PAGE, found)
        written.append(draft / PAGE)
        files = [folder / path.relative_to(draft) for path in written]
    return found, files


def _run(method: Method, whole: RecordedRide) -> MethodResult:
    """One method on the ride."""
    recording, begun = whole.recording, time.perf_counter()
    estimate = method.estimator.estimate(recording)
    seconds = time.perf_counter() - begun
    if not len(estimate.states.columns):
        raise InputError(
            "concludes nothing",
            field="--estimator",
            value=method.method,
            limit="an estimate with states",
            remedy="choose another estimator",
        )
    if {*ODOMETRY} <= {*estimate.states.columns}:
        # A method that finds the place itself says where its figures belong.
        recording = recording.with_odometry(estimate.states[[*ODOMETRY]], method.name)
    lines = []
    if estimate.geometry is not None:
        base = whole.spec.limits.limits().twist_base_m
        lines = rail_lines(estimate.geometry, estimate.geometry_draws, twist_base_m=base)
    told = description_of(method.estimator)
    shown = repr(method.estimator)
    return MethodResult(
        method.name, told.label, shown, recording, estimate, tuple(lines), seconds, told.cites
    )


def _write_method(
    result: MethodResult, found: RideEstimates, folder: Path, format: Format, units: Collection[str]
) -> list[Path]:
    """Write the tables of one method."""
    states = result.estimate.states
    if result.recording.odometry is not None:
        # Where each state belongs on the track stands beside it, as the odometry has it.
        place = [name for name in ("position_m", "speed_mps") if name not in states]
        states = states.join(result.recording.odometry[place])
    lines = result.lines
    frames = {
        "estimate": states,
        "innovations": result.estimate.innovations,
        "geometry": result.estimate.geometry,
        "rails_in_bands": rails_over_distance(lines) if lines else None,
        "sections": rail_sections(lines, found.limits) if lines else None,
        "exceedances": exceedances(lines, found.limits) if lines else None,
    }
    written = []
    for stem, frame in frames.items():
        if frame is not None:
            path = folder / f"{stem}.{format}"
            about = f"{CONTENTS[stem]}, by {result.name} of the recorded ride {found.recording.name!r}"
            write_frame(frame, path, format=format, about=about, units=units)
            written.append(path)
    return written
