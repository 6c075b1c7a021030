"""Kinova Gen3, joint 7: dry friction and the ripple of a harmonic drive, measured by others."""

from __future__ import annotations

from dataclasses import replace

from experiments.runner.registry import Context
from experiments.runner.result import Finding, Result, Table
from experiments.studies.measured.report import MeasuredRig, measured_result
from experiments.studies.measured.rigs import Study, values_table
from experiments.studies.measured.twins import Twin, twins_finding
from pymoo_hdte.discrepancy._answers.next_test_mechanism import next_test
from pymoo_hdte.discrepancy._report.mechanism_document import limits
from pymoo_hdte.effects.effect import place_of

RIG = MeasuredRig(
    name="kinova",
    folder="kinova_gen3_j7",
    title="Kinova Gen3, joint 7: friction and ripple of a harmonic drive, measured by others",
    origin=(
        "the repository HBRS-SDP/joint-friction-model on GitHub, its ten runs at constant speed"
    ),
    believed=(
        "The believed model is an inertia with viscous friction, driven by the measured "
        "current; the torque sensor of the link is believed to show nothing but its zero. "
        "Eight of ten speeds, all in one direction, are fitted, two held out."
    ),
    port="bearing",
    # Dry friction of the joint is 1.4 N.m.
    drag=4.0,
)
KNOWN = {
    "kinematic error: order 200 amplitude": 0.040,
    "kinematic error: order 400 amplitude": 0.029,
}
HEADING = "our fits record by record"
SOURCE = (
    "lines at 200 and 400 cycles a turn of the joint, 0.033 to 0.048 and 0.022 to 0.036 N.m over "
    "the ten speeds (middles shown), which a fit of every record by itself gives."
)
ORDERS = (200.0, 400.0)
"""Cycles a turn of the joint: twice and four times a turn of the wave generator."""


def run(context: Context) -> Result:
    """Start from the model without friction; compare verdict, orders, limits with known ones."""
    return measured_result(RIG, _judged)


def _judged(one: Study, found: tuple[Twin, ...]) -> Table:
    table = values_table(one, KNOWN, HEADING, SOURCE)
    dry = {"coulomb_friction", "stribeck_friction"} & set(one.names)
    seen = {
        place_of(effect)[2]
        for effect in one.finding.accepted.effects
        if effect.name == "kinematic_error"
    }
    shown = ", ".join(f"{order:g}" for order in sorted(order for order in seen if order))
    said = any("cannot separate Coulomb" in sentence for sentence in limits(one.finding))
    reverse = next_test(one.finding).rate < 0.0
    findings = (
        Finding(
            bool(dry),
            f"Dry friction is found, as {' and '.join(sorted(dry)).replace('_', ' ')}."
            if dry
            else "No dry friction is found.",
            check=True,
            answers=True,
        ),
        Finding(
            set(ORDERS) <= seen,
            f"A kinematic ripple is found at the orders {shown or 'none'}; "
            f"{' and '.join(f'{order:g}' for order in ORDERS)} were to be among them.",
            check=True,
            answers=True,
        ),
        Finding(
            said and reverse,
            "One direction of motion cannot separate Coulomb friction from an offset: "
            f"{'said' if said else 'not said'}, and the reverse run is "
            f"{'proposed' if reverse else 'not proposed'}.",
            check=True,
        ),
        twins_finding(found),
    )
    return replace(table, findings=findings)
