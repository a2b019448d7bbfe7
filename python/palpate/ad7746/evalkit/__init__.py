"""The evaluation kit: an FX2 on USB, found, opened, given its firmware, and asked for the chip's registers."""
