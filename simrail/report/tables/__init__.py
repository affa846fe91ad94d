"""Tables of pages and of the terminal."""
