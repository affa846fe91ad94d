"""Units of the text end at the tables: each figure of a sensor or of what shakes, by hand, in SI."""

from __future__ import annotations

from dataclasses import asdict

import pytest

from simrail.recording.sheets.imu_file import load_grade
from simrail.scenario.sensor_tables import (
    EncoderPart,
    GnssPart,
    IronPart,
    MagnetometerPart,
    OutagePart,
    RailSensorPart,
    SecondImuPart,
    SlipPart,
    SteelPart,
    TractionPart,
)
from simrail.scenario.vibration_tables import (
    CorrugationPart,
    DipsPart,
    RoughnessPart,
    SectionGainPart,
    SleepersPart,
    VibrationPart,
    WheelsPart,
)
from simrail.sensors.gnss import Outage

DEG = 0.017453292519943295


def test_a_magnetometer_is_in_tesla_and_radians() -> None:
    part = MagnetometerPart(
        intensity_ut=50.0,
        inclination_deg=60.0,
        declination_deg=3.0,
        x_axis_deg=-40.0,
        noise_ntpsqrthz=20.0,
        bias_nt=400.0,
        range_ut=200.0,
        resolution_nt=7.0,
        iron=IronPart(
            hard_iron_ut=(1.0, -2.0, 3.0), soft_iron=((0.1, 0.2, 0.3), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        ),
        traction=TractionPart(
            supply="third_rail",
            voltage_v=1500.0,
            efficiency=0.9,
            auxiliary_kw=20.0,
            mass_t=60.0,
            resistance_kn=3.0,
            regenerative=False,
            share=0.25,
        ),
        steel=SteelPart(spacing_m=30.0, moment_sd_am2=900.0, beside_m=(2.0, 3.0), height_m=(0.0, 1.0)),
    )
    spec = asdict(part.spec(17))
    assert spec.pop("field") == pytest.approx(
        {
            "intensity_t": 50e-6,
            "inclination_rad": 60.0 * DEG,
            "declination_rad": 3.0 * DEG,
            "x_axis_rad": -40.0 * DEG,
        }
    )
    iron, traction, steel = (spec.pop(name) for name in ("iron", "traction", "steel"))
    assert iron["hard_iron_t"] == pytest.approx((1e-6, -2e-6, 3e-6)) and iron["soft_iron"][0] == (
        0.1,
        0.2,
        0.3,
    )
    assert traction == {
        "supply": "third_rail",
        "voltage_v": 1500.0,
        "efficiency": 0.9,
        "auxiliary_w": 20e3,
        "mass_kg": 60e3,
        "resistance_n": 3e3,
        "regenerative": False,
        "share": 0.25,
    }
    assert steel == {
        "track_seed": 17,
        "spacing_m": 30.0,
        "moment_sd_am2": 900.0,
        "beside_m": (2.0, 3.0),
        "height_m": (0.0, 1.0),
    }
    told = {"noise_tpsqrthz": 20e-9, "bias_t": 400e-9, "range_t": 200e-6, "resolution_t": 7e-9}
    assert spec == pytest.approx(told)


def test_what_nobody_names_disturbs_nothing() -> None:
    spec = MagnetometerPart().spec(1)
    assert (spec.iron, spec.traction, spec.steel) == (None, None, None)


def test_other_sensors_are_in_metres_radians_and_seconds() -> None:
    rails = RailSensorPart(noise_mm=0.2, outlier_fraction=0.05, outlier_mm=4.0).spec()
    assert asdict(rails) == pytest.approx({"noise_m": 2e-4, "outlier_fraction": 0.05, "outlier_m": 4e-3})
    second = SecondImuPart(
        name="rear",
        body="frame",
        position_m=(1.0, 2.0, 3.0),
        roll_deg=1.0,
        pitch_deg=2.0,
        yaw_deg=3.0,
        clock_offset_sd_s=0.5,
        clock_offset_s=-0.25,
        spacing_sd_m=0.125,
    ).spec(load_grade("tactical"))
    mount = second.mount
    assert (mount.name, mount.body, mount.position_m) == ("rear", "frame", (1.0, 2.0, 3.0))
    assert (mount.roll_rad, mount.pitch_rad, mount.yaw_rad) == pytest.approx((DEG, 2.0 * DEG, 3.0 * DEG))
    assert (second.clock_offset_sd_s, second.clock_offset_s, second.spacing_sd_m) == (0.5, -0.25, 0.125)
    receiver = GnssPart(ahead_m=2.5, latency_s=0.4, outage=(OutagePart(from_m=10.0, to_m=30.0),)).spec()
    assert receiver.outages == (Outage(10.0, 30.0),)
    assert (receiver.ahead_m, receiver.latency_s) == (2.5, 0.4)
    slip = SlipPart(start_s=1.0, duration_s=2.0, creepage=-0.1, ramp_s=0.5)
    (event,) = EncoderPart(wheel="front.left", slip=(slip,)).spec().slip
    assert asdict(event) == {"start_s": 1.0, "duration_s": 2.0, "creepage": -0.1, "ramp_s": 0.5}


def test_what_shakes_is_in_metres_and_decibels_add_up() -> None:
    part = VibrationPart(
        roughness=RoughnessPart(offset_db=2.0),
        section_gain=SectionGainPart(sd=0.3, long_waves_sd=0.2, lengths_m=(50.0, 90.0)),
        welds=DipsPart(spacing_m=20.0, depth_mm=0.2, depth_sd_mm=0.1, decay_m=0.15, reach_m=0.7),
        joints=DipsPart(on=False),
        sleepers=SleepersPart(spacing_m=0.65, spacing_sd=0.02, amplitude_um=12.0, amplitude_sd=0.3),
        corrugation=CorrugationPart(wavelength_m=0.1, amplitude_um=25.0, radius_m=300.0),
        wheels=WheelsPart(amplitude_um=50.0, exponent=1.5, spread=0.2, orders=6),
    )
    made = part.vibration(1.75, 3.0)
    assert made is not None and made.rails.roughness is not None
    assert made.rails.roughness.offset_db == 5.0 and made.rails.roughness.longest_m == 1.75
    welds, sleepers, corrugation, gain = (
        made.rails.welds,
        made.rails.sleepers,
        made.rails.corrugation,
        made.rails.section_gain,
    )
    assert welds is not None and sleepers is not None and corrugation is not None and gain is not None
    assert made.rails.joints is None
    assert tuple(asdict(welds).values()) == pytest.approx((20.0, 2e-4, 1e-4, 0.15, 0.7))
    assert tuple(asdict(sleepers).values()) == pytest.approx((0.65, 0.02, 12e-6, 0.3))
    assert tuple(asdict(corrugation).values()) == pytest.approx((0.1, 25e-6, 300.0))
    assert (gain.sd, gain.lengths_m) == (0.3, (50.0, 90.0))
    long = part.long_wave_gain()
    assert long is not None and (long.sd, long.lengths_m) == (0.2, (50.0, 90.0))
    assert made.wheels is not None
    assert tuple(asdict(made.wheels).values()) == pytest.approx((50e-6, 1.5, 0.2, 6))


def test_a_source_that_is_off_is_none() -> None:
    """The gain by sections of the roughness goes with it; that of the long waves stays."""
    part = VibrationPart(roughness=RoughnessPart(on=False), corrugation=CorrugationPart(on=False))
    made = part.vibration(1.5, 0.0)
    assert made is not None
    assert (made.rails.roughness, made.rails.corrugation, made.rails.section_gain) == (None, None, None)
    assert part.long_wave_gain() is not None
    assert VibrationPart(off=True).vibration(1.5, 0.0) is None
