"""The trajectory smoother as something to tune: its parameters, and what a search of them minimises.

Gonzalez-Carbajal et al. 2023 (paper 001), section 4. **CML** (constrained maximum likelihood) takes the
hyper-parameters under which the recorded signals are likeliest, by prediction-error decomposition. **KOM**
(known output) takes those with which the rails come out as a reference has them, which is handed in as a
frame, as a measured one would be.

Straights and curves may have a set each: what is minimised then counts the samples, or places, of its own
kind only, the set holding throughout, so that the two searches do not depend on each other.

The likelihood does not identify the virtual positions' variances (`SearchSpace.position_m2`), and what it
finds for the other parameters makes the signals likely under a model that the train does not obey: see
`simrail.estimators.tuning.identify`.

Not here: the search (`simrail.estimators.tuning.tune`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np
import pandas as pd
from simrail.estimators.trajectory.kernel import Model
from simrail.estimators.trajectory.model import kinds_of, with_noise
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.trajectory.smoother import OUTPUT, TrajectorySmoother, likelihoods, run_model
from simrail.estimators.trajectory.track_geometry import track_geometry
from simrail.estimators.tuning.space import SearchSpace

from simrail.core.columns import ATTITUDE, IRREGULARITY, RELATIVE_POSITION, require
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.estimation.tunable import Parameter, refuse_settings
from simrail.recording.recording import Recording
from simrail.track.bands import Band, band_pass, why_not
from simrail.track.design import STRAIGHT

KINDS = ("straights", "curves")
"""What a set is for if there are two of them; curves with their transitions."""

TUNED = IRREGULARITY[:3]
"""What the known output is judged by; gauge does not depend on the trajectory (paper, Eq. 18)."""

STEP_M = 0.25
"""Distance of the places at which the rails are compared, unless another is given."""

SETTINGS = (*(entry.name for entry in fields(SearchSpace)), "by_kind", "band", "step_m")
"""Settings of a search."""


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

    def value(self, values: Mapping[str, float]) -> float:
        """See `simrail.estimation.tunable.Objective`."""
        parameters = Hyperparameters(**values)
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

    def value(self, values: Mapping[str, float]) -> float:
        """See `simrail.estimation.tunable.Objective`."""
        errors = self.errors(Hyperparameters(**values))
        return 1e3 * float(np.sqrt((errors**2).mean(axis=0)).sum())

    def errors(self, parameters: Hyperparameters) -> FloatArray:
        """Estimate less reference at the places of all rides that count, (p, 3)."""
        rides = zip(self.recordings, self.models, self.references, strict=True)
        return np.concatenate([self._errors(*ride, parameters) for ride in rides])

    def _errors(
        self, recording: Recording, model: Model, reference: pd.DataFrame, parameters: Hyperparameters
    ) -> FloatArray:
        """Estimate less reference at the places that count, (p, 3)."""
        trace = run_model(with_noise(model, parameters), smoothed=True, covariance_of=())
        names = [*ATTITUDE, *RELATIVE_POSITION]
        states = pd.DataFrame(trace.states[:, list(OUTPUT)], index=recording.imu.index, columns=names)
        if not np.isfinite(trace.states).all():
            return np.full((1, len(TUNED)), np.inf)
        geometry = track_geometry(Estimate(states, recording.mount), recording, step_m=self.step_m)
        place, surveyed = geometry.index.to_numpy(), reference.index.to_numpy()
        inside = (place >= surveyed[0]) & (place <= surveyed[-1])
        place, geometry = place[inside], geometry[inside]
        errors = np.column_stack(
            [geometry[name].to_numpy() - np.interp(place, surveyed, reference[name]) for name in TUNED]
        )
        if self.band is not None:
            edges = [self.band.edges_m(name.removesuffix("_m")) for name in TUNED]
            pairs = zip(errors.T, edges, strict=True)
            errors = np.column_stack([band_pass(column, edge, step_m=self.step_m) for column, edge in pairs])
        if self.kind is not None:
            errors = errors[(recording.track.kind(place) != STRAIGHT) == bool(self.kind)]
        counted: FloatArray = errors[np.isfinite(errors).all(axis=1)]
        return counted


@dataclass(frozen=True)
class SmootherTuning:
    """One set of a smoother's hyper-parameters, as a `simrail.estimation.tunable.Tunable`.

    Attributes
    ----------
    smoother : TrajectorySmoother
        Its equations are used; its hyper-parameters (on straights) are where the search begins.
    space : SearchSpace
        Where to search; the paper's box and constraint if not given.
    kind : int, optional
        0 to count straights only, 1 for transitions and curves.
    band : Band, optional
        KOM compares within this band of wavelengths.
    step_m : float
        Distance of the places at which KOM compares.
    """

    smoother: TrajectorySmoother
    space: SearchSpace = field(default_factory=SearchSpace)
    kind: int | None = None
    band: Band | None = None
    step_m: float = STEP_M

    def parameters(self) -> tuple[Parameter, ...]:
        """The 13 hyper-parameters."""
        return self.space.parameters(self.smoother.noise[0])

    @property
    def search_settings(self) -> dict[str, Any]:
        """What the file of a tuning says of the search beside the rest."""
        return asdict(self.space)

    def likelihood(self, recordings: Sequence[Recording]) -> Likelihood:
        """What CML minimises.

        Raises
        ------
        InputError
            If no sample is of the kind.
        """
        counts = tuple(
            np.ones(len(recording.imu), dtype=bool) if self.kind is None else kinds_of(recording) == self.kind
            for recording in recordings
        )
        likelihood = Likelihood(tuple(map(self.smoother.model, recordings)), counts)
        if likelihood.samples == 0:
            raise InputError(
                "no sample is of this kind",
                field="kind",
                value=self._which,
                limit="one sample or more",
                remedy="ride over such a part of the track",
            )
        return likelihood

    def reference_error(
        self, recordings: Sequence[Recording], references: Sequence[pd.DataFrame]
    ) -> KnownOutput:
        """What KOM minimises.

        Raises
        ------
        InputError
            If a reference is none, or knows no place that counts, or the band is longer than the ride.
        """
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
            if self.band is not None:
                count = int((place[-1] - place[0]) / self.step_m)
                edges = [self.band.edges_m(name.removesuffix("_m")) for name in TUNED]
                reasons = [why_not(edge, count=count, step_m=self.step_m) for edge in edges]
                if any(reasons):
                    raise InputError(
                        max(reasons),
                        field="band",
                        value=self.band.name,
                        limit="a ride that is long enough for the band",
                        remedy="choose another band, or a longer ride",
                    )
        models = tuple(map(self.smoother.model, recordings))
        output = KnownOutput(tuple(recordings), models, tuple(references), self.kind, self.band, self.step_m)
        if not len(output.errors(Hyperparameters())):
            raise InputError(
                "knows none of the places",
                field="reference",
                value=self._which,
                limit="places that the ride passes",
                remedy="give a reference of this line",
            )
        return output

    @property
    def _which(self) -> str:
        return "whole track" if self.kind is None else KINDS[self.kind]


def tunables_of_smoother(
    smoother: TrajectorySmoother, settings: Mapping[str, Any]
) -> dict[str, SmootherTuning]:
    """One set for the whole track, or with the setting ``by_kind`` one for straights and one for curves.

    Parameters
    ----------
    smoother : TrajectorySmoother
        What is tuned.
    settings : mapping
        Of the search: ``box``, ``constrained``, ``position_m2`` (see `SearchSpace`), ``by_kind``, ``band``,
        ``step_m``; those that differ from the defaults.
    """
    refuse_settings(smoother, settings, known=SETTINGS)
    settings = dict(settings)
    by_kind = settings.pop("by_kind", False)
    compared = {name: settings.pop(name) for name in ("band", "step_m") if name in settings}
    whole = SmootherTuning(smoother, SearchSpace(**settings), **compared)
    return {name: replace(whole, kind=kind) for kind, name in enumerate(KINDS)} if by_kind else {"all": whole}
