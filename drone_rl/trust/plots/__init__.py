"""Images and charts that reports, maps and videos share."""
