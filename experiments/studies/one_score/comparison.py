"""The decision of the score on sets that it grew itself, beside the verdict of the rules."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from pymoo_hdte._one_thread import ONE_THREAD
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._evidence.force_balances.law_errors import BalanceErrors
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._evidence.order_lines.law_errors import LawErrors
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.decision import Decision
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.growth import Growth, Weighed


@dataclass(frozen=True, eq=False)
class Comparison:
    """What the score says of some data.

    Attributes
    ----------
    decision : Decision
    sets : tuple of Weighed
        The likeliest first.
    seconds : float
        Of processor time, for all fits and scores.
    """

    decision: Decision
    sets: tuple[Weighed, ...]
    seconds: float


def with_held_out(data: Data) -> Data:
    """Return the data of a drive with the records kept out of fits.

    The likelihood of all records is that of those that were fitted, times the predictive density of
    the others with the same coefficients.
    """
    if (held_out := data.held_out) is None:
        return data
    records = (*data.features.records, *held_out.features.records)
    orders = data.features.orders.tolist()
    return replace(data, features=measure(data.campaign, records, orders, data.rules))


@ONE_THREAD
def compare(
    data: Any, base: Fit, candidates: Sequence[Candidate], best: Fit | None = None
) -> Comparison:
    """Return the score's decision on the effects that may be missing.

    Parameters
    ----------
    data : Data or MeasuredData
    base : Fit
        Of these data, without effects.
    candidates : sequence of Candidate
    best : Fit, optional
        Of the least residuals, of a mechanism: how coloured they are.
    """
    started = time.process_time()
    if isinstance(data, MeasuredData):
        errors: LawErrors | BalanceErrors = BalanceErrors(data, base, best)
    else:
        errors = LawErrors(data, base)
    growth = Growth(data, base, candidates, errors)
    growth.grow()
    decision, sets = growth.decide()
    return Comparison(decision, tuple(sets), time.process_time() - started)
