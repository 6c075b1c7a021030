"""Virtual rigs that hide effects, to try the discrepancy workflow on."""

from pymoo_hdte.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
