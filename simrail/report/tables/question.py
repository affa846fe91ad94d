"""What a scenario is run for: one figure, its draws by method and by IMU and mount, and who is best in it.

Rails in the band that counts where a method under test says what they look like, else roll, else the
position. Medians are of one IMU at one mount: what somebody chooses is not averaged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.report.tables.geometry import JUDGED, QUANTITIES, band_words
from simrail.report.tables.methods import MethodStyle, readable
from simrail.report.words.sentences import significant
from simrail.report.words.verdicts import short_name
from simrail.scoring.ablations import without_ablations
from simrail.scoring.table import FULL
from simrail.track.bands import BANDS, Band

UNLIKE = ("vehicle", "mount", "imu", "odometry", "track", "engine")
"""What somebody chooses: figures are averaged over what a ride meets alone, its speeds, rails and ways."""

IDEAL = "ideal"
"""Grade without errors: it is a floor, and no answer."""

RAILS_UNIT = " mm"

_ODOMETRY = "odometry:"


@dataclass(frozen=True)
class Question:
    """What a scenario is run for.

    Attributes
    ----------
    words : str
        The figure, for a sentence that begins with it.
    unit : str
        Its unit, with the space before it where it has one.
    methods : list of MethodStyle
        Whose it is, in their order.
    draws : pandas.DataFrame
        A row per recording, method and window: ``cell``, ``estimator``, ``window``, ``slot`` (IMU, mount and
        what else differs), ``ideal``, ``value``.
    window : str
        The window that is judged.
    """

    words: str
    unit: str
    methods: list[MethodStyle]
    draws: pd.DataFrame
    window: str

    @property
    def of_rails(self) -> bool:
        """Whether it asks what the rails look like."""
        return self.unit == RAILS_UNIT

    @property
    def judged(self) -> pd.DataFrame:
        """Rows of the window that is judged."""
        return self.draws[self.draws["window"] == self.window]

    def said(self, value: float) -> str:
        """A value with its unit."""
        return f"{significant(value)}{self.unit}"

    def medians(self, style: MethodStyle) -> dict[str, float]:
        """Median of a method by slot, in their order."""
        own = self.judged[self.judged["estimator"] == style.name]
        return {str(slot): float(v) for slot, v in own.groupby("slot", sort=False)["value"].median().items()}

    @property
    def tested(self) -> list[MethodStyle]:
        """Methods under test; where there are none, all that use an IMU."""
        users = [style for style in self.methods if style.uses_imu]
        return [style for style in users if not style.baseline] or users

    @property
    def ranked(self) -> list[MethodStyle]:
        """Methods under test, the one first whose median is least over the real IMUs."""
        real = self.real
        return sorted(
            (style for style in self.tested if self.medians(style)),
            key=lambda style: np.median([v for s, v in self.medians(style).items() if s in real] or [np.inf]),
        )

    @property
    def without(self) -> MethodStyle | None:
        """The method that uses no IMU, of those that have the figure."""
        there = set(self.judged["estimator"].unique())
        return next((s for s in self.methods if not s.uses_imu and s.name in there), None)

    @property
    def real(self) -> set[str]:
        """Slots of IMUs that err; all, where none does."""
        slots = self.judged[["slot", "ideal"]].drop_duplicates()
        return set(slots.loc[~slots["ideal"], "slot"]) or set(slots["slot"])


def question_of(
    scores: pd.DataFrame,
    styles: Sequence[MethodStyle],
    *,
    attitude: Sequence[MethodStyle],
    band: str,
    known: Mapping[str, Band] = BANDS,
) -> Question | None:
    """What a scenario asks for; None if nothing was scored that answers.

    Parameters
    ----------
    scores : pandas.DataFrame
        The score table.
    styles, attitude : sequence of MethodStyle
        The scenario's methods, and those that are told apart by their attitude.
    band : str
        Band that rails are judged in.
    known : mapping of str to Band
        Bands whose wavelengths are told.
    """
    scores = without_ablations(scores)
    scores = scores[(scores["reference"] == "truth") & scores["value"].notna()]
    shown = [style for style in styles if not style.ablation] or list(styles)
    tested = [style.name for style in shown if not style.baseline]
    for quantity in JUDGED:
        rows = _rows(scores, quantity, "sd", band)
        if rows["estimator"].isin(tested).any():
            where = f"in {band_words(band, known)}" if band != FULL else "unfiltered"
            return _question(rows, f"error of the {QUANTITIES[quantity]} {where}, sd", RAILS_UNIT, shown)
    rows = _rows(scores, "roll", "rms", FULL)
    odometries = _odometries(scores)
    if rows["estimator"].isin(tested).any() or (len(rows) and not odometries):
        shown = [style for style in attitude if style in shown]
        return _question(rows, "roll error, rms", "\u00b0", shown)
    rows = _rows(scores, "position", "rms", FULL)
    return _question(rows, "position error of the odometry, rms", " m", odometries)


def _odometries(scores: pd.DataFrame) -> list[MethodStyle]:
    """Looks of the odometries that were scored; the true one is an ablation."""
    names = [str(name) for name in scores["estimator"].unique()]
    colours = ("#0072B2", "#D55E00", "#009E73", "#6350c4", "#a8326f")
    named = [name for name in names if name.startswith(_ODOMETRY) and name != f"{_ODOMETRY}truth"]
    return [
        MethodStyle(name, readable(name.removeprefix(_ODOMETRY)), "", True, "", None, colour, "-")
        for name, colour in zip(named, colours, strict=False)
    ]


def _rows(scores: pd.DataFrame, quantity: str, metric: str, band: str) -> pd.DataFrame:
    chosen = (scores["quantity"] == quantity) & (scores["metric"] == metric) & (scores["band"] == band)
    columns = [name for name in UNLIKE if name in scores]
    return scores.loc[chosen, ["cell", "estimator", "window", "value", *columns]].astype(
        dict.fromkeys(("estimator", "window", *columns), str)
    )


def _question(rows: pd.DataFrame, words: str, unit: str, styles: Sequence[MethodStyle]) -> Question | None:
    rows = rows[rows["estimator"].isin([style.name for style in styles])]
    if rows.empty:
        return None
    # Of roll, curves are where methods differ.
    window = "curve" if words.startswith("roll") and (rows["window"] == "curve").any() else "whole"
    if not (rows["window"] == window).any():
        return None
    varying = [name for name in UNLIKE if name in rows and len(rows[name].unique()) > 1]
    between = {"mount": "on ", "vehicle": "of ", "odometry": "by "}
    named = [name for name in ("imu", "mount", "vehicle", "odometry") if name in varying] or ["imu"]
    names = {imu: short_name(imu) for imu in rows["imu"].unique()}
    # Two sheets of one name in two folders are told by their folders.
    clear = rows.assign(imu=rows["imu"].map(names)) if len(set(names.values())) == len(names) else rows
    slot = clear[named[0]]
    for name in named[1:]:
        slot = slot + " " + between.get(name, "") + clear[name]
    rows = rows.assign(slot=slot, ideal=rows["imu"] == IDEAL)
    where = " in curves" if window == "curve" else ""
    figure, comma, metric = words.partition(",")
    return Question(f"{figure}{where}{comma}{metric}", unit, list(styles), rows, window)
