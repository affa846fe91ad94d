"""The scale of a model track, by its gauge: all that is in metres of a full-size line shrinks with it."""

from simrail.recording.recording import Recording

STANDARD_BASE_M = 1.5
"""Distance of the rails' heads where the gauge is 1.435 m, of which all that is in metres speaks."""

SAME_SCALE = 0.3
"""Relative difference of gauges that makes no other scale: 1.0 to 1.676 m are all of full size."""


def scale_of(recording: Recording) -> float:
    """Of a model track; 1 for every gauge of full size."""
    scale = recording.track.rail_base_m / STANDARD_BASE_M
    return 1.0 if abs(scale - 1.0) < SAME_SCALE else scale
