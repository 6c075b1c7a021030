"""Compilation of numerical functions by numba, cached on disk where that is possible."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from numba import njit
from numba.core.dispatcher import Dispatcher

F = TypeVar("F", bound=Callable)


def compiled(function: F) -> Dispatcher[F]:
    """Return ``function`` as machine code, which numba makes at the first call.

    Other threads of Python go on while it runs. If no cache can be written, as in a read-only
    installation for a user without a home, every process compiles anew.
    """
    try:
        return njit(cache=True, nogil=True)(function)
    except RuntimeError:
        return njit(nogil=True)(function)
