"""Vibration by short waves, superposed on a ride: its sources, and the motion and loads that follow."""
