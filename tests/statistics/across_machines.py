"""The scores of a small campaign as other processors and other Pythons would compute them, side by side.

    python tests/statistics/across_machines.py [--python /path/to/python3.13]

Each machine is a process of its own whose linear algebra (``OPENBLAS_CORETYPE``), compiled kernels
(``NUMBA_CPU_NAME``) or Python is another one; rides are simulated anew by each. A difference is told relative
to the largest value of the same figure, as a mean error near zero is the difference of large numbers. The
last line of each says whether it is within what is asked: 1e-9 for a body on the rails, and 1e-7 for a
vehicle on springs (``--engine compiled``), whose very motion comes out otherwise, by 6e-8 m/s2 of its axle.
The IMU has no counts: where it has, one sample in 160,000 fell on another of .1 mg, and scores moved by up to
3.5e-4.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

MOST = {"kinematic": 1e-9, "compiled": 1e-7}
"""Largest relative difference between machines, by engine."""

MACHINES: dict[str, dict[str, str]] = {
    "linear algebra of Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "kernels for any x86-64": {"NUMBA_CPU_NAME": "generic"},
    "both": {"OPENBLAS_CORETYPE": "Prescott", "NUMBA_CPU_NAME": "generic"},
}

PROGRAM = """
import sys
from simrail.campaign.campaign import run_campaign
from simrail.core.machine import machine
from simrail.scenario.scenario import load_scenario

if __name__ == "__main__":
    result = run_campaign(load_scenario(sys.argv[1], overrides=sys.argv[3:]), workers=1)
    result.scores.to_parquet(sys.argv[2])
    print(machine())
"""

SCENARIO = """
title = "Every kind of method on a body on the rails, or on a vehicle with springs and wheels"
seed = 11
track = "smooth_curve"
vehicle = "metro_irw_bogie"
engine = "kinematic"
[monte_carlo]
sensor_draws = 2
[map]
[irregularity]
spectrum = "erri_b176_low"
wavelengths_m = [1.5, 100.0]
fade_m = 40.0
[[ride]]
name = "out"
start_m = 10.0
end_m = 330.0
speed_kmh = 50.0
rest_s = 5.0
final_rest_s = 1.0
[[imu]]
name = "axle"
grade = "industrial"
body = "front"
position_m = [0.0, 0.0, 0.6]
[encoder]
wheel = "front.left"
pulses_per_revolution = 1024
radius_error_sd = 0.001
"""

METHODS = (
    *("AttitudeEkf", "AttitudeGda", "ComplementaryFilter", "DesignAngles", "Imufusion", "Vqf"),
    *("TrajectorySmoother", "TrackRelativeSmoother", "ProfileFilter", "ZeroVelocityOdometry"),
)


def scores_of(
    python: str, machine: dict[str, str], folder: Path, *, methods: Sequence[str], settings: Sequence[str]
) -> pd.DataFrame:
    """Run the campaign in a process of a machine; what it has run before is read.

    Parameters
    ----------
    python : str
        Its interpreter, which has simrail.
    machine : dict of str to str
        Its environment.
    folder : Path
        For its rides and scores.
    methods, settings : sequence of str
        Estimators, and settings of the scenario.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if (folder / "scores.parquet").exists():
        return pd.read_parquet(folder / "scores.parquet")
    (folder / "program.py").write_text(PROGRAM)
    estimators = "".join(f'[[estimator]]\nname = "{one.lower()}"\nmethod = "{one}"\n' for one in methods)
    (folder / "mine.toml").write_text(SCENARIO + estimators)
    words = [python, "program.py", "mine.toml", "scores.parquet", *settings]
    environment = os.environ | {"SIMRAIL_RIDES": str(folder / "rides")} | machine
    done = subprocess.run(words, env=environment, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr[-2000:])
    print(f"    {done.stdout.strip()}", flush=True)
    return pd.read_parquet(folder / "scores.parquet")


def difference(ours: pd.DataFrame, theirs: pd.DataFrame) -> pd.Series:
    """Relative differences of two score tables of one campaign, by row; time aside.

    Raises
    ------
    AssertionError
        If rows, statuses or numbers of samples differ.
    """
    ours, theirs = (
        table[table["metric"] != "us_per_sample"].reset_index(drop=True) for table in (ours, theirs)
    )
    plain = [name for name in ours if name != "value"]
    for name in plain:
        same = ours[name].astype(str) == theirs[name].astype(str)
        assert same.all(), f"{name}: {ours[name][~same].iloc[0]} and {theirs[name][~same].iloc[0]}"
    assert (ours["value"].isna() == theirs["value"].isna()).all()
    figure = ["cell", "estimator", "quantity", "band", "reference", "window", "unit"]
    size = ours["value"].abs().groupby([ours[name].astype(str) for name in figure]).transform("max")
    return ((ours["value"] - theirs["value"]).abs() / size).fillna(0.0)


def compare(
    machines: Mapping[str, dict[str, str]],
    pythons: Sequence[str],
    place: Path,
    *,
    methods: Sequence[str] = METHODS,
    settings: Sequence[str] = (),
    most: float = MOST["kinematic"],
) -> dict[str, float]:
    """Largest relative difference of every machine, and with every other Python, from this one.

    Parameters
    ----------
    machines : mapping of str to dict
        Environments by their names.
    pythons : sequence of str
        Other interpreters that have simrail.
    place : Path
        A folder for what they compute.
    methods, settings : sequence of str
        Estimators, and settings of the scenario.
    most : float
        What is asked.
    """
    asked = {"methods": methods, "settings": settings}
    first = scores_of(sys.executable, {}, place / "this", **asked)
    ways = [(sys.executable, name, machine) for name, machine in machines.items()]
    found: dict[str, float] = {}
    for python, name, machine in [*ways, *((python, python, {}) for python in pythons)]:
        print(name, flush=True)
        folder = place / re.sub(r"\W+", "_", name)
        unlike = difference(first, scores_of(python, machine, folder, **asked))
        found[name] = float(unlike.max())
        rows = first[first["metric"] != "us_per_sample"].reset_index(drop=True).loc[unlike.nlargest(3).index]
        print(rows[["cell", "estimator", "quantity", "window", "metric", "value"]].to_string(index=False))
        worse, count = int((unlike > most).sum()), int((unlike > 0.0).sum())
        words = "within" if not worse else f"{worse} of them beyond"
        print(f"    {count} of {len(unlike)} values differ, by {found[name]:.1e} at most: {words} {most:g}")
    return found


def main() -> int:
    """Read the command line, and compare."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--python", action="append", default=[], help="another interpreter that has simrail")
    words.add_argument("--machine", action="append", choices=MACHINES, help="one of these; all if not given")
    words.add_argument("--method", action="append", help="an estimator; ten if not given")
    words.add_argument("--engine", choices=MOST, default="kinematic")
    words.add_argument("--set", action="append", default=[], help="a setting of the scenario")
    words.add_argument("--keep", type=Path, help="a folder to go on with")
    given = words.parse_args()
    machines = {name: MACHINES[name] for name in given.machine or MACHINES}
    with tempfile.TemporaryDirectory(prefix="simrail-machines-") as spare:
        place = (given.keep or Path(spare)).resolve()
        methods = given.method or METHODS
        settings = [f"engine={given.engine!r}", *given.set]
        most = MOST[given.engine]
        found = compare(machines, given.python, place, methods=methods, settings=settings, most=most)
    return int(max(found.values()) > most)


if __name__ == "__main__":
    sys.exit(main())
