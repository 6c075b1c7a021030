"""Rules for the search: which effects and sets of them are fitted, and how far."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.discrepancy.engine.thresholds.fields import BY_HAND, RuleSet, rule


@dataclass(frozen=True, kw_only=True)
class SearchRules(RuleSet):
    """Thresholds for the search among effects and sets of them.

    Raises
    ------
    InvalidInput
        For a value that is no number or that its field does not allow.
    """

    promising_share: float = rule(
        0.2,
        "share of the best candidate's reduction",
        "Least reduction of chi-square, to first order, with which a candidate is fitted. Beside "
        "other effects it is a share of what these leave: where no candidate reaches "
        "`second_hope_share`, the best one is fitted from here on; and what stays below the "
        "product of both by its signature beside the base is not screened again.",
        f"{BY_HAND}: the screening is linear and may underrate a candidate; this allows for a "
        "factor of five.",
        at_least=0.0,
        at_most=1.0,
    )
    most_fitted: int = rule(
        5,
        "1",
        "Most candidates fitted without linearisation after the screening.",
        "Simulation: the screening had the right one among the first three in all of 70 campaigns; "
        "two more are a margin.",
    )
    most_of_one_name: int = rule(
        2,
        "1",
        "Most of the fitted candidates that have one name.",
        f"{BY_HAND}: two forms or orders of one effect leave three places to others.",
    )
    fit_evaluations: int = rule(
        25,
        "1",
        "Most steps of a fit of the base, or of one effect beside it.",
        "Simulation: from believed and from fitted values, all fits of twelve campaigns that were "
        "looked at converge in 8 to 20.",
    )
    trial_gain: float = rule(
        0.01,
        "share of chi-square",
        "Least share that a step removes for a fit to go on that only ranks an explanation, or "
        "tells which parameters want to leave their tolerances.",
        f"{BY_HAND}: explanations that are told apart by less are fitted to the end.",
        at_least=0.0,
        at_most=1.0,
    )
    outdone_share: float = rule(
        0.1,
        "share of the base's chi-square",
        "Least chi-square that a fit promises to leave, twice in a row, for it to end where "
        "another effect leaves noise; at least `contradicting_chi_square` times that, too.",
        "Simulation: of 48 fits in 39 campaigns that ended near the noise none promised more than "
        "0.05 the second time.",
        at_least=0.0,
        at_most=1.0,
    )
    refit_margin: float = rule(
        5.0,
        "1",
        "Multiple of `evidence_distance` within which another explanation is fitted to the end "
        "before it is judged.",
        f"{BY_HAND}: a fit that is continued may come nearer by this factor.",
        at_least=1.0,
    )
    second_hope_share: float = rule(
        0.5,
        "share of what the first effect leaves",
        "Least share that a second effect removes to first order to be fitted, if not only the "
        "best is; and a first one, of the whole misfit, in any form of its law.",
        f"{BY_HAND}: well below `second_share`, since the screening is linear.",
        at_least=0.0,
    )
    most_effects: int = rule(
        3,
        "1",
        "Most effects of one set, base parameters out of tolerance counted as one.",
        f"{BY_HAND}: a campaign of a dozen records seldom tells four apart.",
    )
    most_firsts: int = rule(
        2,
        "1",
        "Single effects that are extended by a further one, and sets of one size that are fitted "
        "to the end however far apart; one alone where the best leaves no more than noise. A "
        "second single that leaves the same as the first is not extended anew.",
        f"{BY_HAND}: the better of two effects alone need not be one of both.",
    )
    most_freed_rounds: int = rule(
        3,
        "1",
        "Rounds in which base parameters that reach a bound are freed.",
        f"{BY_HAND}: freeing the ones at bounds may carry others to theirs.",
    )
    most_seconds: int = rule(
        2,
        "1",
        "Most second effects fitted beside the first, and as many for each part that it explains "
        "ill.",
        f"{BY_HAND} as a budget of time.",
    )
