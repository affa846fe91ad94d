"""Ride files: recordings of real trains read, recordings written in the same form."""
