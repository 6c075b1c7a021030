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

    Fractions from which most of the others follow are taken, for each needs its own angle. The
    harmonics of 0.5644, for instance, lie at the fractions 0.4356, 0.1287 and 0.3069 of a turn,
    of which the second and third are multiples of the first, up to whole turns.
    """
    candidates = [_fundamentals(tuple(orders), most) for most in _MULTIPLES]
    sizes = [
        [2 * multiple + 1 for multiple in largest_multiples(fundamentals, orders)[1:]]
        for fundamentals in candidates
    ]
    return candidates[int(np.argmin([np.prod(counts) for counts in sizes]))]


@lru_cache(maxsize=1024)
def _fundamentals(orders: tuple[float, ...], most: int) -> tuple[float, ...]:
    """Return `fundamental_orders` with multiples up to ``most``; each prediction needs them."""
    fractions = sorted({round(abs(order - np.rint(order)), 9) for order in orders} - {0.0})
    fundamentals: list[float] = []
    while fractions:
        # Of equally good ones the smallest.
        follow = {
            candidate: [_follows(fraction, candidate, most) for fraction in fractions]
            for candidate in fractions
        }
        best = max(fractions, key=lambda candidate: (sum(follow[candidate]), -candidate))
        fundamentals.append(best)
        fractions = [
            fraction for fraction, done in zip(fractions, follow[best], strict=True) if not done
        ]
    return (1.0, *sorted(fundamentals))


def _follows(fraction: float, known: float, most: int) -> bool:
    """Tell whether a fraction is a multiple of a known one, up to whole turns and sign."""
    multiples = known * np.arange(1, most + 1)
    return bool(np.any(np.abs(np.abs(multiples - np.rint(multiples)) - fraction) < TOLERANCE))


@lru_cache(maxsize=1024)
def multiples_of(fundamentals: tuple[float, ...], order: float) -> NDArray[np.int_]:
    """Return the smallest whole multiples of the fundamentals, 1 first, that sum to ``order``."""
    n, (small, large) = len(fundamentals) - 1, _MULTIPLES
    sums = np.indices((2 * small + 1,) * n).reshape(n, (2 * small + 1) ** n).T - small
    # What follows a fraction in a large multiple is a multiple of that one alone.
    for parts in (sums, np.kron(np.arange(-large, large + 1)[:, None], np.eye(n, dtype=int))):
        remainder = order - parts @ np.array(fundamentals[1:])
        fits = np.flatnonzero(np.abs(remainder - np.rint(remainder)) < TOLERANCE)
        if len(fits):
            best = fits[np.argmin(np.abs(parts[fits]).sum(axis=1))]
            multiples = np.array([int(np.rint(remainder[best])), *parts[best]])
            # All callers share it.
            multiples.flags.writeable = False
            return multiples
    raise InvalidInput("order", order, f"a sum of multiples of {tuple(fundamentals)}")


def largest_multiples(fundamentals: tuple[float, ...], orders: Sequence[float]) -> list[int]:
    """Return the largest multiple of each fundamental in any of the ``orders``."""
    multiples = np.array([multiples_of(fundamentals, order) for order in orders], dtype=int)
    return [
        int(multiple)
        for multiple in np.abs(multiples.reshape(-1, len(fundamentals))).max(0, initial=0)
    ]
