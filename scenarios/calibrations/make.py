"""Make the calibrations of the spectral speed anew: ``python scenarios/calibrations/make.py``, some minutes.

Each is of one ride over a line of its own, none of which ``imu_only`` runs on: an average one, one that is
smoother and one that is rougher. The known speed is that of the encoder, as the paper's was the tachometer's.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from simrail.estimators.odometry.encoder import EncoderOdometry
from simrail.estimators.odometry.spectral import Calibration, calibrate

from simrail.campaign.cell import record_cell
from simrail.core.toml_files import toml_text
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import Scenario, load_scenario

FOLDER = Path(__file__).parent
ONE = ("monte_carlo.track_draws=1", "monte_carlo.sensor_draws=1")
LINES: dict[str, tuple[int, tuple[str, ...]]] = {
    "metro_average": (401, ()),
    "metro_smooth": (402, ("vibration.roughness.offset_db=-6", "irregularity.scale=0.7")),
    "metro_rough": (403, ("vibration.roughness.offset_db=6", "irregularity.scale=1.4")),
}
"""By file: seed of the line, and what of it is not as in the scenario. The sizes are synthetic."""


def lines_of(scenario: Scenario) -> dict[str, Calibration]:
    """By mount, the line that fits the scenario's first ride."""
    parts, found = Parts(scenario), {}
    for cell in cells(scenario):
        recording = record_cell(cell, simulate(parts.ride(cell)), parts)
        known = EncoderOdometry().estimate(recording).states["speed_mps"].to_numpy(dtype=np.float64)
        found[recording.mount] = calibrate([recording], [known])
    return found


def main() -> None:
    """Run the rides and write the files."""
    for name, (seed, changes) in LINES.items():
        scenario = load_scenario("imu_only", overrides=[*ONE, *changes], seed=seed)
        ride = f"one ride over {scenario.spec.track}, seed {seed}" + "".join(f", {one}" for one in changes)
        mounts = {
            mount: {"slope": line.slope, "intercept_mps": line.intercept, "rms_mps": line.rms}
            for mount, line in lines_of(scenario).items()
        }
        text = toml_text({"rides": [ride], "mount": mounts})
        path = FOLDER / f"{name}.toml"
        path.write_text(f"# Made by: python scenarios/calibrations/make.py\n{text}", encoding="utf-8")
        print(f"wrote {path.name}: {mounts}")


if __name__ == "__main__":
    main()
