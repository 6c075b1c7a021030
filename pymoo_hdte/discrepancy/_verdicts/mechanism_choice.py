"""What a mechanism's records say is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pymoo_hdte._one_thread import ONE_THREAD
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._evidence.force_balances.law_errors import BalanceErrors
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.decided import verdict_of
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.growth import Growth
from pymoo_hdte.discrepancy._selection.verdict import Verdict


@ONE_THREAD
def judged(
    sensors: MeasuredData,
    data: MeasuredData,
    candidates: Sequence[Candidate],
    best: Fit | None = None,
) -> Verdict:
    """Return the verdict in units of the residual, if it also holds against the sensors' noise.

    Parameters
    ----------
    sensors, data : MeasuredData
        With the noise of the sensors, and with the unexplained residual as noise.
    candidates : sequence of Candidate
    best : Fit, optional
        Of the least residuals: see `BalanceErrors`.
    """
    base = fit(data)
    growth = Growth(data, base, candidates, BalanceErrors(data, base, best))
    growth.grow()
    decision, sets = growth.decide()
    verdict = verdict_of(data, decision, sets, base)
    if verdict.chosen is None:
        left, noise = data.power(base.residuals), sensors.power(np.ones_like(base.residuals))
        quiet = np.all(left <= data.rules.noise_power_ratio * noise)
        return verdict if quiet else replace(verdict, certain=False)
    return verdict
