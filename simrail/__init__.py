"""simrail: an open testbed for inertial sensors on trains."""

__version__ = "0.1.0"
