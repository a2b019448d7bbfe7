"""Acceptance of a board: steps that measure it without the driver and with it, and the report of them."""
