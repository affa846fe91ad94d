"""Whole pages, one module and one template each."""
