"""EMPS: the friction of a positioning system, known from the literature."""

from __future__ import annotations

from dataclasses import replace

from experiments.runner.registry import Context
from experiments.runner.result import Finding, Result, Table
from experiments.studies.measured.report import MeasuredRig, measured_result
from experiments.studies.measured.rigs import Study, fitted_values, values_table
from experiments.studies.measured.twins import Twin, twins_finding

RIG = MeasuredRig(
    name="emps",
    folder="emps",
    title="EMPS: a positioning system with friction, measured by others",
    origin=(
        "DATA_EMPS.mat and DATA_EMPS_PULSES.mat of the EMPS benchmark (Janot, Gautier, Brunot, "
        "2019) at nonlinearbenchmark.org"
    ),
    believed=(
        "The believed model is an inertia with viscous friction, in round numbers. One file is "
        "fitted, the other, whose voltage has pulses added, is simulated from its voltage."
    ),
    port="joint",
    # Dry friction of the rig is 20 N.
    drag=30.0,
)
PUBLISHED = {
    "inertia of position": (95.109, 0.05),
    "damping of joint": (203.50, 0.05),
    "coulomb friction: level": (20.39, 0.05),
}
"""Values of the benchmark's fit and the share within which ours should lie."""
MOST_LEFT = 0.5
"""Share of the held-out error that may be left."""
SOURCE = "Janot, Gautier, Brunot (2019), nonlinearbenchmark.org; its offset is -3.165 N."


def run(context: Context) -> Result:
    """Start from the model without friction; compare all results with known ones."""
    return measured_result(RIG, _judged)


def _judged(one: Study, found: tuple[Twin, ...]) -> Table:
    known = {name: value for name, (value, _) in PUBLISHED.items()}
    table = values_table(one, known, "literature", SOURCE)
    simulated = next(error for error in one.errors if error.kind == "simulation")
    ours = fitted_values(one)
    near = all(
        name in ours
        and abs(ours[name]["value"] / published - 1.0) <= share
        and ours[name]["interval95"][0] <= published <= ours[name]["interval95"][1]
        for name, (published, share) in PUBLISHED.items()
    )
    first, *seconds = one.names or ("nothing",)
    findings = (
        Finding(
            first == "coulomb_friction",
            f"The first effect that is named is {first.replace('_', ' ')}; it should be Coulomb "
            "friction.",
            check=True,
        ),
        Finding(
            near,
            "Mass, viscous and Coulomb friction lie within 5 % of the published values, which "
            "their intervals cover."
            if near
            else "Not all of mass, viscous and Coulomb friction lie within 5 % of the published "
            "values with their intervals covering them.",
            check=True,
            answers=True,
        ),
        Finding(
            simulated.after <= MOST_LEFT * simulated.before,
            f"The simulated position of the held-out file is off by {1e3 * simulated.before:.3g} "
            f"mm before and by {1e3 * simulated.after:.3g} mm after; at most {MOST_LEFT:g} of it "
            "may be left.",
            check=True,
            answers=True,
        ),
        Finding(
            bool({"direction_dependent_friction", "force_offset"} & set(seconds)),
            "The next one is a force offset or a friction that depends on the direction: "
            f"{' and '.join(seconds).replace('_', ' ') or 'none'} is named.",
            check=True,
        ),
        twins_finding(found),
    )
    return replace(table, findings=findings)
