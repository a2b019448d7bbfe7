"""The evaluation kit: an FX2 on USB that reads and writes the registers of the AD7746."""
