"""A design track that is given by formulas, in the form that simrail's kernels take it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy as sp

from simrail.track.frame_kernel import CANT_TERMS, HEIGHT_TERMS, Pieces


def taylor_pieces(angles: Sequence[sp.Expr], s: sp.Symbol, places: np.ndarray) -> Pieces:
    """Roll, pitch and yaw by their Taylor polynomials at some places: exact there, as far as is asked."""
    of_roll, of_pitch, of_yaw = angles
    slope = -sp.tan(of_pitch)
    functions = [
        *(of_yaw.diff(s, k) / sp.factorial(k) for k in range(3)),
        *(sp.sin(of_roll).diff(s, k) / sp.factorial(k) for k in range(3)),
        *[sp.Integer(0)] * (CANT_TERMS - 3),
        sp.Integer(0),
        *(slope.diff(s, k - 1) / sp.factorial(k) for k in range(1, 4)),
        *[sp.Integer(0)] * (HEIGHT_TERMS - 4),
    ]
    rows = sp.lambdify(s, functions, "numpy", cse=True)
    return Pieces(places, np.array([rows(place) for place in places], dtype=np.float64))
