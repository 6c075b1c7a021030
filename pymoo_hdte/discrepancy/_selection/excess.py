"""Chi-square beyond degrees of freedom, by record and part, and that of records kept out of fits.

Each part of the data is assessed separately. The misfit of a sweep at rest may be a thousand times
that of the transmission error, and an effect that explains only one of them must not count as the
cause of both.
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
        """Excess of each part, summed over its records, shape (parts,)."""
        return np.asarray(self.chi_square.sum(axis=0))

    def significant(self, rules: Rules) -> NDArray[np.bool_]:
        """Return for which parts, shape (parts,), the excess is significant."""
        return np.asarray(self.of_parts > self._most_noise(rules))

    def _most_noise(self, rules: Rules) -> NDArray[np.float64]:
        noise = np.sqrt(2.0 * self.degrees_of_freedom.sum(axis=0))
        return np.asarray(rules.false_alarm_deviations * noise)


@dataclass(frozen=True)
class HeldOutTest:
    """Test of a change of the model on records that were kept out of the fit.

    Attributes
    ----------
    before, after : float
        Chi-square of these records without and with the change.
    change : float
        Squared norm of the change of their whitened prediction. A true change removes this much of
        chi-square on average, with a standard deviation of twice its root.
    """

    before: float
    after: float
    change: float

    def counts(self, rules: Rules) -> bool:
        """Tell whether the change is large enough in these records to be seen."""
        return self.change >= rules.vote_change

    def denies(self, rules: Rules, misfit: float) -> bool:
        """Tell whether the change does not reduce their error as a true change would.

        A true change may by chance remove two standard deviations less, in units of the fit's
        ``misfit``, and in another form of its law only a share. For a change too small to be seen,
        tell whether the error grows by more than chance. A change with which the prediction
        diverges is denied.
        """
        removed = self.before - self.after
        if not np.isfinite(self.change):
            return removed <= 0.0
        by_chance = self.change - (rules.vote_change * self.change * misfit) ** 0.5
        if not self.counts(rules):
            return removed < min(by_chance, 0.0)
        return removed <= max(min(by_chance, rules.vote_share * self.change), 0.0)
