"""The track-relative smoother as something to tune: sizes of a body's motion, by the likelihood of rides.

What is searched is chosen by name, and is chosen with care: the likelihood knows the signals alone. Where a
mount shakes, it drives the processes of y and z to nothing and calls all of it white, and the place in the
track with them. Sizes of the angles it finds.

    simrail tune SCENARIO --estimator TrackRelativeSmoother --method cml --parameter axle_yaw_sd ...

The likelihood is that of the filter, of all rides together, linearised about their odometry, so that two
values are judged by the same measurements. Not here: the search (`simrail.estimators.tuning.tune`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from simrail.estimators.track_relative.model import Steps
from simrail.estimators.track_relative.noise import CLASSES, class_of
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother, log_likelihood

from simrail.core.errors import InputError, one_of
from simrail.estimation.tunable import Parameter, TunedValues, refuse_settings
from simrail.recording.recording import Recording

BOX = (0.1, 10.0)
"""Least and greatest value, times where the search begins."""

MOST_DAMPING = 0.95
"""An oscillator swings below 1."""


@dataclass(frozen=True)
class MotionLikelihood:
    """Negative log-likelihood per step of the filter, but for a constant, over all rides.

    Attributes
    ----------
    smoother : TrackRelativeSmoother
        Of which the sizes are tuned; what is not searched stays as it has it.
    rides : tuple of (Recording, Steps)
    """

    smoother: TrackRelativeSmoother
    rides: tuple[tuple[Recording, Steps], ...]
    unit = "negative log-likelihood per step"

    def value(self, values: Mapping[str, float]) -> float:
        """See `simrail.estimation.tunable.Objective`."""
        smoother = tuned(self.smoother, values)
        return -sum(log_likelihood(smoother.course(*ride)) for ride in self.rides) / self.samples

    @property
    def samples(self) -> int:
        """How many steps there are."""
        return sum(len(steps.time_s) for _, steps in self.rides)


def tuned(smoother: TrackRelativeSmoother, values: Mapping[str, float]) -> TrackRelativeSmoother:
    """The smoother with some sizes as they are given, and the others as it has them."""
    before = {} if smoother.tuning is None else smoother.tuning.values
    return replace(smoother, tuning=TunedValues({**before, **values}))


@dataclass(frozen=True)
class MotionTuning:
    """Sizes of a body's motion, as a `simrail.estimation.tunable.Tunable`.

    Attributes
    ----------
    smoother : TrackRelativeSmoother
        Its sizes are where the search begins.
    names : tuple of str
        What is searched (`simrail.estimators.track_relative.noise.tuned_motions`).
    box : tuple of float
        Least and greatest value of each, times where the search begins.

    Raises
    ------
    InputError
        If nothing is to be searched, a name is none, its class has none of it, or the box is none.
    """

    smoother: TrackRelativeSmoother
    names: tuple[str, ...]
    box: tuple[float, float] = BOX

    def __post_init__(self) -> None:
        motions = self.smoother.motions()
        possible = [
            f"{kind}_{size}"
            for kind, own in CLASSES.items()
            for size, value in asdict(motions[own]).items()
            if value > 0.0
        ]
        if not self.names:
            raise InputError(
                "nothing is to be searched",
                field="parameters",
                limit=f"one or more of {', '.join(possible)}",
                remedy="name what to search",
            )
        for name in self.names:
            one_of(name, possible, "there is no such size to search", field="parameters")
        low, high = self.box
        if not 0.0 < low < 1.0 < high:
            limit = "0 < least < 1 < greatest, times where the search begins"
            raise InputError("is no box", field="box", value=list(self.box), limit=limit)

    def parameters(self) -> tuple[Parameter, ...]:
        """What is searched, in the order in which it was named."""
        low, high = self.box
        motions = self.smoother.motions()
        searched = []
        for name in dict.fromkeys(self.names):
            kind, _, size = name.partition("_")
            start = getattr(motions[CLASSES[kind]], size)
            most = max(start, MOST_DAMPING) if size == "damping" else high * start
            searched.append(Parameter(name, "SI", low * start, min(high * start, most), start))
        return tuple(searched)

    @property
    def search_settings(self) -> dict[str, Any]:
        """What the file of a tuning says of the search beside the rest."""
        return {"parameters": self.names, "box": self.box}

    def likelihood(self, recordings: Sequence[Recording]) -> MotionLikelihood:
        """What is minimised.

        Raises
        ------
        InputError
            If no ride is from a mount of a class of which a size is searched.
        """
        kinds = {class_of(recording) for recording in recordings}
        ridden = [word for word, motion in CLASSES.items() if motion in kinds]
        for name in self.names:
            if name.partition("_")[0] not in ridden:
                raise InputError(
                    "none of the rides is from such a mount",
                    field="parameters",
                    value=name,
                    limit=f"sizes of {', '.join(ridden)}",
                    remedy="name another, or tune on rides from such a mount",
                )
        courses = [self.smoother.course(recording) for recording in recordings]
        return MotionLikelihood(self.smoother, tuple((course.recording, course.steps) for course in courses))


def tunables_of_motion(
    smoother: TrackRelativeSmoother, settings: Mapping[str, Any]
) -> dict[str, MotionTuning]:
    """One set, from the settings ``parameters`` (names of what is searched) and ``box``."""
    refuse_settings(smoother, settings, known=("parameters", "box"))
    names = tuple(settings.get("parameters", ()))
    return {"all": MotionTuning(smoother, names, settings.get("box", BOX))}
