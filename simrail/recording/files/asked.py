"""What a ride file asks for beside its signals: methods, limits of the rails, a reference to compare with.

None of it is part of a `Recording`: no method sees a reference, and no signal is read otherwise for it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, Self

import pandas as pd
from pydantic import Field, model_validator

from simrail.core.amounts import amount_in
from simrail.core.errors import InputError, one_of
from simrail.core.toml_files import Part, blame, judge
from simrail.recording.files.signal_part import SignalPart
from simrail.recording.signals import RAIL_REFERENCE_SIGNAL, REFERENCE_SIGNAL, Signal
from simrail.track.bands import BANDS, TWIST_BASE_M
from simrail.track.quality import SECTION_M
from simrail.track.rail_limits import EXAMPLE_LIMITS, QUANTITIES, UNFILTERED, RailLimits

_SD = "_sd"
_LIMIT_KEYS = [*BANDS, *(f"{band}{_SD}" for band in BANDS), UNFILTERED, f"{UNFILTERED}{_SD}"]

LimitTable = dict[str, float | str]
"""Band -> limit; with ``_sd`` behind the band, that of the standard deviation of a section."""


class MethodPart(Part):
    """``[[estimator]]`` of a ride file: a method that ``simrail estimate`` runs, under a name.

    Attributes
    ----------
    name : str, optional
        Name in tables and of its files; that of its class if not given.
    method : str
        Its class by name, or FILE.py:CLASS for one of your own.
    options : dict
        Arguments of the class; files are seen from the folder of the ride file.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,60}$")] | None = None
    method: Annotated[str, Field(min_length=1, max_length=500)]
    options: dict[str, Any] = Field(default_factory=dict)

    @property
    def called(self) -> str:
        """Its name in tables."""
        return self.name or self.method.rpartition(":")[2]


class LimitsPart(Part):
    """``[limits]``: what the rails are held against, by quantity and band, e.g. ``D1 = "4 mm"``.

    Attributes
    ----------
    section_m : float
        Length of the sections of standard deviations, m.
    twist_base_m : float
        Base of the twist, m.
    alignment, vertical_profile, cross_level, gauge : dict
        Band (D0, D1, D2, D3, or full for what is unfiltered) -> greatest distance from zero, with its unit;
        D1_sd and the like limit the standard deviation of a section.
    twist : dict
        The same; of twist there is the unfiltered one alone, full and full_sd.
    """

    section_m: Annotated[float, Field(ge=10.0, le=10_000.0)] = SECTION_M
    twist_base_m: Annotated[float, Field(gt=0.0, le=50.0)] = TWIST_BASE_M
    alignment: LimitTable = Field(default_factory=dict)
    vertical_profile: LimitTable = Field(default_factory=dict)
    cross_level: LimitTable = Field(default_factory=dict)
    gauge: LimitTable = Field(default_factory=dict)
    twist: LimitTable = Field(default_factory=dict)

    @model_validator(mode="after")
    def _readable(self) -> Self:
        self.limits()
        return self

    def limits(self) -> RailLimits:
        """The same in SI.

        Raises
        ------
        InputError
            If a band is none, or a limit no length.
        """
        peaks: dict[tuple[str, str], float] = {}
        sds: dict[tuple[str, str], float] = {}
        for quantity in QUANTITIES:
            known = [UNFILTERED, f"{UNFILTERED}{_SD}"] if quantity == "twist" else _LIMIT_KEYS
            for key, value in getattr(self, quantity).items():
                if key not in known:
                    raise InputError(
                        "has no such band",
                        field=f"{quantity}.{key}",
                        value=key,
                        limit=", ".join(known),
                        remedy='e.g. cross_level = { D1 = "4 mm" }, twist = { full = "6 mm" }',
                    )
                of = sds if key.endswith(_SD) else peaks
                metres = 1e-3 * amount_in(value, "mm", what=quantity, field=f"{quantity}.{key}")
                of[quantity, key.removesuffix(_SD)] = metres
        if not peaks and not sds:
            base, section = self.twist_base_m, self.section_m
            return RailLimits(EXAMPLE_LIMITS.peaks, EXAMPLE_LIMITS.sds, section, base, is_example=True)
        return RailLimits(peaks, sds, self.section_m, self.twist_base_m)

    def replaced(self, told: Sequence[str], *, option: str) -> "LimitsPart":
        """The same with limits that a command names, in place of those here or beside them.

        Parameters
        ----------
        told : sequence of str
            ``quantity.band=limit``, e.g. ``vertical_profile.D1=6mm``.
        option : str
            What they are called on the command line, for messages.

        Raises
        ------
        InputError
            If one is not of that form, or there is no such quantity or band.
        """
        data = self.model_dump(exclude_unset=True)
        for one in told:
            key, _, value = one.partition("=")
            quantity, _, band = (word.strip() for word in key.partition("."))
            if not (band and value.strip()):
                raise InputError(
                    "is no limit",
                    field=option,
                    value=one,
                    limit="QUANTITY.BAND=LIMIT",
                    remedy=f"write e.g. {option} vertical_profile.D1=6mm",
                )
            one_of(quantity, QUANTITIES, "rails have no such quantity", field=option)
            data[quantity] = {**data.get(quantity, {}), band: value.strip()}
        return judge(LimitsPart, data, file=option)


class MeasuredPart(SignalPart):
    """What something better measured, to compare with.

    Attributes
    ----------
    source : str
        What measured it, as pages call it.
    sd : dict
        Quantity -> standard deviation of the reference itself, with its unit, e.g. ``roll = "0.02 deg"``.
    """

    sd_units: ClassVar[dict[str, str]]

    source: Annotated[str, Field(min_length=1, max_length=200)]
    sd: dict[str, float | str] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _readable(self) -> Self:
        self.sds()
        return self

    def sds(self) -> dict[str, float]:
        """Standard deviations by column, SI.

        Raises
        ------
        InputError
            If a quantity is none of these, or a standard deviation has not its unit.
        """
        columns = {quantity.key: quantity.columns[0] for quantity in self.signal.quantities}
        found = {}
        for key, value in self.sd.items():
            if key not in self.sd_units:
                raise InputError(
                    "has no such quantity",
                    field=f"sd.{key}",
                    value=key,
                    limit=", ".join(self.sd_units),
                    remedy="name one of them",
                )
            unit = self.sd_units[key]
            if not isinstance(value, str):
                example = {"rad": "0.02 deg", "m": "0.5 mm", "m/s": "0.05 m/s"}[unit]
                raise InputError(
                    "lacks its unit",
                    field=f"sd.{key}",
                    value=value,
                    limit=f'a text with a unit, e.g. "{example}"',
                    remedy="add the unit",
                )
            with blame(None, "sd"):
                found[columns[key]] = amount_in(value, unit, what=key, field=key)
        return found


class ReferencePart(MeasuredPart):
    """``[reference]``: angles, place or speed, on the clock of the IMU.

    It may be slower than the IMU, have gaps, and lack quantities.
    """

    signal: ClassVar[Signal] = REFERENCE_SIGNAL
    sd_units: ClassVar[dict[str, str]] = {
        "roll": "rad",
        "pitch": "rad",
        "yaw": "rad",
        "position": "m",
        "speed": "m/s",
    }


class RailReferencePart(MeasuredPart):
    """``[rail_reference]``: the rails as a trolley or a car measured them, over the distance of the track.

    Attributes
    ----------
    band : str, optional
        The band that it was filtered to, if it was; compared with in that band alone.
    """

    signal: ClassVar[Signal] = RAIL_REFERENCE_SIGNAL
    sd_units: ClassVar[dict[str, str]] = {
        quantity.key: "m" for quantity in RAIL_REFERENCE_SIGNAL.quantities if quantity.key != "position"
    }

    band: Literal["D0", "D1", "D2", "D3"] | None = None


@dataclass(frozen=True)
class RideReference:
    """What a recorded ride is compared with; no truth, but better known than what is judged.

    Attributes
    ----------
    motion : pandas.DataFrame, optional
        Indexed by ``time_s``: some of roll_rad, pitch_rad, yaw_rad, position_m, speed_mps; NaN where one has
        no sample.
    rails : pandas.DataFrame, optional
        Indexed by rising ``position_m``: some of `simrail.core.columns.IRREGULARITY`.
    sds : mapping of str to float
        Standard deviation of a column of `motion`, SI; absent where nothing is known.
    rail_sds : mapping of str to float
        The same of `rails`.
    source, rail_source : str
        What measured them.
    rail_band : str, optional
        The band that the rails were filtered to.
    """

    motion: pd.DataFrame | None = None
    rails: pd.DataFrame | None = None
    sds: dict[str, float] = field(default_factory=dict)
    rail_sds: dict[str, float] = field(default_factory=dict)
    source: str = ""
    rail_source: str = ""
    rail_band: str | None = None
