"""Vertical profile of the rails by a filter with a delay line along the track: Hidalgo et al. (paper 004).

An accelerometer over one of two axles gives that axle's height, by two integrations that drift; a virtual
sensor that always says zero holds them. What the body's pitch rate says is the difference between both axles'
vertical speeds, and where the other axle is now, this one was, or will be, a wheelbase away: heights that are
kept along the track tie the two together. Equations: `simrail.estimators.profile.kernel`.

What was changed of the paper, whose filter keeps the last n samples in place of places (EQUATIONS 1.3, 5):

* the nodes lie on a fixed grid over the distance. In time, the slope at the other axle is 0/0 at standstill,
  n >= L / (V dt) has no bound as V falls, and there is no way back;
* the way along the track comes from an odometry, which is the paper's rows of encoder and longitudinal
  accelerometer (Eqs. 8 and 10) in a filter of its own;
* the zero of the virtual sensor is off by the profile, which hangs together over some metres. Taken as new at
  each sample, it is believed some hundred times too much, and takes away the long waves;
* at standstill the height does not change: a row for h' stands in for the virtual sensor's;
* both sensors have a bias, and the design track's gravity, curves and grades are taken off;
* a body on springs, or an axle box, leaves the chord from axle to axle: by an angle that is a state.

A node is the estimate once the vehicle has left it, one wheelbase after the IMU has passed it.
"""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from simrail.estimators.profile.kernel import Found, H, Model, profile_filter, room
from simrail.estimators.profile.model import Deviation, Profile, axles_under, model_of, require_over_axle

from simrail.core.columns import IRREGULARITY, IRREGULARITY_SD
from simrail.core.errors import InputError
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording, odometry_of

LEAST_NODES, MOST_NODES = 4, 100
"""Nodes on a wheelbase: the slope at the other axle takes four."""

ROUNDING = 1e-9
"""Relative, of a step that divides the wheelbase."""

NODES = 12
"""Nodes on a wheelbase unless asked otherwise."""

LONGEST_STEP_M = 0.5
"""Of such nodes: six to the shortest wave of D1."""

KEPT_M = 5.0
"""How long a node is kept without a gyro where nobody says where the other axle is."""


@dataclass(frozen=True)
class ProfileFilter:
    """Filter of the vertical profile (paper 004); its IMU stands over an axle.

    Attributes
    ----------
    gyro : bool
        False leaves the gyro aside: an accelerometer alone, over any place of any vehicle.
    deviation_rad : float
        Standard deviation of the angle by which the mount leaves the chord from axle to axle; 0 for the
        paper's, whose body has no springs. The default is synthetic: a wagon's axle box pitches by more, a
        stiff bogie by less.
    step_m : float
        Distance of the nodes, and of the places of the geometry; 0 for a twelfth of the wheelbase, at most
        0.5 m.
    other_axle_m : float
        Where the other axle is, forward from the IMU, m; 0 for what the vehicle's drawing says.
    profile_sd_m, profile_length_m : float
        Standard deviation of the vertical profile, which is the error of the virtual sensor, and the length
        over which it hangs together. Synthetic, of a line of fair quality.
    slowest_mps : float
        Below this speed the train counts as standing.
    oldest : bool
        False takes a node as it was when the IMU passed it, in place of as the vehicle left it.
    independent_zeros : bool
        The virtual sensor's error as if each sample had one of its own (the paper reads so).
    printed : bool
        The delay line over time, as printed: the gyro's row is used only where the last n samples reach back
        to the other axle, with n enough for 18 km/h; slopes by two nodes; zeros independent; no deviation.
    """

    gyro: bool = True
    deviation_rad: float = 3e-4
    step_m: float = 0.0
    other_axle_m: float = 0.0
    profile_sd_m: float = 0.003
    profile_length_m: float = 5.0
    slowest_mps: float = 0.05
    oldest: bool = True
    independent_zeros: bool = False
    printed: bool = False

    causal = True
    needs = ("odometry",)
    label = "profile filter"
    cites = ("hidalgo",)

    def __post_init__(self) -> None:
        for name, least, limit in (
            ("deviation_rad", 0.0, "0 or more, rad"),
            ("step_m", 0.0, "0 (by the wheelbase) or more, m"),
            ("profile_sd_m", math.ulp(0.0), "> 0 m"),
            ("profile_length_m", math.ulp(0.0), "> 0 m"),
            ("slowest_mps", math.ulp(0.0), "> 0 m/s"),
            ("other_axle_m", -math.inf, "a number, m"),
        ):
            value = getattr(self, name)
            if not (least <= value < math.inf and math.isfinite(value)):
                raise InputError("is out of range", field=name, value=value, limit=limit)

    @property
    def role(self) -> str:
        """An ablation without the gyro, and as printed."""
        is_whole = self.gyro and self.oldest and not (self.printed or self.independent_zeros)
        return "method" if is_whole else "ablation"

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate the height of the IMU at every sample, and the vertical profile along the track.

        Raises
        ------
        InputError
            If a signal that is used never changes on a ride that moves, the IMU stands over no axle, nobody
            says where the other axle is, the nodes are too coarse for the wheelbase, or a ride that is over
            was shorter than the wheelbase or never fast enough.
        """
        model = self.model(recording)
        self._judge_ride(recording, model)
        found = room(model)
        profile_filter(model, found)
        height = recording.mount_position_m[2] + found.states[:, H]
        columns = {"vertical_m": height, "vertical_sd_m": np.sqrt(found.variances[:, H])}
        return Estimate(
            states=pd.DataFrame(columns, index=recording.imu.index),
            mount=recording.mount,
            geometry=self._geometry(model, found),
        )

    def model(self, recording: Recording) -> Model:
        """What the kernel takes of a recording."""
        odometry_of(recording)
        other = self._other_axle(recording)
        step = self.step_m or max(min(abs(other) / NODES, LONGEST_STEP_M), abs(other) / MOST_NODES)
        if not LEAST_NODES * (1.0 - ROUNDING) <= abs(other) / step <= MOST_NODES * (1.0 + ROUNDING):
            raise InputError(
                "the nodes do not fit the wheelbase",
                field="step_m",
                value=step,
                limit=f"{abs(other) / MOST_NODES:.3g} to {abs(other) / LEAST_NODES:.3g} m",
                remedy=f"leave step_m out: the axles are {abs(other):.3g} m apart",
            )
        return model_of(
            recording,
            other_m=other,
            step_m=step,
            profile=Profile(self.profile_sd_m, self.profile_length_m),
            deviation=Deviation(0.0 if self.printed else self.deviation_rad),
            gyro=self.gyro,
            slowest_mps=self.slowest_mps,
            independent_zeros=self.independent_zeros or self.printed,
            over_time=self.printed,
        )

    def _other_axle(self, recording: Recording) -> float:
        """Where the other axle is, forward from the IMU, m."""
        if self.other_axle_m:
            return self.other_axle_m
        axles = axles_under(recording)
        if axles is not None:
            if self.gyro:
                require_over_axle(recording, axles)
            return axles.farthest_m if self.gyro else axles.farthest_m - axles.nearest_m
        if not self.gyro:
            return -KEPT_M
        raise InputError(
            "nobody says where the other axle is, of which the gyro tells",
            field="other_axle_m",
            value=recording.mount_body,
            limit="a body of [vehicle_sheet] on two axles or more, or an axle under one",
            remedy="give the option other_axle_m, or leave the gyro aside by gyro = false",
        )

    def _judge_ride(self, recording: Recording, model: Model) -> None:
        """Refuse a ride that cannot say anything; of one that goes on nobody knows yet."""
        way = float(np.ptp(model.place))
        if way <= model.step_m:  # it stands
            return
        signals = {"accel_z_mps2": "no vertical profile without it"}
        if self.gyro:
            signals["gyro_y_radps"] = "leave the gyro aside by gyro = false"
        for name, remedy in signals.items():
            values = recording.imu[name].to_numpy(dtype=np.float64)
            if np.ptp(values) == 0.0:
                raise InputError(
                    "never changes on a ride that moves: there is no such signal",
                    field=f"imu.{name}",
                    value=float(values[0]),
                    limit="a signal",
                    remedy=remedy,
                )
        if model.moves[-1]:
            return
        if not model.moves.any():
            raise InputError(
                "the ride is never faster",
                field="slowest_mps",
                value=self.slowest_mps,
                limit=f"below {float(np.abs(model.speed).max()):.3g} m/s, the greatest speed of the ride",
                remedy="lower slowest_mps, or take a faster ride",
            )
        if self.gyro and way < model.wheelbase_m:
            raise InputError(
                "the ride is shorter than the wheelbase: no place is passed by both axles",
                field="other_axle_m",
                value=round(model.wheelbase_m, 3),
                limit=f"at most the {way:.3g} m of the ride",
                remedy="take a longer ride, or leave the gyro aside by gyro = false",
            )

    def _geometry(self, model: Model, found: Found) -> pd.DataFrame:
        """Heights of the nodes that the IMU has passed, over s."""
        nodes = found.first_node + np.arange(len(found.oldest))
        at = nodes * model.step_m
        heights = found.oldest if self.oldest else found.front
        passed = (at >= model.place.min()) & (at <= model.place.max()) & np.isfinite(heights[:, 0])
        place, heights = model.side * at[passed], heights[passed]
        order = np.argsort(place, kind="stable")
        columns = {name: np.full(len(place), np.nan) for name in (*IRREGULARITY, *IRREGULARITY_SD)}
        columns["vertical_profile_m"] = heights[order, 0]
        columns["vertical_profile_sd_m"] = np.sqrt(heights[order, 1])
        return pd.DataFrame(columns, index=pd.Index(place[order], name="position_m"))
