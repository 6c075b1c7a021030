"""The plan: tests to make, the power they give, and what no test within the limits separates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_hdte._one_thread import ONE_THREAD
from pymoo_hdte.discrepancy._plan.changes import signatures_of, stated_orders
from pymoo_hdte.discrepancy._plan.choice import Aims, smallest_set
from pymoo_hdte.discrepancy._plan.imagined import (
    PlannedTest,
    imagined_campaign,
    imagined_data,
    possible_tests,
)
from pymoo_hdte.discrepancy._plan.limits import PlanLimits
from pymoo_hdte.discrepancy._plan.signatures import Counts
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.units import REVOLUTION_PER_MINUTE


@dataclass(frozen=True)
class Chance:
    """Power of detection of an effect, or of its separation from a rival.

    Attributes
    ----------
    effect : str
        With its port.
    rival : str
        Empty for detection.
    power : float
        Of the planned tests; for two effects to be found that of the one that is harder to tell.
    possible : float
        No set of as many tests within the limits gives more.
    """

    effect: str
    rival: str
    power: float
    possible: float


@dataclass(frozen=True)
class Plan:
    """What to measure, and what that tells.

    Attributes
    ----------
    tests : tuple of PlannedTest
        To be fitted, in the order to make them.
    held_out : tuple of PlannedTest
        Running tests of other conditions, where there are any, to prove what the fit names.
    detected : tuple of Chance
        One of each effect to be found.
    separated : tuple of Chance
        Of the effects that are detected from each other one.
    wanted : float
        Probability that was wanted as power.

    Examples
    --------
    >>> plan = plan_tests(preset("calibrated"), read_limits("bench.toml"))  # doctest: +SKIP
    >>> plan.tests[0], plan.missed  # doctest: +SKIP
    """

    tests: tuple[PlannedTest, ...]
    held_out: tuple[PlannedTest, ...]
    detected: tuple[Chance, ...]
    separated: tuple[Chance, ...]
    wanted: float

    @property
    def missed(self) -> list[str]:
        """A sentence for each effect that is not detected, or not told from others.

        What is not detected is not told from anything either, and not in `separated`.
        """
        unseen = {one.effect: one for one in self.detected if one.power < self.wanted}
        found = [_missed([one], self.wanted) for one in unseen.values()]
        confused: dict[tuple[str, bool], list[Chance]] = {}
        for one in self.separated:
            if one.power < self.wanted:
                key = one.effect, one.possible < self.wanted
                confused.setdefault(key, []).append(one)
        return found + [_missed(ones, self.wanted) for ones in confused.values()]

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as plain types, in the units of the names."""
        roles = [("train", one) for one in self.tests] + [
            ("held_out", one) for one in self.held_out
        ]
        return {
            "wanted_power": self.wanted,
            "test": [_test(role, one) for role, one in roles],
            "effect": [
                {"effect": one.effect, "power": _rounded(one.power)} for one in self.detected
            ],
            "pair": [
                {"effect": one.effect, "rival": one.rival, "power": _rounded(one.power)}
                for one in self.separated
            ],
            "not_reached": self.missed,
        }


@ONE_THREAD
def plan_tests(
    model: DriveModel,
    limits: PlanLimits,
    rng: np.random.Generator | None = None,
    rules: Rules = RULES,
) -> Plan:
    """Return the smallest set of tests that separates the effects that matter.

    Changes of the readings are linear in the unknowns of a rival about its typical values, so that
    the power is that of small effects.

    Parameters
    ----------
    model : DriveModel
        What is believed of the drive.
    limits : PlanLimits
    rng : Generator, optional
        For phases and noise of the imagined records; by default of seed 0.
    rules : Rules

    Returns
    -------
    Plan

    Raises
    ------
    InvalidInput
        If records within the limits could not be analysed: see `Campaign` and `expected_orders`.

    Examples
    --------
    >>> plan = plan_tests(preset("calibrated"), read_limits("bench.toml"))  # doctest: +SKIP
    >>> len(plan.tests)  # doctest: +SKIP
    """
    rng = np.random.default_rng(0) if rng is None else rng
    believed, tests = limits.believed(model), possible_tests(limits)
    campaign = imagined_campaign(believed, limits, tests, rng, rules=rules)
    data = imagined_data(campaign, limits, stated_orders(limits.effects, believed.ratio), rules)
    aims = Aims(signatures_of(data, limits, model.sheet.load_torque), rules, limits.power)
    most = limits.most_records - limits.held_out
    counts = smallest_set(aims, most)
    counts = _enough(counts, tests, min(rules.fewest_records, most))
    made = tuple(tests[k] for k in np.repeat(np.arange(len(tests)), counts))
    detected, separated = _chances(aims, counts, most)
    held_out = _held_out(made, tests, limits.held_out)
    return Plan(_ordered(made), _ordered(held_out), detected, separated, limits.power)


def _chances(
    aims: Aims, counts: Counts, most: int
) -> tuple[tuple[Chance, ...], tuple[Chance, ...]]:
    signatures, pairs = aims.signatures, aims.pairs
    alone, beside = aims.powers(counts)
    best_alone, best_beside = aims.powers(np.full(len(counts), most))
    detected = tuple(
        Chance(name, "", float(alone[k]), float(best_alone[k]))
        for k, name in enumerate(signatures.effects)
    )
    found: dict[frozenset[str], Chance] = {}
    for k, effect in enumerate(signatures.effects):
        for j, rival in enumerate(signatures.rivals):
            if not pairs[k, j] or alone[k] < aims.power:
                continue
            one = Chance(effect, rival, float(beside[k, j]), float(best_beside[k, j]))
            known = found.setdefault(frozenset((effect, rival)), one)
            if (one.possible, one.power) < (known.possible, known.power):
                found[frozenset((effect, rival))] = one
    return detected, tuple(found.values())


def _enough(counts: Counts, tests: Sequence[PlannedTest], least: int) -> Counts:
    """Add running tests, unlike those chosen, up to the least number that can be analysed."""
    counts = counts.copy()
    running = [k for k, one in enumerate(tests) if one.kind == "running"]
    while sum(counts[running]) < least:
        chosen = [tests[k] for k in running if counts[k]]
        distances = [_distance(tests[k], chosen, tests) for k in running]
        counts[running[int(np.argmax(distances))]] += 1
    return counts


def _held_out(
    made: Sequence[PlannedTest], tests: Sequence[PlannedTest], number: int
) -> tuple[PlannedTest, ...]:
    """Return running tests as unlike those made, and each other, as the limits allow."""
    running = [one for one in tests if one.kind == "running"]
    found: list[PlannedTest] = []
    for _ in range(number):
        known = [*(one for one in made if one.kind == "running"), *found]
        found.append(max(running, key=lambda one: _distance(one, known, running)))
    return tuple(found)


def _distance(
    one: PlannedTest, others: Sequence[PlannedTest], tests: Sequence[PlannedTest]
) -> float:
    """Return the distance of a condition to the nearest other one, in units of the limits."""
    speed = max(abs(test.speed) for test in tests)
    load = max(max(abs(test.load) for test in tests), 1e-12)
    time = max(max(test.elapsed for test in tests), 1e-12)
    return min(
        (
            abs(one.speed - other.speed) / speed
            + abs(one.load - other.load) / load
            + abs(one.elapsed - other.elapsed) / time
            for other in others
        ),
        default=np.inf,
    )


def _ordered(tests: Sequence[PlannedTest]) -> tuple[PlannedTest, ...]:
    def place(one: PlannedTest) -> tuple[bool, float, bool, float, float]:
        return one.kind == "running", one.elapsed, one.speed < 0.0, abs(one.speed), abs(one.load)

    return tuple(sorted(tests, key=place))


def chance_words(chance: float) -> str:
    """Return a chance in per cent, rounded down: what falls short of 80 % is not shown as 80 %.

    >>> chance_words(0.796), chance_words(0.004), chance_words(0.9999)
    ('79 %', 'less than 1 %', 'over 99 %')
    """
    if chance > 0.99:
        return "over 99 %"
    # The small term is for products such as 100 * 0.29, which end just below a whole number.
    whole = int(100.0 * chance + 1e-9)
    return f"{whole} %" if whole else "less than 1 %"


def _missed(ones: Sequence[Chance], wanted: float) -> str:
    """Return what the tests leave open about one effect, of which all ``ones`` are."""
    effect = ones[0].effect
    rivals = ", nor from ".join(one.rival for one in ones)
    if max(one.possible for one in ones) < wanted:
        asked = f"separates {effect} from {rivals}" if rivals else f"shows {effect}"
        best = max(one.possible for one in ones)
        most = f"the chance is {chance_words(best)} at best"
        return f"No test within the limits {asked} at this size: {most}."
    least = min(one.power for one in ones)
    shown = f"separate {effect} from {rivals.replace(', nor', ' and')}"
    asked = shown if rivals else f"show {effect}"
    return (
        f"To {asked} at this size takes more records than the limits allow: these give a chance "
        f"of {chance_words(least)}."
    )


def _test(role: str, one: PlannedTest) -> dict[str, Any]:
    if one.kind != "running":
        return {"test": one.kind, "role": role, "largest_torque_Nm": one.load}
    return {
        "test": one.kind,
        "role": role,
        "input_speed_rpm": float(f"{one.speed / REVOLUTION_PER_MINUTE:.9g}"),
        "load_torque_Nm": one.load,
        "direction": "forward" if one.speed > 0.0 else "reverse",
        "elapsed_s": one.elapsed,
    }


def _rounded(power: float) -> float:
    # Down, so that a power that is written reaches what is wanted only where the power does.
    return math.floor(1e4 * power + 1e-9) / 1e4
