"""Every cell of a scenario, run by whoever is there, kept as it is done, gone on with."""
