"""What a recording says of itself: factors, place, mounting and clocks, fitted and judged with their sds."""
