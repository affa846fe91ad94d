"""Hertz's contact ellipse and Kalker's creep coefficients: closed forms and one published table.

Used when contact tables are built, never inside an integration step. Everything is for one pair of
equal elastic bodies.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import ellipe, ellipk

from simrail.core.jit import FloatArray

SHEAR_MODULUS_PA = 82e9
"""Shear modulus of rail steel as the Manchester contact benchmark has it."""
POISSON_RATIO = 0.28
"""Poisson's ratio of rail steel as the Manchester contact benchmark has it."""

# Kalker (1990), Three-Dimensional Elastic Bodies in Rolling Contact, Table E3, nu = 0.25. Rows are
# a/b = 0.1 .. 0.9, 1, then b/a = 0.9 .. 0.1; a is the semi-axis along the rolling direction.
_RATIO = np.array([*(np.arange(1, 11) / 10.0), *(10.0 / np.arange(9, 0, -1))])
_C11 = [3.31, 3.37, 3.44, 3.53, 3.62, 3.72, 3.81, 3.91, 4.01, 4.12]
_C11 += [4.22, 4.36, 4.54, 4.78, 5.10, 5.57, 6.34, 7.78, 11.7]
_C22 = [2.52, 2.63, 2.75, 2.88, 3.01, 3.14, 3.28, 3.41, 3.54, 3.67]
_C22 += [3.81, 3.99, 4.21, 4.50, 4.90, 5.48, 6.40, 8.14, 12.8]
_C23 = [0.473, 0.603, 0.715, 0.823, 0.929, 1.03, 1.14, 1.25, 1.36, 1.47]
_C23 += [1.59, 1.75, 1.95, 2.23, 2.62, 3.24, 4.32, 6.63, 14.6]
_C33 = [8.28, 4.27, 2.96, 2.32, 1.93, 1.68, 1.50, 1.37, 1.27, 1.19]
_C33 += [1.11, 1.04, 0.965, 0.892, 0.819, 0.747, 0.674, 0.601, 0.526]


class Ellipse(NamedTuple):
    """Contact under a load N: semi-axes are `a, b` times N^(1/3), approach is `approach` N^(2/3)."""

    a: FloatArray
    b: FloatArray
    approach: FloatArray


def hertz_ellipse(
    longitudinal: FloatArray | float,
    lateral: FloatArray | float,
) -> Ellipse:
    """Contact ellipse of two bodies whose gap is ``longitudinal x^2 + lateral y^2`` (Hertz 1882).

    Parameters
    ----------
    longitudinal, lateral : ndarray or float
        Half the relative curvatures along and across the rail, 1/m, positive.

    Returns
    -------
    Ellipse
        For 1 N: semi-axes along (a) and across (b) the rail in m / N^(1/3) and approach in
        m / N^(2/3), shaped like the broadcast input.

    Notes
    -----
    With g the smaller over the larger semi-axis, k^2 = 1 - g^2 and complete integrals E, K:
    ``(E/g^2 - K)/(K - E)`` is the larger over the smaller curvature; the larger semi-axis cubed is
    ``3 N E / (2 pi g^2 (A + B) E*)`` with ``E* = E_young / (2 (1 - nu^2))``; the approach follows from
    ``delta = N K 3/(2 pi a E*)`` (Johnson, Contact Mechanics, 1985, chapter 4).
    """
    along, across = np.broadcast_arrays(np.asarray(longitudinal, float), np.asarray(lateral, float))
    ratio = np.maximum(along, across) / np.minimum(along, across)
    # Invert curvature ratio -> axis ratio by a spline in logarithms; exact to 1e-10 up to 1e6.
    log_g = -(np.linspace(0.0, 1.0, 2001) ** 2) * 9.0
    k2 = -np.expm1(2.0 * log_g[1:])
    e, k = ellipe(k2), ellipk(k2)
    log_ratio = np.concatenate([[0.0], np.log((e * np.exp(-2.0 * log_g[1:]) - k) / (k - e))])
    g = np.exp(CubicSpline(log_ratio, log_g)(np.log(ratio)))
    k2 = 1.0 - g**2
    modulus = SHEAR_MODULUS_PA * (1.0 + POISSON_RATIO) / (1.0 - POISSON_RATIO**2)
    e, k = ellipe(k2), ellipk(k2)
    large = np.cbrt(3.0 * e / (2.0 * np.pi * g**2 * (along + across) * modulus))
    approach = 3.0 * k / (2.0 * np.pi * large * modulus)
    long_is_large = along <= across
    return Ellipse(
        a=np.where(long_is_large, large, g * large),
        b=np.where(long_is_large, g * large, large),
        approach=approach,
    )


def kalker_coefficients(axis_ratio: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Kalker's linear creep coefficients C11, C22, C23, C33 at a/b, for nu = 0.25.

    Parameters
    ----------
    axis_ratio : ndarray
        a/b, the semi-axis along the rolling direction over the one across; clipped to the table's
        0.1 to 10.

    Returns
    -------
    tuple of ndarray
        C11, C22, C23, C33 (Kalker 1990, Table E3), cubic splines in log-log between the table's rows.
    """
    x = np.log(np.clip(axis_ratio, 0.1, 10.0))
    c11, c22, c23, c33 = (
        np.exp(CubicSpline(np.log(_RATIO), np.log(np.array(c)))(x)) for c in (_C11, _C22, _C23, _C33)
    )
    return c11, c22, c23, c33
