"""What runs on the rails: bodies, axles, suspensions, their file, and their linear study."""
