"""What a recording says of its devices: IMU and way, axes alone, a second IMU, a magnetometer's clock."""

from dataclasses import replace

from simrail.recording.evidence.axes import are_columns, weigh_axes
from simrail.recording.evidence.clipped import weigh_clipped
from simrail.recording.evidence.exchanged import weigh_exchange
from simrail.recording.evidence.field_clock import weigh_field_clock
from simrail.recording.evidence.finding import Finding
from simrail.recording.evidence.judge import Evidence, weigh
from simrail.recording.evidence.second import weigh_second
from simrail.recording.recording import Recording


def weigh_all(recording: Recording) -> Evidence:
    """What a recording says of itself.

    Single axes are judged where no device as a whole is surely wrong; and where each of them follows the line
    with a sign of its own, they are what is wrong.

    Parameters
    ----------
    recording : Recording
        A ride that has passed `simrail.recording.check_form.check_recording`.
    """
    first = weigh(recording)
    axes = weigh_axes(recording, first.single)
    if any(finding.wrong for finding in (*first.findings, *axes)):
        exchanged = weigh_exchange(recording)
        if exchanged is not None:
            first, axes = exchanged, ()
    is_single = first.single is not None and bool(first.single.free)
    if any(finding.verdict == "surely wrong" for finding in first.findings):
        slopes = weigh_axes(recording)
        if are_columns(slopes):
            first, axes = (
                replace(first, findings=tuple(_unjudged(finding) for finding in first.findings)),
                slopes,
            )
        elif not is_single:
            axes = ()
    clipped = weigh_clipped(recording)
    cut = {finding.key.replace("clipped", "alone", 1) for finding in clipped}
    axes = tuple(_cut(finding) if finding.key in cut else finding for finding in axes)
    beside = (*axes, *clipped, *weigh_second(recording, first))
    beside += weigh_field_clock(recording)
    return replace(first, findings=first.findings + beside) if beside else first


def _cut(finding: Finding) -> Finding:
    """A finding of an axis that is cut off: its factor follows from that."""
    why = "the axis is cut off at the end of its range"
    return replace(finding, rests_on="nothing", verdict="could not be judged", why=why, setting="", remedy="")


def _unjudged(finding: Finding) -> Finding:
    """A finding of a device as a whole, whose columns have different signs."""
    return replace(
        finding,
        rests_on="nothing",
        verdict="could not be judged",
        why="single columns of the IMU have the other sign",
        setting="",
        remedy="",
    )
