"""The page of a film: one self-contained file, which draws its frames on plain canvases.

No library is carried: a vehicle is some hundred polygons, which a canvas fills sooner than a software WebGL
clears its own (figures: docs/film.md). Numbers travel as base64 of little-endian single precision.
"""

import base64
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from simrail.core.atomic_files import write_whole
from simrail.core.columns import CONTACT
from simrail.core.jit import FloatArray
from simrail.report.film.film import FRAME_HZ, Film, Signal
from simrail.report.film.shapes import boxes_of, discs_of, profile_lines, scale_of
from simrail.report.pages.frame import page_text

AHEAD_M = 160.0
"""So much of the line is shown beyond either end of the piece, for the usual gauge."""

DESIGN_STEP_M, RAILS_STEP_M = 0.5, 0.1
"""Steps of the line and of the rails, for the usual gauge: an irregularity has no wave that a chord hides."""

_FORCES = ("wheel_load_n", "guiding_force_n", "rail_contact_m", "contact_angle_rad", "flange_contact")


def write_film(path: Path, film: Film, *, dark: bool | None = None) -> Path:
    """Write the page of a film.

    Parameters
    ----------
    path : Path
        File of the page; its folder is made if it is not there.
    film : Film
        What is shown.
    dark : bool, optional
        Colours; those of the reader's system if not given.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    here = files("simrail.report.film")
    text = page_text(
        "film/film.html.j2",
        film=film,
        theme={True: "dark", False: "light", None: ""}[dark],
        methods=list(film.estimated_rad),
        axles=film.vehicle.axle_names,
        data=Markup(json.dumps(film_data(film), separators=(",", ":")).replace("<", "\\u003c")),
        player=Markup((here / "film.js").read_text(encoding="utf-8")),
        looks=Markup((here / "film.css").read_text(encoding="utf-8")),
    )
    return write_whole(path, text.encode(), what="film")


def film_data(film: Film) -> dict[str, Any]:
    """What the page's script draws, as JSON values: arrays are base64 of float32, row by row."""
    size, vehicle = scale_of(film.vehicle), film.vehicle
    origin = float(np.floor(film.reference_m.min()))
    wheel, rail, offset = profile_lines(vehicle)
    design, rails = _line(film, size, origin)
    return {
        "scenario": film.scenario,
        "hz": FRAME_HZ,
        "frames": len(film.time_s),
        "start_s": float(film.time_s[0]),
        "origin_m": origin,
        "scale": size,
        "tape_m": vehicle.wheel_rail.tape_circle_half_m,
        "reference": _packed(film.reference_m - origin),
        "design": design,
        "rails": rails,
        "bodies": [_body(film, name, origin) for name in film.poses],
        "boxes": [
            {"body": box.body, "kind": box.kind, "corners": np.round(box.corners, 4).tolist()}
            for box in boxes_of(vehicle)
            if box.body in film.poses
        ],
        "faces": boxes_of(vehicle)[0].faces,
        "wheels": [
            {
                "name": disc.wheel,
                "body": disc.body,
                "side": disc.side,
                "middle": disc.middle_m,
                "radius": disc.radius_m,
                "width": disc.width_m,
                "flange": disc.flange_m,
                "turned": _packed(film.turns_rad[disc.wheel] - film.turns_rad[disc.wheel][0]),
                "forces": _forces(film, disc.wheel),
                "static_n": float(load),
            }
            for disc, load in zip(discs_of(vehicle), vehicle.wheel_load_n(9.81), strict=True)
            if disc.wheel in film.turns_rad and disc.body in film.poses
        ],
        "profiles": {"wheel": wheel.round(6).tolist(), "rail": rail.round(6).tolist(), "offset": offset},
        "imu": {"body": film.mount.body, "place": _place(film)},
        "attitude": {
            "true": _packed(film.true_rad),
            "estimated": {name: _packed(values) for name, values in film.estimated_rad.items()},
        },
        "signals": [_strip(signal) for signal in film.signals],
    }


def _packed(values: FloatArray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def _body(film: Film, name: str, origin: float) -> dict[str, Any]:
    pose = film.poses[name].copy()
    pose[:, 0] -= origin
    return {"name": name, "rest_z": film.vehicle.body(name).position_m[2], "pose": _packed(pose)}


def _place(film: Film) -> list[float]:
    """Where the IMU sits, from the centre of gravity of its body."""
    x, y, z = film.mount.position_m
    return [x, y, z - film.vehicle.body(film.mount.body).position_m[2]]


def _line(film: Film, size: float, origin: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """The design line and both rails over the piece and somewhat more."""
    track, reach = film.rails.design, film.vehicle.reach_m
    low, high = film.reference_m.min() + reach[0], film.reference_m.max() + reach[1]
    beyond = AHEAD_M * size
    first, last = max(track.start_m, low - beyond), min(track.end_m, high + beyond)
    place = np.arange(first, last, DESIGN_STEP_M * size)
    frame = track.frame(place)
    start = track.frame(np.array([np.clip(origin, track.start_m, track.end_m)])).position[0]
    columns = np.column_stack([frame.position - start, frame.yaw_rad, frame.pitch_rad, frame.roll_rad])
    fine = np.arange(first, last, RAILS_STEP_M * size)
    return (
        {"from": first - origin, "step": DESIGN_STEP_M * size, "rows": _packed(columns)},
        {"from": first - origin, "step": RAILS_STEP_M * size, "rows": _packed(film.rails.rails(fine))},
    )


def _forces(film: Film, wheel: str) -> str | None:
    if wheel not in film.contacts:
        return None
    return _packed(film.contacts[wheel][:, [CONTACT.index(name) for name in _FORCES]])


def _strip(signal: Signal) -> dict[str, Any]:
    return {
        "label": signal.label,
        "unit": signal.unit,
        "least": signal.least,
        "lines": {name: _packed(values) for name, values in signal.lines.items()},
        "methods": {name: _packed(values) for name, values in signal.methods.items()},
    }
