"""Lumped mechanisms of any kind: what they are, how they move, and what force balances miss."""

from pymoo_hdte.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
