"""Signs that tooth flanks part: records that do not repeat with the input, and torsion sweeps."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.effects.effect import known_effects

SUMMED = 8
"""Most lines whose sums and differences a steady motion is taken to have."""
LEAKED = 0.01
"""Share of a record's strongest line, in power, up to which a line may be what that one leaks."""
SAME_ORDER = 0.6
"""Cycles of an output turn up to which a line is of a steady order, which may lie between lines.

An order half-way between two lines shows in both.
"""


def is_heard(
    lines: Sequence[dict[float, float]],
    held: NDArray[np.bool_],
    orders: Sequence[float],
    ratio: float,
    rules: Rules = RULES,
) -> bool:
    """Tell whether records show by themselves that tooth flanks part.

    Flanks that part and meet again do not repeat with the input. Records whose load does not hold
    them together then have many lines that no steady motion has: a curved law makes only sums and
    differences of the lines that there are, however many of them.

    Parameters
    ----------
    lines : sequence of dict
        Of each record: see `features.unexpected_lines`.
    held : ndarray, shape (r,)
        Which records have a load that holds the flanks together: see `evidence.flanks_held`.
    orders : sequence of float
        Of the error, cycles per input turn. Lines of records with load count as well.
    ratio : float
    rules : Rules
    """
    with_load = [spectrum for spectrum, is_held in zip(lines, held, strict=True) if is_held]
    without = [spectrum for spectrum, is_held in zip(lines, held, strict=True) if not is_held]
    loaded = {order for spectrum in with_load for order in spectrum}
    if sum(len(spectrum) >= rules.rattling_trace for spectrum in without) < rules.fewest_rattling:
        return False
    of_error, steady = (
        _sums_of(known_orders, rules.highest_order, ratio)
        for known_orders in (orders, {*orders, *loaded})
    )
    irregular = np.array([_strong_beyond(spectrum, steady, ratio) for spectrum in without])
    rough = [_strong_beyond(spectrum, of_error, ratio) for spectrum in with_load]
    several = np.sum(irregular >= rules.rattling_trace) >= rules.fewest_rattling
    return bool(several and max(rough, default=0) < rules.rattling_lines <= irregular.max())


def _strong_beyond(lines: dict[float, float], steady: NDArray[np.float64], ratio: float) -> int:
    """Return the number of lines at no steady order; those that a strong one leaks are left out."""
    least = LEAKED * max(lines.values(), default=0.0)
    strong = np.array([order for order, power in lines.items() if power >= least])
    away = np.abs(np.subtract.outer(strong, steady)).min(axis=1)
    return int(np.sum(away > SAME_ORDER / ratio))


def _sums_of(orders: Collection[float], highest: float, ratio: float) -> NDArray[np.float64]:
    """Return the sums and differences of up to `SUMMED` orders, up to the highest.

    To a hundredth of a cycle of an output turn, so that they are not too many.
    """
    signed = np.array([0.0, *orders, *(-order for order in orders)])
    sums = np.zeros(1)
    for _ in range(SUMMED):
        sums = np.abs(np.add.outer(sums, signed)).ravel()
        sums = np.unique((100.0 * ratio * sums[sums <= highest]).round()) / (100.0 * ratio)
    return sums


def with_clearance(data: Data) -> Data:
    """Return the data without records that rattle, in which a clearance is evident.

    The same data where too few records are left.
    """
    loaded = data.loaded
    return data if loaded is data else replace(loaded, evident=clearances())


def clearances() -> frozenset[str]:
    """Return the names of the effects with which parts may lose contact."""
    return frozenset(effect.name for effect in known_effects() if effect.rattles)


def leading_sweep_effect(data: Data, fitted: Fit, candidates: Sequence[Candidate]) -> str | None:
    """Return the name of the effect that the torsion sweeps alone indicate, if any.

    At rest a clearance is a jump at zero torque that no other law imitates, whereas a running
    record with rattling has no steady state that would identify it.
    """
    base = fitted.values[None, : len(data.base)]
    before = data.torsion_residuals(base, fitted.effects)[0]
    layout = Layout(data.base)
    places = [layout.index(name) for name in ("stiffness", "output_torque_zero")]
    stiffness, offset = np.eye(len(data.base))[places]
    steps = np.array([0.01 * base[0, 0], data.campaign.torque_scale * 0.05])
    moved = np.vstack([base + steps[0] * stiffness, base + steps[1] * offset])
    imitated = (data.torsion_residuals(moved, fitted.effects) - before).T
    orthonormal, _ = np.linalg.qr(imitated)
    residual = before - orthonormal @ (orthonormal.T @ before)
    least, gains = data.rules.sweep_gain, list[tuple[float, str]]()
    for candidate in candidates:
        for start in candidate.starts if not candidate.nuisance else ():
            effects = (*fitted.effects, *candidate.build(start))
            change = np.nan_to_num(data.torsion_residuals(base, effects)[0] - before)
            change -= orthonormal @ (orthonormal.T @ change)
            size = float(change @ change)
            along = float(-change @ residual)
            if size > least and along > 0.0:
                gains.append((along**2 / size, candidate.name))
    reduction, name = max(gains, default=(0.0, ""))
    return name if reduction > least else None
