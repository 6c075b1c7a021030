"""A model as an MJCF file of MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree import ElementTree

from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.effects.portable import Lumped
from pymoo_hdte.export.exported import Exported, head_lines, turns
from pymoo_hdte.export.lumped_model import GRAVITY, LumpedModel, lumped_model, pendulum
from pymoo_hdte.mechanism import Input, Mechanism

_LONGEST_STEP = 1e-3
"""s. Of ours; a model with faster parts has a shorter one."""
_STEPS_IN_DECAY = 20
"""Steps in the time in which the fastest part decays, or turns by a radian."""
_OF_BODY = 1e-6
"""Share of a shaft's inertia that its body has where it weighs nothing; MuJoCo wants some."""
# As hard as MuJoCo allows: a joint at rest creeps by its dry friction's give.
_DRY = {"solreffriction": "{:g} 1", "solimpfriction": "0.99 0.999 0.001 0.5 2"}


def to_mujoco(model: MechanismModel) -> Exported:
    """Return a mechanism as an MJCF file of MuJoCo.

    Each coordinate is a joint with the name, its inertia as ``armature``; springs, dampers and dry
    friction are its ``stiffness``, ``damping`` and ``frictionloss``, between coordinates those of a
    fixed tendon; gravity is a mass; each input is an actuator whose ``gear`` is its gain, so that
    its control is the measured signal. A sensor ``NAME_pos`` reads each joint.

    Parameters
    ----------
    model : MechanismModel
        For instance ``analysis.revised_model()``.

    Returns
    -------
    Exported
        Its notes tell which laws are left out or approximated: friction that falls with speed keeps
        its level at speed, one that is curved over speed is a straight line, hysteresis is dry
        friction; whatever depends on position or load is left out.

    Raises
    ------
    InvalidInput
        For a port that follows a measured angle.

    Examples
    --------
    >>> from pymoo_hdte.discrepancy import MechanismModel
    >>> from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism
    >>> arm = Mechanism({"q": BelievedValue(0.5)}, [], [Input("torque", {"q": 1.0})], angles=["q"])
    >>> exported = to_mujoco(MechanismModel("An arm", arm))
    >>> '<motor name="torque" joint="q" gear="1" />' in exported.text, exported.notes
    (True, ())
    """
    mechanism, lumped = model.mechanism, lumped_model(model)
    notes = list(lumped.notes)
    root = ElementTree.Element("mujoco", model=" ".join(model.title.split()))
    ElementTree.SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    between = [elements for _, elements in lumped.couplings.values()]
    step = _step(mechanism, [*lumped.joints.values(), *between])
    weighs = any(one.weight for one in lumped.joints.values())
    option = ElementTree.SubElement(root, "option", integrator="implicitfast")
    option.attrib |= {
        "timestep": f"{step:g}",
        "gravity": f"0 0 {-GRAVITY:g}" if weighs else "0 0 0",
    }
    ElementTree.SubElement(option, "flag", contact="disable")
    world = ElementTree.SubElement(root, "worldbody")
    for name, elements in lumped.joints.items():
        body = ElementTree.SubElement(world, "body", name=f"{name}_body")
        joint = ElementTree.SubElement(body, "joint", name=name)
        inertia = mechanism.inertias[name].value
        if turns(mechanism, name):
            mass, place, own = 1.0, 0j, 0.0
            if elements.weight:
                mass, place = pendulum(elements.weight, inertia)
                own = mass * abs(place) ** 2
                notes.append(
                    f"gravity at {name} is a mass of {mass:.4g} kg, {abs(place):.4g} m off the "
                    "axis: only their product is known, and the inertia holds with both together"
                )
            rotor = _OF_BODY * inertia
            joint.attrib |= {"type": "hinge", "axis": "0 -1 0"}
            joint.set("armature", _number(inertia - own - rotor))
            spin = " ".join([_number(rotor)] * 3)
        else:
            mass, place = inertia, 0j
            joint.attrib |= {"type": "slide", "axis": "1 0 0"}
            spin = " ".join([_number(inertia)] * 3)
        joint.attrib |= _attributes(elements, step)
        where = f"{_number(place.real)} 0 {_number(place.imag)}"
        ElementTree.SubElement(body, "inertial", pos=where, mass=_number(mass), diaginertia=spin)
    _tendons(root, mechanism, lumped.couplings, step)
    notes += _actuators(root, mechanism, lumped)
    sensors = ElementTree.SubElement(root, "sensor")
    for name in mechanism.coordinates:
        ElementTree.SubElement(sensors, "jointpos", name=f"{name}_pos", joint=name)
    return Exported(xml_text(root, head_lines(model, tuple(notes))), tuple(notes))


def xml_text(root: ElementTree.Element, head: list[str]) -> str:
    """Return a document with a first comment."""
    # A comment of XML must not hold two hyphens, nor end with one.
    words = "\n".join(head).replace("--", "- -")
    root.insert(0, ElementTree.Comment(f"\n{words}\n"))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _number(value: float) -> str:
    return f"{value:.12g}"


def _attributes(elements: Lumped, step: float) -> dict[str, str]:
    """Return what a joint or a tendon has of them."""
    found = {
        "stiffness": elements.stiffness,
        "damping": elements.damping,
        "frictionloss": elements.level,
    }
    text = {name: _number(value) for name, value in found.items() if value}
    if elements.level:
        # MuJoCo takes no time constant below two steps.
        text |= {name: word.format(2.0 * step) for name, word in _DRY.items()}
    return text


def _step(mechanism: Mechanism, elements: list[Lumped]) -> float:
    """Return a time step, s, that resolves the fastest part."""
    lightest = min(one.value for one in mechanism.inertias.values())
    stiffness = sum(one.stiffness for one in elements)
    damping = sum(one.damping for one in elements)
    fastest = max(damping / lightest, math.sqrt(stiffness / lightest), 1e-9)
    wanted = min(_LONGEST_STEP, 1.0 / (_STEPS_IN_DECAY * fastest))
    return float(f"{wanted:.1g}")


def _tendons(
    root: ElementTree.Element,
    mechanism: Mechanism,
    couplings: Mapping[str, tuple[Mapping[str, float], Lumped]],
    step: float,
) -> None:
    """Write springs between coordinates, and what inputs act on if that is several."""
    shared = {
        f"{one.name}_acts": one.acts
        for one in mechanism.inputs
        if sum(map(bool, one.acts.values())) > 1
    }
    if not (couplings or shared):
        return
    tendons = ElementTree.SubElement(root, "tendon")
    for name, shares, elements in (
        *((name, *coupling) for name, coupling in couplings.items()),
        *((name, shares, Lumped()) for name, shares in shared.items()),
    ):
        fixed = ElementTree.SubElement(tendons, "fixed", name=name)
        if elements.stiffness:
            fixed.set("springlength", "0")
        fixed.attrib |= _attributes(elements, step)
        for joint, share in shares.items():
            if share:
                ElementTree.SubElement(fixed, "joint", joint=joint, coef=_number(share))


def _acts_on(one: Input) -> tuple[dict[str, str], float]:
    """Return joint or tendon of an actuator, and its gear."""
    acts = {name: share for name, share in one.acts.items() if share}
    if len(acts) > 1:
        return {"tendon": f"{one.name}_acts"}, one.gain.value
    ((joint, share),) = acts.items()
    return {"joint": joint}, share * one.gain.value


def _actuators(root: ElementTree.Element, mechanism: Mechanism, lumped: LumpedModel) -> list[str]:
    """Write inputs, and constant forces as what the first actuator of a joint always gives."""
    notes = []
    actuators = ElementTree.SubElement(root, "actuator")
    constant = {name: one.force for name, one in lumped.joints.items() if one.force}
    for one in mechanism.inputs:
        where, gear = _acts_on(one)
        named = {"name": one.name, **where, "gear": _number(gear)}
        actuator = ElementTree.SubElement(actuators, "motor", named)
        force = constant.pop(where.get("joint", ""), 0.0) if gear else 0.0
        if force:
            actuator.tag = "general"
            actuator.attrib |= _biased(-force / gear, "1")
            notes.append(
                f"the constant force at {where['joint']} is what actuator {one.name} adds to its "
                "control"
            )
    left = [({"joint": name}, force) for name, force in constant.items()]
    between = lumped.couplings.items()
    left += [({"tendon": name}, coupled.force) for name, (_, coupled) in between if coupled.force]
    for where, force in left:
        (name,) = where.values()
        own = ElementTree.SubElement(actuators, "general", {"name": f"{name}_constant", **where})
        own.attrib |= {"gear": "1", **_biased(-force, "0")}
        notes.append(f"the constant force at {name} is an actuator that ignores its control")
    return notes


def _biased(force: float, gain: str) -> dict[str, str]:
    return {"gainprm": gain, "biastype": "affine", "biasprm": f"{_number(force)} 0 0"}
