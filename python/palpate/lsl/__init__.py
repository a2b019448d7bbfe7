"""A measurement on Lab Streaming Layer: outlets of samples, estimates and marks."""

from palpate.lsl.outlets import Outlets

__all__ = ["Outlets"]
