"""An IMU grade in the units of data sheets, as a table for the terminal and the page."""

import math

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from simrail.core.errors import joined
from simrail.recording.sheets.figures import FIGURES
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import ImuHead
from simrail.recording.sheets.usual import sheet_warnings

_ROWS = (
    ("noise density", "gyro_noise_degpsqrthz", "accel_noise_ugpsqrthz"),
    ("random walk", "gyro_noise_degpsqrth", "accel_noise_mpspsqrth"),
    ("bias instability", "gyro_bias_instability_degph", "accel_bias_instability_mg"),
    ("rate random walk", "gyro_random_walk_degphpsqrth", "accel_random_walk_mgpsqrth"),
    ("initial bias, ±", "gyro_turn_on_bias_degps", "accel_turn_on_bias_mg"),
    ("scale factor error, ±", "gyro_scale_error_ppm", "accel_scale_error_ppm"),
    ("nonlinearity, ±", "gyro_nonlinearity_percentfs", "accel_nonlinearity_percentfs"),
    ("non-orthogonality, ±", "gyro_nonorthogonality_deg", "accel_nonorthogonality_deg"),
    ("g-sensitivity, ±", "gyro_g_sensitivity_degphpg", ""),
    (
        "vibration rectification, ±",
        "gyro_vibration_rectification_degphpg2",
        "accel_vibration_rectification_ugpg2",
    ),
    ("bias per kelvin, ±", "gyro_bias_temperature_degphpk", "accel_bias_temperature_mgpk"),
    ("scale per kelvin, ±", "gyro_scale_temperature_ppmpk", "accel_scale_temperature_ppmpk"),
    ("bandwidth of its own", "gyro_bandwidth_hz", "accel_bandwidth_hz"),
    ("range, ±", "gyro_range_degps", "accel_range_g"),
    ("resolution", "gyro_resolution_degps", "accel_resolution_mg"),
)

_DEVICE = (
    ("bandwidth", "bandwidth_hz"),
    ("misalignment of the package, ±", "package_misalignment_deg"),
    ("clock jitter, sd", "clock_jitter_us"),
    ("clock drift, ±", "clock_drift_ppm"),
    ("samples lost", "dropped_percent"),
)


def triad_rows(grade: ImuGrade) -> list[tuple[str, str, str]]:
    """What a grade says of its triads: (term, gyro, accelerometer), terms that neither has left out."""
    rows = [(term, _words(grade, gyro), _words(grade, accel)) for term, gyro, accel in _ROWS]
    return [row for row in rows if row[1] or row[2]]


def device_rows(grade: ImuGrade) -> list[tuple[str, str]]:
    """What a grade says of the whole device."""
    rows = [("rate", f"{grade.rate_hz:g} Hz")]
    if grade.oversampling > 1:
        rows.append(("averages over", f"{grade.oversampling} samples"))
    if grade.output != "rates":
        rows.append(("output", grade.output))
    if grade.lag_s > 0.0:
        rows.append(("lag", f"{1e3 * grade.lag_s:.3g} ms"))
    if grade.gyro_bias_instability_radps or grade.accel_bias_instability_mps2:
        low, high = grade.flicker_range_s
        gyro, accel = grade.gyro_bias_correlation_s, grade.accel_bias_correlation_s
        how = f"flicker, flat from {low:g} to {high:g} s"
        if grade.bias_process == "gauss_markov":
            how = f"Gauss-Markov, {gyro:g} s" + ("" if gyro == accel else f" and {accel:g} s")
        rows.append(("bias wanders", how))
    return rows + [(term, words) for term, key in _DEVICE if (words := _words(grade, key))]


def _words(grade: ImuGrade, key: str) -> str:
    if not key:
        return ""
    figure = FIGURES[key]
    value = getattr(grade, figure.field)
    if value is None or value == 0.0 or math.isinf(value):
        return ""
    shares = getattr(grade, f"{key.partition('_')[0]}_axis_noise", (1.0,)) if "_noise_" in key else (1.0,)
    if len(set(shares)) > 1:
        # Noise of the axes x, y, z, where they differ.
        return f"{', '.join(f'{share * value / figure.si:.5g}' for share in shares)} {figure.unit}"
    return f"{value / figure.si:.5g} {figure.unit}"


def print_imu(console: Console, file: ImuHead, grade: ImuGrade) -> None:
    """Print a grade: title, source, figures, and what was assumed."""
    console.print(
        f"[bold]{escape(file.title)}[/bold]  ({grade.name}{', synthetic' if file.synthetic else ''})"
    )
    # Text of a person may hold brackets, e.g. [earth], which are no markup.
    console.print(f"source: {grade.source}", highlight=False, markup=False)
    for term, words in device_rows(grade):
        console.print(f"{term}: {words}", highlight=False)
    rows = triad_rows(grade)
    if rows:
        table = Table(box=None, pad_edge=False)
        for title in ("", "gyro", "accelerometer"):
            table.add_column(title, no_wrap=True)
        for row in rows:
            table.add_row(*row)
        console.print(table)
    else:
        console.print("no error terms: it records the true motion, filtered and sampled at its rate")
    for warning in sheet_warnings(grade):
        console.print(f"warning: {warning}", highlight=False, markup=False, soft_wrap=True)
    for sentence in grade.assumed:
        console.print(f"assumed: {joined(sentence)}", highlight=False, markup=False)
