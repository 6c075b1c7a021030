"""Nuisances of a bench: found, told of the bench, and no answer to what the drive lacks."""

from dataclasses import replace

import numpy as np
import pytest
from planted_features import SCALES, known_data, measured

from pymoo_hdte.discrepancy._evidence.order_lines.bench import IDEAL
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._verdicts import records_judged
from pymoo_hdte.drive import LawAtPort
from pymoo_hdte.drive._effects import (
    BenchResonance,
    InputTorqueDrift,
    LoadShaft,
    NewInputTorqueZero,
    NewZero,
    WarmingFriction,
)
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.ripple import BrakeRipple, CouplingTorque, PeriodicTorque

ORDERS = [1.0 / 101.0, 2.0 / 101.0, 3.0 / 101.0, 1.0, 2.0, 2.02, 3.0, 6.0]
CONDITIONS = (
    *((30.0, 0.0), (700.0, 40.0), (-700.0, 0.0), (2000.0, 40.0)),
    *((30.0, 40.0), (-700.0, 40.0), (2000.0, 0.0), (700.0, 0.0)),
)
"""Neither speeds nor loads rise with time: friction that falls with one would fall with both."""
DATA = known_data(CONDITIONS, ORDERS)
DAMPING = DATA.campaign.believed.input_damping
ALONE = {
    "coupling_ripple": LawAtPort("coupling_ripple", "input", CouplingTorque(1.0, 0.8, 2e-3)),
    "torque_ripple": LawAtPort("torque_ripple", "output", PeriodicTorque(1.0, 0.8, 0.08)),
    "gravity": LawAtPort("gravity", "load", Gravity(0.08, 0.3)),
    "brake_ripple": LawAtPort("brake_ripple", "load", BrakeRipple(3.0, 0.5, 0.004)),
    "warming": LawAtPort("warming", "input", WarmingFriction(DAMPING, 0.2, 250.0)),
    "input_torque_drift": InputTorqueDrift(3e-3, 250.0),
    "new_input_torque_zero": NewInputTorqueZero(3e-3, 350.0),
    "new_zero": NewZero(1e-5, 350.0),
    "bench_resonance": BenchResonance(5e-6, 400.0, 0.05),
    "load_shaft": LoadShaft(1e-5, 1e-5),
}
COULOMB = LawAtPort("coulomb_friction", "input", CoulombFriction(0.02))


def candidates_of(data, *_):
    changes = (150.0, 350.0, 550.0)
    scales = replace(SCALES, changes=changes, duration=700.0, swept=False, loads_differ=True)
    orders = data.features.orders.tolist()
    seen = [1.0 / 101.0, 3.0 / 101.0, 1.0]
    sizes = port_sizes(data.campaign.believed, orders, seen, scales)
    return drive_candidates(sizes, (), data.bench.nuisances)


def test_lines_of_one_effect_that_share_an_order_take_the_place_of_each_other():
    """Beside a brake's line twice a turn, its line once a turn was never tried."""
    scales = replace(SCALES, loads_differ=True, changes=(150.0, 350.0), duration=700.0)
    orders = DATA.features.orders.tolist()
    seen = [1.0 / 101.0, 2.0 / 101.0]
    candidates = drive_candidates(port_sizes(DATA.campaign.believed, orders, seen, scales))
    by_label = {candidate.label: candidate for candidate in candidates}
    once, twice = by_label["brake_ripple:load@0.009901"], by_label["brake_ripple:load@0.0198"]
    assert once.is_instead_of(twice)
    assert twice.is_instead_of(once)
    assert not once.is_instead_of(once)
    changes = [candidate for candidate in candidates if candidate.name == "new_zero"]
    assert len(changes) > 1
    assert not changes[0].is_instead_of(changes[1])


def test_a_weight_at_the_shaft_of_a_load_is_known_exactly():
    """With an error of its form over the load it was the ripple of a brake as well."""
    gravity = next(one for one in candidates_of(DATA) if one.name == "gravity")
    assert gravity.exact
    assert not effect_named("gravity").exact


def verdict_on(effects, seed=6):
    data, _ = measured(effects, np.random.default_rng(seed), DATA)
    data, verdict, _ = records_judged.judged(data, fit(data), candidates_of)
    shown = data.bench.shown(verdict.accepted, verdict.rules)
    return verdict, [nuisance.name for nuisance, _ in shown], data


def test_a_brake_may_ripple_once_a_turn_beside_a_coupling_or_a_weight():
    """A bench with both was 'unlisted': what was constant took the place of the share."""
    begin = candidates_of(DATA)
    (coupling,) = (one for one in begin if one.label == "torque_ripple/1+2:load")
    data = DATA.on_bench(coupling, coupling.starts[0])
    labels = {one.label for one in candidates_of(data)}
    assert "brake_ripple:load@0.009901" in labels
    assert not any(label.startswith("torque_ripple/1+2:load") for label in labels)


DAILY = ("coupling_ripple",)
"""Others run at night; gravity is told of by day beside friction."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [name if name in DAILY else pytest.param(name, marks=pytest.mark.nightly) for name in ALONE],
)
def test_a_nuisance_alone_is_told_of_the_bench_and_the_drive_is_adequate(name):
    verdict, told, _ = verdict_on([ALONE[name]])
    assert verdict.status == "adequate"
    assert told == [name]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "gravity",
        "warming",
        pytest.param("coupling_ripple", marks=pytest.mark.nightly),
    ],
)
def test_a_nuisance_takes_no_name_from_an_effect(name):
    verdict, told, _ = verdict_on([COULOMB, ALONE[name]])
    assert (verdict.status, verdict.chosen.names) == ("named", {("coulomb_friction", "input")})
    assert name in told
    (_, place) = verdict.chosen.fit.places[0]
    assert verdict.chosen.fit.values[place] == pytest.approx([0.02], rel=0.02)


@pytest.mark.slow
def test_without_a_nuisance_the_bench_is_ideal():
    for effects in ([], [COULOMB]):
        verdict, _, data = verdict_on(effects)
        assert verdict.status == ("named" if effects else "adequate")
        assert data.bench is IDEAL


def test_vectors_are_predicted_together_as_one_by_one():
    """Those that share the numbers of a bench are solved together, in the order that they had."""
    base = fit(measured((), None, DATA)[0])
    candidates = candidates_of(DATA, base)
    chosen = [
        next(candidate for candidate in candidates if candidate.name == name)
        for name in ("coupling_ripple", "warming")
    ]
    data = DATA
    for nuisance in chosen:
        data = data.on_bench(nuisance, nuisance.starts[0])
    start = np.array([parameter.start for parameter in data.base])
    vectors = np.tile(start, (4, 1))
    vectors[[0, 2], -1] *= 2.0
    vectors[[1, 2], -3] *= 0.5
    together = data.predict(vectors, ())
    for row, vector in enumerate(vectors):
        alone = data.predict(vector[None], ())[0]
        np.testing.assert_allclose(together[row], alone, rtol=1e-9, atol=1e-12)
    assert np.abs(together[0] - together[1]).max() > 1e-5
