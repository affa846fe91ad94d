"""The example class by the name that the report is called with; it lives in `simrail.example`."""

from __future__ import annotations

from simrail.example import CellResult

__all__ = ["CellResult"]
