"""Robust design of harmonic drives: a pymoo plugin.

``drive`` models the dynamic transmission error, ``surrogate`` replaces it by a Chebyshev
polynomial with exact moments, ``problems`` and ``algorithms`` plug both into pymoo.
"""

__version__: str


def __getattr__(name: str) -> str:
    # The metadata of packages take longer to look up than all of `import pymoo`.
    if name == "__version__":
        from importlib.metadata import version

        return version("pymoo-hdte")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
