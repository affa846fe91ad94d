"""Tables of a scenario that say how rails lie and what the train knows: ``[irregularity]``, ``[map]``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from simrail.core.errors import InputError
from simrail.core.toml_files import Part, blame, existing_file
from simrail.recording.files.data_file import TABLES, TEXTS
from simrail.scenario.axes import Listed
from simrail.scenario.fields import Positive, Scale, Wavelengths
from simrail.scenario.measured_file import MeasuredPart
from simrail.scenario.measured_header import recognise
from simrail.scenario.spectrum_file import is_spectrum, read_spectrum
from simrail.track.defects import Defect
from simrail.track.irregularity import OWN, Irregularity
from simrail.track.map_errors import EXACT, MapDefect, MapErrors
from simrail.track.map_file import (
    CantSd,
    CorrelationLength,
    GradientSd,
    OffsetSd,
    PlaceSd,
    RadiusSd,
    ScaleSd,
    map_errors_of,
)
from simrail.track.measured import MeasuredRails


class DefectPart(Part):
    """``[[irregularity.defect]]``: a discrete defect by form and place (`simrail.track.defects`)."""

    form: Literal["ramp", "step", "dip", "joint", "twist"]
    """Its form."""
    at_m: float
    """Where it begins, s along the track, m."""
    length_m: Positive
    """Length of the form, of a ramp, step or twist that of its rise, m."""
    size_mm: float
    """Its size, mm: up or left positive, of a dip or joint down or right, of a twist left rail up."""
    direction: Literal["vertical", "lateral"] = "vertical"
    """Whether rails leave their place up and down, or aside."""
    rails: Literal["both", "left", "right"] = "both"
    """Which of the rails have it."""
    hold_m: Annotated[float, Field(ge=0.0)] | None = None
    """How far a ramp or a twist keeps its height before it returns, m."""

    def defect(self) -> Defect:
        """The defect that it describes."""
        return Defect(
            form=self.form,
            at_m=self.at_m,
            length_m=self.length_m,
            size_m=self.size_mm / 1000.0,
            direction=self.direction,
            rails=self.rails,
            hold_m=self.hold_m,
        )


class IrregularityPart(Part):
    """``[irregularity]``: how the rails deviate from the design. Without it they do not.

    What the spectrum gives lies from ``start_m`` to ``end_m``, or along the whole track; rails from a file
    and defects are added.

    In the place of a spectrum's name may stand the path of a measuring car's export, whose columns are known
    by their names: its rails are laid from ``start_m`` or the start of the track on, as far as they reach;
    or that of a table of densities (`simrail.scenario.spectrum_file`).
    """

    spectrum: Listed[str] = "none"
    """Spectrum that the rails are drawn from, by its name."""
    wavelengths_m: Wavelengths = (1.5, 100.0)
    """Shortest and longest wavelength, m."""
    fade_m: Listed[Annotated[float, Field(ge=0.0, le=1000.0)]] = 40.0
    """Length over which irregularities rise at their beginning and fall at their end, m."""
    scale: Listed[Scale] = 1.0
    """Factor on all amplitudes."""
    alignment_scale: Listed[Scale] = 1.0
    """Factor on the amplitudes of the alignment, beside scale."""
    vertical_profile_scale: Listed[Scale] = 1.0
    """Factor on the amplitudes of the vertical profile, beside scale."""
    cross_level_scale: Listed[Scale] = 1.0
    """Factor on the amplitudes of the cross-level, beside scale."""
    gauge_scale: Listed[Scale] = 1.0
    """Factor on the amplitudes of the gauge, beside scale."""
    start_m: Listed[float] | None = None
    """Where what the spectrum gives begins, s along the track, m; with the track if left out."""
    end_m: Listed[float] | None = None
    """Where it ends, m; with the track if left out."""
    measured: MeasuredPart | None = None
    """Rails from a file, in place of the spectrum or beside it."""
    defect: tuple[DefectPart, ...] = ()
    """Discrete defects, added to it."""

    @classmethod
    def explained(cls, key: str, value: object) -> str | None:  # noqa: ARG003
        """Where keys of measured rails belong."""
        own = set(MeasuredPart.model_fields) - set(cls.model_fields)
        if key in own or key == "start":
            name = key if key in own else "start_m"
            return f"put it into a table of its own: [irregularity.measured] {name} = ..."
        return None

    def with_file(self, folder: Path | None, *, start_m: Callable[[], float]) -> IrregularityPart:
        """The part with the rails of a file that stands in the place of a spectrum's name; else itself."""
        if not self._names_file:
            return self
        with blame(None, "spectrum"):
            path = existing_file(str(self.spectrum), folder)
            if self.measured is not None and not is_spectrum(path):
                raise InputError(
                    "is a file beside that of [irregularity.measured]",
                    value=str(self.spectrum),
                    limit="one file of measured rails",
                    remedy="keep one of them",
                )
            if is_spectrum(path):
                return self
            recognise(path)
        place = start_m() if self.start_m is None else float(self.start_m)
        measured = MeasuredPart(file=str(self.spectrum), start_m=place, partial=True)
        return self.model_copy(update={"spectrum": "none", "measured": measured, "start_m": None})

    def irregularity(self, measured: MeasuredRails | None, *, folder: Path | None = None) -> Irregularity:
        """The irregularity that it describes, with the rails of its file; nothing in it is a list."""
        own = self.model_dump(exclude={"defect", "measured"})
        defects = tuple(part.defect() for part in self.defect)
        if not self._names_file:
            return Irregularity(**own, defects=defects, measured=measured)
        with blame(None, "irregularity.spectrum"):
            spectrum = read_spectrum(existing_file(str(self.spectrum), folder))
        own |= {"spectrum": OWN, "own_spectrum": spectrum}
        return Irregularity(**own, defects=defects, measured=measured)

    @property
    def _names_file(self) -> bool:
        return Path(str(self.spectrum)).suffix.lower() in (*TEXTS, *TABLES)


class MapDefectPart(Part):
    """``[[map.defect]]``: one fault of the map that the train does not know of.

    ``at_m`` lies in the transition or the curve that is wrong, or in the middle of what has settled.
    """

    kind: Literal["missing_transition", "straightened_transition", "coarse_curve", "settled"]
    """What is wrong: a transition that is missing or straight, a curve drawn by chords, ground that has
    settled."""
    at_m: float
    """In the transition or curve that is wrong, or the middle of what has settled, m."""
    chord_m: Annotated[float, Field(ge=1.0, le=200.0)] = 20.0
    """Distance of the vertices by which a coarse curve is known, m."""
    depth_mm: Annotated[float, Field(ge=-500.0, le=500.0)] = 20.0
    """How deep the ground has settled, mm."""
    length_m: Annotated[float, Field(ge=20.0, le=1000.0)] = 60.0
    """Over which length it has, m."""


class MapPart(Part):
    """``[map]``: how the map that the train carries differs from what was laid. Without it, not at all.

    Standard deviations by kind, and single defects. ``exact = true`` is an ablation: a map without errors,
    and a train that knows it to be so.
    """

    exact: Listed[bool] = False
    """True is an ablation: a map without errors, and a train that knows it to be so."""
    cant_sd_mm: Listed[CantSd] = 3.0
    """Standard deviation of the cant of a curve, one error for each, mm."""
    cant_along_sd_mm: Listed[CantSd] = 1.0
    """Standard deviation of the cant that wanders along the line, mm."""
    cant_along_length_m: Listed[CorrelationLength] = 100.0
    """Distance at which the correlation of that has fallen to 1/e, m."""
    radius_sd_percent: Listed[RadiusSd] = 1.0
    """Relative standard deviation of the curvature of a curve, one error for each, percent."""
    place_sd_m: Listed[PlaceSd] = 0.5
    """Standard deviation of the place of each joint of two segments, m."""
    gradient_sd_permil: Listed[GradientSd] = 0.2
    """Standard deviation of the slope of each gradient, per mille."""
    chainage_scale_sd_percent: Listed[ScaleSd] = 0.0
    """Relative standard deviation of all lengths, percent."""
    chainage_offset_sd_m: Listed[OffsetSd] = 0.0
    """Standard deviation of a shift of all places, m."""
    defect: tuple[MapDefectPart, ...] = ()
    """Single faults of the map that the train does not know of."""

    def errors(self) -> MapErrors:
        """The sizes in SI."""
        return EXACT if self.exact else map_errors_of(self, EXACT)

    def defects(self) -> tuple[MapDefect, ...]:
        """The single defects in SI; none of an exact map."""
        if self.exact:
            return ()
        return tuple(
            MapDefect(
                part.kind,
                part.at_m,
                part.chord_m if part.kind == "coarse_curve" else 1e-3 * part.depth_mm,
                part.length_m,
            )
            for part in self.defect
        )
