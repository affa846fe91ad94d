"""Wheel loads of an engine, for tests."""

import numpy as np


def wheel_loads_n(engine):
    """Vertical contact force (track frame) of each wheel (w,) at the engine's last evaluation, N."""
    memos = engine.memory.axle_memos
    return np.column_stack([memos["load_left_n"], memos["load_right_n"]]).ravel()
