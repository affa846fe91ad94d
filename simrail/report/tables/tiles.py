"""The few numbers that a reader sees first."""

from typing import NamedTuple


class Tile(NamedTuple):
    """A number with its meaning above and its context below."""

    title: str
    value: str
    note: str
