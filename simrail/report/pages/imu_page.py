"""The page of an IMU: its figures, and analytic beside simulated Allan deviation; one self-contained file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from simrail.core.columns import ACCEL, GYRO, IMU
from simrail.core.jit import FloatArray
from simrail.recording.sheets.allan import overlapping_allan
from simrail.recording.sheets.datasheet import FIGURES
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import ImuHead
from simrail.report.figures.style import INK, log_ticks, look, panels, to_svg
from simrail.report.pages.page_file import write_page
from simrail.report.tables.imu_text import device_rows, triad_rows
from simrail.sensors.imu import sample_imu

HOUR_S = 3600.0
_COLOURS = ("#0072B2", "#D55E00", "#009E73")


def write_imu_page(folder: Path, file: ImuHead, grade: ImuGrade, *, seed: int = 1) -> Path:
    """Write ``<folder>/<grade>.html`` and return its path; the folder is made if it is not there."""
    environment = Environment(
        loader=PackageLoader("simrail.report", "."),
        autoescape=select_autoescape(default=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text = environment.get_template("pages/imu.html.j2").render(
        file=file,
        grade=grade,
        device=device_rows(grade),
        triads=triad_rows(grade),
        figure=Markup(allan_figure(grade, seed=seed)),
    )
    return write_page(folder, grade.name, text)


def at_rest(grade: ImuGrade, *, seconds: float, seed: int) -> pd.DataFrame:
    """Samples of a device at rest and level, response and clock left out: they do not show at rest."""
    resting = replace(grade, bandwidth_hz=None, oversampling=1, clock_jitter_s=0.0, clock_drift=0.0)
    index = pd.Index(np.arange(round(seconds * grade.rate_hz)) / grade.rate_hz, name="time_s")
    motion = pd.DataFrame(0.0, index=index, columns=list(IMU))
    motion[ACCEL[2]] = 9.81
    return sample_imu(motion, resting, seed=seed, draw=0, name="imu")[0]


def allan_figure(grade: ImuGrade, *, seed: int) -> str:
    """Allan deviation of one simulated hour, each axis, beside the closed form; "" if it shows nothing."""
    whole = np.unique(np.rint(np.geomspace(1.0, 0.2 * HOUR_S * grade.rate_hz, 36)))
    tau: FloatArray = whole / grade.rate_hz
    analytic = grade.allan(tau)
    frame = at_rest(grade, seconds=HOUR_S, seed=seed)
    if not (frame[list(IMU)].to_numpy() != frame[list(IMU)].iloc[0].to_numpy()).any():
        return ""
    units = {"gyro": FIGURES["gyro_bias_instability_degph"], "accel": FIGURES["accel_bias_instability_ug"]}
    with look():
        figure, axes = panels([2.6, 2.6])
        for axis, kind, columns in zip(axes, ("gyro", "accel"), (GYRO, ACCEL), strict=True):
            unit = units[kind]
            for colour, column in zip(_COLOURS, columns, strict=True):
                found = overlapping_allan(frame[column].to_numpy(), grade.rate_hz, tau) / unit.si
                shown = found > 0.0
                axis.plot(tau[shown], found[shown], ".", color=colour, label=f"{column[-7:].split('_')[0]}")
            if np.any(analytic[kind] > 0.0):
                axis.plot(tau, analytic[kind] / unit.si, color=INK, label="closed form")
                axis.set_yscale("log")
            axis.set_xscale("log")
            axis.set_ylabel(f"{'gyro' if kind == 'gyro' else 'accelerometer'}, {unit.unit}")
        for axis in axes:
            if axis.get_yscale() == "log":
                log_ticks(axis.yaxis)
        axes[0].legend(loc="lower left", bbox_to_anchor=(-0.005, 1.0), ncols=4, borderaxespad=0.15)
        log_ticks(axes[1].xaxis)
        axes[1].set_xlabel("averaging time, s")
        return to_svg(figure, description=f"Allan deviation of {grade.name}, simulated and analytic")
