"""Angles with which everything repeats: input turns, and fractions whose multiples others are."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput

TOLERANCE = 1e-8
"""Orders that differ by less are one, cycles per turn."""
_MULTIPLES = (4, 16)
"""An order whose fraction is at most this multiple of a known one needs no angle of its own.
The second where a torus is smaller with it: for a crest with many harmonics of the output turn."""


def fundamental_orders(orders: Sequence[float]) -> tuple[float, ...]:
    """Return 1 and the fractions from which all ``orders`` are whole multiples and sums.

    Those from which most of the others follow are taken, for each needs an angle of its own. The
    harmonics of 0.5644, for instance, lie at the fractions 0.4356, 0.1287 and 0.3069 of a turn,
    of which the second and third are multiples of the first, up to whole turns.
    """
    found = [_fundamentals(tuple(orders), most) for most in _MULTIPLES]
    sizes = [[2 * one + 1 for one in largest_multiples(each, orders)[1:]] for each in found]
    return found[int(np.argmin([np.prod(one) for one in sizes]))]


@lru_cache(maxsize=1024)
def _fundamentals(orders: tuple[float, ...], most: int) -> tuple[float, ...]:
    """Return `fundamental_orders` with multiples up to ``most``; each prediction asks for them."""
    left = sorted({round(abs(order - np.rint(order)), 9) for order in orders} - {0.0})
    found: list[float] = []
    while left:
        # Of equally good ones the smallest.
        follow = {one: [_follows(other, one, most) for other in left] for one in left}
        best = max(left, key=lambda one: (sum(follow[one]), -one))
        found.append(best)
        left = [other for other, done in zip(left, follow[best], strict=True) if not done]
    return (1.0, *sorted(found))


def _follows(fraction: float, known: float, most: int) -> bool:
    """Tell whether a fraction is a multiple of a known one, up to whole turns and sign."""
    multiples = known * np.arange(1, most + 1)
    return bool(np.any(np.abs(np.abs(multiples - np.rint(multiples)) - fraction) < TOLERANCE))


@lru_cache(maxsize=1024)
def multiples_of(fundamentals: tuple[float, ...], order: float) -> NDArray[np.int_]:
    """Return the smallest whole multiples of the fundamentals, 1 first, that sum to ``order``."""
    n, (near, far) = len(fundamentals) - 1, _MULTIPLES
    sums = np.indices((2 * near + 1,) * n).reshape(n, (2 * near + 1) ** n).T - near
    # What follows a fraction in a large multiple is a multiple of that one alone.
    for parts in (sums, np.kron(np.arange(-far, far + 1)[:, None], np.eye(n, dtype=int))):
        rest = order - parts @ np.array(fundamentals[1:])
        fits = np.flatnonzero(np.abs(rest - np.rint(rest)) < TOLERANCE)
        if len(fits):
            best = fits[np.argmin(np.abs(parts[fits]).sum(axis=1))]
            found = np.array([int(np.rint(rest[best])), *parts[best]])
            # All callers share it.
            found.flags.writeable = False
            return found
    raise InvalidInput("order", order, f"a sum of multiples of {tuple(fundamentals)}")


def largest_multiples(fundamentals: tuple[float, ...], orders: Sequence[float]) -> list[int]:
    """Return the largest multiple of each fundamental in any of the ``orders``."""
    found = np.array([multiples_of(fundamentals, order) for order in orders], dtype=int)
    return [int(one) for one in np.abs(found.reshape(-1, len(fundamentals))).max(0, initial=0)]
