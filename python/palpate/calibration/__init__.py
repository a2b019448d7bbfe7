"""Calibration: from touches on specimens of known modulus to the modulus of another object."""

from palpate.calibration.model import Calibration
from palpate.calibration.modulus import Modulus

__all__ = ["Calibration", "Modulus"]
