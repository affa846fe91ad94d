"""Smoother and filter of a body relative to its track, and of the track relative to its map."""
