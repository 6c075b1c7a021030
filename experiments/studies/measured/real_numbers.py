"""Numbers of a study of a measured rig: held-out errors, and distances from known values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.studies.measured.known_answers import KnownRig
from experiments.studies.measured.other_tools import terms_of
from experiments.studies.measured.rigs import Study, fitted_values
from pymoo_hdte.discrepancy._report.mechanism_values import effects
from pymoo_hdte.discrepancy._report.torsion import torsion_document
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.mechanism.motion import SmoothedMotion
from pymoo_hdte.mechanism.port_motion import law_force
from pymoo_hdte.units import ARCSEC

Values = NDArray[np.float64]

LOST = -10.0
"""R2 below which a prediction is lost."""


def named(one: Study) -> list[dict[str, Any]]:
    """Return what a verdict names with its values, ripple beyond the band included."""
    beyond = (effect for ripple in one.finding.ripples.lines for effect in ripple.as_dicts())
    twist = torsion_document(one.joint)["effects"] if one.joint else []
    return [*effects(one.finding), *beyond, *twist]


def torsion_errors(one: Study) -> list[str]:
    """Return the errors of the held-out torsion before and after, arcseconds, where measured."""
    gaps = one.joint.gaps if one.joint else ()
    sizes = ([getattr(gap, side) for gap in gaps] for side in ("before", "after"))
    return [f"{np.sqrt(np.mean(np.square(each))) / ARCSEC:.4g}" if each else "" for each in sizes]


def share_in_words(value: float | None) -> str:
    """Return an R2 as a text; far below zero, digits mean nothing."""
    return "" if value is None else f"{value:.5f}" if value > LOST else f"below {LOST:g}"


def determinations(one: Study) -> list[str]:
    """Return R2 of force and simulated position by the accepted model, held out."""
    finding, gaps = one.finding, [gap for gap in one.gaps if gap.kind == "balance"]
    (name,) = finding.mechanism.coordinates
    gaps = [gap for gap in gaps if gap.quantity == name]
    if not gaps:
        return ["", ""]
    power = terms_of(finding, "held_out", ()).power
    left = float(np.mean([gap.after**2 for gap in gaps]))
    return [f"{1.0 - left / power:.5f}", f"{explained(one)[1]:.5f}"]


def explained(one: Study) -> tuple[float, float]:
    """Return R2 of all simulated positions, before and after."""
    gaps = [gap for gap in one.gaps if gap.extent is not None]
    if not gaps:
        return np.nan, np.nan
    power = np.concatenate([gap.measured - gap.measured.mean() for gap in gaps])
    left = (
        np.concatenate([gap.measured - getattr(gap, side) for gap in gaps])
        for side in ("predicted_before", "predicted_after")
    )
    before, after = (1.0 - float(np.mean(one**2) / np.mean(power**2)) for one in left)
    return before, after


def pooled(one: Study, kind: str, side: int) -> float | None:
    """Return the root mean square over the held-out records, of the first coordinate."""
    name = one.finding.mechanism.coordinates[0]
    sizes = [
        (gap.before, gap.after)[side]
        for gap in one.gaps
        if (gap.kind, gap.quantity) == (kind, name)
    ]
    return float(np.sqrt(np.mean(np.square(sizes)))) if sizes else None


def farthest(rig: KnownRig, one: Study) -> float | None:
    """Return the largest deviation from a known value or from the curve of friction, in %."""
    found = fitted_values(one)
    off = [
        abs(found[name.replace("_", " ")]["value"] / value - 1.0)
        for name, value in rig.values
        if name.replace("_", " ") in found
    ]
    if rig.friction is not None:
        speed = _speeds(one)
        off.append(float(np.max(np.abs(_friction(one, speed) / rig.friction.at(speed) - 1.0))))
    return 100.0 * max(off) if off else None


def _speeds(one: Study) -> Values:
    """Return speeds at which the records move, between the 10th and the 90th of a hundred."""
    spectra = one.finding.data.spectra
    (name,) = one.finding.mechanism.coordinates
    speed = np.concatenate([np.abs(balance.motions[name].speed) for balance in spectra])
    slowest, fastest = np.quantile(speed, (0.1, 0.9)).tolist()
    return np.linspace(slowest, fastest, 30)


def _friction(one: Study, speed: Values) -> Values:
    """Return the friction of the accepted model, odd part, at speeds (n,)."""
    finding = one.finding
    damping = sum(
        value
        for parameter, value in zip(
            finding.accepted.parameters, finding.accepted.values, strict=True
        )
        if parameter.name.startswith("damping of ")
    )
    force = damping * speed
    for effect in finding.accepted.effects:
        if effect.law.states or effect.law.orders:
            continue
        there, back = (
            law_force(effect.law, SmoothedMotion(0.0 * speed, way * speed, 0.0 * speed), 0.0)
            for way in (1.0, -1.0)
        )
        force = force + 0.5 * (there - back)
    return np.asarray(force)


def nearest_order(rig: KnownRig, one: Study) -> float | None:
    """Return the order of a named ripple, that nearest to the known one."""
    if rig.order is None:
        return None
    orders = [
        effect["parameters"]["order"]["value"]
        for effect in named(one)
        if "order" in effect["parameters"]
    ]
    orders += [order for each in one.finding.accepted.effects if (order := place_of(each)[2])]
    known = rig.order
    return min(orders, key=lambda order: abs(order - known), default=None)
