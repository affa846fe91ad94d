"""The units of the signals."""

from __future__ import annotations

import pytest

from simrail.recording.signals import FORCES, LENGTHS, RATES, SPEEDS, TIMES


def test_units_are_those_of_the_tables_of_units():
    """Against literal figures: standard gravity by definition, 180 deg per pi, 3600 s per hour."""
    known = {
        "g": 9.80665,
        "mg": 9.80665e-3,
        "deg/s": 0.017453292519943295,
        "deg/h": 4.84813681109536e-06,
        "km/h": 0.2777777777777778,
        "km": 1000.0,
        "mm": 1e-3,
        "ms": 1e-3,
        "us": 1e-6,
        "ns": 1e-9,
    }
    listed = {**RATES, **FORCES, **SPEEDS, **LENGTHS, **TIMES}
    for unit, (multiply, divide) in listed.items():
        assert multiply / divide == pytest.approx(known.get(unit, 1.0), rel=1e-15), unit
    assert set(known) | {"s", "m", "m/s", "m/s2", "rad/s"} == set(listed)
