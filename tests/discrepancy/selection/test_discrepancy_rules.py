"""The rules of the verdict: each explained, checked and derived; the verdict follows a change."""

import ast
import inspect
from dataclasses import fields, replace

import numpy as np
import pytest
from planted_features import analysed, known_data, library, measured
from scipy.stats import chi2
from virtual_rig_cases import BELIEVED

import pymoo_hdte.drive._solve.free_angle as solver
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.where.location import locate
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.preconditions import check_scale
from pymoo_hdte.discrepancy._records.plausibility import check_believed
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record
from pymoo_hdte.units import ARCSEC

ORDERS = [1.0 / 101.0, 1.0, 2.0, 2.02, 3.0, 4.0, 5.0, 6.0]
CONDITIONS = [(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 20.0, 40.0)]
EMPTY = known_data(CONDITIONS, ORDERS)
RIPPLE, LINE = "torque_ripple:input@5", "kinematic_error:mesh@3"


def of_labels(*labels):
    found = {candidate.label: candidate for candidate in library(EMPTY, [3.0, 5.0])}
    return [found[label] for label in labels]


def planted(label, values, seed=4):
    (candidate,) = of_labels(label)
    return measured(candidate.build(values), np.random.default_rng(seed), EMPTY)[0]


def test_every_rule_says_what_it_means_and_where_it_comes_from():
    sources = ("Set by hand on ", "Test level", "Literature: ", "Simulation: ", "Resolution: ")
    computed = ("A uniform distribution",)
    for one in RULES.explained():
        assert one.value == getattr(RULES, one.name)
        assert one.unit, one.name
        assert one.meaning.endswith("."), one.name
        assert one.derivation.endswith("."), one.name
        assert one.derivation.startswith(sources + computed), one.name


def test_all_fields_are_rules():
    assert [one.name for one in RULES.explained()] == [one.name for one in fields(Rules)]


def test_a_rule_is_declared_once():
    """Two rules of one name stood in two classes, and the second won silently."""
    source = ast.parse(inspect.getsource(Rules))
    declared = [node.target.id for node in ast.walk(source) if isinstance(node, ast.AnnAssign)]
    assert declared == [one.name for one in fields(Rules)]


@pytest.mark.parametrize("bad", [-1.0, float("nan"), float("inf"), "much", True])
def test_impossible_values_are_refused(bad):
    for one in fields(Rules):
        with pytest.raises(InvalidInput, match=f"rules.{one.name}"):
            replace(RULES, **{one.name: bad})


def test_numbers_of_things_are_whole():
    with pytest.raises(InvalidInput, match=r"rules\.most_fitted"):
        Rules(most_fitted=2.5)
    with pytest.raises(InvalidInput, match=r"rules\.order_line_chance"):
        Rules(order_line_chance=1.1)


def test_the_level_of_a_false_alarm_is_the_one_stated():
    for degrees_of_freedom, chance in ((100, 3e-4), (1400, 6.5e-5)):
        limit = degrees_of_freedom + RULES.false_alarm_deviations * np.sqrt(
            2.0 * degrees_of_freedom
        )
        assert chi2.sf(limit, degrees_of_freedom) == pytest.approx(chance, rel=0.15)


def slipping(data):
    """Springs of a fortieth of the load's torque that slip at a tenth of the wind-up."""
    load = np.abs(data.features.conditions.output_torque).max()
    return load / 40.0, 0.1 * load / data.campaign.believed.stiffness, 1.5


def errors_of_the_model(data):
    """Relative change of what a library's effects do when three times as many harmonics are kept.

    Two numbers: the worst of the effects of exact form, and the worst of all others.
    """
    truth = Layout(data.base).array("start")[None]
    changes = {}
    least = solver.HIGHEST
    for harmonics in (least, 3 * least):
        solver.HIGHEST = harmonics
        try:
            without = data.predict(truth, ())[0]
            for candidate in library(data, [3.0, 5.0]):
                # A clearance rattles without load, and its steady state is then that without it.
                values = slipping(data) if candidate.name == "hysteresis" else candidate.starts[0]
                effects = candidate.build(values)
                moved = data.whiten(data.predict(truth, effects)[0] - without)
                changes.setdefault((candidate.exact, candidate.label), []).append(moved)
        finally:
            solver.HIGHEST = least
    worst = {True: 0.0, False: 0.0}
    for (exact, _), (coarse, fine) in changes.items():
        error = np.linalg.norm(coarse - fine) / np.linalg.norm(fine)
        worst[exact] = max(worst[exact], float(error))
    return worst[True], worst[False]


@pytest.mark.nightly
def test_the_accuracy_of_the_drive_model_is_that_of_its_harmonics():
    exact, others = errors_of_the_model(EMPTY)
    assert exact < 2e-5 < RULES.exact_model_accuracy
    # The rule is no smaller than the model's error, and not so large that it would hide others'.
    assert RULES.model_accuracy / 5.0 < others < RULES.model_accuracy


def test_the_map_flags_by_the_rate_of_its_rules():
    data = planted(LINE, (0.05 * ARCSEC, 0.0))
    strict, loose = (
        locate(analysed(replace(data, rules=replace(RULES, false_discovery_rate=rate)), "adequate"))
        for rate in (1e-6, 0.2)
    )
    assert strict.flagged.sum() < loose.flagged.sum()
    assert strict.summary()["rule"] != loose.summary()["rule"]


def test_a_campaign_is_refused_by_the_rules_that_it_is_given():
    careful = replace(RULES, least_tolerance=2.0 * BELIEVED.tolerance)
    check_believed(BELIEVED, RULES)
    with pytest.raises(InvalidInput, match="tolerance"):
        check_believed(BELIEVED, careful)


def test_records_of_a_mechanism_are_refused_by_the_rules_that_they_are_given():
    time = np.arange(0.0, 2.0, 0.002)
    angle = np.sin(4.4 * time) + 0.3 * np.sin(14.5 * time)
    noise = np.random.default_rng(1).standard_normal((2, len(time)))
    torque = -0.05 * 4.4**2 * np.sin(4.4 * time) + 0.01 * noise[0]
    record = Record("joint", "train", time, {"q": angle + 1e-6 * noise[1], "torque": torque})
    joint = Mechanism(
        {"q": BelievedValue(0.06, 0.5)},
        [Port("bearing", {"q": 1.0})],
        [Input("torque", {"q": 1.0})],
    )
    check_scale(measured_data(joint, [record], 10.0))
    with pytest.raises(InvalidInput, match="only ratios are known"):
        examine_mechanism(joint, [record], 10.0, rules=replace(RULES, noise_power_ratio=1e9))
