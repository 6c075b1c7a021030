"""What forbids a plain name."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_verdicts import made_verdict

from pymoo_hdte.discrepancy._selection import choice
from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.caveats import reasons_of, varies
from pymoo_hdte.discrepancy._selection.excess import HeldOutTest
from pymoo_hdte.discrepancy._selection.fitted_sets import FittedSets
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    contains,
    indistinguishable,
    label_of,
)
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._selection.search import Search
from pymoo_hdte.discrepancy._verdicts import mechanism_choice as measured
from pymoo_hdte.effects.unknowns import Parameter, unknown

FREEDOM = 1000
JUDGED = SimpleNamespace(rules=RULES, evident=frozenset())


def one(label, *, exact, releases=None):
    """A candidate without unknowns of its own."""
    name, _, place = label.partition(":")
    port, _, order = place.partition("@")
    of_place = {"name": name, "port": port, "order": float(order) if order else None}
    return SimpleNamespace(label=label, exact=exact, releases=releases, parameters=(), **of_place)


def fit_of(chi_square_per_degree, candidates, base=(), values=()):
    """A fit of these that leaves so much, with the values of base parameters."""
    layout = Layout(base)
    return SimpleNamespace(
        candidates=candidates,
        chi_square=chi_square_per_degree * FREEDOM,
        at_bounds=(),
        parameters=base,
        values=np.array(values),
        bound_sides=1.0 * (values >= layout.array("upper")) if base else np.zeros(0),
        places=[(each, slice(0, 0)) for each in candidates],
    )


def caveats(chi_square_per_degree, *candidates, base=(), values=()):
    """Caveats of a set that leaves so much, with no held-out record."""
    fitted = fit_of(chi_square_per_degree, candidates, base, values)
    quiet = chi_square_per_degree < 1.1
    search = SimpleNamespace(
        data=SimpleNamespace(rules=RULES),
        degrees_of_freedom=FREEDOM,
        enough=lambda chosen: quiet,
    )
    return reasons_of(search, Hypothesis(fitted, bic=0.0, explained=1.0), None)


FRICTION, LINE = one("stribeck:input", exact=False), one("kinematic_error:mesh@3", exact=True)
FREED = one("parameter:damping", exact=True, releases="damping")


@pytest.mark.parametrize(
    ("left", "candidates", "doubtful"),
    [
        (6.0, (FRICTION, FREED), True),
        (1.0, (FRICTION, FREED), False),
        (6.0, (FRICTION,), False),
        (6.0, (LINE, FREED), False),
        (6.0, (FREED,), False),
    ],
)
def test_values_beside_a_curve_that_does_not_quite_fit_are_not_certain(left, candidates, doubtful):
    """A rational fall of a friction was named Stribeck's with a damping that had not changed."""
    assert bool(caveats(left, *candidates)) == doubtful


CLEARANCE = one("clearance_variation:mesh@2", exact=False)


@pytest.mark.parametrize(
    ("left", "label", "doubtful"),
    [
        (2.1, "kinematic_error:mesh@4", True),
        (2.1, "kinematic_error:mesh@6", True),
        (2.1, "kinematic_error:mesh@3", False),
        (2.1, "kinematic_error:mesh@2", False),
        (2.1, "kinematic_error:mesh@1", False),
        (2.1, "torque_ripple:input@4", False),
        (2.1, "clearance_variation:mesh@4", False),
        (1.0, "kinematic_error:mesh@4", False),
    ],
)
def test_a_harmonic_of_another_effect_is_not_certain(left, label, doubtful):
    """A clearance with a harmonic was named with a kinematic error of order 4."""
    line = one(label, exact=True)
    assert bool(caveats(left, CLEARANCE, line)) == doubtful
    assert bool(caveats(left, line, CLEARANCE)) == doubtful


@pytest.mark.parametrize(
    ("prior", "value", "doubtful"),
    [(0.1, 1.0, True), (0.1, 0.9, False), (0.5, 1.0, False), (np.inf, 1.0, False)],
)
def test_a_sensor_far_beyond_what_is_stated_of_it_is_a_caveat(prior, value, doubtful):
    """Friction of the load that begins slowly was named with a dry one and a zero of ten times."""
    zero = Parameter("output_torque_zero", 0.0, -1.0, 1.0, 0.1, prior=prior)
    assert bool(caveats(1.0, FRICTION, base=(zero,), values=(value,))) == doubtful


def test_what_is_left_in_multiples_of_the_noise_is_a_caveat():
    limit = RULES.contradicting_chi_square
    assert not caveats(0.99 * limit, LINE)
    assert caveats(1.01 * limit, LINE)


def law(name, *, bounded=False, chi_square=1000.0):
    """A set of one law at the input with one unknown, which may have ended at its upper bound."""
    level = unknown("level", 0.0, 1.0, 0.1)
    only = Candidate(name, "input", (level,), ((0.0,),), lambda values: (), "")
    fitted = SimpleNamespace(
        candidates=(only,),
        chi_square=chi_square,
        bound_sides=np.array([1.0 if bounded else 0.0]),
        values=np.ones(1),
        places=[(only, slice(0, 1))],
    )
    return Hypothesis(fitted, bic=chi_square, explained=1.0)


@pytest.mark.parametrize(
    ("bounded", "left", "removed", "name"),
    [
        (True, 1000.0, 1e4, "coulomb_friction"),
        (True, 5000.0, 1e4, "stribeck_friction"),
        (False, 1000.0, 1e4, "coulomb_friction"),
        (False, 1050.0, 1e4, "stribeck_friction"),
        # What is left is then no more than a form that is off by two hundredths.
        (False, 1050.0, 1e6, "coulomb_friction"),
        (False, 5000.0, 1e8, "stribeck_friction"),
    ],
)
def test_the_special_case_that_does_as_well_stands_for_its_law(
    bounded, left, removed, name, monkeypatch
):
    """On a linear axis (EMPS) friction fell within less than the slowest speed."""
    monkeypatch.setattr(choice, "explains_as_listed", lambda search, one: True)
    best, simple = (
        law("stribeck_friction", bounded=bounded),
        law("coulomb_friction", chi_square=left),
    )
    search = SimpleNamespace(
        hypotheses=[best, simple],
        enough=lambda one: one.fit.chi_square < 1100.0,
        is_significant=lambda one: True,
        excess=removed,
        finished=lambda one: one,
        data=SimpleNamespace(rules=RULES),
    )
    ((chosen, _),) = choice.special_case(search, best).names
    assert chosen == name


@pytest.mark.parametrize(
    ("first", "second", "nested"),
    [
        (("play", "a", "b"), ("richer", "a", "b", "c"), True),
        # Values are a member of their own: a verdict compares sets of as many members.
        (("play",), ("richer", "a"), False),
        (("play", "a"), ("richer", "b"), False),
        (("play", "a", "b"), ("richer", "a"), False),
        # The same law with fewer values is no other law: whether each is needed is asked elsewhere.
        (("play", "a"), ("play", "a", "b"), False),
    ],
)
def test_a_special_case_may_need_fewer_values_than_the_law(first, second, nested, monkeypatch):
    """A play with a soft skin was named a clearance that varies, with a fourth value for it."""
    monkeypatch.setattr(Candidate, "holds", lambda one, other: one.name == "richer")

    def of(names):
        return set_of(a_law(names[0]), *freed(*names[1:]), left=1.0)

    assert contains(of(second), of(first)) == nested
    assert not contains(of(first), of(second))


def test_a_set_that_is_fitted_further_while_others_are_judged_is_judged_itself(monkeypatch):
    monkeypatch.setattr(choice, "explains_as_listed", lambda search, one: True)
    pair, trial, other, ended = (object() for _ in range(4))
    search = SimpleNamespace(hypotheses=[pair, other, trial])

    def earned(one):
        # Without one of its members the pair is what was only tried so far.
        if one is pair:
            search.hypotheses = [ended, pair, other]
        return one is not pair

    search.is_significant = earned
    assert choice.best_set(search) is ended


def test_the_smaller_set_of_least_bic_is_left_of_two_members_in_doubt(monkeypatch):
    monkeypatch.setattr(choice, "explains_as_listed", lambda search, one: True)
    monkeypatch.setattr(choice, "uncertain", lambda fitted, rules: ["first", "second"])

    def of(bic, *members):
        return SimpleNamespace(
            bic=bic, fit=SimpleNamespace(chi_square=bic), members=[(one,) for one in members]
        )

    both, alone = of(900.0, "first", "second"), {"first": of(1150.0, "f"), "second": of(990.0, "s")}
    search = SimpleNamespace(
        data=SimpleNamespace(rules=RULES, held_out_test=lambda before, after: None),
        without=lambda one, member: alone["second" if member == ("first",) else "first"],
        enough=lambda one: True,
    )
    assert choice.confirmed(search, both) is alone["second"]


def test_two_lines_of_one_name_are_no_special_case_of_one_of_them_and_another():
    """An eccentricity with its harmonic beside one with another line ended in an error."""

    def lines(*names):
        return set_of(*(Candidate(name, "sensor", (), ((),), None, "") for name in names), left=5.0)

    twice, mixed = lines("eccentricity", "eccentricity"), lines("eccentricity", "encoder_line")
    assert not contains(twice, mixed)
    assert not contains(mixed, twice)
    assert contains(twice, lines("eccentricity", "eccentricity"))


def set_of(*members, left, explained=0.9):
    """A set of laws, and values set free, that leaves so many times the noise beyond it."""
    chi_square = (1.0 + left) * FREEDOM
    fitted = SimpleNamespace(
        candidates=members, chi_square=chi_square, evidence=chi_square, n_base=0
    )
    return Hypothesis(fitted, bic=chi_square, explained=explained)


def a_law(name, releases=None):
    return Candidate(name, "mesh", (), ((),), lambda values: (), "", releases=releases)


def search_among(*found):
    base = SimpleNamespace(chi_square=40.0 * FREEDOM, residuals=np.zeros(FREEDOM))
    return SimpleNamespace(
        data=SimpleNamespace(rules=RULES),
        base=base,
        degrees_of_freedom=FREEDOM,
        hypotheses=found,
        of_size=lambda size: [one for one in found if len(one.members) == size],
        is_significant=lambda one: True,
    )


@pytest.mark.parametrize(
    ("size", "behind", "enough", "held", "resumed", "finished"),
    [
        (2, 1e4, True, 0.0, False, [0]),
        (2, 10.0, True, 0.0, False, [0, 1]),
        (2, 1e4, False, 0.0, False, [0, 1]),
        (1, 1e4, True, 0.0, False, [0]),
        (1, 1e3, True, 0.0, False, [0, 1]),
        (1, 1e4, True, 90.0, False, [0, 1]),
        (1, 1e4, False, 0.0, False, [0, 1]),
        (1, 1e4, True, 0.0, True, [0]),
        (1, 10.0, True, 0.0, True, [0, 1]),
    ],
)
def test_sets_far_behind_are_not_finished(size, behind, enough, held, resumed, finished):
    """Springs that slip took two minutes to end far behind a damping that explained all.

    A friction far behind a reaction took ten seconds again when the noise was renewed. A single
    effect whose other form may leave the same is finished: of 2e5 that is removed 5 x 0.0025.
    """
    sets = [SimpleNamespace(place=0, bic=0.0), SimpleNamespace(place=1, bic=behind)]
    for one in sets:
        one.fit = SimpleNamespace(chi_square=float(FREEDOM))
        one.members, one.removed = (None,) * size, 2e5
    done = []
    known = FittedSets.__new__(FittedSets)
    known.data, known.degrees_of_freedom = JUDGED, FREEDOM
    known._resumed = resumed
    known.of_size, known.enough = lambda wanted: sets, lambda one: enough
    known.held_by_sensors = lambda one: held
    known.finished = lambda one: done.append(one.place)
    known.finish_near(size)
    assert done == finished


@pytest.mark.parametrize(
    ("rest", "both", "removed", "earned"),
    [
        (0.6, 0.1, 30.0, True),
        (0.3, 0.1, 30.0, False),
        (0.6, 0.5, 30.0, False),
        (0.6, 0.1, 20.0, False),
    ],
)
def test_what_brings_a_sensor_s_gain_back_is_earned_also_beside_noise(rest, both, removed, earned):
    """A friction that grows with the load was left out beside a hysteresis and a gain of 6 sigma.

    Not what no far gain asks for, or what removes no more than noise gives.
    """
    gain = (Parameter("input_torque_gain", 0.0, -1.0, 1.0, 0.1, prior=0.1),)
    fits = {
        name: fit_of(left, (FRICTION,), gain, (value,))
        for name, left, value in (
            ("rest", 1.0, rest),
            ("both", 1.0 - removed / FREEDOM, both),
        )
    }
    known = FittedSets.__new__(FittedSets)
    known.data, known.degrees_of_freedom = JUDGED, FREEDOM
    known.base = SimpleNamespace(residuals=np.zeros(FREEDOM), values=())
    known.without = lambda one, member: SimpleNamespace(fit=fits["rest"])
    whole = SimpleNamespace(fit=fits["both"], members=[(LINE,), (FRICTION,)])
    assert known.is_significant(whole) == earned


def freed(*names):
    return tuple(replace(a_law("parameter", name), port=name) for name in names)


def test_all_sets_of_a_size_may_be_known_under_another_name():
    """An inertia in a viscous clutch ended in an error, as none was left of two sets."""
    known = Search.__new__(Search)
    known.degrees_of_freedom = FREEDOM
    known.data, known.candidates = JUDGED, [a_law("load_inertia")]
    # The effect in its place is no better.
    known._replace_by_effect = lambda one: None
    ripple, covered = a_law("ripple"), freed("load_inertia")
    covered = tuple(replace(one, covered_by="load_inertia") for one in covered)
    sets = [set_of(ripple, *covered, *more, left=1.0) for more in ((), freed("damping"))]
    known._by_label = {label_of(one.candidates): one for one in sets}
    known._left_out, known._whole_only = set(), False
    known.finished = lambda one: one
    known._prune_near(2)
    assert known.of_size(2) == []


@pytest.mark.parametrize(
    ("members", "left", "near"),
    [
        ((a_law("soft_windup"), a_law("damping_reference")), 5.01, True),
        ((a_law("soft_windup"), a_law("damping_reference")), 5.2, False),
        # More values beside the same effect are no other answer.
        ((a_law("hardening_stiffness"), *freed("stiffness", "damping", "inertia")), 5.01, False),
    ],
)
def test_an_effect_may_stand_for_several_values_beside_another(members, left, near):
    """A wind-up with more damping was a hardening with two values out of tolerance, plainly."""
    chosen = set_of(a_law("hardening_stiffness"), *freed("stiffness", "damping"), left=5.0)
    assert indistinguishable(set_of(*members, left=left), chosen, FREEDOM, RULES) == near


@pytest.mark.parametrize(
    ("others", "certain"),
    [
        ([set_of(a_law("backlash"), left=12.0)], True),
        ([set_of(a_law("backlash"), left=9.0)], False),
        # The same values and one more say nothing else.
        ([set_of(a_law("backlash"), left=12.0), set_of(*freed("damping", "drag"), left=5.0)], True),
        ([set_of(a_law("backlash"), left=12.0), set_of(*freed("inertia"), left=5.0)], False),
    ],
)
def test_a_set_stands_out_from_others_that_say_something_else(others, certain):
    chosen = set_of(*freed("damping"), left=5.0)
    assert choice.stands_out(search_among(chosen, *others), chosen) == certain


def test_sets_that_leave_the_same_stand_out_together():
    chosen, twin = set_of(a_law("eccentricity"), left=5.0), set_of(a_law("error"), left=5.0)
    search = search_among(chosen, twin)
    assert not choice.stands_out(search, chosen)
    assert choice.stands_out(search, chosen, [twin])
    third = set_of(a_law("ripple"), left=9.0)
    assert not choice.stands_out(search_among(chosen, twin, third), chosen, [twin])


def test_twins_are_told_apart_by_no_evidence_and_say_something_else(monkeypatch):
    monkeypatch.setattr(Candidate, "holds", lambda one, other: one.name == "richer")
    chosen = set_of(a_law("eccentricity"), left=5.0)
    twin, far, richer = (
        set_of(a_law(name), left=left)
        for name, left in (("error", 5.01), ("ripple", 5.2), ("richer", 5.0))
    )
    freed_alone = set_of(*freed("damping"), left=5.0)
    search = search_among(chosen, twin, far, richer, freed_alone)
    assert choice.competing_by_evidence(search, chosen) == [twin]


@pytest.mark.parametrize(("special_left", "name"), [(9.0, "hysteresis"), (11.0, "richer")])
def test_a_richer_law_that_leaves_a_misfit_is_no_more_certain_than_its_special_case(
    special_left, name, monkeypatch
):
    """Friction that varies with position left 5.311 times the noise, dry friction 5.328 times."""
    monkeypatch.setattr(Candidate, "holds", lambda one, other: one.name == "richer")
    rich = set_of(a_law("richer"), left=5.0)
    special = set_of(a_law("hysteresis"), left=special_left)
    ((chosen, _),) = choice.simpler_law(search_among(rich, special), rich).names
    assert chosen == name


def test_another_choice_keeps_the_rivals_that_name_as_much(monkeypatch):
    """A set with fewer values out of tolerance lost its rivals with more, and its class."""
    monkeypatch.setattr(measured, "_reasons", lambda data, base, one: [])
    chosen = set_of(a_law("richer"), *freed("a", "b"), left=1.0)
    simpler = set_of(a_law("play"), *freed("a"), left=1.0)
    rival = set_of(a_law("soft"), *freed("a", "b"), left=1.0)
    larger = set_of(a_law("soft"), a_law("play"), *freed("a"), left=1.0)
    verdict = made_verdict(
        "class", None, chosen, (simpler, rival, larger), (rival, larger), FREEDOM
    )
    found = measured._choosing(None, verdict, simpler)
    assert (found.status, found.chosen, found.equivalent) == ("class", simpler, (rival,))


def denials(change, share, misfit=1.0):
    """How often records kept out of the fit deny a change of which a share is true, in 4000.

    Beside what the model leaves unexplained: a misfit of so many times the noise's square.
    """
    rng = np.random.default_rng(5)
    predicted = np.zeros(40)
    predicted[0] = np.sqrt(change)
    measured = share * predicted + misfit**0.5 * rng.normal(size=(4000, 40))
    before, after = (np.sum((measured - one) ** 2, axis=1) for one in (0.0, predicted))
    held_out_tests = [HeldOutTest(*pair, change) for pair in zip(before, after, strict=True)]
    return np.mean([one.denies(RULES, misfit) for one in held_out_tests])


@pytest.mark.parametrize("misfit", [1.0, 4.0])
@pytest.mark.parametrize("change", [64.0, 200.0, 1e3, 1e6])
def test_records_deny_a_true_change_as_rarely_as_is_stated(change, misfit):
    # At most 2.3 %, two standard deviations of a normal value, and 0.5 % for 4000 draws.
    assert denials(change, 1.0, misfit) < 0.028


@pytest.mark.parametrize(("share", "denied"), [(0.0, 1.0), (0.5, 1.0), (0.9, 0.0)])
def test_records_deny_a_change_of_which_half_is_true_and_none_of_which_a_tenth_is_not(
    share, denied
):
    assert denials(1e3, share) == pytest.approx(denied, abs=0.01)


def test_a_play_that_stood_for_an_error_that_grows_with_load_is_denied():
    """As it was fitted from one start to a published case: its error shrinks by 0.02 of 54."""
    assert HeldOutTest(803.54, 803.52, 54.2).denies(RULES, 1.0)


def test_records_deny_a_change_with_which_their_prediction_diverges_and_none_that_prevents_it():
    assert HeldOutTest(1.0, np.inf, np.inf).denies(RULES, 1.0)
    assert not HeldOutTest(1.0, 0.0, np.inf).denies(RULES, 1.0)


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_a_line_that_is_noise_in_both_parts_is_seen_as_rarely_as_a_value(correlation):
    """Beyond a radius of r deviations lies exp(-r^2 / 2) of a plane, erfc(k / sqrt 2) of a line."""
    both_sides = math.erfc(RULES.certain_deviations / math.sqrt(2.0))
    radius = math.sqrt(-2.0 * math.log(both_sides))
    covariance = 0.04 * np.array([[1.0, correlation], [correlation, 1.0]])
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    border = radius * np.column_stack([np.cos(turns), np.sin(turns)])
    border = border @ np.linalg.cholesky(covariance).T
    line = SimpleNamespace(lines=[[0, 1]])
    for parts in border:
        assert varies(line, 1.001 * parts, covariance, RULES)
        assert not varies(line, 0.999 * parts, covariance, RULES)
