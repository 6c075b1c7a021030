"""The smallest set of tests that separates effects: tests are added one by one, then removed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._answers.separation import noncentrality_for, power
from pymoo_hdte.discrepancy._plan.signatures import Counts, Signatures, is_rival
from pymoo_hdte.discrepancy._selection.rules import RULES

Values = NDArray[np.float64]

_GAIN = 1e-9
"""Least gain of a further test, as a share of one aim; smaller gains are rounding."""


@dataclass(frozen=True, eq=False)
class Aims:
    """What a set of tests should reach: each effect detected, and separated from its rivals.

    `Rules.single_effect_gain` detects an effect, `Rules.evidence_distance` separates two.

    Attributes
    ----------
    signatures : Signatures
    power : float
        Wanted probability of each detection and separation.
    """

    signatures: Signatures
    power: float

    @property
    def pairs(self) -> NDArray[np.bool_]:
        """Which rivals are to be separated from which effects, shape (n_effects, n_rivals)."""
        signatures = self.signatures
        separable = [
            [is_rival(effect, rival) for rival in signatures.rivals]
            for effect in signatures.effects
        ]
        return np.array(separable, dtype=bool).reshape(len(separable), len(signatures.rivals))

    def powers(self, counts: Counts) -> tuple[Values, Values]:
        """Return the powers of detection (n_effects,) and separation (n_effects, n_rivals).

        ``counts``, shape (n_tests,), is how often each test is made.
        """
        alone, beside = self.signatures.noncentralities(counts)
        return (
            power(alone, RULES.single_effect_gain),
            power(beside, RULES.evidence_distance),
        )

    def shares(self, counts: Counts) -> Values:
        """Return the share of each aim that a set of tests reaches, at most 1; shape (n_aims,)."""
        alone, beside = self.signatures.noncentralities(counts)
        detected = alone / noncentrality_for(self.power, RULES.single_effect_gain)
        apart = beside / noncentrality_for(self.power, RULES.evidence_distance)
        return np.minimum(np.concatenate([detected, apart[self.pairs]]), 1.0)


def smallest_set(aims: Aims, most: int) -> Counts:
    """Return how often each test is made in a small set that reaches what can be reached.

    Tests are added by what they contribute to the aims, and removed again as long as every aim that
    was reached still is. Aims that all tests, each made ``most`` times, do not reach are left out,
    since no set of ``most`` tests reaches them. Neither are tests spent on separating effects that
    they do not even detect.

    Parameters
    ----------
    aims : Aims
    most : int
        Largest number of tests.

    Returns
    -------
    ndarray of int, shape (n_tests,)
    """
    n_tests, n_effects = len(aims.signatures.grams), len(aims.signatures.effects)
    owners = np.append(np.arange(n_effects), np.nonzero(aims.pairs)[0])
    possible = aims.shares(np.full(n_tests, most)) >= 1.0
    while True:
        pursued = possible & possible[:n_effects][owners]
        counts = _set_for(aims, most, pursued)
        seen = aims.shares(counts)[:n_effects] >= 1.0
        if not np.any(pursued[:n_effects] & ~seen):
            return counts
        possible[:n_effects] &= seen


def _set_for(aims: Aims, most: int, pursued: NDArray[np.bool_]) -> Counts:
    """Return a small set of tests for the aims that are ``pursued``, shape (n_aims,)."""
    n_tests = len(aims.signatures.grams)
    grown = np.zeros(n_tests, dtype=int)
    while grown.sum() < most and not _reached(aims, grown, pursued).all():
        here = aims.shares(grown)[pursued].sum()
        one_more = grown + np.eye(n_tests, dtype=int)
        gains = [aims.shares(counts)[pursued].sum() - here for counts in one_more]
        if max(gains) <= _GAIN:
            break
        grown = one_more[int(np.argmax(gains))]
    sets = [_pruned(aims, grown, pursued)]
    if not _reached(aims, sets[0], pursued).all():
        # Where tests help only together, adding one by one does not find them.
        sets.append(_pruned(aims, np.ones(n_tests, dtype=int), pursued))
    allowed = [counts for counts in sets if counts.sum() <= most]
    return max(allowed, key=lambda counts: (_reached(aims, counts, pursued).sum(), -counts.sum()))


def _reached(aims: Aims, counts: Counts, pursued: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return (aims.shares(counts) >= 1.0)[pursued]


def _pruned(aims: Aims, counts: Counts, pursued: NDArray[np.bool_]) -> Counts:
    """Remove tests, the most dispensable first, while all that was reached still is."""
    counts, reached = counts.copy(), _reached(aims, counts, pursued)
    while counts.any():
        information: dict[int, float] = {}
        for test in np.flatnonzero(counts):
            fewer = counts - np.eye(len(counts), dtype=int)[test]
            alone, beside = aims.signatures.noncentralities(fewer)
            if np.all(_reached(aims, fewer, pursued) >= reached):
                information[int(test)] = float(np.log1p(alone).sum() + np.log1p(beside).sum())
        if not information:
            return counts
        counts[max(information, key=lambda test: information[test])] -= 1
    return counts
