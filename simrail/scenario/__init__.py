"""What a person asks for: the scenario's tables, its axes, and the cells they make."""
