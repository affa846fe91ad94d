"""Truth meets estimate: metrics over windows, their table, and statistics over draws."""
