"""Beside Briales et al. 2021: the section of the report that sets their results beside ours."""
