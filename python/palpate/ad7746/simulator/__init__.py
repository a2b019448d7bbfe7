"""Twins (simulated devices with the same interface) of the chip, the board and USB, with faults on demand."""
