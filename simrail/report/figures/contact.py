"""Forces between the wheels of the leading axle and their rails."""

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.columns import CONTACT
from simrail.core.jit import FloatArray
from simrail.report.figures.ride import direction_of

POSITION, _LOAD, _GUIDING = (CONTACT.index(n) for n in ("position_m", "wheel_load_n", "guiding_force_n"))


def leading_axle(example: CellResult) -> dict[str, FloatArray]:
    """Contact (k, 12) of the left and right wheel of the axle that runs ahead."""
    forward = direction_of(example)
    first = max(example.contacts.values(), key=lambda rows: forward * rows[0, POSITION])[0, POSITION]
    return {
        wheel.rpartition(".")[2]: np.asarray(rows)
        for wheel, rows in example.contacts.items()
        if rows[0, POSITION] == first
    }


def wheel_forces(side: str, rows: FloatArray) -> dict[str, FloatArray]:
    """Q and Y of a wheel in kN, each (k,), and their quotient, positive where it presses its rail outward."""
    load, guiding = rows[:, _LOAD], rows[:, _GUIDING]
    outward = guiding * (-1.0 if side == "left" else 1.0)
    ratio = np.where(load > 0.0, outward / np.where(load > 0.0, load, 1.0), 0.0)
    return {"Q": 1e-3 * load, "Y": 1e-3 * guiding, "Y/Q": ratio}
