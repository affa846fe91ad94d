"""Rides of the lessons: one made anew in a tenth of a second, and one of an engine that ships with them."""

import shutil
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from simrail.core.jit import FloatArray
from simrail.core.toml_files import load
from simrail.ride import cache as ride_cache
from simrail.ride.kinematic import kinematic_truth, rail_following
from simrail.ride.ride import Kept, Ride, rails_of, simulate
from simrail.ride.truth import Mount, Truth
from simrail.ride.truth_files import load_truth
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import load_scenario
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import LaidTrack, lay
from simrail.vehicle.speed_profile import SpeedProfile

RATE_HZ = 250.0
"""Rate of the truths: that of the IMUs, so that nothing has to be filtered."""

HEIGHT_M = 0.6
"""Height of the IMU over the rails, as in the shipped scenarios."""

WHEEL_RADIUS_M = 0.29

SHIPPED = Path(__file__).parent / "short_ride"
"""The ride that ships with the package: a folder as `simrail.ride.truth_files` reads it."""

SHIPPED_SCENARIO = Path(__file__).parent / "short_ride.toml"
"""What it is a ride of."""

MOST_SHIPPED_BYTES = 3_000_000


class Line(NamedTuple):
    """A ride over one curve: the rails as they lie, and what happened."""

    rails: LaidTrack
    truth: Truth

    @property
    def curve_s(self) -> tuple[float, float]:
        """When the vehicle is in the full curve, s."""
        inside = abs(self.truth.track.curvature(self.place_m)) > 0.999 / 300.0
        times: FloatArray = self.truth.time_s[inside]
        return float(times[0]), float(times[-1])

    @property
    def place_m(self) -> FloatArray:
        """Where it is along the track, each sample."""
        return self.truth.reference_position_m


@lru_cache(maxsize=16)
def one_curve(speed_kmh: float = 50.0, rough: float = 1.0, seed: int = 1, rest_s: float = 8.0) -> Line:
    """Ride over the shipped track ``smooth_curve``: a left curve of 300 m with 76 mm of cant.

    Parameters
    ----------
    speed_kmh : float
        Cruise speed.
    rough : float
        Factor on the rails' irregularities (ERRI B176, low); 0 for rails that lie as designed.
    seed : int
        Of the irregularities.
    rest_s : float
        Time at rest before the start.

    Returns
    -------
    Line
        Of a body that keeps to the rails exactly (body ``"body"``, wheel ``"wheel"``): no suspension.
    """
    design = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    laid = lay(design, Irregularity("erri_b176_low", (1.5, 100.0), 40.0, scale=max(rough, 1e-9)), seed=seed)
    profile = SpeedProfile(
        start_m=10.0,
        end_m=590.0,
        speed_mps=speed_kmh / 3.6,
        acceleration_mps2=1.0,
        jerk_mps3=0.8,
        rest_s=rest_s,
        final_rest_s=2.0,
    )
    truth = kinematic_truth(
        design,
        profile,
        channels=rail_following(laid, height_m=HEIGHT_M),
        height_m=HEIGHT_M,
        wheel_radius_m=WHEEL_RADIUS_M,
        rate_hz=RATE_HZ,
    )
    return Line(laid, truth)


ON_BODY = Mount("imu", "body", (0.0, 0.0, HEIGHT_M))
"""Where the IMU sits on the ride of `one_curve`."""


@lru_cache(maxsize=1)
def short_ride() -> Line:
    """The shipped ride: a bogie over the same curve by the compiled engine, its axle ``front`` and its frame.

    The rails are laid again from the scenario beside it.
    """
    return Line(rails_of(_ride()), load_truth(SHIPPED))


def _ride() -> Ride:
    """The ride as the scenario has it; of its motion only what the lessons use is kept."""
    scenario = load_scenario(SHIPPED_SCENARIO)
    ride = Parts(scenario).ride(next(iter(cells(scenario))))
    return replace(ride, kept=Kept(("front", "frame"), ("rear.left",)))


def make_short_ride(folder: Path = SHIPPED) -> int:
    """Simulate the shipped ride and put it into a folder; returns its size in bytes.

    Raises
    ------
    ValueError
        If it is larger than what may ship.
    """
    ride = _ride()
    simulate(ride)
    files = sorted((ride_cache.folder() / ride_cache.key_of(ride.describe())).iterdir())
    size = sum(file.stat().st_size for file in files)
    if size > MOST_SHIPPED_BYTES:
        raise ValueError(f"the ride takes {size} bytes, more than {MOST_SHIPPED_BYTES}")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file in files:
        shutil.copyfile(file, folder / file.name)
    return size


if __name__ == "__main__":
    print(f"wrote {SHIPPED.name}: {make_short_ride() / 1e6:.2f} MB")
