"""The AD7746 and its boards: the driver, the ways to its registers, and the kit's twin, which needs no board."""
