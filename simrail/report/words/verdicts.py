"""Verdicts in words: which IMUs are good enough, of how many devices that is known, and what is open."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from simrail.report.tables.methods import MethodStyle
from simrail.scoring.share import ENOUGH, NOT_ENOUGH, NOT_JUDGED, UNDECIDED

MARKS = {ENOUGH: "\u2713", NOT_ENOUGH: "\u2717", UNDECIDED: "?", NOT_JUDGED: "\u2013"}
"""Short forms, for tables."""

_MOST_NAMES = 6


def judged_methods(verdicts: pd.DataFrame, styles: Sequence[MethodStyle]) -> list[MethodStyle]:
    """Methods with a verdict: those under test first, those without an IMU last."""
    have = set(verdicts.loc[verdicts["verdict"] != NOT_JUDGED, "estimator"].astype(str))
    return sorted(
        (style for style in styles if style.name in have),
        key=lambda style: (not style.uses_imu, bool(style.baseline)),
    )


def best_method(verdicts: pd.DataFrame, styles: Sequence[MethodStyle]) -> MethodStyle | None:
    """The method under test with which most IMUs are enough, and devices are best where as many are."""

    def merit(style: MethodStyle) -> tuple[int, float]:
        own = verdicts[verdicts["estimator"] == style.name]
        return int((own["verdict"] == ENOUGH).sum()), -float(own["at_share"].median())

    tested = [style for style in judged_methods(verdicts, styles) if style.uses_imu]
    tested = [style for style in tested if not style.baseline] or tested
    return max(tested, key=merit, default=None)


def verdict_sentence(verdicts: pd.DataFrame, styles: Sequence[MethodStyle]) -> str:
    """One sentence of the verdicts of a requirement at a mount, with the method that is best there."""
    wanted, mount = str(verdicts["requirement"].iloc[0]), str(verdicts["mount"].iloc[0])
    best = best_method(verdicts, styles)
    if best is None:
        reason = next((str(one) for one in verdicts["reason"] if one), "no method gives it")
        return f"{wanted}, on the {mount}: not judged ({reason})."
    own = verdicts[verdicts["estimator"] == best.name]
    parts = [
        f"{words} {_names(own.loc[own['verdict'] == verdict, 'imu'])}"
        for verdict, words in ((ENOUGH, "enough:"), (NOT_ENOUGH, "not enough:"), (UNDECIDED, "open:"))
        if (own["verdict"] == verdict).any()
    ]
    return f"{wanted}, on the {mount} with {best.label}: " + "; ".join(parts) + "."


def glance_sentence(table: pd.DataFrame, styles: Sequence[MethodStyle]) -> str:
    """How many of the IMUs are enough at each mount, of each requirement, with the best method there."""
    parts = []
    for wanted, of_wanted in table.groupby("requirement", sort=False):
        mounts, full, none = [], True, True
        for mount, rows in of_wanted.groupby("mount", sort=False):
            best = best_method(rows, styles)
            own = rows[rows["estimator"] == best.name] if best is not None else rows[:0]
            enough = own.loc[own["verdict"] == ENOUGH, "imu"].astype(str).unique()
            imus = rows["imu"].astype(str).unique()
            mounts.append(f"{len(enough)} of {len(imus)} on the {mount}")
            full, none = full and len(enough) == len(imus), none and len(enough) == 0
        told = "all, on every mount" if full else "none, on no mount" if none else ", ".join(mounts)
        parts.append(f"{str(wanted).partition(' for ')[0]}: {told}")
    return "IMUs that are enough: " + "; ".join(parts) + "."


def devices_words(verdicts: pd.DataFrame) -> str:
    """Of how many devices on how many tracks verdicts are."""
    devices, tracks = verdicts["devices"], int(verdicts["tracks"].max())
    low, high = int(devices.min()), int(devices.max())
    many = f"{low}" if low == high else f"{low} to {high}"
    where = "one track: what other rails would do is not in it" if tracks == 1 else f"{tracks} tracks"
    return f"{many} device{'s' * (high != 1)} each, on {where}"


def share_words(row: pd.Series) -> str:
    """A verdict with its share of devices: ``"enough: 60 of 60, 94 to 100 %"``."""
    if row["verdict"] == NOT_JUDGED:
        return f"{NOT_JUDGED}: {row['reason']}"
    low, high = 100.0 * row["low95"], 100.0 * row["high95"]
    return f"{row['verdict']}: {row['passed']} of {row['devices']}, {low:.0f} to {high:.0f} %"


def short_name(imu: object) -> str:
    """Name of an IMU, of a sheet of one's own that of its file without its folders."""
    return Path(str(imu)).name


def imu_words(labels: Mapping[str, object]) -> str:
    """Where an IMU is, and which it is: ``"axle (my_imu.toml)"``."""
    return f"{labels['mount']} ({short_name(labels['imu'])})"


def _names(imus: "pd.Series[str]") -> str:
    names = [short_name(imu) for imu in dict.fromkeys(imus.astype(str))]
    if len(names) > _MOST_NAMES:
        return ", ".join(names[:_MOST_NAMES]) + f" and {len(names) - _MOST_NAMES} more"
    return ", ".join(names)
