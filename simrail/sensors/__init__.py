"""What is bolted on: the truth becomes a recording here, and nowhere else."""
