"""Wheel loads of an engine, for tests."""


def wheel_loads_n(engine):
    """Vertical contact force (track frame) of each wheel (w,) at the engine's last evaluation, N."""
    return engine.memory.contacts["load_n"].copy()
