"""The page of a vehicle, in the look of the reports."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from simrail.report.figures import canvas
from simrail.report.figures.vehicle import conicity_figure, locus_figure, pair_figure, shift_figure
from simrail.report.pages.frame import page_text, write_page
from simrail.report.tables.tables import signed
from simrail.report.tables.vehicle_text import body_rows, critical_words, listed
from simrail.report.words.sentences import unbroken
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.stability import Mode
from simrail.vehicle.study import Conicity, VehicleStudy


def write_vehicle_page(folder: Path, study: VehicleStudy) -> Path:
    """Write ``<folder>/<vehicle>.html`` and return its path; the folder is made if it is not there."""
    model = study.model
    contents = {"masses": "Masses and loads", "contact": "Contact", "modes": "Modes", "locus": "Root locus"}
    text = page_text(
        "pages/vehicle.html.j2",
        contents=[item for item in contents.items() if study.conicity or item[0] != "contact"],
        model=model,
        tiles=_tiles(study),
        bodies=[(row[0], *map(signed, row[1:])) for row in body_rows(model)],
        wheels=[
            (wheel.name, f"{load / 1e3:.4g}", f"{wheel.radius_m:g}", _turns(model, wheel.spin))
            for wheel, load in zip(model.wheels, study.wheel_load_n, strict=True)
        ],
        contact=_contact(model, study.conicity) if study.conicity else None,
        standstill=[_row(mode, mode.natural_frequency_hz) for mode in listed(study.standstill)],
        running=[_row(mode, mode.frequency_hz) for mode in listed(study.running)],
        running_kmh=3.6 * study.running_mps,
        critical=critical_words(study.critical),
        locus=canvas.drawn("locus", partial(locus_figure, study)),
    )
    return write_page(folder, model.name, text)


def _tiles(study: VehicleStudy) -> list[tuple[str, str, str]]:
    mass = sum(body.mass_kg for body in study.model.bodies)
    load = study.wheel_load_n
    slowest = listed(study.standstill)[:1]
    value, _, note = critical_words(study.critical).partition(" (")
    tiles = [
        ("mass", f"{mass / 1e3:.4g} t", f"{len(study.model.bodies)} bodies"),
        ("wheel load", f"{np.mean(load) / 1e3:.3g} kN", f"mean of {len(load)} wheels at rest"),
        ("critical speed", value, note.rstrip(")") or "no oscillation grows"),
    ]
    if slowest:
        mode = slowest[0]
        tiles.insert(2, ("lowest frequency", f"{mode.natural_frequency_hz:.2f} Hz", mode.words(most=1)))
    if study.conicity and study.conicity.steers:
        contact = study.conicity
        note = f"equivalent, at {3.0 * contact.scale:.2g} mm"
        tiles.insert(2, ("conicity", f"{contact.at_3_mm:.3f}", note))
    return tiles


def _turns(model: VehicleModel, spin: str) -> str:
    shared = sum(wheel.spin == spin for wheel in model.wheels) > 1
    return "with its mate" if shared else "by itself"


def _row(mode: Mode, frequency_hz: float) -> tuple[str, str, str]:
    return f"{frequency_hz:.3f}", f"{100.0 * mode.damping:.1f}", unbroken(mode.words())


def _contact(model: VehicleModel, contact: Conicity) -> dict[str, Any]:
    rest = contact.rest
    every = max(1, len(rest.y_m) // 30)
    digits = 2 if contact.scale == 1.0 else 3

    def number(value: float, decimals: int) -> str:
        return signed(f"{value:z.{decimals}f}")  # a zero has no sign

    rows = [
        (
            number(1e3 * rest.y_m[i], digits),
            *(number(1e3 * value, digits) for value in contact.abscissa_m[i]),
            *(f"{np.rad2deg(np.arctan(abs(value))):.2f}" for value in contact.slope[i]),
            number(1e3 * (rest.radius_left_m[i] - rest.radius_right_m[i]), digits + 1),
        )
        for i in range(0, len(rest.y_m), every)
    ]
    return {
        "pair": canvas.drawn("pair", partial(pair_figure, model, contact)),
        "shift": canvas.drawn("shift", partial(shift_figure, contact)),
        "conicity": canvas.drawn("conicity", partial(conicity_figure, contact)) if contact.steers else None,
        "rows": rows,
    }
