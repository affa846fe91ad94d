"""What an estimator concludes, and what an estimator is.

An `Estimate` holds numbers only: it neither plots nor saves itself. Scores against the truth are
made in `simrail.scoring.score`, the only place where truth and estimate meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import Protocol, runtime_checkable

import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording


@dataclass(frozen=True)
class Estimate:
    """States over time that an estimator found.

    Attributes
    ----------
    states : pandas.DataFrame
        Indexed by ``time_s`` (the recording's IMU times), columns from `simrail.core.columns`; standard
        deviations (``roll_sd_rad`` ...) where the method has them.
    mount : str
        Name of the IMU that the states speak of.
    innovations : pandas.DataFrame, optional
        Indexed by ``time_s``; columns ``simrail.core.columns.INNOVATION``, and ``RATE_INNOVATION`` where the
        method predicts the gyro as well.
    covariance : ndarray (n, m, m), optional
        Covariance of the states named in `covariance_of`.
    covariance_of : tuple of str
        Names of the m states, in the order of `covariance`.
    geometry : pandas.DataFrame, optional
        Rail irregularities over a uniform ``position_m``, columns `simrail.core.columns.IRREGULARITY`, with
        `IRREGULARITY_SD` where the method has them. A column that is NaN throughout is one that the method
        cannot observe; any other is finite.
    geometry_draws : ndarray (m, places, 4), optional
        m independent draws of true minus estimated irregularities, of equal probability, m: columns
        `simrail.core.columns.IRREGULARITY` over the places of `geometry`, NaN where that is. What is linear
        in the rails, such as a band of wavelengths, has the standard deviation of its draws.
    """

    states: pd.DataFrame
    mount: str
    innovations: pd.DataFrame | None = None
    covariance: FloatArray | None = None
    covariance_of: tuple[str, ...] = ()
    geometry: pd.DataFrame | None = None
    geometry_draws: FloatArray | None = None


SENSORS = ("encoder", "magnetometer", "rail_sensor")
"""What an estimator may need beside the IMU, by the names of a scenario's tables."""


@runtime_checkable
class Estimator(Protocol):
    """One method. Parameters are fields of a frozen dataclass; `estimate` is its only verb.

    A method that cannot do without some of `SENSORS` may name them in an attribute ``needs`` (tuple of
    str): a scenario without them is refused before anything runs.
    """

    causal: bool
    """True if the states at a time use nothing recorded later; `simrail.estimation.conformance` checks it."""

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate from a recording and nothing else."""
        ...


@cache
def estimator_class(method: str) -> type[Estimator]:
    """Find an estimator by the name it is registered under.

    Parameters
    ----------
    method : str
        Name in the entry-point group ``simrail.estimators``, e.g. ``"AttitudeEkf"``.

    Raises
    ------
    InputError
        If no installed package registers that name; the message lists those that are there.
    """
    found = entry_points(group="simrail.estimators")
    for entry in found:
        if entry.name == method:
            loaded: type[Estimator] = entry.load()
            return loaded
    raise InputError(
        "no such estimator",
        value=method,
        limit="one of " + ", ".join(sorted({entry.name for entry in found})),
        remedy="install the package that registers it under the entry-point group simrail.estimators",
    )


def estimate_many(estimator: Estimator, recordings: Sequence[Recording]) -> list[Estimate]:
    """Run an estimator on many recordings, in its own batch verb where it has one."""
    batch = getattr(estimator, "estimate_many", None)
    if batch is not None:
        results: list[Estimate] = batch(recordings)
        return results
    return [estimator.estimate(recording) for recording in recordings]
