"""What is known of the records of a mechanism once their verdict is given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.ripple import NO_RIPPLES, Ripples
from pymoo_hdte.discrepancy._evidence.force_balances.delay import Delay, delays
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._evidence.force_balances.gain import GainRange, gains
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import (
    root_mean_square,
    share_removed,
)
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import SimulatedRecord
from pymoo_hdte.mechanism import LawAt, Mechanism, Record


@dataclass(frozen=True, eq=False)
class MechanismFinding:
    """The result of the analysis of measured records.

    Attributes
    ----------
    mechanism : Mechanism
        Without the effects that were to be found.
    records : tuple of Record
        All that were given, training and held out; interpolated where they were sampled less than
        ten times in a period of the cutoff.
    cutoff : float
        Hz, up to which the motion is known.
    data : MeasuredData
        Training records; their noise is the unexplained residual.
    verdict : Verdict
        What is missing: its ``status`` is ``"adequate"``, ``"named"``, ``"class"``,
        ``"parameter"``, ``"partial"`` or ``"unlisted"``.
    ripples : Ripples
        What varies with the position beyond the cutoff. With one, a verdict is never
        ``"adequate"``, but ``"named"`` without a chosen hypothesis.
    simulated : tuple of SimulatedRecord
        The held-out records by the base and by what the training records named.
    judged_by_balance : frozenset of str
        Coordinates of which the force balance is validated, since their mass is too small for a
        simulation: see `without_mass`.
    """

    mechanism: Mechanism
    records: tuple[Record, ...]
    cutoff: float
    data: MeasuredData
    verdict: Verdict
    ripples: Ripples = NO_RIPPLES
    simulated: tuple[SimulatedRecord, ...] = ()
    judged_by_balance: frozenset[str] = frozenset()

    @cached_property
    def delays(self) -> tuple[Delay, ...]:
        """Delays of inputs in the records, with those that the mechanism states taken out."""
        return tuple(delays(self.data, tuple(self.accepted.effects)))

    @cached_property
    def gains(self) -> tuple[GainRange, ...]:
        """What the stated mechanism tells of the gains of inputs that are stated exactly."""
        return tuple(gains(self.data, tuple(self.accepted.effects), self.delays))

    @property
    def accepted(self) -> Fit:
        """The fit with the effects that the verdict names, or that of the base."""
        return self.verdict.accepted

    @property
    def believed(self) -> tuple[LawAt, ...]:
        """Effects that the mechanism was known to have."""
        return tuple(law for law in self.data.known if law not in self.ripples.laws)

    @property
    def sensors(self) -> MeasuredData:
        """The data with the noise of their sensors only."""
        return replace(self.data, deviation=tuple(balance.noise for balance in self.data.spectra))

    @property
    def share_removed(self) -> float:
        """Share of the power of the misfit beyond the sensors' noise that the effects remove.

        Dimensionless, 0 to 1.
        """
        return share_removed(self.sensors, self.data, self.verdict.base, self.accepted)

    @property
    def sensor_noise(self) -> NDArray[np.float64]:
        """Root mean square of the sensors' noise in each balance, shape (n_balances,), N or N.m."""
        return root_mean_square(self.sensors, np.ones_like(self.verdict.base.residuals))

    @property
    def base_misfit(self) -> NDArray[np.float64]:
        """Root mean square of the residual of the base in each balance.

        Shape (n_balances,), N or N.m.
        """
        return root_mean_square(self.data, self.verdict.base.residuals)

    @property
    def unexplained(self) -> NDArray[np.float64]:
        """Root mean square of the residual of the accepted model in each balance.

        Shape (n_balances,), N or N.m.
        """
        return root_mean_square(self.data, self.accepted.residuals)
