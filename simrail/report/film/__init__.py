"""A ride as a film: one page that plays it, or an animated picture for slides."""
