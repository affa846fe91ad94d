"""Whether what Veillard et al. 2016 say holds in our scores: a function for each claim of ``paper.toml``.

The paper does not say where its IMU sat, nor which line and vehicle it was calibrated on. A claim about sizes
holds if it does at one of our mounts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from simrail.report.papers.claim import Judgement
from simrail.report.papers.veillard_2016.lines import PAPER, Draws, Lines, shares_of_chance
from simrail.report.papers.veillard_2016.ride import Distances, SpectrumOverSpeed

LIMIT = PAPER.limits

FOREIGN = ("paper", "standstill", "average", "smooth", "rough")
"""Parts that are calibrated on other lines than those that they run on."""

GIVEN = ("average", "smooth", "rough")
"""Of these, those that differ in nothing but the line of their calibration."""


@dataclass(frozen=True)
class Evidence:
    """What the claims are judged by.

    Attributes
    ----------
    lines : Lines
        The scores.
    spectra : mapping of str to SpectrumOverSpeed
        By mount: how sqrt(S) goes with the speed on the ride that is drawn.
    distances : mapping of str to Distances
        By mount: where two sums lead on the ride that is drawn.
    """

    lines: Lines
    spectra: Mapping[str, SpectrumOverSpeed] = field(default_factory=dict)
    distances: Mapping[str, Distances] = field(default_factory=dict)


def _means(seen: Evidence, part: str, figure: str) -> dict[str, tuple[float, float, float]]:
    """By mount: mean over lines and devices, with the ends of its interval."""
    return {mount: draws.mean() for mount, draws in seen.lines.by_mount(part, figure).items()}


def _is_of_size(value: float, printed: float) -> bool:
    """Whether two figures agree in size."""
    return printed / LIMIT["size_factor"] <= value <= printed * LIMIT["size_factor"]


def _beside(seen: Evidence, figures: Sequence[str]) -> dict[str, dict[str, float]]:
    """What the motion-compensated filter of the same calibration has, by figure and mount."""
    if not seen.lines.has("standstill"):
        return {}
    return {name: {m: v[0] for m, v in _means(seen, "standstill", name).items()} for name in figures}


def acceleration(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Longitudinal acceleration errs by as much as printed."""
    (printed, _), (part,) = PAPER.printed["acceleration"][0], parts
    rms, greatest = _means(seen, part, "along"), _largest(seen, part, "along_max")
    holds = any(_is_of_size(value[0], printed) for value in rms.values())
    across = _means(seen, part, "across")
    return holds, {"rms": rms, "greatest": greatest, "across": across, "beside": _beside(seen, ["along"])}


def attitude(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Roll and pitch err by as much as printed."""
    (printed, _), (part,) = PAPER.printed["attitude"][0], parts
    roll, pitch = (_means(seen, part, name) for name in ("roll", "pitch"))
    holds = any(
        _is_of_size(roll[mount][0], printed) and _is_of_size(pitch[mount][0], printed) for mount in roll
    )
    greatest = _largest(seen, part, "roll_max")
    return holds, {
        "roll": roll,
        "pitch": pitch,
        "greatest": greatest,
        "beside": _beside(seen, ["roll", "pitch"]),
    }


def speed(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """Speed errs by as much as printed."""
    (printed, _), (part,) = PAPER.printed["speed"][0], parts
    rms, greatest = _means(seen, part, "speed"), _largest(seen, part, "speed_max")
    holds = any(_is_of_size(value[0], printed) for value in rms.values())
    return holds, {"rms": rms, "greatest": greatest, "beside": _beside(seen, ["speed"])}


def _largest(seen: Evidence, part: str, figure: str) -> dict[str, float]:
    """By mount: the largest of all lines and devices."""
    return {mount: float(one.values.max()) for mount, one in seen.lines.by_mount(part, figure).items()}


def centred(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """The error of the speed is centred on zero, ride by ride."""
    (part,) = parts
    share: dict[str, float] = {}
    off: dict[str, float] = {}
    for mount in seen.lines.mounts:
        mean = seen.lines.draws(part, "speed_mean", mount).by_line()
        rms = seen.lines.draws(part, "speed", mount).by_line()
        share[mount] = float(np.mean(np.abs(mean) <= LIMIT["centred_share"] * rms))
        off[mount] = float(np.abs(mean).mean())
    way_m, hours = PAPER.figures["distance_error_m"][0], PAPER.figures["duration_h"][0]
    own_mps = way_m / (3600.0 * hours)
    holds = any(value >= LIMIT["most_lines"] for value in share.values())
    return holds, {"share": share, "off": off, "own_mps": own_mps}


def distance(seen: Evidence, _: Sequence[str]) -> Judgement:
    """The printed error lies inside the distribution over lines, devices and calibrations of other lines."""
    printed = PAPER.printed["distance"][0][0]
    foreign = [part for part in FOREIGN if seen.lines.has(part)]
    ends: dict[str, dict[str, float]] = {}
    chance: dict[str, dict[str, float]] = {}
    for mount in seen.lines.mounts:
        size = np.abs(np.concatenate([seen.lines.draws(p, "distance", mount).values for p in foreign]))
        ends[mount] = {
            "least": float(size.min()),
            "middle": float(np.median(size)),
            "greatest": float(size.max()),
            "beyond": 100.0 * float(np.mean(size >= printed)),
        }
        given: dict[str, Draws] = {
            part: seen.lines.draws(part, "distance", mount) for part in GIVEN if part in foreign
        }
        if len(given) > 1:
            chance[mount] = shares_of_chance(given)
    holds = any(one["least"] <= printed <= one["greatest"] for one in ends.values())
    own = _means(seen, "own", "distance") if seen.lines.has("own") else {}
    return holds, {"ends": ends, "chance": chance, "own": own}


def double_integration(seen: Evidence, _: Sequence[str]) -> Judgement | None:
    """Two sums of the acceleration lead further away than one of the speed."""
    if not seen.distances:
        return None
    worse = [abs(one.by_acceleration) > abs(one.by_speed) for one in seen.distances.values()]
    return all(worse), {"found": {mount: one._asdict() for mount, one in seen.distances.items()}}


def linear(seen: Evidence, _: Sequence[str]) -> Judgement | None:
    """The square root of S is linear in the speed."""
    if not seen.spectra:
        return None
    holds = any(
        min(one.explained, one.explained_of_means) >= LIMIT["linear_share"] for one in seen.spectra.values()
    )
    names = ("slope", "intercept", "rms", "explained", "explained_of_means", "exponent")
    found = {mount: {name: getattr(one, name) for name in names} for mount, one in seen.spectra.items()}
    return holds, {"found": found}


def complementary(seen: Evidence, parts: Sequence[str]) -> Judgement:
    """What the complementary filter takes of motion for inclination is little; parts: with it, without."""
    found = {
        name: {
            mount: [seen.lines.draws(part, name, mount).mean()[0] for part in parts]
            for mount in seen.lines.mounts
        }
        for name in ("roll_curve", "pitch")
    }
    worst = max(leaning / clear for mounts in found.values() for leaning, clear in mounts.values())
    return worst <= LIMIT["leans_factor"], {"found": found, "worst": worst}


def errata(seen: Evidence) -> list[str]:
    """What each slip of the paper does to our figures, where both forms were run."""
    notes = []
    for key, (printed, mended), figure in (
        ("sum", ("spectral_printed", "spectral_own"), "speed"),
        ("sign", ("complementary_printed", "complementary"), "roll"),
        ("date", ("late", "paper"), "speed"),
    ):
        if seen.lines.has(printed, mended):
            both = {
                mount: (
                    seen.lines.draws(printed, figure, mount).mean()[0],
                    seen.lines.draws(mended, figure, mount).mean()[0],
                )
                for mount in seen.lines.mounts
            }
            still: dict[str, tuple[float, float]] = {}
            if key == "sign":
                still = {
                    mount: (
                        seen.lines.draws(printed, "roll_still", mount).mean()[0],
                        seen.lines.draws(mended, "roll_still", mount).mean()[0],
                    )
                    for mount in seen.lines.mounts
                }
            notes.append(PAPER.written(PAPER.words[f"erratum_{key}"], both=both, still=still))
    roll = np.deg2rad(PAPER.figures["range_deg"][0])
    short = float(np.rad2deg(roll - np.arctan(np.sin(roll))))
    notes.append(PAPER.written(PAPER.words["erratum_atan"], short=short))
    return [*notes, PAPER.written(PAPER.words["erratum_count"])]


OURS = ("track_relative", "curve_matched", "zero_velocity", "bogie_delay")
"""Parts that are methods of our own."""


def beside_ours(seen: Evidence) -> list[str]:
    """How our own methods do with the same IMU and no wheel, a sentence each; none if none was run."""
    own = [part for part in OURS if seen.lines.has(part)]
    if not seen.lines.has("paper"):
        return []
    return [PAPER.written(PAPER.words["ours"], part=part, mounts=_compared(seen, part)) for part in own]


def _compared(seen: Evidence, part: str) -> dict[str, dict[str, list[float]]]:
    """By mount, mean rms of the speed and middle error of the distance: of a part, and of the paper's."""
    return {
        mount: {
            "speed": [seen.lines.draws(p, "speed", mount).mean()[0] for p in (part, "paper")],
            "distance": [
                float(np.median(np.abs(seen.lines.draws(p, "distance", mount).values)))
                for p in (part, "paper")
            ],
        }
        for mount in seen.lines.mounts
    }
