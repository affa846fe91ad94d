"""Estimators of attitude, trajectory and track geometry: one method per file."""
