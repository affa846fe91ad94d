"""Smoother and filter of a body relative to its track, of the track relative to its map, and of the sensors."""
