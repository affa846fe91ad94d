"""Spectra of vertical acceleration that others have published, as files: one spectrum, one file.

A spectrum is the rms acceleration in octaves at an axle box, a bogie frame or a floor. An *operating* one
was measured on a named vehicle at a told speed; a *test* level stands for many, and verifies nothing.
Shipped ones lie in ``scenarios/spectra``; a person's own is such a file, too.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part, load, shipped

OCTAVES_HZ = (8.0, 16.0, 31.5, 63.0, 125.0)
"""Nominal centres of the octaves from 5.6 to 178 Hz (IEC 61260-1, base 10)."""

MountKind = Literal["axle", "frame", "floor"]

MOUNTS: dict[MountKind, str] = {"axle": "axle boxes", "frame": "frames", "floor": "floors"}
"""Kinds of mounts in words."""


@dataclass(frozen=True)
class PublishedSpectrum:
    """One published spectrum.

    Attributes
    ----------
    name, title, source, vehicle : str
        Name of its file, what it is, where it was found, and what was measured.
    kind : {"operating", "test"}
        Measured in operation at a told speed; or a level that stands for many.
    mount : {"axle", "frame", "floor"}
        Where.
    speed_mps : float, optional
        Speed; None for a test level.
    rms_mps2 : dict of float to float
        Rms vertical acceleration by nominal centre of the octave, Hz.
    """

    name: str
    title: str
    source: str
    vehicle: str
    kind: Literal["operating", "test"]
    mount: MountKind
    speed_mps: float | None
    rms_mps2: dict[float, float]


class SpectrumFile(Part):
    """A published spectrum as a file: ``octaves_hz`` are of `OCTAVES_HZ`, each with its ``rms_mps2``."""

    title: str
    """One line: what was measured."""
    source: str
    """Where it was published, or that it is synthetic."""
    kind: Literal["operating", "test"]
    """What carried the sensor: axle box, frame or floor."""
    vehicle: str
    """The vehicle."""
    mount: MountKind
    """Where on it."""
    speed_mps: Annotated[float, Field(ge=0.0, le=150.0)] | None = None
    """Speed of the train, m/s."""
    octaves_hz: Annotated[tuple[float, ...], Field(min_length=1)]
    """Centres of the octaves, Hz."""
    rms_mps2: tuple[Annotated[float, Field(gt=0.0, le=1e4)], ...]
    """Root mean square in each, m/s2."""

    @model_validator(mode="after")
    def _fits(self) -> SpectrumFile:
        for octave in self.octaves_hz:
            if octave not in OCTAVES_HZ or self.octaves_hz.count(octave) > 1:
                raise InputError(
                    "is no octave of a spectrum, or is there twice",
                    field="octaves_hz",
                    value=octave,
                    limit=f"each once, of {', '.join(f'{centre:g}' for centre in OCTAVES_HZ)}",
                    remedy="give whole octaves; leave out those that were not measured",
                )
        if len(self.octaves_hz) != len(self.rms_mps2):
            raise InputError(
                "are not as many as octaves_hz",
                field="rms_mps2",
                value=len(self.rms_mps2),
                limit=f"{len(self.octaves_hz)}",
                remedy="give one level for each octave",
            )
        if (self.speed_mps is None) == (self.kind == "operating"):
            raise InputError(
                "belongs to an operating spectrum, and only to one",
                field="speed_mps",
                value=self.speed_mps,
                limit='a speed for kind = "operating", none for kind = "test"',
                remedy="tell the speed, or call it a test level",
            )
        return self

    def spectrum(self, name: str) -> PublishedSpectrum:
        """The spectrum under a name."""
        levels = dict(zip(self.octaves_hz, self.rms_mps2, strict=True))
        return PublishedSpectrum(
            name, self.title, self.source, self.vehicle, self.kind, self.mount, self.speed_mps, levels
        )


def octave_edges(centre_hz: float) -> tuple[float, float]:
    """Exact edges of the octave of a nominal centre: powers of ``10^0.3``, half of one to either side."""
    exact = 10.0 ** (0.3 * np.round(np.log10(centre_hz) / 0.3))
    return float(exact / 10.0**0.15), float(exact * 10.0**0.15)


def read_spectrum(name: str) -> PublishedSpectrum:
    """Read a spectrum: a shipped one by its name, or a file by its path.

    Raises
    ------
    InputError
        If there is none, or the file is no spectrum.
    """
    return load(SpectrumFile, "spectrum", name).spectrum(Path(name).stem)


def shipped_spectra() -> list[PublishedSpectrum]:
    """All spectra that come with simrail."""
    return [read_spectrum(name) for name in shipped("spectrum")]


def known(spectra: Iterable[PublishedSpectrum]) -> dict[MountKind, str]:
    """What there is to verify each kind of mount by, in words."""
    said: dict[MountKind, str] = {}
    operating = [one for one in spectra if one.kind == "operating"]
    for kind, words in MOUNTS.items():
        speeds = sorted({float(one.speed_mps or 0.0) for one in operating if one.mount == kind})
        at = ["at rest" if speed == 0.0 else f"at {speed:g} m/s" for speed in speeds]
        if not at:
            said[kind] = f"{words} unverified, no spectrum of a named vehicle and speed being published"
        elif speeds == [0.0]:
            said[kind] = f"{words} beside a published spectrum at rest, unverified in motion"
        else:
            said[kind] = f"{words} beside published spectra {', '.join(at)}"
    return said
