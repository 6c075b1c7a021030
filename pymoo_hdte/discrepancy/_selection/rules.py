"""The thresholds of evidence, and of the verdict on a mechanism: `Rules`, one line each.

``rules_explained.toml`` beside this file says of each what it decides, its unit and its derivation.
Steps of difference quotients, orders of filters and tolerances of solvers are no rules: finer ones
change the digits of a result but not the criteria of a verdict. They stand beside the code that
needs them.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields
from pathlib import Path
from typing import Any

from pymoo_hdte.checks import real_number, whole_number
from pymoo_hdte.units import ARCSEC


@dataclass(frozen=True)
class Rule:
    """One rule in words.

    Attributes
    ----------
    name : str
        Of the field.
    value : float
    unit : str
        ``"1"`` for a ratio or a number of things.
    meaning : str
        What the rule decides.
    derivation : str
        Test level, simulation or literature that it comes from, or that it was set by hand.
    """

    name: str
    value: float
    unit: str
    meaning: str
    derivation: str


def rule(value: float, *, at_least: float | None = None, at_most: float = math.inf) -> Any:
    """Return a field with its bounds: whole for a whole default, otherwise a real number.

    By default anything above zero is allowed, for a whole number anything from one on.
    """
    return field(default=value, metadata={"at_least": at_least, "at_most": at_most})


def _share(right: int, of: int) -> float:
    """Return a share by Laplace's rule of succession, which adds one case of either kind."""
    return (right + 1) / (of + 2)


@dataclass(frozen=True, kw_only=True)
class Rules:
    """Every threshold that decides what is named, refused, flagged or shown as certain.

    ``analyse(..., rules=...)`` takes one, by default `RULES`. `explained` returns all of them in
    words.

    Raises
    ------
    InvalidInput
        For a value that is no number or that its field does not allow.

    Examples
    --------
    >>> from dataclasses import replace
    >>> stricter = replace(RULES, bic_gain=10.0)
    >>> stricter.bic_gain
    10.0
    """

    # How far sets of effects are searched.
    promising_share: float = rule(0.2, at_least=0.0, at_most=1.0)
    most_fitted: int = rule(5)
    most_of_one_name: int = rule(2)
    fit_evaluations: int = rule(25)
    trial_gain: float = rule(0.01, at_least=0.0, at_most=1.0)
    outdone_share: float = rule(0.1, at_least=0.0, at_most=1.0)
    refit_margin: float = rule(5.0, at_least=1.0)
    second_hope_share: float = rule(0.5, at_least=0.0)
    most_effects: int = rule(3)
    most_firsts: int = rule(2)
    most_freed_rounds: int = rule(3)
    most_seconds: int = rule(2)

    # When a row is faulty, or a stated noise wrong.
    row_fault_chance: float = rule(1e-3, at_most=1.0)
    fault_prominence: float = rule(2.0, at_least=1.0)
    spike_share: float = rule(0.01, at_most=0.5)
    longest_spike: int = rule(3)
    most_jumps: int = rule(3)
    stuck_rows: int = rule(30)
    stuck_ratio: float = rule(10.0, at_least=1.0)
    changing_share: float = rule(0.5, at_most=1.0)
    saturated_share: float = rule(0.5, at_most=1.0)
    longest_settling: float = rule(0.1, at_most=0.3)
    fewest_unsettled: int = rule(2)
    gap_of_rows: float = rule(1.5, at_least=1.0)
    noise_mismatch: float = rule(1.05, at_least=1.0)

    # Plausibility of numbers: wide enough for every effect that a campaign may contain.
    largest_transmission_error: float = rule(0.02)
    least_error_amplitude: float = rule(1e-3 * ARCSEC)
    largest_twist: float = rule(0.1)
    least_natural_frequency: float = rule(0.5)
    least_tolerance: float = rule(1e-3)
    overstated_noise_ratio: float = rule(30.0, at_least=1.0)
    speed_mismatch: float = rule(0.1, at_most=1.0)
    slope_mismatch: float = rule(5.0, at_least=1.0)
    load_mismatch: float = rule(0.3, at_most=1.0)
    torque_mismatch: float = rule(10.0, at_least=1.0)
    fewest_records: int = rule(3)

    # Which lines of a drive are analysed, and which count as seen?
    highest_order: float = rule(14.0)
    line_separation: float = rule(0.9)
    nyquist_share: float = rule(0.9, at_most=1.0)
    unexpected_line_chance: float = rule(1e-3, at_most=1.0)
    most_unexpected_lines: int = rule(6)
    order_line_chance: float = rule(1e-6, at_most=1.0)
    second_speed_chance: float = rule(0.01, at_most=1.0)
    most_order_lines: int = rule(4)

    # What else the records of a drive must show.
    least_held_load: float = rule(0.5)
    rattling_lines: int = rule(8)
    rattling_trace: int = rule(2)
    fewest_rattling: int = rule(2)
    least_temperature_spread: float = rule(3.0)
    sweep_gain: float = rule(50.0)

    # Machines other than a drive.
    noise_power_ratio: float = rule(2.0, at_least=1.0)
    band_share: float = rule(0.2, at_most=1.0)
    fewest_periods: float = rule(5.0)
    position_order_chance: float = rule(1e-4, at_most=1.0)
    most_position_orders: int = rule(6)
    most_tried_orders: int = rule(20_000)
    interpolated_share: float = rule(0.3, at_most=0.5)
    slow_rows_share: float = rule(0.1, at_most=1.0)
    side_lines: float = rule(2.5)
    ripple_share: float = rule(1e-3, at_least=0.0, at_most=1.0)
    reverse_share: float = rule(0.01, at_least=0.0, at_most=0.5)

    # Where is the model wrong?
    false_discovery_rate: float = rule(0.01, at_most=1.0)

    # Of what kind is the misfit?
    slow_share: float = rule(0.1, at_least=0.0, at_most=1.0)
    caused_share: float = rule(0.25, at_least=0.0, at_most=1.0)
    growth_ratio: float = rule(1.25, at_least=1.0)
    growth_chance: float = rule(0.01, at_most=1.0)
    fixed_frequency_width: float = rule(0.02, at_most=1.0)
    fixed_frequency_range: float = rule(0.1, at_least=0.0, at_most=1.0)
    fixed_frequency_records: int = rule(3)
    broad_band_lines: float = rule(8.0)

    # Which questions can these records not answer?
    one_speed_ratio: float = rule(1.1, at_least=1.0)
    one_load_range: float = rule(0.1, at_least=0.0, at_most=1.0)
    undetermined_share: float = rule(0.8, at_most=1.0)

    # What does the validation say, and what is to be measured next?
    least_gap_share: float = rule(0.1, at_least=0.0)
    worse_share: float = rule(0.05, at_least=0.0)
    separated_chi_square: float = rule(9.0)
    nearest_rival_ratio: float = rule(4.0, at_least=1.0)
    offered_share: float = rule(0.05, at_least=0.0, at_most=1.0)

    # How probable is what is said?
    named_right: float = rule(_share(110, of=112), at_most=1.0)
    class_right: float = rule(_share(31, of=33), at_most=1.0)
    partial_right: float = rule(_share(20, of=24), at_most=1.0)
    adequate_right: float = rule(_share(38, of=38), at_most=1.0)

    # What machines other than a drive need.
    mechanism_remainder: float = rule(0.05, at_least=0.0, at_most=1.0)
    main_share: float = rule(0.5, at_least=0.0, at_most=1.0)
    parsimony_ratio: float = rule(1.1, at_least=1.0)
    rest_rounds: int = rule(2)
    rest_seconds: int = rule(3)
    fewest_error_periods: float = rule(1.0)

    # How are held-out records simulated?
    window_drift: float = rule(0.1, at_most=1.0)
    window_decays: float = rule(10.0)
    fewest_windows: int = rule(10)
    proof_samples: int = rule(12_000)

    # Is anything missing?
    false_alarm_deviations: float = rule(4.0)
    single_effect_gain: float = rule(25.0)

    # Which effect is it, and does it explain the misfit?
    bic_gain: float = rule(6.0)
    explained_share: float = rule(0.9, at_most=1.0)
    partial_share: float = rule(0.75, at_most=1.0)
    explained_part_share: float = rule(0.5, at_least=0.0, at_most=1.0)
    contradicting_chi_square: float = rule(9.0, at_least=1.0)
    exact_chi_square: float = rule(1.3, at_least=1.0)
    exact_model_accuracy: float = rule(1e-3, at_least=0.0, at_most=1.0)
    model_accuracy: float = rule(0.02, at_least=0.0, at_most=1.0)

    # Can the data tell two explanations apart?
    evidence_distance: float = rule(10.0)
    form_accuracy: float = rule(0.02, at_least=0.0, at_most=1.0)
    form_share: float = rule(0.05, at_least=0.0, at_most=1.0)
    form_ratio: float = rule(2.0, at_least=1.0)

    # Is there a second effect?
    second_share: float = rule(0.8, at_least=0.0, at_most=1.0)
    second_form_share: float = rule(0.05, at_least=0.0, at_most=1.0)
    vote_change: float = rule(16.0)
    vote_share: float = rule(0.5, at_least=0.0, at_most=1.0)
    certain_deviations: float = rule(1.959964)

    def __post_init__(self) -> None:
        for threshold in fields(self):
            _check(threshold, getattr(self, threshold.name))

    @property
    def exact_share(self) -> float:
        """Least share of the excess that effects of exact form remove: all but their own error."""
        return 1.0 - self.exact_model_accuracy**2

    def explained(self) -> tuple[Rule, ...]:
        """Return every rule with its present value, in words."""
        text = Path(__file__).with_name("rules_explained.toml").read_text(encoding="utf-8")
        return tuple(
            Rule(name, getattr(self, name), **words) for name, words in tomllib.loads(text).items()
        )


def _check(threshold: Field[Any], value: Any) -> None:
    limits: Mapping[str, Any] = threshold.metadata
    name, at_least = f"rules.{threshold.name}", limits["at_least"]
    if isinstance(threshold.default, int):
        whole_number(name, value, 1 if at_least is None else int(at_least))
    elif at_least is None:
        real_number(name, value, above=0.0, at_most=limits["at_most"])
    else:
        real_number(name, value, at_least=at_least, at_most=limits["at_most"])


RULES = Rules()
"""The rules that hold where none are given."""
