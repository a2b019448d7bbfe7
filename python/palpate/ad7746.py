"""The AD7746 capacitance-to-digital converter: facts of its data sheet, rev. 0."""

CONVERSION_S = (0.0110, 0.0119, 0.0200, 0.0380, 0.0620, 0.0770, 0.0920, 0.1096)
"""Conversion time by the AD7746's setting CAPF, 0 to 7 (data sheet, rev. 0)."""
NOISE_PF = (40.0e-6, 27.3e-6, 12.2e-6, 7.3e-6, 5.4e-6, 4.9e-6, 4.4e-6, 4.2e-6)
"""Noise of a conversion, rms, by CAPF (data sheet, rev. 0)."""
FULL_SCALE_PF = 4.096
CODES_PER_PF = 2**24 / (2 * FULL_SCALE_PF)
ZERO_CODE = 0x800000
SATURATED_CODES = 500
"""A code so near to either end of the range is saturated."""
