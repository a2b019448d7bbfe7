"""Twins of the chip, of the kit's board and of its USB: the driver runs without hardware, and every fault on demand."""
