"""Robust design of harmonic drives: a pymoo plugin.

``drive`` models the dynamic transmission error, ``surrogate`` replaces it by a Chebyshev
polynomial with exact moments, ``problems`` and ``algorithms`` plug both into pymoo.
"""

from importlib.metadata import version

__version__ = version("pymoo-hdte")
