"""The papers' results beside ours, one folder each, by authors and year."""
