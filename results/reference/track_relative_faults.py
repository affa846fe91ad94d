"""Make ``track_relative_faults.csv``: how soon the track-relative filter tells a fault, and its error before.

    python results/reference/track_relative_faults.py [--rides 4] [--draws 2]

Rides are some of the scenario ``bounds``, west and east, both ways; each recording is spoiled by one fault at
a time. One row per fault: on how many of the recordings it was told, how far the train had run by then since
the fault began (median and most) and since the end of the first curve behind that (most; below 0 if it was
told before), the greatest error of place and roll until then or, if it was not told, of the whole ride, and
the longest stretch over which the place was outside its bound without a word. The row ``none`` is of the same
rides as they are.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother

from simrail.campaign.cell import record_cell
from simrail.core.columns import ACCEL, BOUND, FAULT, GYRO
from simrail.recording.recording import Recording
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import load_scenario
from simrail.scoring.score import truth_at_imu
from simrail.track.design import CURVE, Curve, Straight, TrackDesign
from simrail.track.file import track_by_name

SHARE = 0.4
"""Of a ride's time: where a fault begins that was not there from the start."""

SLIPS_S, SLIPS = 5.0, 0.1
"""For how long a wheel slips, and how much faster it turns."""


@dataclass(frozen=True)
class Fault:
    """What is done to a recording, and whether it begins under way."""

    spoil: Callable[[Recording], Recording]
    under_way: bool = False


def begin_of(recording: Recording) -> float:
    """Time at which a fault begins that was not there from the start."""
    time = recording.imu.index.to_numpy()
    return float(time[int(SHARE * len(time))])


def turned(recording: Recording, rows: np.ndarray) -> Recording:
    """An IMU in other axes: those of ``rows`` (3, 3)."""
    imu = recording.imu.copy()
    for names in (GYRO, ACCEL):
        imu[list(names)] = recording.imu[list(names)].to_numpy() @ rows.T
    return replace(recording, imu=imu)


def yawed(degrees: float) -> np.ndarray:
    """Axes yawed by an angle."""
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def biased(column: str, bias: float) -> Fault:
    """A sensor whose bias jumps by a size that its sheet excludes."""

    def spoil(recording: Recording) -> Recording:
        imu = recording.imu.copy()
        imu.loc[imu.index > begin_of(recording), column] += bias
        return replace(recording, imu=imu)

    return Fault(spoil, under_way=True)


def scaled_wheel(scale: float) -> Callable[[Recording], Recording]:
    """A wheel whose radius is wrong by a constant."""

    def spoil(recording: Recording) -> Recording:
        assert recording.encoder is not None
        counts = np.round(recording.encoder["pulse_count"] * scale)
        return replace(recording, encoder=recording.encoder.assign(pulse_count=counts))

    return spoil


def slipping(recording: Recording) -> Recording:
    """A wheel that turns too fast for some seconds."""
    assert recording.encoder is not None
    counts = recording.encoder["pulse_count"].to_numpy(dtype=np.float64)
    time, begin = recording.encoder.index.to_numpy(), begin_of(recording)
    slips = (time > begin) & (time <= begin + SLIPS_S)
    more = np.cumsum(np.where(slips, SLIPS * np.diff(counts, prepend=counts[0]), 0.0))
    return replace(recording, encoder=recording.encoder.assign(pulse_count=np.round(counts + more)))


def moved_curve(metres: float) -> Callable[[Recording], Recording]:
    """A map on which the curve nearest to the middle of 40 to 2060 m lies elsewhere, with its transitions."""

    def spoil(recording: Recording) -> Recording:
        track = recording.track
        place, elements = track.start_m, list(track.elements)
        starts = [place := place + length for length in [0.0, *(e.length_m for e in elements)]]
        middle = recording.start_position_m + (500.0 if recording.start_position_m in FIRST else -500.0)
        between = [
            (abs(starts[i] - middle), i)
            for i in range(2, len(elements) - 2)
            if isinstance(elements[i], Curve)
            and all(isinstance(elements[j], Straight) and elements[j].length_m > 5.0 for j in (i - 2, i + 2))
        ]
        _, i = min(between)
        for j, more in ((i - 2, metres), (i + 2, -metres)):
            elements[j] = replace(elements[j], length_m=elements[j].length_m + more)
        return replace(recording, track=replace(track, elements=tuple(elements)))

    return spoil


FIRST: set[float] = set()
"""Places where rides towards larger s begin; filled by `recordings`."""


def other_line(recording: Recording) -> Recording:
    """Another line's map."""
    return replace(recording, track=track_by_name("metro_line"))


def better_map(recording: Recording) -> Recording:
    """A map whose sheet claims a hundredth of its errors."""
    sizes = {name: size for name, size in asdict(recording.map_errors).items() if "length" not in name}
    claimed = {name: 0.01 * size for name, size in sizes.items()}
    return replace(recording, map_errors=replace(recording.map_errors, **claimed))


def better_imu(recording: Recording) -> Recording:
    """An IMU whose sheet claims a hundredth of its biases."""
    sheet = recording.imu_sheet
    names = ("gyro_turn_on_bias_radps", "accel_turn_on_bias_mps2", "package_misalignment_rad")
    return replace(
        recording, imu_sheet=replace(sheet, **{name: 0.01 * getattr(sheet, name) for name in names})
    )


FAULTS = {
    "none": Fault(lambda recording: recording),
    "slip of 10 % for 5 s": Fault(slipping, under_way=True),
    "wheel wrong by 5 %": Fault(scaled_wheel(1.05)),
    "wheel wrong by -5 %": Fault(scaled_wheel(0.95)),
    "one curve of the map 2 m off": Fault(moved_curve(2.0)),
    "start 2 m off": Fault(lambda r: replace(r, start_position_m=r.start_position_m + 2.0)),
    "gyro's bias .02 rad/s": biased(GYRO[2], 0.02),
    "accelerometer's bias .2 m/s2": biased(ACCEL[1], 0.2),
    "IMU yawed by 3 degrees": Fault(lambda r: turned(r, yawed(3.0))),
    "IMU upside down": Fault(lambda r: turned(r, np.diag([1.0, -1.0, -1.0]))),
    "another line's map": Fault(other_line),
    "map's sheet 100 times too good": Fault(better_map),
    "IMU's sheet 100 times too good": Fault(better_imu),
}


def recordings(rides: int, draws: int) -> Iterator[tuple[Recording, pd.DataFrame, TrackDesign]]:
    """Recordings of some of the campaign's rides, evenly taken, with what was true at their samples."""
    scenario = load_scenario("bounds")
    parts, every = Parts(scenario), list(cells(scenario))
    numbers = sorted({cell.ride_number for cell in every})
    for number in numbers[:: max(1, len(numbers) // rides)][:rides]:
        own = [cell for cell in every if cell.ride_number == number and cell.map_draw == cell.sensor_draw]
        truth = simulate(parts.ride(own[0]), warn=False)
        for cell in own[:draws]:
            recording = record_cell(cell, truth, parts)
            if truth.reference_position_m[-1] > truth.reference_position_m[0]:
                FIRST.add(recording.start_position_m)
            yield recording, truth_at_imu(truth, recording), truth.track


def figures_of(
    recording: Recording, motion: pd.DataFrame, line: TrackDesign, fault: Fault
) -> dict[str, float]:
    """How soon a fault is told on a recording, and how wrong the filter is before."""
    states = (
        TrackRelativeSmoother(smoothed=False, geometry_step_m=0.0).estimate(fault.spoil(recording)).states
    )
    time = states.index.to_numpy()
    place = motion["position_m"].to_numpy()
    run = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(place)))])
    first = int(np.searchsorted(time, begin_of(recording))) if fault.under_way else 0
    is_told = states[FAULT].to_numpy() > 0.0
    told = int(np.argmax(is_told)) if is_told.any() else len(time)
    curved = line.kind(place) == CURVE
    ends = np.flatnonzero(curved[:-1] & ~curved[1:]) + 1
    behind = ends[ends > first]
    error = np.abs(states["position_m"] - motion["position_m"]).to_numpy()
    roll = np.rad2deg(np.abs(states["roll_rad"] - motion["roll_rad"])).to_numpy()
    until = slice(first, max(told, first + 1))
    outside = error > states[BOUND[1]].to_numpy()
    since = np.maximum.accumulate(np.where(outside, 0.0, run))
    at_end = min(told, len(time) - 1)
    return {
        "told": float(is_told.any()),
        "too_early": float(told < first),
        "run_m": run[at_end] - run[first] if is_told.any() else np.nan,
        "after_curve_m": run[at_end] - run[behind[0]] if is_told.any() and len(behind) else np.nan,
        "error_m": error[until].max(),
        "roll_deg": roll[until].max(),
        "outside_m": (run - since)[until].max(),
    }


def main() -> None:
    """Spoil, estimate, and write the table."""
    options = argparse.ArgumentParser()
    options.add_argument("--rides", type=int, default=4)
    options.add_argument("--draws", type=int, default=2)
    chosen = options.parse_args()
    rows = [
        {"fault": name} | figures_of(recording, motion, line, fault)
        for recording, motion, line in recordings(chosen.rides, chosen.draws)
        for name, fault in FAULTS.items()
    ]
    each = pd.DataFrame(rows).groupby("fault", sort=False)
    table = pd.DataFrame(
        {
            "recordings": each.size(),
            "told": each["told"].sum().astype(int),
            "run_median_m": each["run_m"].median(),
            "run_most_m": each["run_m"].max(),
            "after_first_curve_most_m": each["after_curve_m"].max(),
            "place_error_most_m": each["error_m"].max(),
            "roll_error_most_deg": each["roll_deg"].max(),
            "outside_most_m": each["outside_m"].max(),
        }
    )
    path = Path(__file__).with_suffix(".csv")
    table.to_csv(path, float_format="%.4g")
    print(table.round(2).to_string())
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
