"""``simrail tune my_ride.toml``: an estimator's parameters by the likelihood of recorded rides."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from simrail.core.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from simrail.campaign.progress import Watcher
    from simrail.estimators.tuning.file import TuningResult


def refuse_of_scenarios(options: Mapping[str, Any], method: str) -> None:
    """Refuse what says nothing to a recorded ride: a search against known rails, draws, a choice of IMUs.

    Raises
    ------
    InputError
        Naming the option.
    """
    if method != "cml":
        raise InputError(
            "searches against known rails, and those below a recorded ride nobody knows",
            field="--method",
            value=method,
            limit="cml for a recorded ride",
            remedy="use --method cml: a likelihood needs no known rails",
        )
    for option, value in options.items():
        if value is not None:
            raise InputError(
                "is for scenarios, not for recorded rides",
                field=option,
                value=value,
                limit="only for scenarios",
                remedy="leave it out",
            )


def tune_rides(
    rides: Sequence[Path],
    file: Path,
    *,
    estimator: str | None,
    options: Sequence[str],
    settings: Mapping[str, Any],
    evaluations: int,
    at_most: int | None,
    seed: int,
    command: str,
    watcher: Watcher,
) -> tuple[TuningResult, dict[str, pd.DataFrame], str]:
    """Read rides, search, and write what was found.

    Parameters
    ----------
    rides : sequence of Path
        Ride files; methods are those of the first.
    file : Path
        Of the tuning.
    estimator : str, optional
        A method of the ride file, a registered one, or FILE.py:CLASS.
    options : sequence of str
        ``option=value`` of the estimator.
    settings, evaluations, at_most, seed, command, watcher
        See `simrail.campaign.tune.tune_recordings`.

    Returns
    -------
    result, identified
        See there.
    use : str
        The command that takes the tuning.
    """
    from simrail.campaign.tune import tune_recordings
    from simrail.cli.estimate_ride import chosen_methods, judge_needs, ride_with_warnings
    from simrail.core.toml_files import label
    from simrail.recording.files.ride_reader import ride_file

    wholes = [ride_with_warnings(ride) for ride in rides]
    asked = [
        # A tuning that the ride file names may be the one that is made here.
        part.model_copy(update={"options": {k: v for k, v in part.options.items() if k != "tuning"}})
        for part in wholes[0].spec.estimator
    ]
    named = [estimator] if estimator else [asked[0].called] if asked else []
    (method,) = chosen_methods(asked, named, options, ride_file(rides[0]).parent)
    for ride, whole in zip(rides, wholes, strict=True):
        judge_needs(method, whole.recording, label(ride_file(ride)))
    result, identified = tune_recordings(
        [whole.recording for whole in wholes],
        file,
        estimator=method.estimator,
        settings=settings,
        evaluations=evaluations,
        at_most=at_most,
        seed=seed,
        command=command,
        watcher=watcher,
    )
    words = ["simrail", "estimate", str(rides[0])]
    words += ["--estimator", estimator] if estimator else []
    for option in (*options, f"tuning={file}"):
        words += ["--set", option]
    return result, identified, shlex.join(words)
