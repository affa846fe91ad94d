"""Attitude against the track: filters of Briales et al. 2021."""
