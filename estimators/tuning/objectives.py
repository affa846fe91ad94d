"""What a tuning of the trajectory smoother minimises: a recording's unlikeliness, or the error of the rails.

Gonzalez-Carbajal et al. 2023 (paper 001), section 4: CML and KOM. The rails that KOM knows are handed in as a
frame, as a measured reference would be. Not here: the search (`simrail.estimators.tuning.tune`).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pandas as pd
from simrail.estimators.trajectory.model import Model, kinds_of, with_noise
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.trajectory.smoother import OUTPUT, TrajectorySmoother, likelihoods, run_model
from simrail.estimators.trajectory.track_geometry import track_geometry
from simrail.estimators.tuning.search import Batch
from simrail.estimators.tuning.space import SearchSpace

from simrail.core.columns import ATTITUDE, IRREGULARITY, RELATIVE_POSITION, require
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.track.bands import Band, band_pass, why_not
from simrail.track.design import STRAIGHT

KINDS = ("straights", "curves")
"""What a set is for if there are two of them; curves with their transitions."""

TUNED = IRREGULARITY[:3]
"""What the known output is judged by; gauge does not depend on the trajectory (paper, Eq. 18)."""

STEP_M = 0.25
"""Distance of the places at which the rails are compared, unless another is given."""


class Objective(Protocol):
    """What is minimised."""

    unit: str

    def value(self, parameters: Hyperparameters) -> float:
        """Of a set of hyper-parameters that holds throughout."""
        ...


@dataclass(frozen=True)
class Likelihood:
    """Negative log-likelihood per sample, over all recordings: what CML minimises.

    Attributes
    ----------
    models : tuple of Model
        One per recording.
    counts : tuple of ndarray of bool (n,)
        Which samples count, in each; all of them go through the filter.
    """

    models: tuple[Model, ...]
    counts: tuple[np.ndarray, ...]
    unit = "negative log-likelihood per sample"

    def value(self, parameters: Hyperparameters) -> float:
        """See `Objective`."""
        total = sum(
            float(likelihoods(with_noise(model, parameters))[counts].sum())
            for model, counts in zip(self.models, self.counts, strict=True)
        )
        return -total / self.samples

    @property
    def samples(self) -> int:
        """How many samples count."""
        return sum(int(counts.sum()) for counts in self.counts)


@dataclass(frozen=True)
class KnownOutput:
    """Sum of the RMS errors of alignment, vertical profile and cross-level, mm: what KOM minimises (Eq. 18).

    Attributes
    ----------
    recordings : tuple of Recording
        The rides.
    models : tuple of Model
        What the smoother takes of each.
    references : tuple of DataFrame
        The rails of each as a reference has them, columns `TUNED` over ``position_m``.
    kind : int, optional
        0 to count straights only, 1 for transitions and curves.
    band : Band, optional
        Compare within a band of wavelengths.
    step_m : float
        Distance of the places.
    """

    recordings: tuple[Recording, ...]
    models: tuple[Model, ...]
    references: tuple[pd.DataFrame, ...]
    kind: int | None = None
    band: Band | None = None
    step_m: float = STEP_M
    unit = "sum of rms errors in mm"

    def value(self, parameters: Hyperparameters) -> float:
        """See `Objective`."""
        errors = [
            self._errors(*ride, parameters)
            for ride in zip(self.recordings, self.models, self.references, strict=True)
        ]
        return 1e3 * float(np.sqrt((np.concatenate(errors) ** 2).mean(axis=0)).sum())

    def _errors(
        self, recording: Recording, model: Model, reference: pd.DataFrame, parameters: Hyperparameters
    ) -> FloatArray:
        """Estimate less reference at the places that count, (p, 3)."""
        found = run_model(with_noise(model, parameters), smoothed=True, with_covariance=False)
        names = [*ATTITUDE, *RELATIVE_POSITION]
        states = pd.DataFrame(found.states[:, list(OUTPUT)], index=recording.imu.index, columns=names)
        if not np.isfinite(found.states).all():
            return np.full((1, len(TUNED)), np.inf)
        geometry = track_geometry(Estimate(states, recording.mount), recording, step_m=self.step_m)
        place, known = geometry.index.to_numpy(), reference.index.to_numpy()
        inside = (place >= known[0]) & (place <= known[-1])
        place, geometry = place[inside], geometry[inside]
        errors = np.column_stack(
            [geometry[name].to_numpy() - np.interp(place, known, reference[name]) for name in TUNED]
        )
        if self.band is not None:
            edges = [self.band.edges_m(name.removesuffix("_m")) for name in TUNED]
            pairs = zip(errors.T, edges, strict=True)
            errors = np.column_stack([band_pass(column, edge, step_m=self.step_m) for column, edge in pairs])
        if self.kind is not None:
            errors = errors[(recording.track.kind(place) != STRAIGHT) == bool(self.kind)]
        return errors[np.isfinite(errors).all(axis=1)]


def objective_of(
    recordings: Sequence[Recording],
    smoother: TrajectorySmoother,
    *,
    kind: int | None = None,
    references: Sequence[pd.DataFrame] | None = None,
    band: Band | None = None,
    step_m: float = STEP_M,
) -> Objective:
    """What is minimised: the `Likelihood` of recordings, or, with references, their `KnownOutput`.

    Raises
    ------
    InputError
        If there is no recording, or nothing in them counts: no samples of the kind, no places that the
        reference knows, a band that is longer than the ride.
    """
    if not recordings:
        raise InputError("there is nothing to tune on", field="recordings", limit="at least one")
    models = tuple(smoother.model(recording) for recording in recordings)
    which = "whole track" if kind is None else KINDS[kind]
    if references is None:
        counts = tuple(
            np.ones(len(recording.imu), dtype=bool) if kind is None else kinds_of(recording) == kind
            for recording in recordings
        )
        likelihood = Likelihood(models, counts)
        if likelihood.samples == 0:
            raise InputError("no sample is of this kind", field="kind", value=which)
        return likelihood
    if len(references) != len(recordings):
        raise InputError("are not one per recording", field="references", value=len(references))
    for reference in references:
        require(reference, TUNED, what="reference")
        place = reference.index.to_numpy(dtype=np.float64)
        finite = np.isfinite(place).all() and np.isfinite(reference[list(TUNED)].to_numpy()).all()
        if len(place) < 2 or not finite or np.any(np.diff(place) <= 0.0):
            raise InputError(
                "is no reference of the rails",
                field="reference",
                limit="finite numbers over rising position_m, two places or more",
            )
        if band is not None:
            count = int((place[-1] - place[0]) / step_m)
            edges = [band.edges_m(name.removesuffix("_m")) for name in TUNED]
            reasons = [why_not(edge, count=count, step_m=step_m) for edge in edges]
            if any(reasons):
                raise InputError(max(reasons), field="band", value=band.name)
    output = KnownOutput(tuple(recordings), models, tuple(references), kind, band, step_m)
    rides = zip(recordings, models, references, strict=True)
    if not any(len(output._errors(*ride, Hyperparameters())) for ride in rides):
        raise InputError("knows none of the places", field="reference", value=which)
    return output


def side_by_side(objective: Objective, space: SearchSpace, pool: Executor) -> Batch:
    """An objective of many points of the cube at once: the kernels run without the GIL."""

    def evaluate(points: FloatArray) -> FloatArray:
        parameters = [Hyperparameters.from_vector(space.values(point)) for point in points]
        return np.array(list(pool.map(objective.value, parameters)))

    return evaluate
