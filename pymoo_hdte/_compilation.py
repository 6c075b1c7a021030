"""Compilation of numerical functions by numba, cached on disk where that is possible."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from numba.core.dispatcher import Dispatcher
try:
    from numba import njit

    COMPILES = True
except ImportError:
    COMPILES = False
"""Whether numba is there. Problems and swarms need none; docs/distribute.md has what each costs."""

F = TypeVar("F", bound=Callable)


def compiled(function: F) -> Dispatcher[F]:
    """Return ``function`` as machine code, which numba makes at the first call.

    Other threads of Python go on while it runs. If no cache can be written, as in a read-only
    installation for a user without a home, every process compiles anew. Where numba is not
    installed, the function stays as it is: it gives the same numbers, a hundred times slower.
    """
    if not COMPILES:
        plain: Any = function
        return plain
    try:
        return njit(cache=True, nogil=True)(function)
    except RuntimeError:
        return njit(nogil=True)(function)
