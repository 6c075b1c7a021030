"""Chi-square beyond degrees of freedom, by record and part, and that of records kept out of fits.

In a fit each part of the data is judged separately: the misfit of a sweep at rest may be a thousand
times that of the transmission error, and an effect that explains only the one must not count as the
cause of the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.rules import Rules


@dataclass(frozen=True, eq=False)
class Excess:
    """Chi-square beyond the degrees of freedom, in each part of the data.

    Attributes
    ----------
    chi_square : ndarray, shape (rows, parts)
        Excess by record and part. Data without a running record, such as sweeps, have a row of
        their own.
    degrees_of_freedom : ndarray, shape (rows, parts)
        Degrees of freedom.
    """

    chi_square: NDArray[np.float64]
    degrees_of_freedom: NDArray[np.float64]

    @property
    def of_parts(self) -> NDArray[np.float64]:
        """Of each part, shape (parts,)."""
        return np.asarray(self.chi_square.sum(axis=0))

    def significant(self, rules: Rules) -> NDArray[np.bool_]:
        """Return for which parts, shape (parts,), the excess is significant."""
        return np.asarray(self.of_parts > self._most_noise(rules))

    def is_noise(self, rules: Rules) -> bool:
        """Tell whether each part has as much as noise gives, neither more nor less.

        Less does not show in a part with fewer than some thirty degrees of freedom.
        """
        return bool(np.all(np.abs(self.of_parts) <= self._most_noise(rules)))

    def _most_noise(self, rules: Rules) -> NDArray[np.float64]:
        noise = np.sqrt(2.0 * self.degrees_of_freedom.sum(axis=0))
        return np.asarray(rules.false_alarm_deviations * noise)

    @property
    def worst(self) -> NDArray[np.int_]:
        """Row of each part's largest excess, shape (parts,); -1 where a part has only one row."""
        several = np.count_nonzero(self.degrees_of_freedom, axis=0) > 1
        return np.where(several, np.argmax(self.chi_square, axis=0), -1)

    def without(self, rows: NDArray[np.int_]) -> Excess:
        """Return it with one row left out of each part; -1 leaves a part as it is."""
        chi_square, degrees_of_freedom = self.chi_square.copy(), self.degrees_of_freedom.copy()
        parts = np.flatnonzero(rows >= 0)
        chi_square[rows[parts], parts] = degrees_of_freedom[rows[parts], parts] = 0.0
        return Excess(chi_square, degrees_of_freedom)


@dataclass(frozen=True)
class HeldOutTest:
    """What records kept out of a fit say of a change of the model.

    Attributes
    ----------
    before, after : float
        Their chi-square without and with it.
    change : float
        Square of the change of their whitened prediction: what a true change removes of chi-square,
        with a standard deviation of twice its root.
    """

    before: float
    after: float
    change: float

    def counts(self, rules: Rules) -> bool:
        """Tell whether the change is large enough in these records to be seen."""
        return self.change >= rules.vote_change

    def denies(self, rules: Rules, misfit: float) -> bool:
        """Tell whether the change removes nothing of their error, or less than a true one would.

        Of a change that is too small to be seen, whether their error grows by more than chance.

        By chance a true one removes two standard deviations less, in units of what a fit's
        residuals are beside their noise (``misfit``), and in another form of its law not all of it:
        what stands for something else may remove next to nothing. A prediction that diverges, so
        that its change has no size, is denied where it diverges with the change.
        """
        removed = self.before - self.after
        if not np.isfinite(self.change):
            return removed <= 0.0
        by_chance = self.change - (rules.vote_change * self.change * misfit) ** 0.5
        if not self.counts(rules):
            return removed < min(by_chance, 0.0)
        return removed <= max(min(by_chance, rules.vote_share * self.change), 0.0)
