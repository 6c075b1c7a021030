"""Steady states of records: those without one, where a clearance rattles, and nearby ones."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from planted_features import judged, known_data, library, listed, measured, with_sweep
from virtual_rig_cases import BELIEVED, RIG, effect, true_rig

from experiments.studies.virtual_rig.rig import run_campaign
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import flanks_held
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure, unexpected_lines
from pymoo_hdte.discrepancy._evidence.order_lines.steady_states import (
    PREDICTION,
    SLOPES,
    Continuation,
    Effort,
    merged,
)
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.growth import NO_EXPERIENCE
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts import rattling, records_judged
from pymoo_hdte.drive._effects import LawAtPort
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.stiffness import SoftWindup
from pymoo_hdte.units import ARCSEC

LOADED_OR_NOT = [(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 10.0, 20.0, 40.0)]


@pytest.fixture(scope="module")
def data():
    return known_data()


@pytest.fixture(scope="module")
def softening():
    return (LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 5e-4, 4.0)),)


def test_a_record_without_a_steady_state_makes_no_slope_of_the_jump(data, softening):
    """A quotient of a prediction with the law and one without would tell of the law's size."""
    records = len(data.features.records)
    values = Layout(data.base).array("start")[None]
    here = data.prediction(values, softening)
    lost = np.arange(records) == 2
    start = replace(here.balance.rows(slice(records)), converged=~lost)
    there = data.prediction(values, softening, start, SLOPES)
    assert np.array_equal(there.balance.converged, ~lost)
    plain = data.features.of_prediction(data.prediction(values, ()))[0]
    with_law = data.features.of_prediction(here)[0]
    found = data.features.of_prediction(there)[0]
    assert np.allclose(found[lost], plain[lost], rtol=1e-5, atol=1e-9)
    assert np.allclose(found[~lost], with_law[~lost], rtol=1e-5, atol=1e-9)
    assert not np.allclose(plain[lost], with_law[lost], rtol=1e-2, atol=1e-7)
    # What is not for slopes is tried anew.
    assert data.prediction(values, softening, start).balance.converged.all()


def test_states_are_continued_to_first_order(data, softening):
    """Half as far away, a quarter as wrong; states that move far begin where they were."""
    records = len(data.features.records)
    values = Layout(data.base).array("start")
    scale = Layout(data.base).array("scale")

    def states(at):
        return data.prediction(at[None], softening, effort=Effort(1e-10)).balance

    known, step = Continuation(), 1e-3 * scale[0]
    assert known.at(values) is None
    away = values.copy()
    away[0] += step
    known.arrived(values, states(values))
    known.depart(len(values))
    known.follow(0, step, states(away))
    errors = []
    for way in (0.2 * scale[0], 0.1 * scale[0]):
        away[0] = values[0] + way
        errors.append(np.abs(known.at(away).torsion - states(away).torsion).sum())
    plain = np.abs(known.motion.torsion - states(away).torsion).sum()
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.3)
    assert errors[1] < 0.1 * plain
    away[0] = -values[0]
    assert np.array_equal(known.at(away).torsion, known.motion.torsion)
    # Where a record has no steady state on one side, the other is no slope.
    lost = np.arange(records) == 1
    away[0] = values[0] + step
    known.depart(len(values))
    known.follow(0, step, replace(states(away), converged=~lost))
    away[0] = values[0] + 0.1 * scale[0]
    still = known.at(away).torsion == known.motion.torsion
    assert still[lost].all()
    assert not still[~lost].all()


def test_a_speed_that_varies_strongly_is_found_as_well_as_the_torsion():
    """A ripple makes the input turn a quarter slower and faster at 10 r/min, and twists little.

    The angle of the input was off by more than half its noise.
    """
    data = known_data(LOADED_OR_NOT, [1.0, 2.0, 2.02, 3.0, 6.0])
    ripple = listed(data, "torque_ripple", [6.0]).build((0.01, 0.0))
    values = Layout(data.base).array("start")[None]
    found, sharp = (
        data.features.of_prediction(data.prediction(values, ripple, effort=effort))[0]
        for effort in (PREDICTION, Effort(1e-12))
    )
    assert np.abs(data.whiten(found - sharp)).max() < 1e-2


def test_merged_rows_keep_their_own_tangents(data, rng):
    values = Layout(data.base).array("start")[None]
    # Memory needs a matrix for every row.
    springs = (LawAtPort("hysteresis", "mesh", MaxwellSlip(5.0, 1e-4)),)
    whole = data.prediction(values, springs).balance
    places = [np.array([0, 3]), np.array([1, 2])]
    found = merged([whole.rows(rows) for rows in places], places)
    for mine, own in zip(found.tangents.systems(), whole.tangents.systems()[:4], strict=True):
        right = rng.standard_normal(len(mine.pivots))
        assert np.array_equal(mine.solve(right), own.solve(right))


@pytest.fixture(scope="module")
def swept():
    """Records whose sweep speaks for a soft wind-up."""
    rng = np.random.default_rng(5)
    data, _ = measured((), rng, known_data(LOADED_OR_NOT))
    data = with_sweep(data, listed(data, "soft_windup").build((0.3, 3e-4, 3.0)), rng)
    assert rattling.leading_sweep_effect(data, fit(data), library(data)) == "soft_windup"
    return data


def named(*names):
    return SimpleNamespace(effects=[SimpleNamespace(name=name, listed=True) for name in names])


def answer(*names, status="named", rivals=()):
    return SimpleNamespace(status=status, chosen=named(*names), equivalent=rivals)


HARDENING = "hardening_stiffness"
SOFT = answer("soft_windup", HARDENING, status="partial")
PLAY = answer("backlash", HARDENING)


@pytest.mark.parametrize(
    ("of_all", "of_loaded", "kept"),
    [
        (SOFT, PLAY, 6),
        (answer("soft_windup", status="unlisted"), PLAY, 6),
        (SOFT, answer("soft_windup", HARDENING, rivals=[named("backlash", HARDENING)]), 6),
        # All records are explained: there is no reason to leave any out.
        (answer("soft_windup"), PLAY, 8),
        # The loaded records show no clearance beside another effect, or more than that.
        (SOFT, answer("soft_windup", HARDENING), 8),
        (SOFT, answer("backlash"), 8),
        (SOFT, answer("backlash", HARDENING, status="partial"), 8),
        (SOFT, answer("backlash", HARDENING, status="unlisted"), 8),
    ],
)
def test_records_that_rattle_count_unless_a_clearance_explains_all_others(
    monkeypatch, swept, of_all, of_loaded, kept
):
    """A play with a soft skin beside a hardening was named a soft wind-up beside it."""

    def judged_on(some, *_):
        whole = len(some.features.records) == len(LOADED_OR_NOT)
        return records_judged.Judged(some, of_all if whole else of_loaded, NO_EXPERIENCE)

    monkeypatch.setattr(records_judged, "_judged_on", judged_on)

    def if_explained(_, some, *others, without):
        assert "backlash" in without
        return judged_on(some, *others)

    monkeypatch.setattr(records_judged, "judged_if_explained", if_explained)
    found, verdict, _ = records_judged.judged(swept, fit(swept), lambda some, base: library(some))
    assert len(found.features.records) == kept
    assert verdict is (of_all if kept == len(LOADED_OR_NOT) else of_loaded)


def test_all_records_are_not_asked_again_where_a_clearance_cannot_explain_them(monkeypatch, swept):
    """A clearance beside an error took six minutes to find in vain what explains rattling."""
    play = partial(records_judged.Judged, verdict=PLAY, experience=NO_EXPERIENCE)
    monkeypatch.setattr(records_judged, "_judged_on", lambda some, *_: play(some))
    monkeypatch.setattr(records_judged, "judged_if_explained", lambda *_, **__: None)
    found, _, _ = records_judged.judged(swept, fit(swept), lambda some, base: library(some))
    assert len(found.features.records) == 6


@pytest.mark.parametrize(("name", "kept"), [("backlash", 6), (None, 8)])
def test_records_that_rattle_do_not_count_where_sweeps_speak_for_a_clearance(
    monkeypatch, name, kept
):
    data = known_data(LOADED_OR_NOT)
    monkeypatch.setattr(records_judged, "leading_sweep_effect", lambda *_: name)
    soft = partial(records_judged.Judged, verdict=SOFT, experience=NO_EXPERIENCE)
    monkeypatch.setattr(records_judged, "_judged_on", lambda some, *_: soft(some))
    found, _, _ = records_judged.judged(data, fit(data), lambda some, base: [])
    assert len(found.features.records) == kept


CONDITIONS = tuple(
    Condition(speed, load, 1000.0, 1, "train") for speed in (600.0, 1500.0) for load in (0.0, 20.0)
)
ORDERS = [1.0 / 101.0, 2.0 / 101.0, 1.0, 2.0, 2.02, 3.0, 4.0, 6.0]
CLEARANCES = {"backlash", "clearance_variation"}
MANY, FEW = (
    {1.0 / 3.0 + 0.05 * k: 20.0 for k in range(n)}
    for n in (RULES.rattling_lines, RULES.rattling_trace)
)
BEATS = {2.0 + 0.02 * k: 20.0 for k in range(-6, 7)}
BEATS_OF_HIDDEN = {0.31 * k: 20.0 for k in range(1, 5)} | {
    1.0 + 0.31 * k: 20.0 for k in range(1, 6)
}


@pytest.mark.parametrize(
    ("hidden", "heard"),
    [
        ({"clearance": 12.0 * ARCSEC, "clearance_rounding": 0.6 * ARCSEC}, True),
        ({"soft_share": 0.3, "soft_corner": 3e-4, "corner_rounding": 5e-5}, False),
        ({}, False),
    ],
)
def test_a_clearance_is_heard_without_load_and_a_soft_windup_is_not(hidden, heard):
    rig = true_rig(*([effect("mesh", **hidden)] if hidden else []))
    campaign = run_campaign(rig, BELIEVED, RIG, np.random.default_rng(4), CONDITIONS)
    features = measure(campaign, campaign.train, ORDERS)
    lines = unexpected_lines(features, BELIEVED.ratio, campaign.rig)
    held = flanks_held(features, campaign.torque_scale, RULES)
    assert held.tolist() == [False, True, False, True]
    assert rattling.is_heard(lines, held, BELIEVED.error_orders, BELIEVED.ratio) == heard


@pytest.mark.parametrize(
    ("lines", "heard"),
    [
        ([MANY, {}, FEW, {}], True),
        # One record may be disturbed, and what is rough with load as well is no rattling.
        ([MANY, {}, {}, {}], False),
        ([MANY, MANY, MANY, {}], False),
        ([FEW, {}, FEW, {}], False),
        # Beats of the error and of a line of records with load, and what a strong line leaks.
        ([BEATS, {}, BEATS, {}], False),
        ([BEATS_OF_HIDDEN, {0.31: 50.0}, BEATS_OF_HIDDEN, {}], False),
        ([MANY | {2.0: 1e5}, {}, MANY | {2.0: 1e5}, {}], False),
    ],
)
def test_what_is_rough_without_load_only_and_at_no_steady_order_is_rattling(lines, heard):
    held = np.array([False, True, False, True])
    assert rattling.is_heard(lines, held, [1.0, 2.0, 2.02], 101.0) == heard


def test_a_clearance_is_evident_only_where_enough_records_are_left():
    whole = known_data([(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 10.0, 20.0)])
    found = rattling.with_clearance(replace(whole, rules=replace(RULES, fewest_records=4)))
    assert found.evident == CLEARANCES
    assert np.all(found.features.conditions.output_torque > 0.0)
    few = rattling.with_clearance(replace(whole, rules=replace(RULES, fewest_records=5)))
    assert not few.evident
    assert len(few.features.records) == 6


@pytest.mark.nightly
@pytest.mark.parametrize("evident", [True, False])
def test_what_is_evident_is_told_beside_what_explains_the_rest(evident):
    """A soft wind-up told of a clearance beside it as well, in records with load."""
    rng = np.random.default_rng(2)
    empty = known_data([(rpm, load) for rpm in (10.0, 2000.0) for load in (10.0, 20.0, 30.0, 40.0)])
    effects = listed(empty, "soft_windup").build((0.3, 3e-4, 3.0))
    data = with_sweep(measured(effects, rng, empty)[0], effects, rng)
    data = replace(data, evident=frozenset(CLEARANCES if evident else ()))
    names = ("soft_windup", "backlash")
    verdict = judged(data, [one for one in library(data) if one.name in names])
    told = [verdict.chosen, *verdict.equivalent]
    for one in told:
        assert "soft_windup" in {each.name for each in one.effects}
        assert bool(CLEARANCES & {each.name for each in one.effects}) == evident
    assert verdict.status in ("named", "class")


def test_steady_orders_between_two_lines_are_no_rattling():
    """With a ratio that is no whole number orders of the input lie between those of the output."""
    between = {order + way / 50.5: 20.0 for order in (3.0, 5.0, 7.0, 9.0) for way in (-0.5, 0.5)}
    held = np.array([False, False, True])
    assert not rattling.is_heard([between, between, {}], held, [1.0, 2.0], 50.5)
