"""Published spectra as files: what is shipped, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.scoring.published_spectra import (
    OCTAVES_HZ,
    PublishedSpectrum,
    known,
    octave_edges,
    read_spectrum,
    shipped_spectra,
)

MINE = """
title = "Mine"
source = "made up"
kind = "operating"
vehicle = "a coach"
mount = "frame"
speed_mps = 20.0
octaves_hz = [16.0, 31.5]
rms_mps2 = [0.5, 0.25]
"""


def written(folder: Path, text: str = MINE) -> str:
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_octaves_join() -> None:
    """IEC 61260-1, base 10: 10^0.3 wide, centres 10^(0.3 n), without a gap from 5.6 to 178 Hz."""
    edges = np.array([octave_edges(centre) for centre in OCTAVES_HZ])
    np.testing.assert_allclose(edges[1:, 0], edges[:-1, 1], rtol=1e-12)
    np.testing.assert_allclose(edges[:, 1] / edges[:, 0], 10.0**0.3, rtol=1e-12)
    np.testing.assert_allclose(edges[[0, -1], [0, 1]], 10.0 ** np.array([0.75, 2.25]), rtol=1e-12)
    np.testing.assert_allclose(np.sqrt(edges.prod(axis=1)), OCTAVES_HZ, rtol=0.01)


def test_a_file_is_a_spectrum(tmp_path: Path) -> None:
    spectrum = read_spectrum(written(tmp_path))
    assert spectrum == PublishedSpectrum(
        "mine", "Mine", "made up", "a coach", "operating", "frame", 20.0, {16.0: 0.5, 31.5: 0.25}
    )


def test_every_shipped_spectrum_says_where_it_is_from() -> None:
    spectra = shipped_spectra()
    assert [one.name for one in spectra] == list(shipped("spectrum"))
    assert all(one.source and one.vehicle for one in spectra)


def test_the_test_level_is_its_density_over_the_octave() -> None:
    """8.74 (m/s2)2/Hz, even from 20 to 100 Hz: what lies inside is the root of density times width."""
    level = read_spectrum("iec_61373_axle")
    for octave, rms in level.rms_mps2.items():
        low, high = octave_edges(octave)
        assert 20.0 < low < high < 100.0
        assert rms == pytest.approx(np.sqrt(8.74 * (high - low)), rel=0.005)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("[16.0, 31.5]", "[16.0, 30.0]", ["octaves_hz", "30.0", "31.5"]),
        ("[16.0, 31.5]", "[16.0, 16.0]", ["octaves_hz", "16.0", "each once"]),
        ("[0.5, 0.25]", "[0.5]", ["rms_mps2", "1", "2", "one level for each octave"]),
        ("[0.5, 0.25]", "[0.5, 0.0]", ["rms_mps2", "> 0"]),
        ("speed_mps = 20.0\n", "", ["speed_mps", "operating", "tell the speed"]),
        ('"operating"', '"test"', ["speed_mps", "test"]),
        ('"frame"', '"roof"', ["mount", "roof", "floor"]),
    ],
)
def test_a_wrong_spectrum_is_refused(tmp_path: Path, before: str, after: str, words: list[str]) -> None:
    with pytest.raises(InputError) as refused:
        read_spectrum(written(tmp_path, MINE.replace(before, after)))
    said = str(refused.value)
    assert "\n" not in said
    for word in ["mine.toml", *words]:
        assert word in said


def test_a_page_says_of_each_mount_what_there_is(tmp_path: Path) -> None:
    said = known(shipped_spectra())
    assert said["axle"].startswith("axle boxes unverified")
    assert said["frame"].startswith("frames unverified")
    assert said["floor"] == "floors beside a published spectrum at rest, unverified in motion"
    assert known([read_spectrum(written(tmp_path))])["frame"] == "frames beside published spectra at 20 m/s"
