"""The report: one self-contained page with figures, tables and what they say."""

from __future__ import annotations

from simrail.report.page import write_report

__all__ = ["write_report"]
