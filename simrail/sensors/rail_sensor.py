"""A sensor that sees both rails from the body: numbers in the place of cameras or lasers, no images.

It gives where each rail passes through the plane across the body at the IMU, seen from the IMU along the Y
and Z of the body, with white noise and now and then an outlier. The defaults are the order of what cameras
such as those of paper 001 (Gonzalez-Carbajal et al. 2023) deliver; the size of the outliers is synthetic. Its
axes are those of the body without error, and it samples with the IMU.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from simrail.core.columns import ATTITUDE, POSITION, RAIL_DISPLACEMENT
from simrail.core.errors import refuse_unless
from simrail.core.jit import FloatArray
from simrail.core.resample import interpolated
from simrail.core.rotation import rotation_matrix
from simrail.core.seeds import stream
from simrail.track.laid_track import LaidTrack


@dataclass(frozen=True)
class RailSensorSpec:
    """A sensor of the rails.

    Attributes
    ----------
    noise_m : float
        Standard deviation of each value.
    outlier_fraction : float
        Share of the values that are outliers.
    outlier_m : float
        Standard deviation of what an outlier adds; synthetic.
    """

    noise_m: float = 0.1e-3
    outlier_fraction: float = 0.01
    outlier_m: float = 5e-3


def sample_rails(
    motion: pd.DataFrame,
    times: pd.Index,
    spec: RailSensorSpec,
    rails: LaidTrack,
    *,
    seed: int,
    draw: int,
    name: str,
) -> pd.DataFrame:
    """What the sensor gives over a ride.

    Parameters
    ----------
    motion : pandas.DataFrame
        True motion of the IMU's mount, columns `simrail.core.columns.MOTION`, indexed by ``time_s``
        (uniform).
    times : pandas.Index
        Times of the samples, s.
    spec : RailSensorSpec
        The sensor.
    rails : LaidTrack
        The rails that the ride was run on.
    seed, draw : int
        Seed of the scenario and number of the sensor draw.
    name : str
        Name of the IMU: with seed and draw it names the random streams, one for each term.

    Returns
    -------
    pandas.DataFrame
        Indexed by `times`, columns `simrail.core.columns.RAIL_DISPLACEMENT`, m.

    Raises
    ------
    InputError
        If a value of the specification is impossible.
    """
    check_rail_sensor(spec)
    wanted = times.to_numpy(dtype=np.float64)
    at_times = partial(interpolated, motion, wanted)

    position, angles = at_times(*POSITION), at_times(*ATTITUDE)
    guess = at_times("position_m")[:, 0]
    left, right = rails_seen(position, angles, guess, rails)
    values = np.column_stack([left, right])

    term = partial(stream, seed, "sensor", draw, "rail_sensor", name)
    values += term("white").standard_normal(values.shape) * spec.noise_m
    struck = term("outlier_place").random(values.shape) < spec.outlier_fraction
    values += struck * term("outlier_size").standard_normal(values.shape) * spec.outlier_m
    return pd.DataFrame(values, index=pd.Index(wanted, name="time_s"), columns=list(RAIL_DISPLACEMENT))


def rails_seen(
    position: FloatArray, angles: FloatArray, guess: FloatArray, rails: LaidTrack
) -> tuple[FloatArray, FloatArray]:
    """Where the left and the right rail (n, 2 each: y, z) pass through the plane X = 0 of a body.

    Parameters
    ----------
    position, angles : ndarray (n, 3)
        Global position of the body's point and its roll, pitch and yaw.
    guess : ndarray (n,)
        Places s to begin from, within some metres.
    rails : LaidTrack
        The rails: each stands at (0, +-b, 0) plus its deviation in the track frame, b half the design's
        rail base.
    """
    body = rotation_matrix(angles)
    sides = []
    for side, first in ((0.5, 0), (-0.5, 2)):
        s, seen = guess, np.empty((len(guess), 3))
        for _ in range(4):
            s = np.clip(s, rails.design.start_m, rails.design.end_m)
            frame = rails.design.frame(s)
            place = np.zeros((len(s), 3))
            place[:, 1:] = rails.rails(s)[:, first : first + 2]
            place[:, 1] += side * rails.design.rail_base_m
            head = frame.position + np.einsum("nij,nj->ni", frame.rotation, place)
            seen = np.einsum("nji,nj->ni", body, head - position)
            # A metre of s carries the rail about a metre along the body: the rest is for the next turn.
            s = s - seen[:, 0]
            if np.abs(seen[:, 0]).max() < 1e-6:
                break
        sides.append(seen[:, 1:])
    return sides[0], sides[1]


def check_rail_sensor(spec: RailSensorSpec) -> None:
    """Refuse a sensor that cannot be.

    Raises
    ------
    InputError
        Naming the field.
    """
    noise, share, outlier = spec.noise_m, spec.outlier_fraction, spec.outlier_m
    refuse_unless(0.0 <= noise < 0.1, "noise_m", noise, "0 to 0.1 m")
    refuse_unless(0.0 <= share <= 0.2, "outlier_fraction", share, "0 to 0.2: beyond it no median helps")
    refuse_unless(0.0 <= outlier < 1.0, "outlier_m", outlier, "0 to 1 m")
