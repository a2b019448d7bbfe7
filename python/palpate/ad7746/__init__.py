"""The AD7746 and the ways to its registers: data sheet, driver, the evaluation kit and a bus of Linux, and twins of both."""
