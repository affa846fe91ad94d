"""What the paper says, asked of our scores. Each limit stands in the sentence of its verdict."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from simrail.estimators.tuning.file import Tuning
from simrail.report.papers.claim import Claim
from simrail.report.papers.gonzalez_2023.parts import PARTS, Rows
from simrail.report.papers.gonzalez_2023.printed import COLUMNS, COVERAGE, TABLES
from simrail.report.papers.gonzalez_2023.tunings import constraint_claim
from simrail.report.tables.geometry_bands import QUANTITIES
from simrail.report.words.sentences import significant

SAME_FACTOR = 1.5
"""Two tunings are about as accurate if their errors lie within this factor."""

TOO_NARROW, TOO_WIDE = 90.0, 97.0
"""A 95 % interval that holds less, or more, than so many per cent is too narrow, or too wide."""

PEAK_FACTOR = 3.0
"""The start of a ride stands out if its largest error is this many times the sd of the rest."""

MATTERS_FACTOR = 1.05
"""Misprints matter if an error is more than so many times as large with them."""


class Peak(NamedTuple):
    """Unfiltered alignment error: largest over the first metres of a ride, and sd over the rest, mm."""

    first_m: float
    largest_mm: float
    rest_sd_mm: float


def claims(
    rows: Rows,
    *,
    coverage: Sequence[float],
    peak: Peak,
    tuning: Tuning | None = None,
) -> list[Claim]:
    """All of them, in the order of the paper.

    Parameters
    ----------
    rows : Rows
        The scores.
    coverage : sequence of float
        Share of the track inside the interval of `Rows.main`, %, in the order of `COLUMNS`; empty if unknown.
    peak : Peak
        The start of the ride beside its rest, of `Rows.main`.
    tuning : Tuning, optional
        That of CML, with what the search knows.
    """
    return [
        constraint_claim(tuning),
        _same("tunings", "Section 6.1: CML and KOM are about as accurate.", rows, ("cml", "kom")),
        _same(
            "parts",
            "Tables 1 and 2: KOM tuned on a part of the track is about as accurate, once filtered, as on all "
            "of it.",
            rows,
            ("kom", "kom_start", "kom_end"),
        ),
        _peak(rows, peak),
        _intervals(rows, coverage),
        _same("noise", "Section 6.3: added noise hardly changes the error.", rows, ("cml", "cml_noise")),
    ]


def _same(key: str, said: str, rows: Rows, parts: Sequence[str]) -> Claim:
    missing = [PARTS[part] for part in parts if not rows.has(part)]
    if missing:
        return Claim(key, said, None, f"Not run here: {', '.join(missing)}.")
    told, worst = [], 1.0
    for quantity, filtered in COLUMNS:
        if not filtered:
            continue
        sds = [rows.get(part, quantity, "sd", filtered=True).value for part in parts]
        worst = max(worst, max(sds) / min(sds))
        told.append(f"{QUANTITIES[quantity]} {' / '.join(significant(sd) for sd in sds)} mm")
    named = " / ".join(PARTS[part] for part in parts)
    found = (
        f"{named}, sd of the filtered error: {'; '.join(told)} (holds if all lie within a factor of "
        f"{SAME_FACTOR:g}; they lie within {worst:.2f})."
    )
    return Claim(key, said, worst <= SAME_FACTOR, found)


def _peak(rows: Rows, peak: Peak) -> Claim:
    said = (
        "Section 6.1, Fig. A1: the alignment by CML has a spurious peak in the first metres of the ride "
        f"(largest {TABLES['cml'][2].largest:g} mm), which is left open."
    )
    start, rest = peak.largest_mm, peak.rest_sd_mm
    if not (start > 0.0 and rest > 0.0):
        return Claim("peak", said, None, "Not run here.")
    holds = start > PEAK_FACTOR * rest
    found = (
        f"Ours, {PARTS[rows.main]}, unfiltered: at most {significant(start)} mm over the first "
        f"{peak.first_m:g} m, against an sd of {significant(rest)} mm over the rest (holds if more than "
        f"{PEAK_FACTOR:g} times that)."
    )
    return Claim("peak", said, holds, found)


def _intervals(rows: Rows, coverage: Sequence[float]) -> Claim:
    said = (
        "Section 6.2, Fig. A3: the 95 % intervals are too narrow for cross-level, and too wide for "
        "alignment and "
        f"vertical profile: {' / '.join(f'{value:g}' for value in COVERAGE)} %."
    )
    if len(coverage) != len(COLUMNS):
        return Claim("intervals", said, None, "Not run here.")
    told = ", ".join(
        f"{QUANTITIES[quantity]} {'filtered' if filtered else 'unfiltered'} {value:.0f} %"
        for (quantity, filtered), value in zip(COLUMNS, coverage, strict=True)
    )
    narrow = max(coverage[:2]) < TOO_NARROW
    wide = min(coverage[2:]) > TOO_WIDE
    found = (
        f"Ours, first draw, {PARTS[rows.main]}: {told} (holds if both of cross-level are below "
        f"{TOO_NARROW:g} %, "
        f"the other two above {TOO_WIDE:g} %)."
    )
    parts = []
    if not narrow:
        named = [
            word for word, v in zip(("unfiltered", "filtered"), coverage, strict=False) if v >= TOO_NARROW
        ]
        parts.append(f"cross-level {' and '.join(named)} is not too narrow")
    if wide:
        parts.append(
            "alignment and vertical profile, whose intervals are of all waves, are too wide as in the paper"
        )
    cause = f"{'; '.join(parts)[:1].upper()}{'; '.join(parts)[1:]}." if parts else ""
    return Claim("intervals", said, narrow and wide, found, cause)


def errata_note(rows: Rows) -> str:
    """What the misprints of the equations cost; "" if it was not run."""
    if not rows.has("hand", "printed"):
        return ""
    told = []
    worst = 1.0
    for quantity in ("vertical_profile", "cross_level", "alignment"):
        for filtered, words in ((False, "unfiltered"), (True, "filtered")):
            own, printed = (
                rows.get(part, quantity, "sd", filtered=filtered).value for part in ("hand", "printed")
            )
            worst = max(worst, printed / own)
            told.append(
                f"{QUANTITIES[quantity]} {words} from {significant(printed)} to {significant(own)} mm"
            )
    verdict = (
        f"They matter: an error is up to {worst:.1f} times as large with them"
        if worst > MATTERS_FACTOR
        else f"They hardly matter here: no error is more than {MATTERS_FACTOR:g} times as large with them"
    )
    return (
        "Misprints of the equations: corrected, and with what is beyond first order, the sd of the error "
        f"changes: {'; '.join(told)}. {verdict}."
    )
