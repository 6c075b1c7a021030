"""The smallest set of tests that separates effects: one test after the other, then fewer again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.drive.plan.signatures import Counts, Signatures, is_rival
from pymoo_hdte.discrepancy.drive.separation import noncentrality_for, power
from pymoo_hdte.discrepancy.engine.rules import Rules

Values = NDArray[np.float64]

_GAIN = 1e-9
"""Least gain of a further test, as a share of one aim: rounding."""


@dataclass(frozen=True, eq=False)
class Aims:
    """What a set of tests should reach: each effect detected, and told from each of its rivals.

    Attributes
    ----------
    signatures : Signatures
    rules : Rules
        `Rules.single_effect_gain` detects an effect, `Rules.evidence_distance` separates two.
    power : float
        Wanted chance of each.
    """

    signatures: Signatures
    rules: Rules
    power: float

    @property
    def pairs(self) -> NDArray[np.bool_]:
        """Which rivals are to be told from which effects, (n_effects, n_rivals)."""
        signatures = self.signatures
        found = [
            [is_rival(one, other) for other in signatures.rivals] for one in signatures.effects
        ]
        return np.array(found, dtype=bool).reshape(len(found), len(signatures.rivals))

    def powers(self, counts: Counts) -> tuple[Values, Values]:
        """Return the powers of detection (n_effects,) and separation (n_effects, n_rivals).

        ``counts``, shape (n_tests,), tells how often each test is made.
        """
        alone, beside = self.signatures.noncentralities(counts)
        return (
            power(alone, self.rules.single_effect_gain),
            power(beside, self.rules.evidence_distance),
        )

    def shares(self, counts: Counts) -> Values:
        """Return how much of what each aim needs a set of tests gives, at most 1; (n_aims,)."""
        alone, beside = self.signatures.noncentralities(counts)
        detected = alone / noncentrality_for(self.power, self.rules.single_effect_gain)
        apart = beside / noncentrality_for(self.power, self.rules.evidence_distance)
        return np.minimum(np.concatenate([detected, apart[self.pairs]]), 1.0)


def smallest_set(aims: Aims, most: int) -> Counts:
    """Return how often each test is made in a small set that reaches what can be reached.

    Tests are added by what they contribute to the aims, and taken away again as long as every aim
    that was reached still is. Aims that all tests, each made ``most`` times, do not reach are left
    aside: no set of ``most`` tests reaches them.

    Parameters
    ----------
    aims : Aims
    most : int
        Largest number of tests.

    Returns
    -------
    ndarray of int, shape (n_tests,)
    """
    n_tests = len(aims.signatures.grams)
    possible = aims.shares(np.full(n_tests, most)) >= 1.0
    grown = np.zeros(n_tests, dtype=int)
    whole = np.ones(n_tests, dtype=int)
    if not possible.any():
        return grown
    while grown.sum() < most:
        here = aims.shares(grown)[possible].sum()
        if here >= possible.sum():
            break
        gains = [
            aims.shares(grown + one)[possible].sum() - here for one in np.eye(n_tests, dtype=int)
        ]
        if max(gains) <= _GAIN:
            break
        grown[int(np.argmax(gains))] += 1
    found = [_pruned(aims, grown, possible)]
    if not _reached(aims, found[0], possible).all():
        # Where tests help only together, adding one by one does not find them.
        found.append(_pruned(aims, whole, possible))
    allowed = [one for one in found if one.sum() <= most]
    return max(allowed, key=lambda one: (_reached(aims, one, possible).sum(), -one.sum()))


def _reached(aims: Aims, counts: Counts, possible: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return (aims.shares(counts) >= 1.0)[possible]


def _pruned(aims: Aims, counts: Counts, possible: NDArray[np.bool_]) -> Counts:
    """Take tests away, the most dispensable first, while all that was reached still is."""
    counts, reached = counts.copy(), _reached(aims, counts, possible)
    while counts.any():
        left: dict[int, float] = {}
        for test in np.flatnonzero(counts):
            fewer = counts - np.eye(len(counts), dtype=int)[test]
            alone, beside = aims.signatures.noncentralities(fewer)
            if np.all(_reached(aims, fewer, possible) >= reached):
                left[int(test)] = float(np.log1p(alone).sum() + np.log1p(beside).sum())
        if not left:
            return counts
        counts[max(left, key=lambda test: left[test])] -= 1
    return counts
