"""Acceptance of a board: its steps, without the driver and with it, and their report."""
