"""Requirements as people write them."""

import pytest

from simrail.core.errors import InputError
from simrail.scoring.requirement import Requirement, limit_of, read_requirement


@pytest.mark.parametrize(
    "written, quantity, value",
    [
        ("0.1 deg", "roll", 0.1),
        ("0.1deg", "roll", 0.1),
        ("1 mrad", "pitch", 0.05729577951),
        (0.2, "roll", 0.2),
        ("0.5 mm", "alignment", 0.5),
        ("0.05 cm", "alignment", 0.5),
        ("300 mm", "position", 0.3),
        ("3.6 km/h", "speed", 1.0),
        ("5 mg", "acceleration_x", 0.04903325),
        ("36 deg/h", "gyro_bias", 0.01),
        ("12 %", "distance_relative", 0.12),
    ],
)
def test_limits_are_in_the_units_of_the_table(written: str | float, quantity: str, value: float) -> None:
    assert limit_of(written, quantity) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize(
    "written, quantity, words",
    [
        ("0.1 mm", "roll", "unit of length"),
        ("0.1 deg/s", "roll", "unit of rate"),
        ("0.1 furlongs", "position", "not known"),
        ("-1 mm", "alignment", "above 0"),
        ("nan mm", "alignment", "above 0"),
        ("wide", "alignment", "above 0"),
        ("1e999 mm", "alignment", "above 0"),
    ],
)
def test_limits_that_cannot_be(written: str, quantity: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        limit_of(written, quantity)


def test_a_line_is_read() -> None:
    assert read_requirement("roll<0.1deg in curves at 60km/h") == (
        Requirement("roll", 0.1, window="curve"),
        60.0,
    )
    assert read_requirement("alignment D1<0.5mm").requirement == Requirement("alignment", 0.5, band="D1")
    # Of rails without a band, D1: what is not cut are the longest waves, which nobody asks for.
    assert read_requirement("level < 2 mm for 90 %").requirement == Requirement(
        "cross_level", 2.0, band="D1", share=0.9
    )
    assert read_requirement("position p95 <= 0.8 m").requirement == Requirement("position", 0.8, metric="p95")


@pytest.mark.parametrize(
    "line, words",
    [
        ("roll", "is no requirement"),
        ("roll>0.1deg", "is no requirement"),
        ("rol<0.1deg", "nothing that is scored"),
        ("roll<0.1mm", "unit of length"),
        ("roll D1<0.1deg", "band of wavelengths, which roll has not"),
        ("roll<0.1deg in bends", "no part of a ride"),
        ("roll<0.1deg for 100 %", "no share"),
    ],
)
def test_lines_that_are_none(line: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_requirement(line)


def test_its_words() -> None:
    wanted = Requirement("roll", 0.1, window="curve")
    assert wanted.words == "roll rms in curves \u2264 0.1\u00b0 for 95 % of the devices"
