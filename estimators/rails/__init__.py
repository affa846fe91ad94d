"""What the rails look like, from more than one ride over them."""
