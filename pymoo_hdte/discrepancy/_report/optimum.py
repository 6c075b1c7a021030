"""Effect of the correction on the robust optimum, for the report.

The optimisation itself is in `pymoo_hdte.discrepancy._robust_optimum`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_SAME_MOMENTS = 2e-3
"""Relative difference at which two designs are equally good: a few neighbours in a front of 100."""

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Choice:
    """The design chosen under one preference, before and after the correction.

    Attributes
    ----------
    preference : str
        A key of `pymoo_hdte.decision.PREFERENCES`.
    before, after : ndarray, shape (4,)
        Factors on K, J_in, B_in, B_fc of the existing drive.
    free_before, free_after : ndarray of bool, shape (4,)
        Which of them move neither mean nor standard deviation, and so have no number worth saying.
    distance : float
        Relative distance of the two designs (deviation degree, Eq. 42); also along directions
        that do not matter.
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
    free_before: NDArray[np.bool_]
    free_after: NDArray[np.bool_]
    distance: float
    promised: Values
    delivered: Values
    reached: Values

    @property
    def stays(self) -> bool:
        """Whether the old design is still as good as any by the new model."""
        return bool(np.all(self.delivered <= (1.0 + _SAME_MOMENTS) * self.reached))


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
    method : str
        Method of the optimisation, in words.
    """

    choices: tuple[Choice, ...]
    obstacle: str = ""
    fronts: tuple[Values, ...] = ()
    method: str = ""

    @property
    def sentence(self) -> str:
        """How the optimum moved, in words, for the balanced preference."""
        if not self.choices:
            return self.obstacle
        choice = next(choice for choice in self.choices if choice.preference == "balanced")
        promised, delivered, reached = (
            f"mean {mean:.3g} and standard deviation {std:.3g} arcsec"
            for mean, std in (choice.promised, choice.delivered, choice.reached)
        )
        judged = (
            f"The old model predicted {promised} for its balanced design; the revised model "
            f"predicts {delivered}"
        )
        if choice.stays:
            return f"{judged}, as good as its best. The balanced design stays where it was."
        return f"{judged}. The new balanced design reaches {reached}."
