"""The verdict, with or without the records in which a clearance would rattle.

With a clearance a drive whose load does not hold the tooth flanks together has no steady state that
could be fitted: such records are predicted without the clearance. Among the data they deny every
set that has one, and speak for a soft wind-up, which follows the motion within the clearance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pymoo_hdte.discrepancy.drive.evidence import Data
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Fit, fit
from pymoo_hdte.discrepancy.engine.verdict import EXPLAINED, Verdict, judge
from pymoo_hdte.effects.effect import effect_named


def judged(
    data: Data, candidates_of: Callable[[Data, Fit], list[Candidate]]
) -> tuple[Data, list[Candidate], Verdict]:
    """Return the verdict on some data, with the data and the candidates that it is of.

    Records in which a clearance would rattle are left out where sweeps speak for one. So they are
    where sweeps speak for something else, which leaves more than noise, if without these records
    a clearance is named beside it and nothing but noise is left.

    Parameters
    ----------
    data : Data
    candidates_of : callable
        From data and the fit of their base to the effects that may be missing.
    """
    base = fit(data)
    candidates = candidates_of(data, base)
    leading = leading_sweep_effect(data, base, candidates)
    loaded = data if leading is None else data.loaded
    if loaded is data:
        return data, candidates, judge(data, base, candidates)
    if leading is not None and effect_named(leading).rattles:
        return _judged_on(loaded, candidates_of)
    verdict = judge(data, base, candidates)
    if verdict.chosen is None or verdict.leaves_more_than_noise:
        again = _judged_on(loaded, candidates_of)
        if _explains_by_a_clearance(again[-1]):
            return again
    return data, candidates, verdict


def _judged_on(
    data: Data, candidates_of: Callable[[Data, Fit], list[Candidate]]
) -> tuple[Data, list[Candidate], Verdict]:
    """Return data, candidates and the verdict on all these data."""
    base = fit(data)
    candidates = candidates_of(data, base)
    return data, candidates, judge(data, base, candidates)


def _explains_by_a_clearance(verdict: Verdict) -> bool:
    """Tell whether a verdict names or counts among a class a clearance, and leaves only noise."""
    if verdict.status not in EXPLAINED or verdict.leaves_more_than_noise:
        return False
    named = [one for one in (verdict.chosen, *verdict.equivalent) if one is not None]
    listed = {each.name for one in named for each in one.effects if each.listed}
    return any(effect_named(name).rattles for name in listed)


def leading_sweep_effect(data: Data, fitted: Fit, candidates: Sequence[Candidate]) -> str | None:
    """Return the name of the effect that the torsion sweeps alone indicate, if any.

    At rest a clearance is a jump at zero torque that no other law imitates, whereas a running
    record with rattling has no steady state that would identify it.
    """
    base = fitted.values[None, : len(data.base)]
    before = data.torsion_residuals(base, fitted.effects)[0]
    stiffness, offset = np.eye(len(data.base))[[0, -1]]
    steps = np.array([0.01 * base[0, 0], data.campaign.torque_scale * 0.05])
    moved = np.vstack([base + steps[0] * stiffness, base + steps[1] * offset])
    imitated = (data.torsion_residuals(moved, fitted.effects) - before).T
    orthonormal, _ = np.linalg.qr(imitated)
    residual = before - orthonormal @ (orthonormal.T @ before)
    least, found = data.rules.sweep_gain, list[tuple[float, str]]()
    for candidate in candidates:
        for start in candidate.starts:
            effects = (*fitted.effects, *candidate.build(start))
            change = np.nan_to_num(data.torsion_residuals(base, effects)[0] - before)
            change -= orthonormal @ (orthonormal.T @ change)
            size = float(change @ change)
            along = float(-change @ residual)
            if size > least and along > 0.0:
                found.append((along**2 / size, candidate.name))
    reduction, name = max(found, default=(0.0, ""))
    return name if reduction > least else None
