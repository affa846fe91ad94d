"""Data sheets: what is known of a device, in its own units and in SI, and the file it is written in."""
