"""Running safety and ride comfort as a person reads them: a table of rides, and a line in a terminal."""

from collections.abc import Sequence

from simrail.report.tables.pivot import Case, Mean
from simrail.report.tables.tables import Row, Table, mean_cell
from simrail.report.tables.tiles import Tile
from simrail.report.words.sentences import axis_words
from simrail.scoring.kick import decay_limit
from simrail.scoring.ride_figures import RIDE

_COLUMNS = (
    ("wheel load", "least Q/Q\u2080", "wheel_unloading", "max", 3),
    ("wheel load", "\u0394Q/Q\u2080 rms", "wheel_unloading", "rms", 3),
    ("wheel load", "Q max, kN", "wheel_load", "max", 1),
    ("guiding", "Y max, kN", "guiding_force", "max", 1),
    ("derailment, 2 m", "Y/Q max", "derailment_quotient", "max", 3),
    ("derailment, 2 m", "of limit, %", "derailment_quotient", "max", 0),
    ("track shift, 2 m", "\u03a3Y max, kN", "sum_y", "max", 1),
    ("track shift, 2 m", "of limit, %", "sum_y_relative", "max", 0),
    ("comfort", "N_MV", "comfort_nmv", "p95", 2),
    ("comfort", "Wz lateral", "sperling_lateral", "rms", 2),
    ("comfort", "Wz vertical", "sperling_vertical", "rms", 2),
    ("after the kick", "growth, 1/s", "lateral_growth", "mean", 3),
)

SPEED = "speed_kmh"
"""Column of the cells along which a kick may cease to decay."""


def ride_mean(case: Case, quantity: str, metric: str) -> Mean:
    """A figure of the ride itself over the whole of it."""
    return case.get(RIDE, quantity, metric)


def running_table(all_cases: Sequence[Case], *, derailment_limit: float) -> Table | None:
    """Running safety and comfort, one row per case that differs; None if no case has them."""
    own = [case for case in all_cases if RIDE in case.estimators()]
    columns = [column for column in _COLUMNS if any(ride_mean(case, *column[2:4]).draws for case in own)]
    several = _several(own)
    rows, seen = [], set()
    for case in own:
        cells = []
        for _, head, quantity, metric, decimals in columns:
            mean = ride_mean(case, quantity, metric)
            if head.startswith("least"):
                mean = mean._replace(value=1.0 - mean.value)
            share = 100.0 if quantity == "sum_y_relative" else 100.0 / derailment_limit
            scale = share if head.startswith("of limit") else 1.0
            cells.append(mean_cell(mean, decimals=decimals, scale=scale))
        words = [case.labels["ride"], *(case.labels[name] for name in several)]
        words += [axis_words(*axis) for axis in case.axes.items()]
        # Without comfort, which is felt where an IMU is, the IMUs of a ride are alike.
        comfort = any(ride_mean(case, *column).draws for column in (("comfort_nmv", "p95"),))
        label = " \u00b7 ".join([*words, *([case.labels["mount"]] if comfort else [])])
        key = (label, *(cell.text for cell in cells))
        if key not in seen:
            seen.add(key)
            rows.append(Row(label, "", "", cells))
    heads = list(dict.fromkeys(group for group, *_ in columns))
    groups = [(head, sum(group == head for group, *_ in columns)) for head in heads]
    return Table(groups, [head for _, head, *_ in columns], rows) if rows else None


def running_tiles(case: Case, *, derailment_limit: float) -> list[Tile]:
    """The same of a case, as the few numbers that a reader sees first."""

    def of(quantity: str, metric: str, decimals: int = 3) -> str:
        return f"{ride_mean(case, quantity, metric).value:.{decimals}f}"

    result = []
    if (unloading := ride_mean(case, "wheel_unloading", "max")).draws:
        note = (
            f"\u0394Q/Q\u2080 {of('wheel_unloading', 'rms')} rms; Q at most {of('wheel_load', 'max', 1)} kN"
        )
        result.append(Tile("least Q/Q\u2080", f"{1.0 - unloading.value:.3f}", note))
    if (quotient := ride_mean(case, "derailment_quotient", "max")).draws and quotient.value >= 0.0:
        share = f"{100.0 * quotient.value / derailment_limit:.0f} % of its limit"
        result.append(Tile("greatest Y/Q, over 2 m", f"{quotient.value:.3f}", share))
        share = f"{100.0 * ride_mean(case, 'sum_y_relative', 'max').value:.0f} % of its limit"
        result.append(Tile("greatest \u03a3Y, over 2 m", f"{of('sum_y', 'max', 1)} kN", share))
    if ride_mean(case, "comfort_nmv", "p95").draws:
        wz = f"Wz {of('sperling_lateral', 'rms', 2)} lateral, {of('sperling_vertical', 'rms', 2)} vertical"
        result.append(Tile("comfort N_MV", of("comfort_nmv", "p95", 2), wz))
    if (growth := ride_mean(case, "lateral_growth", "mean")).draws:
        does = "grows" if growth.value > 0.0 else "decays"
        result.append(Tile(f"the kick {does} by", f"{abs(growth.value):.3f} /s", "as exp(growth t)"))
    return result


def running_words(case: Case, *, derailment_limit: float) -> str:
    """Running safety and comfort of a case in a line; empty if it has none."""
    said = []
    unloading = ride_mean(case, "wheel_unloading", "max")
    if unloading.draws:
        quotient = ride_mean(case, "derailment_quotient", "max").value
        shift = ride_mean(case, "sum_y", "max").value
        relative = ride_mean(case, "sum_y_relative", "max").value
        said.append(f"least Q/Q0 {1.0 - unloading.value:.3f}, at most")
        said[-1] += f" Q {ride_mean(case, 'wheel_load', 'max').value:.1f} kN"
        said[-1] += f", Y {ride_mean(case, 'guiding_force', 'max').value:.1f} kN"
        if quotient >= 0.0:  # over less than 2 m there is none
            said[-1] += f", Y/Q {quotient:.3f} ({100.0 * quotient / derailment_limit:.0f} % of its limit)"
            said[-1] += f", sum Y {shift:.1f} kN ({100.0 * relative:.0f} %)"
    comfort = ride_mean(case, "comfort_nmv", "p95")
    if comfort.draws:
        lateral, vertical = (
            ride_mean(case, f"sperling_{way}", "rms").value for way in ("lateral", "vertical")
        )
        said.append(f"N_MV {comfort.value:.2f}, Wz {lateral:.2f} lateral, {vertical:.2f} vertical")
    growth = ride_mean(case, "lateral_growth", "mean")
    if growth.draws:
        verb = "grows" if growth.value > 0.0 else "decays"
        said.append(f"the kick {verb} by {abs(growth.value):.3f} per second")
    return "; ".join(said)


def decay_words(all_cases: Sequence[Case]) -> list[str]:
    """Above which speed the kick of a ride no longer decays, a sentence per ride that has several speeds."""
    growth: dict[tuple[str, ...], dict[float, float]] = {}
    several = [name for name in _several(all_cases) if name != "vehicle"]
    for case in all_cases:
        mean = ride_mean(case, "lateral_growth", "mean")
        if mean.draws and SPEED in case.labels:
            axes = [axis_words(*axis) for axis in case.axes.items() if not axis[0].endswith(SPEED)]
            words = [case.labels[name] for name in several]
            who = (f"{case.labels['vehicle']} on ride {case.labels['ride']}", *words, *axes)
            growth.setdefault(who, {})[float(case.labels[SPEED])] = mean.value
    sentences = []
    for who, of_speed in growth.items():
        limit = decay_limit(of_speed)
        said = f"no longer decays above {limit:.1f} km/h" if limit is not None else ""
        if not said and len(of_speed) > 1:
            verb = "grows" if max(of_speed.values()) > 0.0 else "decays"
            said = f"{verb} at all speeds from {min(of_speed):g} to {max(of_speed):g} km/h"
        if said:
            sentences.append(f"{', '.join(who)}: the kick {said}")
    return sentences


def _several(all_cases: Sequence[Case]) -> list[str]:
    """What decides the motion and differs between cases, beside the axes that have a dot in their names."""
    names = [name for name in ("vehicle", "track", "engine") if all(name in c.labels for c in all_cases)]
    return [name for name in names if len({case.labels[name] for case in all_cases}) > 1]
