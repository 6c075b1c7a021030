"""Forces beyond the band of a motion, over the position of a port: ripple."""
