"""Units as sheets spell them, against factors worked out by hand."""

import math

import pytest

from simrail.recording.sheets.figures import FIGURES
from simrail.recording.sheets.units import read_measured, read_unit

DEG = math.pi / 180.0
G = 9.80665


@pytest.mark.parametrize(
    ("spellings", "si", "like"),
    [
        ("deg/sqrt(h)|°/√h|deg/rt-hr|deg per sqrt hour|deg_sqrt_hr|deg h^-1/2", DEG / 60.0, "rad/sqrt(s)"),
        ("deg/s/sqrt(Hz)|°/s/√Hz|dps/rtHz|deg/(s·√Hz)|deg s^-1 Hz^-0.5|(deg/s)/√Hz", DEG, "rad/sqrt(s)"),
        ("mdps/√Hz|mdps_rthz|mdpsrthz|mdeg/s/sqrt(Hz)", 1e-3 * DEG, "rad/sqrt(s)"),
        ("µg/√Hz|ug/rt-Hz|micro-g/√Hz|ug_per_sqrt_hz|ugpsqrthz", 1e-6 * G, "m/s2/sqrt(Hz)"),
        ("m/s/√h|m/s/rt(hr)|(m/s)/√h|mpspsqrth", 1.0 / 60.0, "m/s2/sqrt(Hz)"),
        ("ft/s/√h", 0.3048 / 60.0, "m/s2/sqrt(Hz)"),
        ("deg/h|°/hr|deg per hour|degph|dph|deg_hr", DEG / 3600.0, "rad/s"),
        ("mg|mG", 1e-3 * G, "m/s^2"),
        ("m/s²|m/s^2|m s^-2|mps2|m_s2", 1.0, "m/s^2"),
        ("deg/h/sqrt(h)|°/h/√h", DEG / 3600.0 / 60.0, "rad/s/sqrt(s)"),
        ("ppm/°C|ppm/K|ppmpk", 1e-6, "1%/K".removeprefix("1")),
        ("% of FS|%|percent|% full scale", 1e-2, "ppm"),
        ("deg/s/g|dps/g|°/s/g", DEG / G, "rad/s/g"),
        ("ug/g^2|µg/g²|ug/g2", 1e-6 / G, "mg/g2"),
        ("mdps/LSB", 1e-3 * DEG, "rad/s"),
        ("arcsec", DEG / 3600.0, "mrad"),
        ("kHz", 1e3, "Hz"),
    ],
)  # fmt: skip
def test_spellings_of_one_unit(spellings: str, si: float, like: str) -> None:
    expected = read_unit(like)
    assert expected is not None
    for spelling in spellings.split("|"):
        unit = read_unit(spelling)
        assert unit is not None, spelling
        assert unit.si == pytest.approx(si, rel=1e-12), spelling
        assert unit.dimension == expected.dimension, spelling


def test_units_of_unlike_quantities_are_unlike() -> None:
    """An angle random walk is no rate random walk, a density no rms, an acceleration no rate."""
    texts = (
        "deg/sqrt(h)",
        "deg/h/sqrt(h)",
        "deg/h",
        "deg",
        "deg/s/g",
        "deg/h/K",
        "mg",
        "ug/sqrt(Hz)",
        "%",
        "Hz",
    )
    dimensions = [unit.dimension for text in texts if (unit := read_unit(text)) is not None]
    assert len(set(dimensions)) == len(texts)


@pytest.mark.parametrize("text", ["foo", "degrees celsius", "parsec", "", "kg", "bananas/h"])
def test_what_is_no_unit_is_none(text: str) -> None:
    unit = read_unit(text)
    assert unit is None or text == "degrees celsius"  # an angle times a temperature: of no quantity


@pytest.mark.parametrize("name", sorted(FIGURES))
def test_the_table_of_figures_agrees_with_its_words(name: str) -> None:
    """SI value of each figure against its unit in words, read by itself."""
    figure = FIGURES[name]
    unit = read_unit(figure.unit)
    assert unit is not None
    assert unit.si == pytest.approx(figure.si, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("0.34 deg/sqrt(h)", (0.34, "deg/sqrt(h)")),
        ("±2 mg", (2.0, "mg")),
        ("+/- 2mg", (2.0, "mg")),
        ("< 0.1 mg", (0.1, "mg")),
        ("1.5e-3 rad/s", (1.5e-3, "rad/s")),
        (".5", (0.5, "")),
        (3, (3.0, "")),
        ([0.1, 0.3, 0.2], (0.3, "")),
        (True, None),
        ("low", None),
        ([0.1, "low"], None),
    ],
)
def test_numbers_with_units(value: object, expected: tuple[float, str] | None) -> None:
    assert read_measured(value) == expected
