"""The plan: tests to make, their power, and effects that no test within the limits separates."""

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
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.units import REVOLUTION_PER_MINUTE


@dataclass(frozen=True)
class Chance:
    """Power of detection of an effect, or of its separation from a rival.

    Attributes
    ----------
    effect : str
        Label of the effect, with its port.
    rival : str
        Label of the rival; empty for detection.
    power : float
        Power of the planned tests; for two effects to be found, the smaller of both.
    possible : float
        Largest power of any set of as many tests within the limits.
    """

    effect: str
    rival: str
    power: float
    possible: float


@dataclass(frozen=True)
class Plan:
    """What to measure, and which effects that detects and separates.

    Attributes
    ----------
    tests : tuple of PlannedTest
        Tests to be fitted, in the order to make them.
    held_out : tuple of PlannedTest
        Running tests at other conditions, if there are any, to validate what the fit names.
    detected : tuple of Chance
        Chance to detect each effect.
    separated : tuple of Chance
        Chance to separate each detected effect from each rival.
    wanted : float
        Probability that was requested as power.

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
        """A sentence for each effect that is not detected, or not separated from others.

        An effect that is not detected is not in `separated`.
        """
        unseen = {chance.effect: chance for chance in self.detected if chance.power < self.wanted}
        sentences = [_missed([chance], self.wanted) for chance in unseen.values()]
        confused: dict[tuple[str, bool], list[Chance]] = {}
        for chance in self.separated:
            if chance.power < self.wanted:
                key = chance.effect, chance.possible < self.wanted
                confused.setdefault(key, []).append(chance)
        return sentences + [_missed(chances, self.wanted) for chances in confused.values()]

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as plain types, in the units of the names."""
        roles = [("train", test) for test in self.tests] + [
            ("held_out", test) for test in self.held_out
        ]
        return {
            "wanted_power": self.wanted,
            "test": [_test(role, test) for role, test in roles],
            "effect": [
                {"effect": chance.effect, "power": _rounded(chance.power)}
                for chance in self.detected
            ],
            "pair": [
                {"effect": chance.effect, "rival": chance.rival, "power": _rounded(chance.power)}
                for chance in self.separated
            ],
            "not_reached": self.missed,
        }


@ONE_THREAD
def plan_tests(
    model: DriveModel, limits: PlanLimits, rng: np.random.Generator | None = None
) -> Plan:
    """Return the smallest set of tests that separates the effects that matter.

    Readings are taken as linear in the unknowns of a rival around its typical values, so that the
    power holds for small effects.

    Parameters
    ----------
    model : DriveModel
        Nominal model of the drive.
    limits : PlanLimits
    rng : Generator, optional
        Generator for phases and noise of the imagined records; by default with seed 0.

    Returns
    -------
    Plan

    Raises
    ------
    InvalidInput
        If records within the limits could not be analysed, as `Campaign` checks them.

    Examples
    --------
    >>> plan = plan_tests(preset("calibrated"), read_limits("bench.toml"))  # doctest: +SKIP
    >>> len(plan.tests)  # doctest: +SKIP
    """
    rng = np.random.default_rng(0) if rng is None else rng
    believed, tests = limits.believed(model), possible_tests(limits)
    campaign = imagined_campaign(believed, limits, tests, rng)
    data = imagined_data(campaign, limits, stated_orders(limits.effects, believed.ratio))
    aims = Aims(signatures_of(data, limits, model.sheet.load_torque), limits.power)
    most = limits.most_records - limits.held_out
    counts = smallest_set(aims, most)
    counts = _enough(counts, tests, min(RULES.fewest_records, most))
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
    separated: dict[frozenset[str], Chance] = {}
    for k, effect in enumerate(signatures.effects):
        for j, rival in enumerate(signatures.rivals):
            if not pairs[k, j] or alone[k] < aims.power:
                continue
            chance = Chance(effect, rival, float(beside[k, j]), float(best_beside[k, j]))
            hardest = separated.setdefault(frozenset((effect, rival)), chance)
            if (chance.possible, chance.power) < (hardest.possible, hardest.power):
                separated[frozenset((effect, rival))] = chance
    return detected, tuple(separated.values())


def _enough(counts: Counts, tests: Sequence[PlannedTest], least: int) -> Counts:
    """Return counts with running tests added, up to the least number that can be analysed.

    Each added test is the one whose condition differs most from those chosen.
    """
    counts = counts.copy()
    running = [k for k, test in enumerate(tests) if test.kind == "running"]
    while sum(counts[running]) < least:
        chosen = [tests[k] for k in running if counts[k]]
        distances = [_distance(tests[k], chosen, tests) for k in running]
        counts[running[int(np.argmax(distances))]] += 1
    return counts


def _held_out(
    made: Sequence[PlannedTest], tests: Sequence[PlannedTest], number: int
) -> tuple[PlannedTest, ...]:
    """Return running tests that differ as much as possible from those made, and from each other."""
    running = [test for test in tests if test.kind == "running"]
    held_out: list[PlannedTest] = []
    for _ in range(number):
        known = [*(test for test in made if test.kind == "running"), *held_out]
        held_out.append(max(running, key=lambda test: _distance(test, known, running)))
    return tuple(held_out)


def _distance(
    test: PlannedTest, others: Sequence[PlannedTest], tests: Sequence[PlannedTest]
) -> float:
    """Return the distance of a condition to the nearest of others, in units of the limits."""
    speed = max(abs(test.speed) for test in tests)
    load = max(max(abs(test.load) for test in tests), 1e-12)
    time = max(max(test.elapsed for test in tests), 1e-12)
    return min(
        (
            abs(test.speed - neighbour.speed) / speed
            + abs(test.load - neighbour.load) / load
            + abs(test.elapsed - neighbour.elapsed) / time
            for neighbour in others
        ),
        default=np.inf,
    )


def _ordered(tests: Sequence[PlannedTest]) -> tuple[PlannedTest, ...]:
    def place(test: PlannedTest) -> tuple[bool, float, bool, float, float]:
        return (
            test.kind == "running",
            test.elapsed,
            test.speed < 0.0,
            abs(test.speed),
            abs(test.load),
        )

    return tuple(sorted(tests, key=place))


def chance_words(chance: float) -> str:
    """Return a chance in per cent, rounded down, so that 79.6 % is not shown as 80 %.

    >>> chance_words(0.796), chance_words(0.004), chance_words(0.9999)
    ('79 %', 'less than 1 %', 'over 99 %')
    """
    if chance > 0.99:
        return "over 99 %"
    # The small term is for products such as 100 * 0.29, which end just below a whole number.
    whole = int(100.0 * chance + 1e-9)
    return f"{whole} %" if whole else "less than 1 %"


def _missed(chances: Sequence[Chance], wanted: float) -> str:
    """Return a sentence on what tests do not show of the effect of all ``chances``."""
    effect = chances[0].effect
    rivals = ", nor from ".join(chance.rival for chance in chances)
    if max(chance.possible for chance in chances) < wanted:
        outcome = f"separates {effect} from {rivals}" if rivals else f"shows {effect}"
        best = max(chance.possible for chance in chances)
        most = f"the chance is {chance_words(best)} at best"
        return f"No test within the limits {outcome} at this size: {most}."
    least = min(chance.power for chance in chances)
    separate = f"separate {effect} from {rivals.replace(', nor', ' and')}"
    outcome = separate if rivals else f"show {effect}"
    return (
        f"To {outcome} at this size takes more records than the limits allow: these give a chance "
        f"of {chance_words(least)}."
    )


def _test(role: str, test: PlannedTest) -> dict[str, Any]:
    if test.kind != "running":
        return {"test": test.kind, "role": role, "largest_torque_Nm": test.load}
    return {
        "test": test.kind,
        "role": role,
        "input_speed_rpm": float(f"{test.speed / REVOLUTION_PER_MINUTE:.9g}"),
        "load_torque_Nm": test.load,
        "direction": "forward" if test.speed > 0.0 else "reverse",
        "elapsed_s": test.elapsed,
    }


def _rounded(power: float) -> float:
    # Rounded down, so that a printed power reaches the wanted one only if the power does.
    return math.floor(1e4 * power + 1e-9) / 1e4
