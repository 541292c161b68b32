"""Image and chart building blocks that reports, maps and films share."""
