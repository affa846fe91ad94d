"""A person's text becomes nouns: the only place that reads and judges TOML files."""
