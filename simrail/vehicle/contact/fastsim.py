"""Kalker's simplified theory of rolling contact (FASTSIM): where the ellipse sticks and where it slides.

A particle enters the contact at its leading edge without traction. Inside, its traction changes with the
rigid slip over a flexibility, and is cut back to the parabolic bound wherever it would exceed that; there
it slides. Each creepage has its own flexibility, chosen so that small creepages give Kalker's linear
forces (Kalker, VSD 11, 1982; Vollebregt and Wilders, Comp. Mech. 47, 2011).

In the ellipse's own units, X = x/a against the motion of the particles (1 at the leading edge) and
Y = y/b, tractions over ``p0 = 2 mu N/(pi a b)``, forces over mu N, the flexibilities drop out:

    tx' = -(3 pi/16) q1 + 2 (b/a) twist Y
    ty' = -(3 pi/16) q2 - 2 turn X              ' = d/d(-X)
    |t| <= 1 - X^2 - Y^2

with q1, q2 the linear forces of the creepages and turn, twist that of the spin (f23 times spin creepage).
For, over a strip that sticks, the two add up to Kalker's linear forces: the integral of (X0 - X) over the
unit ellipse is 8/3, that of (X0^2 - X^2) is pi/2, X0 being the strip's leading edge.

The grid is fixed: eight strips at Gauss points across, eight elements along, 1 to 6 us a patch. Forces of
small creepages are 0.8 % below Kalker's, full slip is mu N to 3e-4; against a dense grid forces are wrong
by 1 % of mu N (rms over creepages and spins), by 7 % where spin alone slides the contact. The theory itself
is an approximation: at the usual check point (lateral creepage and spin of a 2:1 ellipse) it is 5.5 % above
the exact one, with this grid 4.8 %. The moment of small creepages is the theory's own, not Kalker's: 3
pi/32 a f22 in place of f23 (three quarters of it for a circle).

Not here: linear forces, relaxation and the falling of friction (`simrail.vehicle.contact.contact`).
"""

import numpy as np

from simrail.core.jit import njit_borrowed, njit_inner


@njit_inner
def _strip(slope_x: float, slope_y: float, turn: float, edge: float) -> tuple[float, float, float]:
    """Sums of tx, ty and X ty over one strip's elements, each taken at its middle.

    ``slope_x``, ``slope_y`` are -tx' and the constant part of -ty'; ``edge`` is the strip's half length.

    A traction that slides turns towards that of the slip, the faster the lower its bound. To cut it back to
    the bound, as usual, is right to first order in the element. Here the change is weighed by 1 + z/2, or
    1/(1 - z/2) where z < 0, with z the change over the bound along the traction, and the traction is
    brought to the mean bound before: right to second order, worth two to three times as many elements.
    That comes in gradually with the overshoot, so that the force is continuous in the creepages.
    """
    step = 0.25 * edge
    at = edge
    tx = ty = 0.0
    sum_x = sum_y = sum_turn = 0.0
    before = 0.0
    for j in range(8):
        middle = edge - (j + 0.5) * step
        way = at - middle
        dx = -way * slope_x
        dy = -way * (slope_y + turn * (at + middle))
        at = middle
        bound = edge * edge - middle * middle
        nx, ny = tx + dx, ty + dy
        square = nx * nx + ny * ny
        if square > bound * bound:
            if j > 0:
                mean = np.sqrt(bound * before)
                z = (tx * dx + ty * dy) / (before * mean)
                share = min(4.0 * (square / (bound * bound) - 1.0), 1.0)
                keep = 1.0 + share * (mean / before - 1.0)
                add = 1.0 + share * (0.5 * z if z > 0.0 else 0.5 * z / (1.0 - 0.5 * z))
                nx, ny = keep * tx + add * dx, keep * ty + add * dy
                square = nx * nx + ny * ny
            shrink = bound / np.sqrt(square)
            nx *= shrink
            ny *= shrink
        tx, ty = nx, ny
        before = bound
        sum_x += tx
        sum_y += ty
        sum_turn += middle * ty
    return sum_x, sum_y, sum_turn


@njit_borrowed
def fastsim(
    q1: float, q2: float, turn: float, twist: float, slimness: float
) -> tuple[float, float, float, float]:
    """Creep force and the two halves of the spin moment, over the friction limit.

    Parameters
    ----------
    q1, q2 : float
        Linear coefficient times creepage, longitudinal and lateral, over mu N.
    turn, twist : float
        f23 times spin creepage over mu N: spin over the signed speed, and over its amount.
    slimness : float
        b/a, the semi-axis across over the one along.

    Returns
    -------
    tuple of float
        Tx and Ty over mu N (against positive creepages); sum of X ty over mu N a, X positive at the leading
        edge; sum of Y tx over mu N b. The moment about the normal is the first times a in the direction of
        travel, less the second times b.

    Notes
    -----
    The strips at +-Y are added before anything else, so that mirrored creepages give mirrored forces to the
    bit. Weights along are those for which the parabola over the eight elements is exact.
    """
    k1, k2 = 0.1875 * np.pi * q1, 0.1875 * np.pi * q2
    force_x = force_y = along = across = 0.0
    for i in range(4):
        # Gauss-Legendre on 0..1.
        if i == 0:
            Y, weight = 0.06943184420297371, 0.17392742256872692
        elif i == 1:
            Y, weight = 0.33000947820757187, 0.32607257743127307
        elif i == 2:
            Y, weight = 0.6699905217924281, 0.32607257743127307
        else:
            Y, weight = 0.9305681557970263, 0.17392742256872692
        edge = np.sqrt(1.0 - Y * Y)
        weight *= edge * 0.25 / (1.0 + 0.5 / 64.0) * 2.0 / np.pi
        swing = 2.0 * slimness * twist * Y
        left = _strip(k1 - swing, k2, turn, edge)
        right = _strip(k1 + swing, k2, turn, edge)
        force_x += weight * (left[0] + right[0])
        force_y += weight * (left[1] + right[1])
        along += weight * (left[2] + right[2])
        across += weight * Y * (left[0] - right[0])
    return force_x, force_y, along, across
