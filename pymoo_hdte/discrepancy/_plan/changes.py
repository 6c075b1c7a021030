"""The signatures of a drive's effects and of their rivals, from its equations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data, flanks_held
from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS
from pymoo_hdte.discrepancy._evidence.order_lines.objective import Objective
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import Scales, port_sizes
from pymoo_hdte.discrepancy._plan.limits import PlanLimits
from pymoo_hdte.discrepancy._plan.signatures import Signatures
from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.drive import DriveEffect
from pymoo_hdte.effects.effect import effect_named, place_of
from pymoo_hdte.effects.law import OUTPUT_SHAFT

Values = NDArray[np.float64]
Change = Callable[[Sequence[DriveEffect]], Values]

_STEP = 1e-3
"""Step of difference quotients, in units of a parameter's scale."""
_STRONGER = 5.0
"""Multiple of its typical strength at which a rival is linearised a second time."""


def signatures_of(data: Data, limits: PlanLimits, rated_torque: float) -> Signatures:
    """Return the signatures of effects for the tests behind data.

    Parameters
    ----------
    data : Data
        Data of imagined records: running ones, then sweeps.
    limits : PlanLimits
    rated_torque : float
        Scale of torques if all loads are zero, N.m.
    """
    objective = Objective(data, ())
    residuals, jacobian = objective.residuals(objective.start), objective.jacobian(objective.start)
    fitted = Fit((), data.base, objective.start, residuals, jacobian)
    change = data.response(fitted)
    by_port: dict[str, list[Candidate]] = {}
    for candidate in _candidates(data, limits, rated_torque):
        if candidate.listed:
            by_port.setdefault(_label(candidate.name, candidate.port), []).append(candidate)
    wanted = _wanted(limits, by_port)
    rivals = [
        (
            label,
            [
                (_by_test(data, form), sided)
                for candidate in candidates
                for form, sided in _forms(candidate, change)
            ],
        )
        for label, candidates in by_port.items()
    ]
    layout = Layout(data.base)
    widths = (layout.array("upper") - layout.array("lower")) / layout.array("scale")
    # Bounds count as a uniform distribution between them, as in `Fit.covariance`.
    known = 12.0 / widths**2 + (layout.array("scale") / layout.array("prior")) ** 2
    signatures = Signatures.of(
        list(wanted),
        _by_test(data, [change(parts) for parts in wanted.values()]),
        rivals,
        np.array(_by_test(data, list(jacobian.T))),
        known,
    )
    held = flanks_held(data.features, data.campaign.torque_scale, data.rules)
    labels = {*wanted, *by_port}
    return replace(
        signatures,
        held=np.append(held, np.ones(len(data.torsion), dtype=bool)),
        rattling=frozenset(label for label in labels if effect_named(label.split(":")[0]).rattles),
    )


def _label(name: str, port: str) -> str:
    return f"{name}:{port}"


def _candidates(data: Data, limits: PlanLimits, rated_torque: float) -> list[Candidate]:
    """Return candidates of the sizes that matter, with lines at the orders of stated effects."""
    believed, features = data.campaign.believed, data.features
    paths = [float(np.abs(sweep.path).max()) for sweep in data.torsion]
    torque = max([float(np.abs(features.conditions.output_torque).max()), *paths])
    torque = torque if limits.sweeps or any(limits.loads) else rated_torque
    motor = float(np.abs(features.values[:, MEANS.index(1)]).max())
    motor = max(motor, torque / believed.ratio)
    braking = features.conditions.output_torque * np.sign(features.conditions.input_speed)
    least = data.campaign.torque_scale * data.rules.least_held_load
    scales = Scales(
        speed=float(np.abs(features.conditions.input_speed).max()),
        torque=torque,
        motor_torque=motor,
        duration=limits.session,
        error=limits.share * torque / believed.stiffness,
        input_torque=limits.share * motor,
        output_torque=limits.share * torque,
        driven=bool(braking.max() > least and braking.min() < -least),
    )
    seen = stated_orders(limits.effects, believed.ratio)
    sizes = port_sizes(believed, features.orders.tolist(), seen, scales)
    return [
        candidate
        for candidate in drive_candidates(sizes, believed.effects)
        if not candidate.nuisance
    ]


def stated_orders(effects: Sequence[DriveEffect], ratio: float) -> list[float]:
    """Return the orders of effects in cycles per input turn."""
    orders = set()
    for effect in effects:
        _, port, order = place_of(effect)
        if order is not None:
            orders.add(order / (ratio if port in (*OUTPUT_SHAFT, "sensor") else 1.0))
    return sorted(orders)


def _wanted(
    limits: PlanLimits, by_port: dict[str, list[Candidate]]
) -> dict[str, tuple[DriveEffect, ...]]:
    """Return the effects to be found by label; stated effects with the same label act together."""
    if not limits.effects:
        return {
            label: candidates[0].build([parameter.start for parameter in candidates[0].parameters])
            for label, candidates in by_port.items()
        }
    effects: dict[str, tuple[DriveEffect, ...]] = {}
    for effect in limits.effects:
        name, port, _ = place_of(effect)
        label = _label(name, port)
        effects[label] = (*effects.get(label, ()), effect)
    return effects


def _forms(candidate: Candidate, change: Change) -> list[tuple[list[Values], bool]]:
    """Return the linearised forms of a candidate: changes, and whether the first is one-sided."""
    if candidate.linear:
        return [([change(candidate.build(start)) for start in candidate.starts], False)]
    one_sided = candidate.parameters[0].lower >= 0.0
    forms = []
    for start in (*candidate.starts, *_strongest(candidate)):
        here = change(candidate.build(start))
        changes = [here]
        for place, parameter in enumerate(candidate.parameters[1:], start=1):
            step = _STEP * parameter.scale
            step = -step if start[place] + step > parameter.upper else step
            moved = [value + step * (k == place) for k, value in enumerate(start)]
            changes.append((change(candidate.build(moved)) - here) / _STEP)
        forms.append((changes, one_sided))
    return forms


def _strongest(candidate: Candidate) -> list[tuple[float, ...]]:
    """Return the starts of a candidate with a larger strength, at which its form is another one.

    A wind-up as soft as its bound allows is nearly a play.
    """
    strongest = candidate.parameters[0].upper
    return [(min(_STRONGER * start[0], strongest), *start[1:]) for start in candidate.starts]


def _by_test(data: Data, rows: Sequence[Values]) -> list[Values]:
    """Return whitened changes by test, shape (n_tests, f) each, padded with zeros."""
    records, size = data.features.values.shape
    widest = max([size, *(len(sweep.angle) - 1 for sweep in data.torsion)])
    changes = []
    for row in rows:
        placed = np.zeros((records + len(data.torsion), widest))
        placed[:records, :size] = np.nan_to_num(row[: records * size]).reshape(records, size)
        start = records * size
        for k, points in enumerate(data.torsion):
            length = len(points.angle) - 1
            placed[records + k, :length] = np.nan_to_num(row[start : start + length])
            start += length
        changes.append(placed)
    return changes
