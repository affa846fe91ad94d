"""From a ride file and its data files to a `Recording`: one way for rides of real trains and for our own.

Signals come in SI and in the body's axes (`simrail.recording.files.signal_reader`); an IMU with irregular
time stamps is resampled (`simrail.core.resample`), with its gaps on record. What is at its best already (SI,
the body's own axes, uniform times) passes bit by bit. Nothing else is repaired: what has a fault is refused
by name.

Not here: an odometry, where the file has none, and whether the ride can be true, which are the matter of
`simrail.estimation.recorded_ride.read_ride`.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.columns import IMU
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.resample import (
    GAP_INTERVALS,
    find_gaps,
    is_uniform,
    rate_of,
    refuse_long_gaps,
    refuse_many_lost,
    resample,
    uniform_times,
)
from simrail.core.toml_files import blame, judge, label, load, read_toml
from simrail.recording.check_form import SHEETS, check_recording
from simrail.recording.check_sheet import check_counts, field_bounds, imu_bounds
from simrail.recording.files.asked import RideReference
from simrail.recording.files.common_time import STILL_MPS, begun_later, common_time, refuse_little, spanned
from simrail.recording.files.counters import unwrap
from simrail.recording.files.reference_reader import read_reference
from simrail.recording.files.ride_file import (
    AccelPart,
    EncoderSignalPart,
    GyroPart,
    ImuSignalPart,
    RideFile,
    SecondImuSignalPart,
)
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.recording import EncoderSheet, ImuSheet, OdometerSheet, Recording, SecondImuSheet
from simrail.recording.sheets.grades import imu_sheet
from simrail.recording.sheets.imu_file import load_grade
from simrail.recording.signals import IMU_SENSORS
from simrail.track.design import NO_MAP
from simrail.track.file import TrackFile

RIDE_FILE = "ride.toml"
"""Name of the ride file in a folder that simrail wrote."""

SPACING_SDS = 6.0
"""Standard deviations by which a stated spacing of two IMUs may differ from the drawing's."""

WAY_GAP_S = 1.0
"""A wheel or an odometer may be silent for this long while the train moves, or as long as its file says."""

SLOW_INTERVALS = 3.0
"""A signal that is slower than the longest gap may be silent for this many of its own intervals."""

SLOWEST_HZ, FASTEST_HZ = 1.0, 1e5
"""Rates of IMUs; beyond them the unit of the time stamps is wrong."""

ASIDE = ("magnetometer", "rail_displacement", "odometry")
"""Signals that are given at the IMU's times."""

SENSORS = ("gyro", "accel")


def read_signals(path: Path) -> Recording:
    """Read the signals of a ride, and what the train knows; its odometry only where the file has one.

    Parameters
    ----------
    path : Path
        A ride file, or a folder that holds a ``ride.toml``.

    Raises
    ------
    InputError
        If a file is missing or unreadable, or says something impossible, or the recording does not pass
        `check_recording`.
    """
    return read_whole(path)[0]


def read_whole(path: Path) -> tuple[Recording, RideFile, RideReference | None]:
    """As `read_signals`, with what the ride file says and what the ride is to be compared with.

    Returns
    -------
    recording : Recording
        What a method may see.
    spec : RideFile
        The ride file.
    reference : RideReference or None
        What none may see.
    """
    path = ride_file(path)
    spec = judge(RideFile, read_toml(path), file=label(path))
    with blame(label(path)):
        reader = SignalReader(path.parent)
        recording = _recording(spec, reader)
        check_recording(recording)
        reference = read_reference(spec, reader, recording.imu)
    return replace(recording, notes=tuple(reader.notes)), spec, reference


def ride_file(path: Path) -> Path:
    """The ride file that a path means."""
    return path / RIDE_FILE if path.is_dir() else path


def _recording(spec: RideFile, reader: SignalReader) -> Recording:
    track, folder = NO_MAP, reader.folder
    if spec.track is not None:
        with blame(None, "track"):
            track = load(TrackFile, "track", spec.track, folder=folder).design(Path(spec.track).stem)
    imu, rate_hz, gaps = _imu(spec, reader, _sheet(spec.imu, folder))
    if spec.gaps is not None:
        noted = reader.frame(spec.gaps, "gaps")
        gaps = noted if gaps is None else pd.concat([noted, gaps], ignore_index=True)
    signals = _aside(spec, reader)
    began_s = float(imu.index[0])
    imu = common_time(imu, signals, reader.notes)
    others: dict[str, Any] = {}
    for name, frame in signals.items():
        others[name] = _at(frame, imu.index.to_numpy(), _longest_gap(spec, name), name, reader)
        if name in SHEETS:
            others[SHEETS[name][0]] = getattr(spec, name).sheet
    recording = Recording(
        name=spec.name,
        imu=imu,
        imu_sheet=_sheet_at(spec.imu, folder, rate_hz),
        mount=spec.imu.name,
        mount_body=spec.imu.body,
        mount_position_m=spec.imu.position_m,
        track=track,
        map_errors=spec.map.errors(),
        vehicle_sheet=None if spec.vehicle_sheet is None else spec.vehicle_sheet.sheet(spec.imu.body),
        encoder=None,
        encoder_sheet=None,
        start_position_m=spec.start_position_m or 0.0,
        start_speed_mps=spec.start_speed_mps,
        odometry_source="" if spec.odometry is None else spec.odometry.source,
        gravity_mps2=spec.gravity_mps2,
        gaps=gaps,
        **others,
    )
    if spec.second_imu is not None:
        recording = _with_second_imu(recording, spec.second_imu, spec, reader)
    if spec.gnss is not None:
        received = reader.frame(spec.gnss, "gnss")
        recording = replace(recording, gnss=received, gnss_sheet=spec.gnss.sheet)
    return begun_later(_with_way(recording, spec, reader), began_s, reader.notes)


def _aside(spec: RideFile, reader: SignalReader) -> dict[str, pd.DataFrame]:
    """Frames of the signals of `ASIDE` that there are, at times of their own."""
    frames = {}
    for name in ASIDE:
        part = getattr(spec, name)
        if part is not None:
            bounds = field_bounds(part.sheet) if name == "magnetometer" else None
            frames[name] = reader.frame(part, name, bounds)
    return frames


def _with_second_imu(
    recording: Recording, part: SecondImuSignalPart, spec: RideFile, reader: SignalReader
) -> Recording:
    """Add the second IMU, at uniform times of its own; its gaps are bridged like the first one's."""
    own = _sheet(part, reader.folder, "second_imu")
    signals = reader.frame(part, "second_imu", imu_bounds(own))
    longest = spec.longest_gap_s if part.longest_gap_s is None else part.longest_gap_s
    imu, rate_hz, _ = _uniform(signals, part, longest, "second_imu")
    with blame(None, "second_imu"):
        spacing_m = _spacing_m(recording, part)
    sheet = SecondImuSheet(
        mount=part.name,
        mount_body=part.body,
        mount_position_m=part.position_m,
        spacing_m=spacing_m,
        imu=replace(own, rate_hz=rate_hz),
        spacing_sd_m=part.spacing_sd_m,
        clock_offset_sd_s=part.clock_offset_sd_s,
    )
    return replace(recording, second_imu=imu, second_imu_sheet=sheet)


def _spacing_m(recording: Recording, part: SecondImuSignalPart) -> float:
    """How far a second IMU is behind the first: as told, or by the drawing; refused where these differ."""
    drawn, drawing = None, recording.vehicle_sheet
    if drawing is not None:
        bodies = drawing.body(recording.mount_body), drawing.body(part.body)
        if bodies[0] is not None and bodies[1] is not None:
            first, second = bodies[0].x_m + recording.mount_position_m[0], bodies[1].x_m + part.position_m[0]
            drawn = first - second
            slack = SPACING_SDS * math.hypot(part.spacing_sd_m, math.sqrt(2.0) * drawing.place_sd_m)
            if part.spacing_m is not None and abs(part.spacing_m - drawn) > slack:
                raise InputError(
                    "is not the distance on the drawing of the vehicle",
                    field="spacing_m",
                    value=part.spacing_m,
                    limit=f"{drawn:g} m to {slack:.2g} m",
                    remedy="mend it (positive if the second IMU sits behind the first), or the drawing",
                )
    if part.spacing_m is not None:
        return part.spacing_m
    if drawn is None:
        raise InputError(
            "is missing, and no drawing of the vehicle has both bodies",
            field="spacing_m",
            limit="metres that this IMU sits behind the first, along the train; below 0 ahead of it",
            remedy="measure it to a centimetre: a thousandth of it is a thousandth of the way",
        )
    return drawn


def _longest_gap(spec: RideFile, name: str) -> float:
    """Longest gap of a signal that is bridged, as the ride file has it; for a way at least `WAY_GAP_S`."""
    own = getattr(spec, name).longest_gap_s
    if own is not None:
        return float(own)
    return (
        max(spec.longest_gap_s, WAY_GAP_S)
        if name in ("odometry", "encoder", "odometer")
        else spec.longest_gap_s
    )


def _at(
    frame: pd.DataFrame, times: FloatArray, longest_gap_s: float, what: str, reader: SignalReader
) -> pd.DataFrame:
    """A signal at the IMU's times: as it is if it has them, else interpolated."""
    stamps = frame.index.to_numpy()
    if np.array_equal(stamps, times):
        return frame
    interval = 1.0 / rate_of(stamps)
    longest = max(longest_gap_s, SLOW_INTERVALS * interval)
    found, gaps = resample(frame, times, longest_gap_s=longest, what=what, interval_s=interval)
    lost = f", over {len(gaps)} gaps of {gaps['missing'].sum():.0f} samples" if len(gaps) else ""
    reader.notes.append(
        f"{what}: {len(stamps)} samples at {1.0 / interval:.4g} Hz are interpolated at the IMU's times{lost}"
    )
    return found


def _imu(
    spec: RideFile, reader: SignalReader, sheet: ImuSheet
) -> tuple[pd.DataFrame, float, pd.DataFrame | None]:
    """IMU at uniform times, its rate, and the gaps that were bridged (None if there were none)."""
    part, bounds = spec.imu, imu_bounds(sheet)
    if part.gyro is None and part.accel is None:
        frames = reader.apart(part, "imu", IMU_SENSORS, bounds)
    else:
        kinds = {"gyro": GyroPart, "accel": AccelPart}
        frames = [reader.frame(part.sensor(key, kind), f"imu.{key}", bounds) for key, kind in kinds.items()]
    longest = spec.longest_gap_s if part.longest_gap_s is None else part.longest_gap_s
    if len(frames) == 1 or np.array_equal(frames[0].index.to_numpy(), frames[1].index.to_numpy()):
        imu = frames[0] if len(frames) == 1 else pd.concat(frames, axis=1)
        return _uniform(imu, part, longest, "imu")
    # The faster one sets the times; of two that are as fast, the gyroscope.
    rates = [rate_of(frame.index.to_numpy()) for frame in frames]
    leads = 1 if rates[1] > 1.01 * rates[0] else 0
    led = frames[1 - leads]
    lead = frames[leads]
    within = (lead.index >= led.index[0]) & (lead.index <= led.index[-1])
    refuse_little(lead.index.to_numpy(), within, {f"imu.{SENSORS[1 - leads]}": led})
    lead, rate, gaps = _uniform(lead[within], part, longest, "imu")
    times, interval = lead.index.to_numpy(), 1.0 / rates[1 - leads]
    other, more = resample(
        led,
        times,
        longest_gap_s=max(longest, SLOW_INTERVALS * interval),
        what=f"imu.{SENSORS[1 - leads]}",
        interval_s=interval,
    )
    reader.notes.append(
        f"imu: {SENSORS[1 - leads]} ({rates[1 - leads]:.4g} Hz) is interpolated at the times of "
        f"{SENSORS[leads]} ({rate:.4g} Hz), {times[0]:.9g} to {times[-1]:.9g} s"
    )
    found = [frame for frame in (gaps, more) if frame is not None and len(frame)]
    imu = pd.concat([lead, other], axis=1)[[*IMU]]
    return imu, rate, pd.concat(found, ignore_index=True).sort_values("start_s") if found else None


def _uniform(
    imu: pd.DataFrame, part: ImuSignalPart, longest_gap_s: float, table: str
) -> tuple[pd.DataFrame, float, pd.DataFrame | None]:
    """A frame at uniform times, its rate, and the gaps that were bridged (None if there were none)."""
    time = imu.index.to_numpy()
    measured = rate_of(time)
    if not SLOWEST_HZ <= measured <= FASTEST_HZ:
        raise InputError(
            "the time stamps are of no IMU's rate",
            field=f"{table}.units.time",
            value=f"{measured:.4g} Hz",
            limit=f"{SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz",
            remedy="give the unit of the time stamps: s, ms, us, ns, epoch_s, epoch_ms, ...",
        )
    stated = part.rate_hz or (part.sheet.rate_hz if part.sheet else None)
    if stated is not None and abs(measured / stated - 1.0) > 0.01:
        raise InputError(
            "the time stamps have another rate than is stated",
            field=f"{table}.rate_hz" if part.rate_hz else f"{table}.sheet.rate_hz",
            value=stated,
            limit=f"{measured:.6g} Hz, to 1 %",
            remedy="mend it, or the unit of the time stamps; samples are not thinned out here",
        )
    rate = stated if stated is not None and abs(measured / stated - 1.0) <= 1e-4 else measured
    if is_uniform(time, rate):
        return imu, rate, None
    # Judged before a grid is made: one over a jump of the clock would take all memory.
    lost = find_gaps(time, 1.0 / rate)
    refuse_long_gaps(lost, longest_gap_s)
    refuse_many_lost(lost, len(time))
    grid = uniform_times(float(time[0]), float(time[-1]), rate)
    sampled, gaps = resample(imu, grid, longest_gap_s=longest_gap_s)
    return sampled, rate, gaps if len(gaps) else None


def _sheet_at(part: ImuSignalPart, folder: Path, rate_hz: float) -> ImuSheet:
    """The sheet at the rate of the file; an increment, a mean up to its stamp, is half an interval old."""
    sheet = replace(_sheet(part, folder), rate_hz=rate_hz)
    return replace(sheet, lag_s=max(sheet.lag_s, 0.5 / rate_hz)) if part.increments else sheet


def _sheet(part: ImuSignalPart, folder: Path, table: str = "imu") -> ImuSheet:
    if part.sheet is not None:
        return part.sheet
    if part.datasheet is not None:
        grade = part.datasheet.grade("datasheet")
    else:
        with blame(None, f"{table}.grade"):
            grade = load_grade(str(part.grade), folder=folder)
    return imu_sheet(grade, delay_s=part.delay_s)


def _judge_way(
    frame: pd.DataFrame, table: str, longest_gap_s: float, step: float, reader: SignalReader
) -> None:
    """Refuse a way that is lost while the train moves; at rest its readings may stay out."""
    time = frame.index.to_numpy()
    interval = 1.0 / rate_of(time)
    gaps = find_gaps(time, interval, gap_intervals=max(GAP_INTERVALS, WAY_GAP_S / interval))
    if step > 0.0:
        way = frame.iloc[:, 0]
        moved = np.abs(way[gaps["end_s"]].to_numpy() - way[gaps["start_s"]].to_numpy()) > step
        gaps = gaps[moved]
    refuse_long_gaps(gaps, max(longest_gap_s, SLOW_INTERVALS * interval), what=table)
    long = gaps["end_s"] - gaps["start_s"] > max(WAY_GAP_S, SLOW_INTERVALS * interval)
    reader.notes += [
        f"{table}: silent from {start:.6g} to {end:.6g} s, carried on over it"
        for start, end in gaps[long][["start_s", "end_s"]].to_numpy(dtype=np.float64)
    ]


def _with_way(recording: Recording, spec: RideFile, reader: SignalReader) -> Recording:
    """Add the encoder or the odometer; a distance in steps is an encoder with one pulse per step."""
    if spec.encoder is not None:
        return _with_encoder(recording, spec.encoder, _longest_gap(spec, "encoder"), reader)
    part = spec.odometer
    if part is None:
        return recording
    longest = _longest_gap(spec, "odometer")
    frame, sign = reader.frame(part, "odometer"), -1.0 if part.reverse else 1.0
    if "speed" in part.columns:
        _judge_way(frame, "odometer", longest, 0.0, reader)
        recording = spanned(recording, frame, "odometer", still=STILL_MPS, notes=reader.notes)
        odometer = frame[["speed_mps"]] * sign
        sheet = OdometerSheet(part.speed_sd_mps, part.radius_relative_sd)
        return replace(recording, odometer=odometer, odometer_sheet=sheet)
    step = float(part.resolution_m or 0.0)
    _judge_way(frame[["distance_m"]], "odometer", longest, step, reader)
    way = frame["distance_m"].to_numpy()
    steps = np.rint(sign * (way - way[0]) / step).astype(np.int64)
    counts = pd.DataFrame({"pulse_count": steps}, index=frame.index)
    sheet_of_steps = EncoderSheet(
        wheel="odometer",
        pulses_per_revolution=1,
        wheel_radius_m=step / (2.0 * np.pi),
        rate_hz=rate_of(frame.index.to_numpy()),
        radius_relative_sd=part.radius_relative_sd,
    )
    counts = _going_on(counts, sheet_of_steps, None, "odometer.distance", reader)
    recording = spanned(recording, counts, "odometer", still=1.0, notes=reader.notes)
    return replace(recording, encoder=counts, encoder_sheet=sheet_of_steps)


def _with_encoder(
    recording: Recording, part: EncoderSignalPart, longest_gap_s: float, reader: SignalReader
) -> Recording:
    counts = _going_on(
        reader.frame(part, "encoder"), part.known, part.counter_modulus, "encoder.count", reader
    )
    if part.reverse:
        counts["pulse_count"] = -counts["pulse_count"]
    _judge_way(counts, "encoder", longest_gap_s, 1.0, reader)
    file = label(reader.folder / part.file)
    check_counts(counts["pulse_count"], part.known, where=reader.places["encoder"], file=file)
    recording = spanned(recording, counts, "encoder", still=1.0, notes=reader.notes)
    return replace(recording, encoder=counts, encoder_sheet=part.known)


def _going_on(
    counts: pd.DataFrame, sheet: EncoderSheet, modulus: int | None, field: str, reader: SignalReader
) -> pd.DataFrame:
    """Counts that go on where the counter began anew."""
    turn = sheet.pulses_per_revolution
    found = unwrap(
        counts["pulse_count"].to_numpy(),
        counts.index.to_numpy(),
        m_per_pulse=2.0 * np.pi * sheet.wheel_radius_m / turn,
        turn=turn,
        modulus=modulus,
        field=field,
    )
    if found.times:
        counts = counts.assign(pulse_count=found.counts)
        times = "once" if found.times == 1 else f"{found.times} times"
        known = modulus is not None or found.modulus & (found.modulus - 1) == 0
        more = "" if known else " (if that is another number, give counter_modulus)"
        reader.notes.append(
            f"{field}: the counter begins anew after {found.modulus} pulses, {times}; its counts go on{more}"
        )
    return counts
