"""What a recording says of its devices: IMU and way, axes alone, a second IMU, a magnetometer's clock."""

from dataclasses import replace

from simrail.recording.evidence.axes import weigh_axes
from simrail.recording.evidence.field_clock import weigh_field_clock
from simrail.recording.evidence.judge import Evidence, weigh
from simrail.recording.evidence.second import weigh_second
from simrail.recording.recording import Recording


def weigh_all(recording: Recording) -> Evidence:
    """What a recording says of itself.

    Single axes are judged where no device as a whole is surely wrong.

    Parameters
    ----------
    recording : Recording
        A ride that has passed `simrail.recording.check_form.check_recording`.
    """
    first = weigh(recording)
    beside = (*weigh_second(recording, first), *weigh_field_clock(recording))
    if not any(finding.verdict == "surely wrong" for finding in first.findings):
        beside = (*weigh_axes(recording), *beside)
    return replace(first, findings=first.findings + beside) if beside else first
