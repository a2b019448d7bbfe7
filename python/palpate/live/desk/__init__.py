"""What stands around the measurement on the page: plain Python, no web."""
