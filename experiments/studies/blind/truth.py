"""What counts as right: which names say what a case hides.

Two names of one physical effect are one: a damping, or an inertia of the load, out of tolerance is
what the effects ``damping_reference`` and ``load_inertia`` say, and dry friction whose contacts
bend before they slip is a form of dry friction. Some effects contain another one:
friction that falls with speed, or varies with position, or fades as grease warms up, is a dry
friction too; naming that beside the effect is no wrong name, naming it alone is not the effect.
"""

from __future__ import annotations

from experiments.studies.blind.cases import OUT_OF_TOLERANCE, Case

SAME = {"damping": "damping_reference", "load_inertia": "load_inertia"}
"""Base parameters that an effect covers under its own name."""
FORM_OF = {
    "presliding_friction": "coulomb_friction",
    "coupled_inertia": "load_inertia",
    "shear_thinning_drag": "nonlinear_drag",
    "bouc_wen_hysteresis": "hysteresis",
}
"""Effects of the library that are a form of one that is hidden."""
PARAMETER = "parameter"


def one_name(name: str, port: str) -> str:
    """Return the name that stands for a candidate of a name at a port."""
    return SAME.get(port, name) if name == PARAMETER else FORM_OF.get(name, name)


def to_be_named(case: Case) -> frozenset[str]:
    """Return the names of all that a case hides and that the workflow could name."""
    if case.kind == "unlisted":
        return frozenset()
    out = {PARAMETER} if case.stress in OUT_OF_TOLERANCE else set()
    return frozenset({*case.names, *out})


def may_be_named(case: Case) -> frozenset[str]:
    """Return the names that are not wrong: what is hidden, and what that contains."""
    contained = {name for one in case.drawn for name in one.components}
    if case.stress == "parameters":
        # All base parameters are far off, those with names of their own among them.
        contained |= set(SAME.values())
    return to_be_named(case) | contained
