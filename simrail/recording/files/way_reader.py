"""The way of a ride: pulses of a wheel, or the distance or the speed of the train's own odometer."""

from dataclasses import replace

import numpy as np
import pandas as pd

from simrail.core.resample import GAP_INTERVALS, SLOW_INTERVALS, find_gaps, rate_of, refuse_long_gaps
from simrail.core.toml_files import label
from simrail.recording.check_counts import check_counts
from simrail.recording.files.common_time import STILL_MPS, spanned
from simrail.recording.files.counters import unwrap
from simrail.recording.files.ride_file import EncoderSignalPart, RideFile
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.recording import EncoderSheet, OdometerSheet, Recording

WAY_GAP_S = 1.0
"""A wheel or an odometer may be silent for this long while the train moves, or as long as its file says."""


def _judge(frame: pd.DataFrame, table: str, longest_gap_s: float, step: float, reader: SignalReader) -> None:
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


def with_way(
    recording: Recording, spec: RideFile, *, longest_gap_s: float, reader: SignalReader
) -> Recording:
    """Add the encoder or the odometer; a distance in steps is an encoder with one pulse per step.

    Parameters
    ----------
    recording : Recording
        Without a way.
    spec : RideFile
        What the ride file says; it has an encoder or an odometer.
    longest_gap_s : float
        For how long the way may be silent.
    reader : SignalReader
        Reads its data file.

    Raises
    ------
    InputError
        If the way is bad, lost while the train moves, or does not span the ride.
    """
    if spec.encoder is not None:
        return _with_encoder(recording, spec.encoder, longest_gap_s, reader)
    part = spec.odometer
    assert part is not None
    frame, sign = reader.frame(part, "odometer"), -1.0 if part.reverse else 1.0
    if "speed" in part.columns:
        _judge(frame, "odometer", longest_gap_s, 0.0, reader)
        recording = spanned(recording, frame, "odometer", still=STILL_MPS, notes=reader.notes)
        odometer = frame[["speed_mps"]] * sign
        sheet = OdometerSheet(part.speed_sd_mps, part.radius_relative_sd)
        return replace(recording, odometer=odometer, odometer_sheet=sheet)
    step = float(part.resolution_m or 0.0)
    _judge(frame[["distance_m"]], "odometer", longest_gap_s, step, reader)
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
    counts = reader.frame(part, "encoder")
    if part.per_reading:
        counts["pulse_count"] = counts["pulse_count"].cumsum()
        reader.notes.append("encoder.count: what was counted in each reading is summed up")
    else:
        counts = _going_on(counts, part.known, part.counter_modulus, "encoder.count", reader)
    if part.reverse:
        counts["pulse_count"] = -counts["pulse_count"]
    _judge(counts, "encoder", longest_gap_s, 1.0, reader)
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
