"""The page of an IMU: its figures, and analytic beside simulated Allan deviation; one self-contained file."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL, GYRO, IMU
from simrail.core.jit import FloatArray
from simrail.recording.sheets.allan import overlapping_allan
from simrail.recording.sheets.figures import FIGURES
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import ImuHead
from simrail.recording.sheets.usual import sheet_warnings
from simrail.report.figures.canvas import INK, drawn, legend_above, log_scale, look, panels, to_svg
from simrail.report.pages.frame import page_text, write_page
from simrail.report.tables.imu_text import device_rows, triad_rows
from simrail.sensors.imu import sample_imu

HOUR_S = 3600.0
_COLOURS = ("#0072B2", "#D55E00", "#009E73")


def write_imu_page(
    folder: Path, file: ImuHead, grade: ImuGrade, *, seed: int = 1, rest: pd.DataFrame | None = None
) -> Path:
    """Write ``<folder>/<grade>.html`` and return its path; the folder is made if it is not there.

    With a recording at ``rest``, its Allan deviation stands beside the closed form in the place of a
    simulated one.
    """
    text = page_text(
        "pages/imu.html.j2",
        file=file,
        grade=grade,
        device=device_rows(grade),
        triads=triad_rows(grade),
        warnings=sheet_warnings(grade),
        allan=drawn("allan", partial(allan_figure, grade, *allan_of(grade, seed=seed, rest=rest))),
        measured=rest is not None,
    )
    return write_page(folder, grade.name, text)


def at_rest(grade: ImuGrade, *, seconds: float, seed: int) -> pd.DataFrame:
    """Samples of a device at rest and level, response and clock left out: they do not show at rest."""
    resting = replace(
        grade,
        bandwidth_hz=None,
        gyro_bandwidth_hz=None,
        accel_bandwidth_hz=None,
        oversampling=1,
        clock_jitter_s=0.0,
        clock_drift=0.0,
    )
    index = pd.Index(np.arange(round(seconds * grade.rate_hz)) / grade.rate_hz, name="time_s")
    motion = pd.DataFrame(0.0, index=index, columns=list(IMU))
    motion[ACCEL[2]] = 9.81
    return sample_imu(motion, resting, seed=seed, draw=0, name="imu")[0]


def allan_of(
    grade: ImuGrade, *, seed: int, rest: pd.DataFrame | None = None
) -> tuple[FloatArray, dict[str, FloatArray], str]:
    """Averaging times (n,) s, the Allan deviation (n,) of each axis, SI, and whence it is.

    That of a rest, or of one simulated hour; there is none of a device without noise.
    """
    seconds = HOUR_S if rest is None else len(rest) / grade.rate_hz
    whole = np.unique(np.rint(np.geomspace(1.0, 0.2 * seconds * grade.rate_hz, 36)))
    tau: FloatArray = whole / grade.rate_hz
    frame = at_rest(grade, seconds=HOUR_S, seed=seed) if rest is None else rest
    how = "simulated" if rest is None else "measured"
    if not (frame[list(IMU)].to_numpy() != frame[list(IMU)].iloc[0].to_numpy()).any():
        return tau, {}, how
    return tau, {name: overlapping_allan(frame[name].to_numpy(), grade.rate_hz, tau) for name in IMU}, how


def allan_figure(grade: ImuGrade, tau: FloatArray, found: Mapping[str, FloatArray], how: str) -> str:
    """Allan deviation of each axis (`allan_of`), beside the closed form; "" if it shows nothing."""
    if not found:
        return ""
    analytic = grade.allan(tau)
    units = {"gyro": FIGURES["gyro_bias_instability_degph"], "accel": FIGURES["accel_bias_instability_ug"]}
    with look():
        figure, axes = panels([2.6, 2.6])
        for axis, kind, columns in zip(axes, ("gyro", "accel"), (GYRO, ACCEL), strict=True):
            unit = units[kind]
            for colour, column in zip(_COLOURS, columns, strict=True):
                deviation = found[column] / unit.si
                shown = deviation > 0.0
                axis.plot(tau[shown], deviation[shown], ".", color=colour, label=column.split("_")[1])
            if np.any(analytic[kind] > 0.0):
                axis.plot(tau, analytic[kind] / unit.si, color=INK, label="closed form")
                log_scale(axis.yaxis)
            log_scale(axis.xaxis)
            axis.set_ylabel(f"{'gyro' if kind == 'gyro' else 'accelerometer'}, {unit.unit}")
        legend_above(axes[0])
        axes[1].set_xlabel("averaging time, s")
        return to_svg(figure, description=f"Allan deviation of {grade.name}, {how} and analytic")
