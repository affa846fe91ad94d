"""What a recording says of its devices: IMU and way, a second IMU, the clock of a magnetometer."""

from dataclasses import replace

from simrail.recording.evidence.field_clock import weigh_field_clock
from simrail.recording.evidence.judge import Evidence, weigh
from simrail.recording.evidence.second import weigh_second
from simrail.recording.recording import Recording


def weigh_all(recording: Recording) -> Evidence:
    """What a recording says of itself; that of a ride with one IMU and nothing beside it is that of `weigh`.

    Parameters
    ----------
    recording : Recording
        A ride that has passed `simrail.recording.check_form.check_recording`.
    """
    first = weigh(recording)
    beside = (*weigh_second(recording, first), *weigh_field_clock(recording))
    return replace(first, findings=first.findings + beside) if beside else first
