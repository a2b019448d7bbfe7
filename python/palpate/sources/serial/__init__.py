"""Lines of text on a serial port: `serial:`. A line is read as a whole or not at all."""
