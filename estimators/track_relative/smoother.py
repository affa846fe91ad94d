"""The track-relative smoother, and its filter: attitude, place and speed, and how sure they are.

A railway vehicle never leaves its track, and its track is on a map: what an IMU on it shows is, nearly all,
known before. The estimate is of the small rest, in three layers
(`simrail.estimators.track_relative.states`): the body in the track, the track in the map, the train on the
line; and of the sensors. What is a deviation in space is a process over the distance, so that a train that
stands measures its sensors and nothing else. The map is not believed: each curve has its own cant, curvature
and place, known as well as the map's sheet says.

Forwards it is a Kalman filter, which is to be had as a causal estimate; backwards a fixed-interval smoother.
All is linear about the odometry (`simrail.estimators.track_relative.model`), of which nothing else is taken:
the wheel is a measurement, as is anything else that a ride may have beside its IMU
(`simrail.estimators.track_relative.aiding`). The smoother linearises a second time, about what it has found
of the train.

The formulation is ours. It owes to Briales et al. 2021 the compensation by the design track, to
Gonzalez-Carbajal et al. 2023 the state of a body in the track frame, and to Hartikainen and Sarkka 2010
processes over space as states.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.aiding import (
    Aiding,
    MagneticHeading,
    Received,
    SecondImuSpeed,
    SeenRails,
    aiding_of,
)
from simrail.estimators.track_relative.kernel import (
    OUTPUTS,
    SEGMENT,
    room_for_segment,
    room_to_work,
    run_back,
    run_filter,
)
from simrail.estimators.track_relative.model import Course, Steps, about, course_of, linearised, steps_of
from simrail.estimators.track_relative.monitor import faults_and_widening
from simrail.estimators.track_relative.noise import CLASSES, Motion, class_of, motion_of, tuned_motions
from simrail.estimators.track_relative.output import Trace, innovations_of, states_of, with_bounds
from simrail.estimators.track_relative.prior import PARTS
from simrail.estimators.track_relative.rails import rails_of
from simrail.estimators.trajectory.smoother import MOST_DRAWS
from simrail.estimators.trajectory.track_geometry import geometry_of, sight_of

from simrail.core.errors import InputError, one_of
from simrail.core.toml_files import blame
from simrail.estimation.estimate import Estimate
from simrail.estimation.tunable import Tunable, TunedValues
from simrail.recording.recording import Recording

MOST_PASSES = 4
"""Two are enough: the train is found to a decimetre by the first."""

ASKED: dict[str, Aiding] = {
    "gnss": Received(),
    "magnetometer": MagneticHeading(),
    "second_imu": SecondImuSpeed(),
    "rail_sensor": SeenRails(),
}
"""What is taken where it is asked for, by the option."""

PIECE = 8 * SEGMENT
"""Steps that are linearised at a time: a minute."""


@dataclass(frozen=True)
class TrackRelativeSmoother:
    """Smoother of a body in its track, on a map that errs.

    Attributes
    ----------
    smoothed : bool
        False stops after the filter, which is causal: but for the speed at which a ride begins that does not
        begin at rest, which is taken from its first second.
    passes : int
        How often to linearise and smooth; the filter does it once.
    rate_hz : float
        Rate of its steps: the IMU is averaged over each. Most of what shakes a mount, which no state is for,
        is beyond 31 Hz.
    motion : Motion, optional
        How the body moves in its track; that of the mount's class
        (`simrail.estimators.track_relative.noise`) if not given.
    tuning : TunedValues, optional
        Sizes of these motions from a file, by class of mount, as ``simrail tune`` finds them
        (`simrail.estimators.track_relative.tuning`); what it has not stays. In a scenario, its path.
    without : str
        Parts of the state that are left out (`simrail.estimators.track_relative.prior.PARTS`), with blanks
        between them, to show what each is for.
    geometry_step_m : float
        Distance of the places of the rail geometry; 0 leaves the geometry out. The smoother's is made at the
        IMU's full rate (`simrail.estimators.track_relative.rails`).
    draws : int
        How often to draw what the rails may be: their standard deviation in a band of wavelengths follows
        from that alone. 0 for none; only smoothed and with a geometry.
    wheel : bool
        False leaves encoder and odometer aside: an IMU and a map alone.
    gnss : bool
        Take place and speed of the recording's satellite receiver.
    magnetometer : bool
        Take the heading of the recording's magnetometer.
    second_imu : bool
        Take the speed by the delay between the recording's two IMUs on two bogies.
    rail_sensor : bool
        Take how the body rolls and where it is in its track by the recording's rail sensor. The rails are
        made of what it sees either way.
    aiding : tuple of Aiding
        What is measured beside what the recording has (`simrail.estimators.track_relative.aiding`).
    """

    smoothed: bool = True
    passes: int = 2
    rate_hz: float = 31.25
    motion: Motion | None = None
    tuning: TunedValues | None = None
    without: str = ""
    geometry_step_m: float = 0.25
    draws: int = 0
    wheel: bool = True
    gnss: bool = False
    magnetometer: bool = False
    second_imu: bool = False
    rail_sensor: bool = False
    aiding: tuple[Aiding, ...] = ()

    cites = ("briales_2021", "gonzalez_2023", "hartikainen_2010")

    def __post_init__(self) -> None:
        for name in self.without.split():
            one_of(name, PARTS, "is no part of the state", field="without")
        out = "is out of range"
        is_whole = isinstance(self.draws, int) and not isinstance(self.draws, bool)
        most = MOST_DRAWS if self.smoothed and self.geometry_step_m > 0.0 else 0
        for name, is_good, limit in (
            ("passes", self.passes in range(1, MOST_PASSES + 1), f"1 to {MOST_PASSES}"),
            ("rate_hz", 10.0 <= self.rate_hz <= 1000.0, "10 to 1000 Hz"),
            (
                "draws",
                is_whole and 0 <= self.draws <= most,
                f"0 to {most}; 0 unless smoothed, with a geometry",
            ),
            ("geometry_step_m", 0.0 <= self.geometry_step_m < 100.0, "0 (none) or more, m"),
        ):
            if not is_good:
                raise InputError(out, field=name, value=getattr(self, name), limit=limit)
        if self.tuning is not None and self.motion is not None:
            raise InputError(
                "a file and a motion cannot both be given",
                field="tuning",
                limit="one of them",
                remedy="leave one out",
            )
        with blame(None, "tuning"):
            self.motions()

    @property
    def needs(self) -> tuple[str, ...]:
        """What is asked for by name."""
        return tuple(name for name in ASKED if getattr(self, name))

    @property
    def causal(self) -> bool:
        """The filter is causal, the smoother is not."""
        return not self.smoothed

    @property
    def label(self) -> str:
        """What a reader calls it."""
        return "track-relative smoother" if self.smoothed else "track-relative filter"

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate attitude, place, speed and the rails at every IMU sample."""
        trace = self.trace(recording)
        states = with_bounds(states_of(trace, causal=self.causal), trace, *faults_and_widening(trace))
        estimate = Estimate(
            states=states,
            mount=recording.mount,
            innovations=innovations_of(trace),
        )
        if not self.geometry_step_m:
            return estimate
        if self.smoothed:
            return rails_of(recording, trace, estimate, step_m=self.geometry_step_m, draws=self.draws)
        geometry = geometry_of(sight_of(estimate, recording), step_m=self.geometry_step_m)
        return replace(estimate, geometry=geometry)

    def motions(self) -> dict[Motion, Motion]:
        """Motion that is taken for each class of mounts, by the class's own."""
        return tuned_motions({} if self.tuning is None else self.tuning.values)

    def tunables(self, settings: Mapping[str, Any]) -> Mapping[str, Tunable]:
        """What `simrail tune` searches; see `simrail.estimators.track_relative.tuning`."""
        # Which is made of this module.
        from simrail.estimators.track_relative.tuning import tunables_of_motion

        return tunables_of_motion(self, settings)

    def usual_search(self, recordings: Sequence[Recording]) -> Mapping[str, Any]:
        """What a search on recorded rides is for, where nobody has said it: how far their mounts turn."""
        sizes = ("roll_sd", "pitch_sd", "yaw_sd")
        kinds = [word for word, motion in CLASSES.items() if motion in map(class_of, recordings)]
        motions = self.motions()
        return {
            "parameters": tuple(
                f"{word}_{size}"
                for word in kinds
                for size in sizes
                if getattr(motions[CLASSES[word]], size) > 0.0
            )
        }

    def course(self, recording: Recording, steps: Steps | None = None) -> Course:
        """What the first pass linearises about; ``steps`` are those of the recording, if they are at hand."""
        if not self.wheel:
            recording = replace(
                recording, encoder=None, encoder_sheet=None, odometer=None, odometer_sheet=None
            )
        motion = motion_of(recording, self.motions()) if self.motion is None else self.motion
        if steps is None:
            steps = steps_of(recording, self.rate_hz, smoothed=self.smoothed)
        asked = [ASKED[name] for name in self.needs]
        aiding = (*aiding_of(recording, smoothed=self.smoothed), *asked, *self.aiding)
        return course_of(recording, steps, motion, aiding, self.without.split())

    def trace(self, recording: Recording) -> Trace:
        """All states, at the filter's own steps."""
        course = self.course(recording)
        trace = _run(course, smoothed=self.smoothed)
        for _ in range(self.passes - 1 if self.smoothed else 0):
            trace = _run(about(course, trace.states), smoothed=True)
        return trace


def log_likelihood(course: Course) -> float:
    """Log-likelihood of a course's measurements by the filter, but for a constant."""
    return _run(course, smoothed=False).log_likelihood


def _pieces(n: int) -> Iterator[slice]:
    for first in range(0, n, PIECE):
        yield slice(first, min(first + PIECE, n))


def _run(course: Course, *, smoothed: bool) -> Trace:
    """Filter, and smoother if wanted, a piece at a time."""
    n = len(course.steps.time_s)
    count = -(-n // SEGMENT) if smoothed else 0
    starts, squares = np.empty((count, at.STATES)), np.empty((count, at.STATES, at.WIDTH))
    states, covariance = np.empty((n, at.STATES)), np.empty((n, OUTPUTS, OUTPUTS))
    surprises, work = np.full((n, course.rows), np.nan), room_to_work()
    x, p, total = course.start.copy(), course.start_covariance.copy(), 0.0
    wanted = slice(0, 0) if smoothed else slice(None)
    for rows in _pieces(n):
        model = linearised(course, rows)
        kept = slice(rows.start // SEGMENT, -(-rows.stop // SEGMENT))
        total += run_filter(
            model,
            starts[kept],
            squares[kept],
            states[rows][wanted],
            covariance[rows][wanted],
            surprises[rows],
            work,
            x,
            p,
        )
    if smoothed:
        lam, info = np.zeros(at.STATES), np.zeros((at.STATES, at.WIDTH))
        segment, lines = room_for_segment(SEGMENT, course.rows), np.zeros((2, OUTPUTS, at.WIDTH))
        for rows in reversed(list(_pieces(n))):
            kept = slice(rows.start // SEGMENT, -(-rows.stop // SEGMENT))
            model = linearised(course, rows)
            run_back(
                model,
                starts[kept],
                squares[kept],
                states[rows],
                covariance[rows],
                segment,
                work,
                x,
                p,
                lam,
                info,
                lines[0],
                lines[1],
            )
    return Trace(course, states, covariance, surprises, -0.5 * total)
