"""The section of the page on a campaign as a whole: its axes, its draws, its worst cells."""
