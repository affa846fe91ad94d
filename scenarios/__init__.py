"""Scenarios and their parts (tracks, vehicles, IMUs) as TOML files, found by name."""
