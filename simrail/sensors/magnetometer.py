"""A magnetometer on a train: the Earth's field, and all that stands in its way on an electrified line.

In order: the field of the Earth at the mount, the currents of the line and the steel beside it, the soft
and hard iron of the vehicle, bias, white noise, range and resolution. Every random term has its own named
stream; steel belongs to the track, so its stream is found by the seed of the track, and every pass and
every sensor meets the same.

Every disturbance is synthetic. With the defaults of all of them a heading is wrong by tens of degrees, as
that of the commercial IMU in Briales et al. 2021 was (rms 52 deg, Table 3). What surrounds the line is in
`simrail.sensors.magnetic_surroundings`.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from simrail.core.columns import ATTITUDE, MAGNETIC, RELATIVE_ATTITUDE, RELATIVE_POSITION
from simrail.core.errors import refuse_unless
from simrail.core.jit import FloatArray
from simrail.core.resample import interpolated
from simrail.core.rotation import rotation_matrix
from simrail.core.seeds import stream
from simrail.sensors.magnetic_surroundings import (
    Steel,
    Traction,
    check_steel,
    check_traction,
    steel_field,
    traction_field,
)

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class EarthField:
    """The undisturbed field, the same along the whole line.

    Attributes
    ----------
    intensity_t, inclination_rad : float
        Total intensity, and dip below the horizontal (positive in the northern hemisphere). The defaults
        are nominal for a mid-latitude, of no particular place or year.
    declination_rad : float
        Magnetic north, east of true north.
    x_axis_rad : float
        Direction of the global X axis, counter-clockwise from east (seen from above).
    """

    intensity_t: float = 45e-6
    inclination_rad: float = float(np.radians(55.0))
    declination_rad: float = 0.0
    x_axis_rad: float = 0.0

    @property
    def north_rad(self) -> float:
        """Direction of magnetic north, counter-clockwise from the global X axis."""
        return 0.5 * np.pi - self.declination_rad - self.x_axis_rad

    @property
    def vector_t(self) -> FloatArray:
        """Field (3,), global axes."""
        level = self.intensity_t * np.cos(self.inclination_rad)
        down = self.intensity_t * np.sin(self.inclination_rad)
        return np.array([level * np.cos(self.north_rad), level * np.sin(self.north_rad), -down])


@dataclass(frozen=True)
class VehicleIron:
    """Steel of the vehicle, which turns with the sensor; on the sensor's axes. Synthetic.

    Attributes
    ----------
    hard_iron_t : tuple of float
        Remanent field of the vehicle.
    soft_iron : tuple of tuple of float
        Induced field over the outer field, 3 x 3: zero for none.
    """

    hard_iron_t: Vector = (6e-6, -4e-6, 8e-6)
    soft_iron: tuple[Vector, Vector, Vector] = ((0.08, 0.02, 0.0), (0.02, -0.05, 0.01), (0.0, 0.01, 0.06))


@dataclass(frozen=True)
class MagnetometerSpec:
    """A magnetometer in the housing of the IMU, and the field around it.

    The defaults of the sensor are those of the LORD 3DM-GX4-25 in Briales et al. 2021, Table 1 (100 uG per
    root Hz, 0.003 G, 2.5 G); its non-linearity and alignment are left out.

    Attributes
    ----------
    field : EarthField
        The field of the Earth.
    noise_tpsqrthz : float
        Density N of the white noise: one sample has the standard deviation N sqrt(rate).
    bias_t : float
        Bound of the constant bias, uniform between minus and plus.
    range_t, resolution_t : float
        Largest magnitude that is measured, and size of one count (0 for none).
    iron, traction, steel
        Disturbances; None for none.
    """

    field: EarthField = EarthField()
    noise_tpsqrthz: float = 10e-9
    bias_t: float = 300e-9
    range_t: float = 250e-6
    resolution_t: float = 0.0
    iron: VehicleIron | None = None
    traction: Traction | None = None
    steel: Steel | None = None


def sample_magnetometer(
    motion: pd.DataFrame,
    times: pd.Index,
    spec: MagnetometerSpec,
    *,
    seed: int,
    draw: int,
    name: str,
    track_m: tuple[float, float] = (0.0, 0.0),
) -> pd.DataFrame:
    """Sample the field at a mount.

    Parameters
    ----------
    motion : pandas.DataFrame
        Indexed by ``time_s`` (uniform), columns `simrail.core.columns.MOTION` of the mount.
    times : pandas.Index
        Uniform times of the samples, s. The field changes slowly: it is sampled as it is, unfiltered.
    spec : MagnetometerSpec
        Sensor and surroundings.
    seed, draw : int
        Seed of the scenario and number of the sensor draw.
    name : str
        Name of the sensor: with seed and draw it names the random streams.
    track_m : tuple of float
        s at the start and the end of the track, where steel may stand.

    Returns
    -------
    pandas.DataFrame
        Indexed by `times`, columns `simrail.core.columns.MAGNETIC`, T, on the mount's axes.

    Raises
    ------
    InputError
        If a value of the specification is impossible.
    """
    check_magnetometer(spec)
    wanted = times.to_numpy(dtype=np.float64)
    at_times = partial(interpolated, motion, wanted)

    field = _into(at_times(*ATTITUDE), np.broadcast_to(spec.field.vector_t, (len(wanted), 3)))
    if spec.traction is not None or spec.steel is not None:
        position, speed, acceleration = at_times("position_m", "speed_mps", "acceleration_mps2").T
        place = at_times(*RELATIVE_POSITION)
        around = np.zeros((len(wanted), 3))
        if spec.traction is not None:
            around += traction_field(place, spec.traction, spec.traction.current_a(speed, acceleration))
        if spec.steel is not None:
            around += steel_field(position, place, spec.steel, track_m)
        field += _into(at_times(*RELATIVE_ATTITUDE), around)
    if spec.iron is not None:
        field += field @ np.asarray(spec.iron.soft_iron).T + np.asarray(spec.iron.hard_iron_t)

    term = partial(stream, seed, "sensor", draw, "magnetometer", name)
    rate_hz = (len(wanted) - 1) / (wanted[-1] - wanted[0])
    field += term("bias").uniform(-1.0, 1.0, 3) * spec.bias_t
    field += term("white").standard_normal(field.shape) * (spec.noise_tpsqrthz * np.sqrt(rate_hz))
    if spec.resolution_t > 0.0:
        field = np.rint(field / spec.resolution_t) * spec.resolution_t
    field = np.clip(field, -spec.range_t, spec.range_t)
    return pd.DataFrame(field, index=pd.Index(wanted, name="time_s"), columns=list(MAGNETIC))


def check_magnetometer(spec: MagnetometerSpec) -> None:
    """Refuse a magnetometer, or a surrounding, that cannot be.

    Raises
    ------
    InputError
        Naming the field.
    """
    intensity, dip = spec.field.intensity_t, spec.field.inclination_rad
    refuse_unless(0.0 < intensity < 1e-4, "intensity_t", intensity, "above 0, below 100 uT: tesla")
    refuse_unless(abs(dip) < np.radians(89.0), "inclination_rad", dip, "within 89 deg of level")
    for field in ("noise_tpsqrthz", "bias_t", "resolution_t"):
        refuse_unless(0.0 <= getattr(spec, field) < np.inf, field, getattr(spec, field), ">= 0")
    refuse_unless(spec.range_t > 0.0, "range_t", spec.range_t, "> 0")
    if spec.iron is not None:
        soft = np.eye(3) + np.asarray(spec.iron.soft_iron, dtype=np.float64)
        refuse_unless(
            bool(np.linalg.det(soft) > 0.0), "soft_iron", spec.iron.soft_iron, "1 + soft_iron keeps its hand"
        )
    if spec.traction is not None:
        check_traction(spec.traction)
    if spec.steel is not None:
        check_steel(spec.steel)


def _into(angles: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors (n, 3) on the axes of a frame with these angles (n, 3) in the frame that they are given in."""
    turned: FloatArray = np.einsum("nji,nj->ni", rotation_matrix(angles), vectors)
    return turned
