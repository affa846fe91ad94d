"""The spectra against numerical integration, known band RMS and other published forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from simrail.core.columns import IRREGULARITY
from simrail.track.spectra import SPECTRA

BANDS = ((3.0, 25.0), (25.0, 70.0), (70.0, 150.0), (3.003, 41.667), (1.0, 100.0))

# RMS in mm in the bands above, from a numerical integration of the published formulas that shares no code
# with this package: alignment, vertical profile, cross-level, gauge.
BAND_RMS_MM = {
    "erri_b176_low": (
        (0.714, 1.197, 1.539, 1.017, 1.696),
        (0.984, 1.651, 2.122, 1.404, 2.339),
        (1.368, 1.05, 0.593, 1.588, 1.792),
        (0.248, 0.191, 0.108, 0.288, 0.325),
    ),
    "erri_b176_high": (
        (1.213, 2.035, 2.616, 1.73, 2.883),
        (1.611, 2.702, 3.474, 2.297, 3.829),
        (2.239, 1.719, 0.97, 2.599, 2.933),
        (0.346, 0.266, 0.15, 0.402, 0.453),
    ),
    "fra_1": (
        (14.235, 24.147, 32.63, 20.346, 34.435),
        (8.541, 14.488, 19.577, 12.207, 20.66),
        (10.109, 6.875, 3.944, 11.421, 12.676),
    ),
    "fra_2": (
        (8.541, 14.488, 19.577, 12.207, 20.66),
        (7.832, 13.285, 17.952, 11.194, 18.945),
        (7.115, 4.188, 2.358, 7.827, 8.559),
    ),
    "fra_3": (
        (4.987, 8.46, 11.431, 7.128, 12.064),
        (6.408, 10.87, 14.689, 9.159, 15.501),
        (6.173, 3.732, 2.107, 6.821, 7.474),
    ),
    "fra_4": (
        (4.271, 7.244, 9.789, 6.104, 10.33),
        (5.691, 9.654, 13.045, 8.134, 13.767),
        (4.51, 2.518, 1.411, 4.919, 5.366),
    ),
    "fra_5": (
        (2.143, 3.635, 4.911, 3.062, 5.183),
        (3.553, 6.027, 8.144, 5.078, 8.594),
        (3.505, 2.144, 1.212, 3.881, 4.257),
    ),
    "fra_6": (
        (1.429, 2.424, 3.276, 2.043, 3.457),
        (1.429, 2.424, 3.276, 2.043, 3.457),
        (1.986, 1.537, 0.906, 2.308, 2.615),
    ),
}


def known_rms_mm(spectrum: str) -> dict[str, tuple[float, ...]]:
    rows = BAND_RMS_MM[spectrum]
    return dict(zip(IRREGULARITY, (*rows, rows[-1])[:4], strict=True))  # FRA: gauge equals cross-level


def test_every_spectrum_has_known_figures() -> None:
    formulas = {f"{name}_formula" for name in BAND_RMS_MM if name.startswith("fra_")}
    assert set(BAND_RMS_MM) | formulas == set(SPECTRA) - {"none"}
    for name in formulas:
        assert SPECTRA[name].densities == SPECTRA[name.removesuffix("_formula")].densities


@pytest.mark.parametrize("name", BAND_RMS_MM)
@pytest.mark.parametrize("column", IRREGULARITY)
def test_band_rms(name: str, column: str) -> None:
    density = SPECTRA[name].densities[column]
    rms = [1e3 * np.sqrt(density.variance(band)) for band in BANDS]
    assert rms == pytest.approx(known_rms_mm(name)[column], abs=0.00051)


@pytest.mark.parametrize("name", BAND_RMS_MM)
@pytest.mark.parametrize("column", IRREGULARITY)
@pytest.mark.parametrize("band", BANDS)
def test_closed_form_is_the_integral_of_the_density(
    name: str, column: str, band: tuple[float, float]
) -> None:
    density = SPECTRA[name].densities[column]
    integral, _ = quad(density.density, 1.0 / band[1], 1.0 / band[0], epsrel=1e-11, epsabs=0.0, limit=200)
    assert density.variance(band) == pytest.approx(integral, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "column", "b0"),
    [
        ("erri_b176_low", "alignment_m", 1.440846e-7),
        ("erri_b176_low", "vertical_profile_m", 2.741619e-7),
        ("erri_b176_high", "alignment_m", 4.164787e-7),
        ("erri_b176_high", "vertical_profile_m", 7.343623e-7),
    ],
)
def test_erri_equals_its_polynomial_form(name: str, column: str, b0: float) -> None:
    # S(W) = b0 / (a0 + a2 W^2 + W^4): the same spectra as another public simulation documents them.
    frequency = np.geomspace(0.01, 1.0, 50)
    w = 2.0 * np.pi * frequency
    other = 2.0 * np.pi * b0 / (0.00028855 + 0.6803895 * w**2 + w**4)
    assert SPECTRA[name].densities[column].density(frequency) == pytest.approx(other, rel=3e-4)


def test_no_irregularity_is_zero() -> None:
    for density in SPECTRA["none"].densities.values():
        assert density.variance((1.0, 100.0)) == 0.0
        assert not density.density([0.01, 1.0]).any()
