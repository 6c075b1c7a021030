"""What is said of a drive whose speed loop lags and whose set speed wanders: as of an ideal one."""

from dataclasses import replace

import pytest
from night import others_at_night

from experiments.studies.blind.campaigns import Hiding, campaign_of
from experiments.studies.blind.cases import all_cases
from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.campaign import restricted, shown
from experiments.studies.blind.rig.elements import INPUT, element
from experiments.studies.blind.rig.nuisances import Nuisances, bench_with
from experiments.studies.blind.rig.session import draw_circumstances
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive

BENCHES = {
    "lags": Nuisances(lag=1e-4),
    "wanders": Nuisances(wander=4e-4),
    "both": Nuisances(lag=5e-4, wander=1e-5),
}
CASE = next(case for case in all_cases() if case.kind == "none" and not case.stress)


def campaign_on(nuisances, *elements):
    """Return a short campaign of a drive with elements on a bench with nuisances."""
    about = draw_circumstances(CASE.generator("session"))
    fitted = [k for k, at in enumerate(about.conditions) if at.role == "train"]
    about = restricted(about, fitted[::2])
    machine = replace(about.machine, elements=(*about.machine.elements, *elements))
    about = replace(about, machine=machine)
    about = bench_with(about, nuisances, lambda group: CASE.generator(f"nuisance {group}"))
    session = shown(about, ())
    hiding = Hiding(CASE, about, (), session, session, nuisances)
    return about.machine, campaign_of(hiding, session)


@pytest.mark.slow
@pytest.mark.parametrize("bench", others_at_night(BENCHES, "both"))
def test_nothing_is_missing_and_the_values_are_the_true_ones(bench):
    machine, campaign = campaign_on(BENCHES[bench])
    verdict = examine_drive(campaign).verdict
    assert verdict.status == "adequate"
    fitted = verdict.base
    names = [parameter.name for parameter in fitted.parameters]
    true = {"loop_lag": machine.lag} | {
        name: getattr(machine, name)
        for name in ("stiffness", "damping", "input_inertia", "load_inertia")
    }
    off = {
        name: (fitted.values[names.index(name)] - value)
        / fitted.covariance[names.index(name), names.index(name)] ** 0.5
        for name, value in true.items()
    }
    assert max(map(abs, off.values())) < 4.0, off


@pytest.mark.slow
@pytest.mark.parametrize("bench", others_at_night(["wanders", "both"], "wanders"))
def test_friction_keeps_its_name(bench):
    friction = element(el.DRY, 0.03, 0.1, 0.0, 0.0, 0.0, 0.0, INPUT)
    _, campaign = campaign_on(BENCHES[bench], friction)
    verdict = examine_drive(campaign).verdict
    assert verdict.status == "named"
    assert verdict.chosen.names == {("coulomb_friction", "input")}
