"""What the logger saw, and whether it can be true; nothing here knows the truth."""
