"""What every room stands on: column names, errors, compiled loops, seeds, rotations, files."""
