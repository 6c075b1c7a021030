"""EMPS: the friction of a positioning system, which the literature knows."""

from __future__ import annotations

from dataclasses import replace

from experiments.measured_rigs import (
    Study,
    absent,
    evidence_table,
    fitted_values,
    gaps_table,
    pictures,
    study,
    values_table,
    verdict_paragraphs,
)
from experiments.measured_twins import Twin, twins, twins_finding, twins_table
from experiments.registry import Context
from experiments.result import Finding, Result, Table

TITLE = "EMPS: a positioning system with friction, measured by others"
COMMAND = "python -m experiments emps"
PUBLISHED = {
    "inertia of position": (95.109, 0.05),
    "damping of joint": (203.50, 0.05),
    "coulomb friction: level": (20.39, 0.05),
}
"""Values of the benchmark's fit and the share within which ours should lie."""
SOURCE = "Janot, Gautier, Brunot (2019), nonlinearbenchmark.org; its offset is -3.165 N."
ORIGIN = (
    "DATA_EMPS.mat and DATA_EMPS_PULSES.mat of the EMPS benchmark (Janot, Gautier, Brunot, 2019) "
    "at nonlinearbenchmark.org"
)
DRAG = 30.0
"""N at the largest speed, hidden in the twins; dry friction of the rig is 20 N."""


def run(context: Context) -> Result:
    """Start from the model without friction; hold verdict, values and proof against the known."""
    one = study("emps", "emps")
    if one is None:
        return absent(TITLE, "emps", COMMAND, ORIGIN)
    found = twins(one, "joint", DRAG)
    return Result(
        title=TITLE,
        command=COMMAND,
        paragraphs=(
            "The believed model is an inertia with viscous friction, in round numbers. One file is "
            "fitted, the other, whose voltage has pulses added, is simulated from its voltage.",
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
    table = values_table(one, {name: value for name, (value, _) in PUBLISHED.items()}, SOURCE)
    simulated = next(gap for gap in one.gaps if gap.kind == "simulation")
    ours = fitted_values(one)
    near = all(
        name in ours
        and abs(ours[name]["value"] / published - 1.0) <= share
        and ours[name]["interval95"][0] <= published <= ours[name]["interval95"][1]
        for name, (published, share) in PUBLISHED.items()
    )
    first, *seconds = one.names or ("nothing",)
    findings = (
        Finding(first == "coulomb_friction", f"The first name is {first}.", check=True),
        Finding(
            near,
            "Mass, viscous and Coulomb friction lie within 5 % of the published values, and their "
            f"intervals cover them: {'yes' if near else 'no'}.",
            check=True,
        ),
        Finding(
            simulated.after <= 0.5 * simulated.before,
            f"The simulated position of the held-out file is off by {1e3 * simulated.before:.3g} "
            f"mm before and by {1e3 * simulated.after:.3g} mm after.",
            check=True,
        ),
        Finding(
            bool({"direction_dependent_friction", "force_offset"} & set(seconds)),
            f"Second: {', '.join(seconds) or 'none'}.",
            check=True,
        ),
        twins_finding(found),
    )
    return replace(table, findings=findings)
