"""A spectrum of one's own: the rails have its density, in its waves only."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import read_scenario
from simrail.scenario.spectrum_file import read_spectrum
from simrail.track.irregularity import PERIOD_M, realise
from simrail.track.spectra import SPECTRA

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
F = np.geomspace(1.0 / 100.0, 1.0 / 3.0, 400)
ERRI = SPECTRA["erri_b176_low"].densities


def scenario(folder: Path):
    text = GOOD.replace('spectrum = "erri_b176_low"', 'spectrum = "./mine.csv"')
    return read_scenario(text, name="mine", folder=folder)


def table(folder: Path, *, axis: str = "frequency [1/m]", unit: str = "mm2/(1/m)") -> None:
    x = {"frequency [1/m]": F, "wavelength [m]": 1.0 / F, "wavenumber [rad/m]": 2.0 * np.pi * F}[axis]
    scale = {"mm2/(1/m)": 1e6, "m2/(rad/m)": 0.5 / np.pi}[unit]
    rows = [
        f"{a:.9g},{scale * v:.9g},{scale * y:.9g}"
        for a, v, y in zip(
            x, ERRI["vertical_profile_m"].density(F), ERRI["alignment_m"].density(F), strict=True
        )
    ]
    head = f"{axis},vertical profile [{unit}],alignment [{unit}]"
    (folder / "mine.csv").write_text("\n".join([head, *rows]), encoding="utf-8")


@pytest.mark.parametrize("axis", ["frequency [1/m]", "wavelength [m]", "wavenumber [rad/m]"])
@pytest.mark.parametrize("unit", ["mm2/(1/m)", "m2/(rad/m)"])
def test_the_table_of_a_known_spectrum_has_its_density(tmp_path: Path, axis: str, unit: str) -> None:
    table(tmp_path, axis=axis, unit=unit)
    own = read_spectrum(tmp_path / "mine.csv").spectrum
    at = np.geomspace(1.0 / 99.0, 1.0 / 3.1, 77)
    for name in ("vertical_profile_m", "alignment_m"):
        np.testing.assert_allclose(own.densities[name].density(at), ERRI[name].density(at), rtol=2e-4)
    assert not own.densities["gauge_m"].density(at).any()
    assert not own.densities["alignment_m"].density([1.0 / 200.0, 1.0]).any()


def test_rails_of_a_scenario_have_it_and_what_is_missing_is_told(tmp_path: Path) -> None:
    table(tmp_path)
    parts = Parts(scenario(tmp_path))
    irregularity = parts.ride(next(cells(parts.scenario))).irregularity
    drawn = realise(irregularity, "vertical_profile_m", seed=1, step_m=0.125)
    power = np.abs(np.fft.rfft(drawn) / len(drawn)) ** 2 * 2.0 * PERIOD_M
    k = np.array([1000, 5000, 15000])
    np.testing.assert_allclose(power[k], ERRI["vertical_profile_m"].density(k / PERIOD_M), rtol=1e-3)
    notes = "\n".join(judge_scenario(parts.scenario).notes)
    assert "one-sided spectrum of 3 to 100 m" in notes and "no cross level, gauge" in notes
    key = irregularity.describe()
    table(tmp_path, unit="m2/(rad/m)")
    other = Parts(scenario(tmp_path))
    assert other.ride(next(cells(other.scenario))).irregularity.describe() != key


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("frequency [1/m],vertical profile [mm]\n1,1\n2,1\n", "is no density that is known"),
        ("frequency [1/m],alignment [mm2/(1/m)]\n1,1\n1,1\n", "has a frequency twice"),
        ("frequency [1/m],alignment [mm2/(1/m)]\n1,-1\n2,1\n", "positive numbers"),
        ("frequency [1/m],alignment [mm2/(1/m)]\n1,x\n2,1\n", "no number"),
    ],
)
def test_tables_that_are_none(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "mine.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=says):
        judge_scenario(scenario(tmp_path))
