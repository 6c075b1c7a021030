"""Unit conversions used at the edges of the package; everything inside is SI."""

import math

ARCSEC = math.pi / 648000.0
"""One arcsecond in radians."""

REVOLUTION_PER_MINUTE = math.pi / 30.0
"""One revolution per minute in radians per second."""
