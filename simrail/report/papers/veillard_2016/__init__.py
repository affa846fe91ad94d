"""Veillard, Mailly and Fraisse 2016 beside ours: an IMU alone, over many lines."""
