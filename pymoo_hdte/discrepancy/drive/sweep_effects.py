"""Early evidence: an effect that only the torsion sweeps show, and unexpected order lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy.campaign.believed import Rig
from pymoo_hdte.discrepancy.campaign.residual_spectrum import residual_spectrum
from pymoo_hdte.discrepancy.drive.evidence import Data
from pymoo_hdte.discrepancy.drive.features import Features
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Fit
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules


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


def unexpected_orders(
    features: Features, ratio: float, rig: Rig, rules: Rules = RULES
) -> list[float]:
    """Return orders beyond those of the features at which the residual exceeds the noise.

    The strongest first, summed over channels and records; fixed frequencies, whose order differs
    from record to record, do not add up and come last.
    """
    total: dict[float, float] = {}
    for record in features.records:
        orders, amplitudes = residual_spectrum(
            record, rig, ratio, features.orders, rules.highest_order
        )
        power = amplitudes**2
        threshold = np.log(power.size * len(features.records) / rules.unexpected_line_chance)
        for place in np.flatnonzero(power.max(axis=0) > threshold):
            key = round(float(orders[place]), 9)
            total[key] = total.get(key, 0.0) + float(power[:, place].sum())
    strongest: list[float] = []
    for order in sorted(total, key=lambda one: -total[one]):
        if all(abs(order - other) > 2.5 / ratio for other in strongest):
            strongest.append(order)
    return strongest[: rules.most_unexpected_lines]
