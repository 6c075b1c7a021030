"""Base parameters that want to leave their tolerances together."""

from __future__ import annotations

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, fit


def freed_together(data: Evidence, bound: Fit) -> tuple[tuple[Candidate, ...], Fit]:
    """Return the parameters that a fit leaves at a bound, free, and its set fitted with them.

    Freeing some may carry others to their bounds, which are freed in a further round.
    """
    freed: tuple[Candidate, ...] = ()
    found = bound
    for _ in range(data.rules.most_freed_rounds):
        names = {one.frees for one in freed}
        free = data.out_of_tolerance(found.at_bounds, together=True)
        more = [one for one in free if one.frees not in names]
        if not more:
            break
        freed = (*freed, *more)
        found = fit(data, (*bound.candidates, *freed), found.values)
    return freed, found
