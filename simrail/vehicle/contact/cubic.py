"""A cubic ``((c0 x + c1) x + c2) x + c3`` and its derivative, compiled: how kernels read their tables."""

from simrail.core.jit import FloatArray, njit_inner


@njit_inner
def value(c: FloatArray, x: float) -> float:
    """The cubic with coefficients c (4,), highest power first, at x."""
    return ((c[0] * x + c[1]) * x + c[2]) * x + c[3]  # type: ignore[no-any-return]


@njit_inner
def slope(c: FloatArray, x: float) -> float:
    """Its derivative."""
    return (3.0 * c[0] * x + 2.0 * c[1]) * x + c[2]  # type: ignore[no-any-return]
