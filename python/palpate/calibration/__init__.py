"""From touches on specimens of known modulus to the modulus of the next object, with an interval."""

from palpate.calibration.calibration import Calibration
from palpate.calibration.modulus import Modulus

__all__ = ["Calibration", "Modulus"]
