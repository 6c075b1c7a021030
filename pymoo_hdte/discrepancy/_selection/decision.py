"""From marginal likelihoods to a verdict: what is said, and how probable it is.

Each explanation is a set of names, with or without something outside of the library. Its posterior
probability is its prior times its marginal likelihood, over the sum of all. Levels of probability
decide what is said of it; one check asks whether the likeliest explanation is possible at all.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

Name = tuple[str, str]
"""An effect and its port; a value out of tolerance is ``("parameter", name)``."""

SURE = 0.95
"""Probability from which on something is said without qualification: the level of the intervals
that reports print."""
MOST_IN_CLASS = 5
"""Most explanations of a class; a longer list says little."""
IMPOSSIBLE = 1e-4
"""Chance of what a record or channel leaves below which no explanation is taken for possible. A
campaign has some twenty of them, so that it turns down one right explanation in 500."""
OUTSIDE = 0.1
"""Prior probability that something is missing which no effect of the library can be."""
PRESENT = 0.05
"""Prior probability of each name of an effect. Of some twenty one is expected to be missing."""


@dataclass(frozen=True)
class Explanation:
    """A set of effects, with its marginal likelihood.

    Attributes
    ----------
    label : str
        Of the set; forms and orders included.
    names : frozenset of Name
    ln : float
        Logarithm of the marginal likelihood.
    outside : bool
        Whether something outside of the library is there as well.
    worst_chance : float
        As of `Score`.
    values_only : bool
        Whether the set is of values out of tolerance, and of no effects.
    """

    label: str
    names: frozenset[Name]
    ln: float
    outside: bool = False
    worst_chance: float = 1.0
    values_only: bool = False


@dataclass(frozen=True)
class Decision:
    """What is said of a campaign.

    Attributes
    ----------
    status : str
        ``"adequate"``, ``"named"``, ``"parameter"``, ``"class"``, ``"partial"`` or ``"unlisted"``.
    members : tuple of frozenset of Name
        What is said; a class has several, the likeliest first. Of ``"unlisted"`` the likeliest.
    probability : float
        That it is right.
    outside : float
        Probability that something outside of the library is there.
    possible : bool
        Whether the likeliest explanation passes the check.
    of_names : dict of Name to float
        Marginal probability of each name.
    """

    status: str
    members: tuple[frozenset[Name], ...]
    probability: float
    outside: float
    possible: bool
    of_names: dict[Name, float]


def log_prior(names: Sequence[Name], forms: Sequence[int], outside: bool) -> float:
    """Return the logarithm of the prior odds of a set against nothing.

    Parameters
    ----------
    names : sequence of Name
        Of the effects of the set.
    forms : sequence of int
        For each of them as how many candidates its name is searched for: ports, orders and forms
        share the prior of a name.
    outside : bool
        Whether something outside of the library is in the set.
    """
    shared = Counter(name for name, _ in names)
    odds = np.log(PRESENT / (1.0 - PRESENT))
    # Two effects of one name at two ports are a second thing that is missing.
    ln = sum(count * odds for count in shared.values()) - float(np.sum(np.log(forms)))
    return float(ln + (np.log(OUTSIDE / (1.0 - OUTSIDE)) if outside else 0.0))


def decide(explanations: Sequence[Explanation], priors: Sequence[float]) -> Decision:
    """Return what is said of explanations with their logarithms of prior odds.

    - ``"adequate"``: that something is missing is not sure. It claims nothing, and its probability
      may be low.
    - ``"named"``, ``"parameter"``: one set is sure, and that nothing is outside of the library.
    - ``"class"``: one of a few sets is sure, and something outside is less likely than not.
    - ``"partial"``: some names are sure, and no more than these. Of values alone that says nothing
      if something outside is likely: it has no form yet that a value could not imitate.
    - ``"class"`` again: one of a few names is sure, whatever else there is.
    - ``"unlisted"``: something is sure to be missing, and no more.
    """
    weights = np.array([item.ln for item in explanations]) + np.asarray(priors)
    shares = np.exp(weights - logsumexp(weights))
    best = explanations[int(np.argmax(shares))]
    possible = best.worst_chance >= IMPOSSIBLE
    outside = float(shares[[item.outside for item in explanations]].sum())
    of_names, of_sets, of_nothing = Counter[Name](), Counter[frozenset[Name]](), 0.0
    for item, share in zip(explanations, shares.tolist(), strict=True):
        of_names.update(dict.fromkeys(item.names, share))
        of_sets[item.names] += share
        of_nothing += share * (not item.names and not item.outside)
    ranked = sorted(of_sets, key=lambda names: -of_sets[names])
    certain = frozenset(name for name, share in of_names.items() if share >= SURE)

    def said(status: str, members: Sequence[frozenset[Name]], probability: float) -> Decision:
        marginal = {name: float(share) for name, share in of_names.most_common()}
        return Decision(status, tuple(members), probability, outside, possible, marginal)

    if possible and of_nothing > 1.0 - SURE:
        return said("adequate", [], of_nothing)
    members = _fewest(ranked, of_sets)
    sure = possible and bool(members) and frozenset() not in members
    if sure and len(members) == 1 and outside <= 1.0 - SURE:
        same = [item for item in explanations if item.names == members[0]]
        only = max(same, key=lambda item: item.ln).values_only
        # One value that an effect covers is that effect.
        only = only and any(name == "parameter" for name, _ in members[0])
        return said("parameter" if only else "named", members, of_sets[members[0]])
    if sure and len(members) > 1 and outside < 0.5:
        # It claims that one of these is missing, not that nothing else is.
        return said("class", members, sum(of_sets[names] for names in members))
    if any(name != "parameter" for name, _ in certain) or (certain and outside < 0.5):
        return said("partial", [certain], min(of_names[name] for name in certain))
    if possible and outside < 0.5 and (any_of := _any_of(explanations, shares)):
        without = sum(shares[[not any_of & item.names for item in explanations]])
        order = sorted(any_of, key=lambda name: -of_names[name])
        return said("class", [frozenset({name}) for name in order], 1.0 - float(without))
    return said("unlisted", ranked[:1], 1.0 - of_nothing)


def _fewest(
    ranked: Sequence[frozenset[Name]], of_sets: Mapping[frozenset[Name], float]
) -> list[frozenset[Name]]:
    """Return the fewest sets that are sure together, the likeliest first; none of too many."""
    total = 0.0
    for number, names in enumerate(ranked[:MOST_IN_CLASS]):
        total += of_sets[names]
        if total >= SURE:
            return list(ranked[: number + 1])
    return []


def _any_of(explanations: Sequence[Explanation], shares: NDArray[np.float64]) -> frozenset[Name]:
    """Return a few names of which one is surely there; none if that takes too many."""
    any_of, rest = frozenset[Name](), np.ones(len(shares), dtype=bool)
    while float(shares[rest].sum()) > 1.0 - SURE:
        of_names = Counter[Name]()
        for item, share, remains in zip(explanations, shares.tolist(), rest.tolist(), strict=True):
            if remains:
                of_names.update(dict.fromkeys(item.names, share))
        if not of_names or len(any_of) == MOST_IN_CLASS:
            return frozenset()
        any_of |= {of_names.most_common(1)[0][0]}
        rest = np.array([not any_of & item.names for item in explanations])
    return any_of
