"""A long ride: memory that does not grow with its length, and cost that grows with it, no faster.

By hand for any length: ``python tests/physics/test_long_rides.py 40``, km.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from simrail.track.laid_track import CHANNELS


def ride_of(km: float) -> dict[str, float]:
    """Simulate one IRW axle over so many km of irregular straight track at 100 km/h in this process."""
    import resource
    import tempfile

    from simrail.core.toml_files import load
    from simrail.ride.ride import Ride, _drive
    from simrail.track.design import Straight, TrackDesign
    from simrail.track.irregularity import Irregularity
    from simrail.vehicle.file import VehicleFile
    from simrail.vehicle.speed_profile import SpeedProfile

    ride = Ride(
        name="long",
        track=TrackDesign("long", 0.0, (Straight(1000.0 * km + 100.0),)),
        irregularity=Irregularity("erri_b176_low", (1.5, 100.0), 40.0),
        track_seed=1,
        vehicle=load(VehicleFile, "vehicle", "irw_axle").model("irw_axle"),
        profile=SpeedProfile(50.0, 50.0 + 1000.0 * km, 100.0 / 3.6, rest_s=2.0, final_rest_s=2.0),
        engine="compiled",
    )
    watched = [0.0, 0.0]

    def watch(done_s: float, total_s: float, speed_mps: float) -> None:
        # What a process must hold: pages mapped from files (the arrays on disk) can be dropped at any time.
        status = Path("/proc/self/status").read_text(encoding="ascii")
        anonymous = next(line for line in status.splitlines() if line.startswith("RssAnon"))
        watched[0] = max(watched[0], int(anonymous.split()[1]) / 1024.0)

    with tempfile.TemporaryDirectory() as folder:
        _drive(ride, Path(folder), watch)
        header = json.loads((Path(folder) / "truth.json").read_text(encoding="utf-8"))["manifest"]
        last = np.load(Path(folder) / "body_1.npy", mmap_mode="r")[-1, 0]
    return {
        "anonymous_mb": watched[0],
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "simulated_s": header["simulated_s"],
        "wall_s": header["wall_s"],
        "end_m": float(last),
    }


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads Linux's own account of memory")
def test_memory_is_bounded_and_cost_linear():
    """12 km to 2 km: but for the track's table, 3 MB/km, under 15 MB more; cost per second within 30 %."""
    found = {}
    for km in (2.0, 12.0):
        done = subprocess.run(
            [sys.executable, __file__, str(km)], capture_output=True, text=True, check=True, timeout=900
        )
        found[km] = json.loads(done.stdout)
        assert found[km]["end_m"] == pytest.approx(50.0 + 1000.0 * km, abs=1.0)
    table_mb = 10e3 / 0.125 * len(CHANNELS) * 4 * 8 / 2**20
    assert found[12.0]["anonymous_mb"] - found[2.0]["anonymous_mb"] < table_mb + 15.0
    rate = [found[km]["wall_s"] / found[km]["simulated_s"] for km in found]
    assert rate[1] == pytest.approx(rate[0], rel=0.3)


if __name__ == "__main__":
    print(json.dumps(ride_of(float(sys.argv[1]))))
