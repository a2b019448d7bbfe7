"""Driver of the AD7746: data sheet, conversions, the evaluation kit on USB, a Linux I2C bus, and simulated devices."""
