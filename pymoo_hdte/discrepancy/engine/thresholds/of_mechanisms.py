"""Rules for machines other than a drive: their models never fit down to the noise of sensors."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.discrepancy.engine.thresholds.fields import BY_HAND, RuleSet, rule


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

    fewest_error_periods: float = rule(
        1.0,
        "periods in a record",
        "Least periods of a low whole order of a shaft within the travel of a record for it to be "
        "a candidate error of a gear between two encoders.",
        f"{BY_HAND}: fewer are a slope or a bow, which the torque explains as well.",
    )

    # How are held-out records simulated?
    window_drift: float = rule(
        0.1,
        "share of the standard deviation of a position",
        "A window in which a held-out record is simulated ends where the forces that the model of "
        "a mechanism leaves unexplained have moved a coordinate by this much.",
        f"{BY_HAND}: the error of such a model then has a hundredth of the power of the motion "
        "(R2 of .99), and that of a worse model stands out of it.",
        at_most=1.0,
    )
    window_decays: float = rule(
        10.0,
        "decay times of the slowest mode",
        "Length of a window where springs or loops let the measured state at its start be "
        "forgotten.",
        f"{BY_HAND}: the error builds up over one decay time, so that a tenth of the window has "
        "less of it than a simulation without a break.",
    )
    fewest_windows: int = rule(
        10,
        "windows in a record",
        "A window of a coordinate that forgets nothing is no longer than this part of its record.",
        f"{BY_HAND}: each gives one independent value of the error, and the mean square of ten is "
        "known to 45 %.",
    )
    proof_samples: int = rule(
        12_000,
        "samples",
        "Most samples for which one model is simulated over all held-out records; beyond, windows "
        "are left out evenly, and the report says how many.",
        f"{BY_HAND} as a budget of time: a sample of one coordinate takes 0.13 ms, so that both "
        "models take some 3 s.",
    )
