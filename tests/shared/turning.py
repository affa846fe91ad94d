"""Rotations in symbols: what a derivation starts from."""

import sympy as sp


def rotation(roll: sp.Expr, pitch: sp.Expr, yaw: sp.Expr) -> sp.Matrix:
    """Body to global: yaw about Z, then pitch about Y, then roll about X."""
    c, d = sp.cos, sp.sin
    about_x = sp.Matrix([[1, 0, 0], [0, c(roll), -d(roll)], [0, d(roll), c(roll)]])
    about_y = sp.Matrix([[c(pitch), 0, d(pitch)], [0, 1, 0], [-d(pitch), 0, c(pitch)]])
    about_z = sp.Matrix([[c(yaw), -d(yaw), 0], [d(yaw), c(yaw), 0], [0, 0, 1]])
    return about_z * about_y * about_x


def turning(c: sp.Matrix, by: sp.Symbol) -> sp.Matrix:
    """Vector w with C^T dC/d(by) = [w]x."""
    skew = c.T * c.diff(by)
    return sp.Matrix([skew[2, 1], skew[0, 2], skew[1, 0]])
