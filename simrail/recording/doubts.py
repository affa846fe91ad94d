"""All that is told of a ride and refused by nothing: what is odd of its devices, beside their sheets."""

from simrail.recording.check_field import field_warnings
from simrail.recording.check_noise import noise_warnings
from simrail.recording.check_offset import offset_warnings
from simrail.recording.check_spikes import spike_warnings
from simrail.recording.recording import Recording


def doubts(recording: Recording) -> tuple[str, ...]:
    """Warnings, a line each, of noise, offsets, single samples and the magnetic field of a ride."""
    return (
        *noise_warnings(recording),
        *offset_warnings(recording),
        *spike_warnings(recording),
        *field_warnings(recording),
    )
