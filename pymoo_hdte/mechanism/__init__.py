"""Lumped mechanisms of any kind: their models, simulation and force balances."""

from pymoo_hdte._lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
