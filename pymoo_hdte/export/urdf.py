"""A model as a URDF file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree import ElementTree

from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.effects.portable import Lumped
from pymoo_hdte.export.exported import Exported, head_lines, turns
from pymoo_hdte.export.lumped_model import LumpedModel, lumped_model, pendulum
from pymoo_hdte.export.mujoco import xml_text
from pymoo_hdte.mechanism import Mechanism

_NOWHERE = "1e9"
"""Limits that URDF wants of a sliding joint, which no measurement has shown."""


def to_urdf(model: MechanismModel) -> Exported:
    """Return a mechanism as a URDF file: for each coordinate a joint to the base.

    Damping and dry friction are its ``dynamics``, the inertia is that of its link. URDF has no
    springs, no gains and nothing between two joints: the notes list them with their values.

    Parameters
    ----------
    model : MechanismModel
        For instance ``analysis.revised_model()``.

    Returns
    -------
    Exported
        Laws are left out or approximated as by `to_mujoco`.

    Raises
    ------
    InvalidInput
        For a port that follows a measured angle.

    Examples
    --------
    >>> from pymoo_hdte.discrepancy import MechanismModel
    >>> from pymoo_hdte.mechanism import BelievedValue, Mechanism, Port
    >>> bearing = Port("bearing", {"q": 1.0}, damping=BelievedValue(0.2))
    >>> arm = Mechanism({"q": BelievedValue(0.5)}, [bearing], angles=["q"])
    >>> '<dynamics damping="0.2" friction="0" />' in to_urdf(MechanismModel("Arm", arm)).text
    True
    """
    mechanism, lumped = model.mechanism, lumped_model(model)
    notes = [*lumped.notes, *_left_out(mechanism, lumped)]
    name = re.sub(r"\W+", "_", model.title).strip("_") or "mechanism"
    root = ElementTree.Element("robot", name=name)
    ElementTree.SubElement(root, "link", name="base")
    for coordinate, elements in lumped.joints.items():
        notes += _link(root, mechanism, coordinate, elements)
        kind = "continuous" if turns(mechanism, coordinate) else "prismatic"
        joint = ElementTree.SubElement(root, "joint", name=coordinate, type=kind)
        ElementTree.SubElement(joint, "parent", link="base")
        ElementTree.SubElement(joint, "child", link=f"{coordinate}_link")
        axis = "0 -1 0" if kind == "continuous" else "1 0 0"
        ElementTree.SubElement(joint, "axis", xyz=axis)
        friction = {"damping": f"{elements.damping:.12g}", "friction": f"{elements.level:.12g}"}
        ElementTree.SubElement(joint, "dynamics", friction)
        if kind == "prismatic":
            most = dict.fromkeys(("upper", "effort", "velocity"), _NOWHERE)
            ElementTree.SubElement(joint, "limit", {"lower": f"-{_NOWHERE}", **most})
            notes.append(f"limits of {coordinate} are not known: {_NOWHERE} stands for none")
    return Exported(xml_text(root, head_lines(model, tuple(notes))), tuple(notes))


def _left_out(mechanism: Mechanism, lumped: LumpedModel) -> Iterator[str]:
    for name, one in lumped.joints.items():
        if one.stiffness:
            yield f"the spring at {name}, {one.stiffness:.6g} SI: left out, as URDF has none"
        if one.force:
            yield f"the constant force at {name}, {one.force:.6g} SI: left out, as URDF has none"
    for name, (_, one) in lumped.couplings.items():
        yield (
            f"{name}, which moves with several joints (stiffness {one.stiffness:.6g}, damping "
            f"{one.damping:.6g}, dry friction {one.level:.6g} SI): left out, as URDF has none"
        )
    for driven in mechanism.inputs:
        acts = ", ".join(
            f"{share * driven.gain.value:.6g} at {name}" for name, share in driven.acts.items()
        )
        yield f"input {driven.name} has in URDF no gain, which is {acts} SI"


def _link(
    root: ElementTree.Element, mechanism: Mechanism, name: str, elements: Lumped
) -> Iterator[str]:
    """Write the link of a coordinate."""
    inertia = mechanism.inertias[name].value
    mass, place, spin = inertia, 0j, inertia
    if turns(mechanism, name):
        mass = 1.0
        if elements.weight:
            mass, place = pendulum(elements.weight, inertia)
            yield (
                f"gravity at {name} is a mass of {mass:.4g} kg, {abs(place):.4g} m off the axis: "
                "only their product is known, and the inertia holds with both together"
            )
        else:
            yield f"the mass of {name} is not known: 1 kg on its axis stands for it"
        spin = inertia - mass * abs(place) ** 2
    link = ElementTree.SubElement(root, "link", name=f"{name}_link")
    inertial = ElementTree.SubElement(link, "inertial")
    where = f"{place.real:.12g} 0 {place.imag:.12g}"
    ElementTree.SubElement(inertial, "origin", xyz=where)
    ElementTree.SubElement(inertial, "mass", value=f"{mass:.12g}")
    same = dict.fromkeys(("ixx", "iyy", "izz"), f"{spin:.12g}")
    ElementTree.SubElement(inertial, "inertia", same | {"ixy": "0", "ixz": "0", "iyz": "0"})
