"""Simulated chip, board and USB with the interface of the real ones, and faults on demand."""
