"""What a recording says of its devices: IMU and way, axes alone, a second IMU, a magnetometer's clock."""

from dataclasses import replace

from simrail.recording.evidence.axes import are_columns, weigh_axes
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
    first, axes = weigh(recording), weigh_axes(recording)
    if any(finding.verdict == "surely wrong" for finding in first.findings):
        if are_columns(axes):
            first = replace(first, findings=tuple(_unjudged(finding) for finding in first.findings))
        else:
            axes = ()
    beside = (*axes, *weigh_second(recording, first), *weigh_field_clock(recording))
    return replace(first, findings=first.findings + beside) if beside else first


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
