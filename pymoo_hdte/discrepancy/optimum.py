"""What the correction does to the robust optimum: the old choice judged by the new model.

Both models go through the same surrogate, swarm and preferences. A design is a set of factors on
the parameters of the drive as it stands, which is what a designer can order without knowing their
true values. The choice made with the old model is then evaluated with the new one: what was
promised, and what one would really get.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pymoo.optimize import minimize

from pymoo_hdte.algorithms import AMPMOPSO
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia, deviation_degree
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.problems import RobustDTE

SURROGATE_ORDER = 3
"""That of the paper; with laws at ports it costs a harmonic balance in each of 4^5 runs."""
GENERATIONS = 60
PARTICLES = 60
_SAME_DESIGN = 1e-3

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Choice:
    """The design chosen under one preference, before and after the correction.

    Attributes
    ----------
    preference : str
        A key of `PREFERENCES`.
    before, after : ndarray, shape (4,)
        Factors on K, J_in, B_in, B_fc of the drive as it stands.
    promised : ndarray, shape (2,)
        Mean and standard deviation of the DTE, arcsec, of the old design by the old model.
    delivered : ndarray, shape (2,)
        Of the old design by the new model.
    reached : ndarray, shape (2,)
        Of the new design by the new model.
    """

    preference: str
    before: Values
    after: Values
    promised: Values
    delivered: Values
    reached: Values

    @property
    def distance(self) -> float:
        """Relative distance of the two designs, Eq. (42)."""
        return float(deviation_degree(self.after[None, :], self.before)[0])


@dataclass(frozen=True, eq=False)
class OptimumShift:
    """The choices, or why there are none.

    Attributes
    ----------
    choices : tuple of Choice
    obstacle : str
        Empty unless a model cannot be optimised.
    fronts : tuple of ndarray, shape (n, 2)
        Mean and standard deviation of the DTE, arcsec, of the designs found before and after;
        empty where there are no choices.
    """

    choices: tuple[Choice, ...]
    obstacle: str = ""
    fronts: tuple[Values, ...] = ()

    @property
    def sentence(self) -> str:
        """How the optimum moved, in words, for the balanced preference."""
        if not self.choices:
            return self.obstacle
        choice = next(one for one in self.choices if one.preference == "balanced")
        promised, delivered, reached = (
            f"mean {mean:.3g} and standard deviation {std:.3g} arcsec"
            for mean, std in (choice.promised, choice.delivered, choice.reached)
        )
        judged = f"It was promised {promised}; by the revised model it has {delivered}."
        if choice.distance < _SAME_DESIGN:
            return f"The balanced design stays where it was. {judged}"
        return (
            f"The balanced design moves by {choice.distance:.2g} of its size. The old one: "
            f"{judged[0].lower()}{judged[1:]} The new one reaches {reached}."
        )


def optimum_shift(before: DriveModel, after: DriveModel, seed: int = 1) -> OptimumShift:
    """Return how the robust optimum moves from one model to another."""
    try:
        old = RobustDTE(before, order=SURROGATE_ORDER)
        new = RobustDTE(after, order=SURROGATE_ORDER)
    except (InvalidInput, ArithmeticError) as error:
        return OptimumShift((), f"One of the models has no robust optimum: {error}")
    fronts = [_front(problem, seed) for problem in (old, new)]
    choices = tuple(_choice(word, old, new, fronts) for word in PREFERENCES)
    return OptimumShift(choices, fronts=tuple(values for _, values in fronts))


def _front(problem: RobustDTE, seed: int) -> tuple[Values, Values]:
    """Return designs (n, 4) and objectives (n, 2) of a short run."""
    result = minimize(problem, AMPMOPSO(PARTICLES), ("n_gen", GENERATIONS), seed=seed)
    return result.X, result.F


def _choice(
    preference: str, old: RobustDTE, new: RobustDTE, fronts: list[tuple[Values, Values]]
) -> Choice:
    choose = WeightedUtopia(PREFERENCES[preference])
    (old_designs, old_values), (new_designs, new_values) = fronts
    first, second = choose.do(old_values), choose.do(new_values)
    factors = old_designs[first] / old.nominal
    # The factors lie in a box that is the same for both; rounding must not lead out of it.
    same = np.clip(factors * new.nominal, new.xl, new.xu)
    return Choice(
        preference,
        before=factors,
        after=new_designs[second] / new.nominal,
        promised=old_values[first],
        delivered=new.evaluate(same[None, :])[0],
        reached=new_values[second],
    )
