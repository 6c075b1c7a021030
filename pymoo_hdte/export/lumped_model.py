"""What a rigid-body engine holds of a mechanism: elements at ports, and what they leave out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.effects.portable import Lumped
from pymoo_hdte.export.exported import acting, common_notes, left_out, stated, turns
from pymoo_hdte.mechanism import Port

GRAVITY = 9.81
"""m/s2, downwards along z in both formats."""


@dataclass(frozen=True)
class LumpedModel:
    """Elements of a mechanism.

    Attributes
    ----------
    joints : mapping of str to Lumped
        Of ports that move as one coordinate, by its name, for the motion of the coordinate.
    couplings : mapping of str to (mapping of str to float, Lumped)
        Of ports that move with several: shares, and elements for the motion of the port.
    notes : tuple of str
    """

    joints: Mapping[str, Lumped]
    couplings: Mapping[str, tuple[Mapping[str, float], Lumped]]
    notes: tuple[str, ...]


def lumped_model(model: MechanismModel) -> LumpedModel:
    """Return the elements of a model, and notes on whatever is not in them.

    Raises
    ------
    InvalidInput
        For a port that follows a measured angle.
    """
    mechanism, notes = model.mechanism, list(common_notes(model))
    if mechanism.angles is None:
        notes.append("the model does not tell which coordinates turn: all are taken as angles")
    joints = {name: Lumped() for name in mechanism.coordinates}
    couplings = {}
    for port in mechanism.ports:
        if port.followed:
            raise InvalidInput(f"{port.name}.followed", dict(port.followed), "empty")
        if port.read:
            continue
        elements, missing = _of_port(model, port)
        notes += missing
        shares = {name: share for name, share in port.motion.items() if share}
        if len(shares) > 1:
            if elements.weight:
                notes.append(f"the weight at {port.name} hangs at no single shaft: left out")
            couplings[port.name] = shares, replace(elements, weight=0.0)
            continue
        ((name, share),) = shares.items()
        weight = 0j
        if elements.weight:
            if abs(share) == 1.0 and turns(mechanism, name):
                # Of the motion -q the cosine has the conjugate phasor, and the force turns too.
                weight = elements.weight if share > 0.0 else -elements.weight.conjugate()
            else:
                notes.append(f"the weight at {port.name} hangs at no shaft of its own: left out")
        joints[name] += Lumped(
            elements.stiffness * share**2,
            elements.damping * share**2,
            elements.level * abs(share),
            elements.force * share,
            weight,
        )
    return LumpedModel(joints, couplings, tuple(notes))


def _of_port(model: MechanismModel, port: Port) -> tuple[Lumped, list[str]]:
    found, notes = Lumped(port.stiffness.value, port.damping.value), []
    if port.error:
        notes.append(f"the kinematic error of {port.name}: left out")
    for effect in acting(model):
        if effect.port != port.name:
            continue
        elements = stated(effect.law, "lumped")
        if elements is None:
            notes.append(left_out(effect))
            continue
        if elements.missing:
            notes.append(f"{effect.name} at {port.name}: {elements.missing}")
        found += elements
    for name in ("stiffness", "damping", "level"):
        if (value := getattr(found, name)) < 0.0:
            word = "dry friction" if name == "level" else name
            notes.append(f"{word} of {port.name} is negative ({value:.4g}): left out")
            found += Lumped(**{name: -value})
    return found, notes


def pendulum(weight: complex, inertia: float) -> tuple[float, complex]:
    """Return mass and place of a body that weighs on a shaft like this.

    Only mass times distance shows in the motion. The distance is chosen so that the body makes half
    of the inertia.

    Parameters
    ----------
    weight : complex
        Of `Lumped`, N.m.
    inertia : float
        Of the shaft, kg.m2.

    Returns
    -------
    (float, complex)
        kg; and m, in the plane of the motion at angle 0, the imaginary part upwards.
    """
    distance = GRAVITY * inertia / (2.0 * abs(weight))
    mass = abs(weight) / (GRAVITY * distance)
    return mass, distance * weight / abs(weight)
