"""Rules for machines other than a drive, whose models never fit down to the noise of the sensors."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.discrepancy.engine.rule_fields import BY_HAND, RuleSet, rule


@dataclass(frozen=True, kw_only=True)
class MechanismRules(RuleSet):
    """When what a mechanism's model leaves is a further effect, and which model is named.

    See `rules.Rules`, which has them all.
    """

    mechanism_remainder: float = rule(
        0.05,
        "share of the excess chi-square of the base",
        "Up to here what is left of the force balances of a mechanism is no second effect.",
        f"{BY_HAND}, equal to `second_form_share`: no model of a real machine is exact, whichever "
        "the port.",
        at_least=0.0,
        at_most=1.0,
    )
    main_share: float = rule(
        0.5,
        "share of the power beyond the sensors' noise",
        "Least share that named effects of a mechanism remove.",
        f"{BY_HAND}: half is the least that may be called most of it.",
        at_least=0.0,
        at_most=1.0,
    )
    parsimony_ratio: float = rule(
        1.1,
        "ratio of powers left",
        "The model of fewer unknowns is named if it leaves at most this multiple of the power that "
        "the best one leaves in every balance.",
        f"{BY_HAND}: 5 % of amplitude; what is left is no noise, so that no test level says it.",
        at_least=1.0,
    )
    rest_rounds: int = rule(
        2,
        "1",
        "Rounds in which the noise of a mechanism is set to what its best model leaves.",
        f"{BY_HAND}: which effects are best depends on the noise in the first round only.",
    )
    rest_seconds: int = rule(
        3,
        "1",
        "Second effects tried beside each of as many first ones, and further ones beside the best "
        "set, to find what no effect explains.",
        "Simulation: as `most_fitted`, without its margin.",
    )
