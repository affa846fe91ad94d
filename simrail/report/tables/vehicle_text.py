"""What ``simrail vehicle`` prints: a study of a vehicle as tables for a terminal."""

from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from simrail.vehicle.contact.profile_files import profile_notes
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.stability import CriticalSpeed, Mode
from simrail.vehicle.study import VehicleStudy

MOST_HZ = 40.0
"""Faster modes (wheels on their contact springs) are not listed."""


def amount(value: float) -> str:
    """A mass or an inertia: whole kilograms of a train, three digits of a model."""
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.3g}"


def critical_words(critical: CriticalSpeed | None) -> str:
    """The critical speed in words; what a bracket holds is a remark."""
    if critical is None:
        return "not given (the wheels turn independently: without conicity no wheelset hunts)"
    low, high = (3.6 * v for v in critical.searched_mps)
    if critical.speed_mps is None:
        return f"none below {high:.0f} km/h"
    hunting = f"above it an oscillation of {critical.frequency_hz:.2f} Hz grows"
    if critical.from_the_start:
        return f"below {low:.0f} km/h already (an oscillation of {critical.frequency_hz:.2f} Hz grows)"
    return f"{3.6 * critical.speed_mps:.1f} km/h ({hunting})"


def listed(modes: list[Mode]) -> list[Mode]:
    """Modes worth listing: not over-damped almost to a standstill, not of the contact springs."""
    return [m for m in modes if m.natural_frequency_hz < MOST_HZ and m.damping < 0.98]


def body_rows(model: VehicleModel) -> list[tuple[str, ...]]:
    """Name of each body, its mass and inertias, and where its centre of gravity lies."""
    return [
        (
            body.name,
            amount(body.mass_kg),
            *(amount(value) for value in body.inertia_kgm2),
            f"{body.position_m[0]:.3f}",
            f"{body.position_m[2]:.3f}",
        )
        for body in model.bodies
    ]


def print_study(console: Console, study: VehicleStudy) -> None:
    """Print a study."""
    model = study.model
    mark = " [yellow](synthetic)[/yellow]" if model.synthetic else ""
    console.print(f"[bold]{model.name}[/bold]{mark}: {escape(model.title)}", highlight=False)
    console.print(f"[dim]{escape(model.source)}[/dim]", highlight=False)

    bodies = _table("body", "mass\nkg", "roll\nkg m2", "pitch\nkg m2", "yaw\nkg m2", "height\nm")
    for *row, _, height in body_rows(model):
        bodies.add_row(*row, height)
    console.print(bodies)
    mass = sum(body.mass_kg for body in model.bodies)
    loads = ", ".join(
        f"{wheel.name} {load / 1e3:.4g}" for wheel, load in zip(model.wheels, study.wheel_load_n, strict=True)
    )
    console.print(f"in all {amount(mass)} kg; static wheel loads, kN: {loads}", highlight=False)

    modes = _table("natural frequency\nHz", "damping\n%", "what moves, wheelsets held but in pitch", words=2)
    for mode in listed(study.standstill):
        words = mode.words().replace(" %", "%")  # or a line may begin with the sign
        modes.add_row(f"{mode.natural_frequency_hz:.3f}", f"{100 * mode.damping:.1f}", words)
    if modes.row_count:
        console.print(modes)
    for line in _contact_lines(study):
        console.print(line, highlight=False)
    console.print(f"critical speed: [bold]{critical_words(study.critical)}[/bold]", highlight=False)


def _contact_lines(study: VehicleStudy) -> list[str]:
    pair, contact = study.model.wheel_rail, study.conicity
    if contact is None:
        return ["contact: prescribed and linear"]
    size = "" if pair.profile_scale == 1.0 else f" at {_ratio(pair.profile_scale)}"
    lines = [
        f"wheel {Path(pair.wheel_profile).name} on rail {Path(pair.rail_profile).name}{size}, "
        f"gauge {1e3 * pair.gauge_m:g} mm, inclination {_ratio(pair.rail_inclination)}, under static load"
    ]
    lines += profile_notes(pair)
    if not contact.steers:
        return [*lines, "equivalent conicity: not given (the wheels turn independently)"]
    at_amplitudes = ", ".join(
        f"{1e3 * amplitude:.2g} mm {value:.3f}"
        for amplitude, value in zip(contact.amplitude_m, contact.equivalent, strict=True)
        if abs(amplitude / contact.scale - 1e-3 * round(1e3 * amplitude / contact.scale)) < 1e-6
    )
    return [
        *lines,
        f"equivalent conicity at {3.0 * contact.scale:.2g} mm: [bold]{contact.at_3_mm:.3f}[/bold]; over the "
        f"amplitude: {at_amplitudes}",
    ]


def _ratio(inclination: float) -> str:
    return f"1:{1.0 / inclination:g}" if inclination > 0.0 else "0"


def _table(*columns: str, words: int = 0) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for i, name in enumerate(columns):
        table.add_column(name, justify="left" if i == words else "right")
    return table
