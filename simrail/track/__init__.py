"""The track: its design, its irregularities, and the rails as they lie."""
