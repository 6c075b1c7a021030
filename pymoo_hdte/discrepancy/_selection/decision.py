"""From marginal likelihoods to a verdict: what is said, and how probable it is.

Each explanation is a set of names, with or without something outside of the library. Its posterior
probability is its prior times its marginal likelihood, over the sum of all. Levels of probability
decide what is said of it; one check asks whether the likeliest explanation is possible at all.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
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
    parameters_only : bool
        Whether nothing but values out of tolerance are in the set.
    """

    label: str
    names: frozenset[Name]
    ln: float
    outside: bool = False
    worst_chance: float = 1.0
    parameters_only: bool = False


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

    The first explanation of equal probability counts as the likelier one.
    """
    weights = np.array([item.ln for item in explanations]) + np.asarray(priors)
    shares = np.exp(weights - logsumexp(weights))
    best = explanations[int(np.argmax(shares))]
    possible = best.worst_chance >= IMPOSSIBLE
    outside = float(sum(share for item, share in _pairs(explanations, shares) if item.outside))
    of_names = Counter[Name]()
    of_sets = Counter[frozenset[Name]]()
    for item, share in _pairs(explanations, shares):
        of_names.update(dict.fromkeys(item.names, share))
        if not item.outside:
            of_sets[item.names] += share
    ranked = sorted(of_sets, key=lambda names: -of_sets[names])
    marginal = dict(of_names.most_common())
    certain = frozenset(name for name, share in marginal.items() if share >= SURE)

    def said(status: str, members: Sequence[frozenset[Name]], probability: float) -> Decision:
        return Decision(status, tuple(members), probability, outside, possible, marginal)

    if possible and of_sets[frozenset()] >= SURE:
        return said("adequate", [], of_sets[frozenset()])
    if possible and outside <= 1.0 - SURE:
        if ranked and ranked[0] and of_sets[ranked[0]] >= SURE:
            only = all(name == "parameter" for name, _ in ranked[0])
            return said("parameter" if only else "named", ranked[:1], of_sets[ranked[0]])
    total, members = 0.0, list[frozenset[Name]]()
    for names in ranked[:MOST_IN_CLASS]:
        members.append(names)
        total += of_sets[names]
        if total >= SURE:
            break
    if possible and total >= SURE and frozenset() not in members:
        return said("class", members, total)
    if certain:
        return said("partial", [certain], min(marginal[name] for name in certain))
    return said("unlisted", ranked[:1], 1.0 - of_sets[frozenset()])


def _pairs(
    explanations: Sequence[Explanation], shares: Sequence[float]
) -> list[tuple[Explanation, float]]:
    return [(item, float(share)) for item, share in zip(explanations, shares, strict=True)]
