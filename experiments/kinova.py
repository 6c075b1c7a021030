"""Kinova Gen3, joint 7: dry friction and the ripple of a harmonic drive, measured by others."""

from __future__ import annotations

from dataclasses import replace

from experiments.measured_rigs import (
    Study,
    absent,
    evidence_table,
    gaps_table,
    pictures,
    study,
    values_table,
    verdict_paragraphs,
)
from experiments.measured_twins import Twin, twins, twins_finding, twins_table
from experiments.registry import Context
from experiments.result import Finding, Result, Table
from pymoo_hdte.drive.effects import place_of
from pymoo_hdte.measured.next_test import next_test
from pymoo_hdte.measured.verdict_document import limits

TITLE = "Kinova Gen3, joint 7: friction and ripple of a harmonic drive, measured by others"
COMMAND = "python -m experiments kinova"
KNOWN = {
    "kinematic error: order 200 amplitude": 0.040,
    "kinematic error: order 400 amplitude": 0.029,
}
SOURCE = (
    "lines at 200 and 400 cycles a turn of the joint, 0.033 to 0.048 and 0.022 to 0.036 N.m over "
    "the ten speeds (middles shown), which a fit of every record by itself gives."
)
ORIGIN = "the repository HBRS-SDP/joint-friction-model on GitHub, its ten runs at constant speed"
ORDERS = (200.0, 400.0)
"""Cycles a turn of the joint: twice and four times a turn of the wave generator."""
DRAG = 4.0
"""N.m at the largest speed, hidden in the twins; dry friction of the joint is 1.4 N.m."""


def run(context: Context) -> Result:
    """Start from the model without friction; hold verdict, orders and limits against the known."""
    one = study("kinova", "kinova_gen3_j7")
    if one is None:
        return absent(TITLE, "kinova_gen3_j7", COMMAND, ORIGIN)
    found = twins(one, "bearing", DRAG)
    return Result(
        title=TITLE,
        command=COMMAND,
        paragraphs=(
            "The believed model is an inertia with viscous friction, driven by the measured "
            "current; the torque sensor of the link is believed to show nothing but its zero. "
            "Eight of ten speeds, all in one direction, are fitted, two held out.",
            *verdict_paragraphs(one),
        ),
        tables=(
            _judged(one, found),
            gaps_table(one),
            twins_table(found),
            evidence_table(one),
        ),
        pictures=pictures(one),
        headline="values",
    )


def _judged(one: Study, found: tuple[Twin, ...]) -> Table:
    table = values_table(one, KNOWN, SOURCE)
    dry = {"coulomb_friction", "stribeck_friction"} & set(one.names)
    seen = {
        place_of(effect)[2]
        for effect in one.finding.accepted.effects
        if effect.name == "kinematic_error"
    }
    said = any("cannot separate Coulomb" in sentence for sentence in limits(one.finding))
    test = next_test(one.finding)
    findings = (
        Finding(bool(dry), f"Dry friction is named: {', '.join(dry) or 'no'}.", check=True),
        Finding(
            set(ORDERS) <= seen,
            "A kinematic ripple is named with the orders "
            f"{', '.join(f'{order:g}' for order in seen if order) or 'none'}.",
            check=True,
        ),
        Finding(
            said and test.rate < 0.0,
            "One direction of motion cannot separate Coulomb friction from an offset: said, and "
            "the reverse run proposed.",
            check=True,
        ),
        twins_finding(found),
    )
    return replace(table, findings=findings)
