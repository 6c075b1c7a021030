"""A law that explains a misfit in another form, and laws that data cannot tell apart."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted_features import FEW, known_data, library, measured, with_sweep

from pymoo_hdte.discrepancy._evidence.order_lines.corrections import (
    AnyForce,
    AnyForceOfLoad,
    Correction,
    LoadRate,
)
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._report.document import effects_of
from pymoo_hdte.discrepancy._selection import any_form, choice, equivalents
from pymoo_hdte.discrepancy._selection.any_form import AnyForm
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.equivalents import undecided
from pymoo_hdte.discrepancy._selection.fitted_sets import FittedSets, is_significant
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import hypothesis_of, indistinguishable
from pymoo_hdte.discrepancy._selection.reason import NEEDS_ANOTHER_FORM
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._selection.search import Search
from pymoo_hdte.discrepancy._selection.verdict import judge
from pymoo_hdte.drive import CoupledInertia, DampingReference, KinematicReaction, LoadInertia
from pymoo_hdte.effects.friction import CoulombFriction, smoothed_sign
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import Aperiodic, Response
from pymoo_hdte.effects.unknowns import unknown, wave

SPEEDS = (10.0, 40.0, 150.0, 500.0, 1200.0, 2000.0)
LOADS = (5.0, 40.0, 20.0, 10.0, 30.0)
DATA = known_data(
    [(speed, LOADS[(2 * k + j) % 5]) for k, speed in enumerate(SPEEDS) for j in (0, 1)],
    [1.0, 2.0, 2.02, 3.0],
)
REACTION = "kinematic_reaction:input"
OF_LOAD, LOAD = "load_dependent_friction:input", "load_inertia:output"


def steep(state):
    """Friction that grows with a power of the load; what most powers share looks like a gain."""
    sign, sharp = smoothed_sign(state.speed)
    size = 0.1 * np.abs(state.load) ** 1.6
    return Response(size * sign, damping=size * sharp)


CLUTCH = (LoadInertia(0.03), *(LoadRate(k, 0.03 * (-5e-4) ** k) for k in (1, 2, 3, 4)))
"""Inertia in a viscous clutch, which brings it to speed within half a millisecond."""
MISFITS = {OF_LOAD: (Correction("input", AnyForceOfLoad(steep)),), LOAD: CLUTCH}
LABELS = [OF_LOAD, pytest.param(LOAD, marks=pytest.mark.nightly)]
NEAREST = {OF_LOAD: "stribeck_friction:input", LOAD: "damping_reference:mesh"}


def planted(label, seed=1):
    return measured(MISFITS[label], np.random.default_rng(seed), DATA)[0]


def judged(label, data):
    laws = [one for one in library(DATA) if one.label in (label, NEAREST[label])]
    return judge(data, fit(data), laws)


@pytest.mark.parametrize("label", LABELS)
def test_a_law_is_named_in_part_whose_listed_form_explains_little(label):
    """What the base and another effect imitate of it leaves nothing that the listed form has."""
    data = planted(label)
    found = judged(label, data)
    assert (found.status, found.chosen.label) == ("partial", label)
    assert found.chosen.explained < RULES.explained_share
    assert found.has_reason(NEEDS_ANOTHER_FORM)
    assert AnyForm(data, found.base).explains_in_another_form(found.chosen)
    assert RULES.partial_share < found.in_another_form <= 1.0


@pytest.mark.nightly
@pytest.mark.parametrize("label", LABELS)
def test_without_its_forms_nothing_tells_that_such_a_law_has_another(label, monkeypatch):
    monkeypatch.setattr(Data, "corrections", lambda self, candidate: [])
    found = judged(label, planted(label))
    assert found.status == ("partial" if label == LOAD else "unlisted")
    assert not found.has_reason(NEEDS_ANOTHER_FORM)


def test_a_form_far_from_the_listed_one_is_followed_there(monkeypatch):
    """To first order around an inertia that is rigid a slow clutch leaves more than noise."""
    slow = (LoadInertia(0.3), *(LoadRate(k, 0.3 * (-5e-4) ** k) for k in (1, 2, 3, 4)))
    data = measured(slow, np.random.default_rng(1), DATA)[0]
    forms = AnyForm(data, fit(data))
    (law,) = [one for one in library(DATA) if one.label == LOAD]
    found = fit(data, [law], np.append(forms.base.values, 0.3))
    one = hypothesis_of(found, forms.excess)
    assert forms.explains_in_another_form(one)
    monkeypatch.setattr(any_form, "in_free_form", lambda data, fitted: fitted)
    assert not AnyForm(data, forms.base).explains_in_another_form(one)


def test_a_force_of_another_argument_is_no_form_of_a_law():
    """A torque that pulses with the input's angle is no friction, damping or inertia."""

    def pulsing(state):
        size = 0.02 * np.cos(state.phase(3.0)) ** 3
        return Response(size)

    data = measured([Correction("input", AnyForce(pulsing, (3.0, 9.0)))], None, DATA)[0]
    forms = AnyForm(data, fit(data))
    laws = [one for one in library(DATA) if one.label in (*MISFITS, *NEAREST.values())]
    search = Search(data, forms.base, laws)
    for law in laws:
        start = np.append(forms.base.values, law.starts[0])
        assert not search.forms.explains_in_another_form(search.fitted((law,), start))


def test_each_curve_of_a_form_counts_as_an_unknown():
    """What is left is noise either way, but the criterion has to gain beyond the curves."""
    data = planted(OF_LOAD)
    (law,) = [one for one in library(DATA) if one.label == OF_LOAD]
    forms = AnyForm(data, fit(data))
    one = Search(data, forms.base, [law]).fitted(
        (law,), np.append(forms.base.values, law.starts[0])
    )
    assert forms.explains_in_another_form(one)
    # As much as it removes, so that the curves alone are too many.
    removed = forms.excess - forms.unexplained(one.fit).excess
    stricter = replace(data, rules=replace(RULES, bic_gain=removed - 1.0))
    assert not AnyForm(stricter, forms.base).explains_in_another_form(one)


def test_the_chosen_set_may_explain_in_another_form_where_no_single_effect_does():
    members = {name: a_law(name) for name in ("first", "second")}
    alone = {name: a_set(one) for name, one in members.items()}
    both = a_set(*members.values())
    search = SimpleNamespace(
        data=SimpleNamespace(corrections=lambda candidate: [], rules=RULES),
        candidates=list(members.values()),
        hypotheses=[both, *alone.values()],
        finished=lambda one: one,
        forms=forms_that_explain(lambda one: one is both),
    )
    assert choice.in_another_form(search, both, ()) == [both]
    search.forms.explains_in_another_form = lambda one: one is not alone["first"]
    assert choice.in_another_form(search, both, ()) == [alone["second"]]
    # A machine whose laws have no known other forms.
    search.data.corrections = lambda candidate: None
    assert choice.in_another_form(search, both, ()) == []


def a_law(name, port="mesh", parameters=(), order=None, holds=()):
    class Law(Candidate):
        def holds(self, other):
            return other.name in holds

    start = tuple(one.start for one in parameters)
    return Law(name, port, tuple(parameters), (start,), lambda values: (), "", order=order)


def a_set(*members, values=(), spread=1e-3, chi_square=1000.0, removed=1e5):
    """Members with fitted values, all of one spread."""
    ends = np.cumsum([0, *(len(one.parameters) for one in members)]).tolist()
    fitted = SimpleNamespace(
        values=np.array(values),
        covariance=spread**2 * np.eye(len(values)),
        places=[(one, slice(*ends[k : k + 2])) for k, one in enumerate(members)],
        chi_square=chi_square,
        evidence=chi_square,
    )
    return SimpleNamespace(
        candidates=members,
        effects=[one for one in members if one.releases is None],
        released=[one for one in members if one.releases is not None],
        fit=fitted,
        listed=True,
        exact=False,
        bic=chi_square,
        removed=removed,
        names=frozenset((one.name, one.port) for one in members),
    )


def forms_that_explain(which):
    return SimpleNamespace(explains_in_another_form=which, in_free_form=lambda fitted: fitted)


@pytest.mark.nightly
@pytest.mark.parametrize(("inertia", "status"), [(0.03, "partial"), (0.0, "unlisted")])
def test_a_form_of_an_inertia_that_is_not_there_names_none(inertia, status):
    """A load on a soft sensor moves as further inertia would that hangs on a spring."""
    loose = [LoadRate(2, 3e-8), LoadRate(1, -1.5e-5), LoadRate(4, 2e-15)]
    effects = [*loose, *([LoadInertia(inertia)] if inertia else [])]
    data = measured(effects, np.random.default_rng(1), DATA)[0]
    assert judged(LOAD, data).status == status


def freed_value(name):
    """A base parameter out of tolerance."""
    return replace(a_law("parameter", name), releases=name, exact=True)


WIDTH = unknown("half_width", 0.0, 1.0, 0.1)
PLAY = a_law("play", parameters=[WIDTH])
VARYING = a_law(
    "varying", parameters=[*wave("variation", 1.0, 0.1), WIDTH], order=1.0, holds=("play",)
)


@pytest.mark.parametrize(
    ("variation", "spread", "open_to_both"),
    [(0.0, 0.01, False), (0.0, 0.1, True), (0.15, 0.01, True), (0.05, 0.01, False)],
)
def test_a_play_that_may_vary_as_much_as_it_is_wide_is_not_shown_to_be_steady(
    variation, spread, open_to_both
):
    """Held flanks show a varying play as a line of the static error, which has a tolerance."""
    steady = a_set(PLAY, values=[0.1])
    varies = a_set(VARYING, values=[0.0, variation, 0.1], spread=spread)
    assert undecided(varies, steady, RULES) == open_to_both


@pytest.mark.parametrize(("excess", "open_to_both"), [(0.004, True), (0.006, False)])
def test_a_friction_that_falls_by_a_twentieth_may_be_dry(excess, open_to_both):
    """Dry friction whose sign is a root was named one that falls with speed by a thirtieth."""
    level, fading = unknown("level", 0.0, 1.0, 0.1), unknown("fading", 1.0, 100.0, 10.0)
    falls = [level, unknown("excess", 0.0, 1.0, 0.1), fading]
    dry = a_set(a_law("dry", "input", [level]), values=[0.1])
    falling = a_set(a_law("falling", "input", falls, holds=("dry",)), values=[0.1, excess, 30.0])
    assert undecided(dry, falling, RULES) == open_to_both


@pytest.mark.parametrize(("spread", "open_to_both"), [(3e-4, False), (1e-3, True)])
def test_a_line_is_the_form_of_what_does_not_vary_only_if_it_may_be_nothing(spread, open_to_both):
    """A play with a skin, which a sweep showed wider, was named one that varies by 0 to 3 % of it.

    The width where the input is locked is a number of its own of a play that varies.
    """
    varies = a_set(VARYING, values=[0.001, 0.0, 0.1], spread=spread)
    assert undecided(a_set(PLAY, values=[0.1]), varies, RULES) == open_to_both


@pytest.mark.parametrize(
    ("port", "overlap", "near"),
    [("mesh", True, True), ("output", True, False), ("mesh", False, False)],
)
def test_forms_of_two_laws_at_one_port_overlap(port, overlap, near):
    """A soft skin on one flank was named a soft wind-up, which left 3.1e-2 less of the whole.

    The springs of a circuit that was measured (Silverbox) are told apart by less.
    """
    further = 2.0 * RULES.form_accuracy**2 * 1e5
    soft = a_set(a_law("soft_windup"))
    play = a_set(a_law("backlash", port), chi_square=1000.0 + further)
    assert indistinguishable(play, soft, 1000, RULES, overlap) == near


@pytest.mark.parametrize(
    ("law", "value", "near"),
    [("backlash", "stiffness", True), ("backlash", "damping", False), ("own", "stiffness", False)],
)
def test_values_out_of_tolerance_beside_two_laws_do_not_tell_their_forms_apart(law, value, near):
    """Blind case stressed 16: a play with a soft skin was named a soft wind-up, values beside it.

    Of an effect of one's own other forms are not known, and another value is another answer.
    """
    further = 2.0 * RULES.form_accuracy**2 * 1e5
    soft = a_set(a_law("soft_windup"), freed_value("stiffness"))
    play = a_set(a_law(law), freed_value(value), chi_square=1000.0 + further)
    sets = FittedSets.__new__(FittedSets)
    sets.data = SimpleNamespace(
        rules=RULES, corrections=lambda one: [] if one.name in ("own", "parameter") else ["form"]
    )
    sets.degrees_of_freedom, sets.forms = 1000, AnyForm.__new__(AnyForm)
    sets.forms.data = sets.data
    assert sets.indistinguishable(play, soft) == near


@pytest.mark.parametrize(("exact", "near"), [(True, False), (False, True)])
def test_lines_beside_a_law_are_told_apart_by_what_they_do_themselves(exact, near):
    """A line of the drive was in a class with one of the encoder that left 650 more of the noise.

    Both stood beside a soft wind-up, and had no other form.
    """
    places = (("kinematic_error", "mesh"), ("encoder_line", "sensor"))
    lines = (replace(a_law(*place), exact=exact) for place in places)
    ours, theirs = (a_set(a_law("soft_windup"), one) for one in lines)
    theirs.fit.chi_square = theirs.fit.evidence = 1650.0
    for one in (ours, theirs):
        one.removed = 3.5e6
    assert indistinguishable(theirs, ours, 1000, RULES) == near


def test_one_effect_at_one_order_or_another_is_one_member_of_a_class():
    """A play that varies once or twice in a turn made four of a class of three effects."""
    soft, once, twice = a_set(a_law("soft")), *(a_set(a_law("varying", order=k)) for k in (1, 2))
    same = a_set(a_law("soft", order=1.0))
    assert equivalents.distinct(soft, [once, twice, same]) == [once]


@pytest.mark.parametrize(("evidence", "members"), [(1122.0, 1), (1105.0, 2)])
def test_what_contains_a_member_of_a_class_has_to_be_a_rival_of_that(
    evidence, members, monkeypatch
):
    """Two frictions beside three springs made a class of five, of which two had needless terms."""
    monkeypatch.setattr(equivalents, "explains_in_any_form", lambda search, one: True)
    level, fading = unknown("level", 0.0, 1.0, 0.1), unknown("excess", 0.0, 1.0, 0.1)
    dry = a_law("dry", "output", [level])
    falling = a_law("falling", "output", [level, fading], holds=("dry",))
    soft, play = a_law("soft_windup"), a_law("backlash")
    chosen = a_set(dry, soft, values=[0.1])
    rival = a_set(dry, play, values=[0.1], chi_square=1100.0)
    further = a_set(falling, play, values=[0.1, 0.05], chi_square=1095.0)
    further.fit.evidence, further.fit.bound_sides = evidence, np.zeros(2)
    search = SimpleNamespace(
        hypotheses=[chosen, rival, further],
        data=SimpleNamespace(rules=RULES),
        indistinguishable=lambda one, other: indistinguishable(
            one, other, 1000, RULES, overlap=True
        ),
        is_significant=lambda one: True,
    )
    assert equivalents.competing_sets(search, chosen) == [rival, further][:members]
    # One effect at two orders is no special case of itself.
    search.hypotheses = [chosen, rival, a_set(dry, a_law("backlash", order=2.0), chi_square=1105.0)]
    assert equivalents.competing_sets(search, chosen) == search.hypotheses[1:]


@pytest.mark.parametrize(
    ("share", "port", "noise", "told"),
    [
        (0.9, "mesh", True, True),
        (1.1, "mesh", True, False),
        (0.9, "output", True, False),
        (0.9, "mesh", False, False),
    ],
)
@pytest.mark.parametrize("shared", [(), ("stiffness",)])
def test_a_value_out_of_tolerance_may_stand_for_the_form_of_another_law(
    shared, share, port, noise, told, monkeypatch
):
    """Blind case single 940: a play with a soft skin was named a soft wind-up and an amplitude."""
    monkeypatch.setattr(equivalents, "explains_in_any_form", lambda search, one: True)
    *both, amplitude = map(freed_value, (*shared, "error_amplitude_1"))
    chosen = a_set(a_law("soft_windup"), *both, amplitude)
    further = share * RULES.form_share**2 * 1e5
    play = a_set(a_law("backlash", port), *both, chi_square=1000.0 + further)
    search = SimpleNamespace(
        hypotheses=[chosen, play],
        data=SimpleNamespace(rules=RULES),
        excess=1e5,
        indistinguishable=lambda one, other: indistinguishable(
            one, other, 1000, RULES, overlap=True
        ),
        is_significant=lambda one: True,
        forms=SimpleNamespace(unexplained_is_noise=lambda fitted: noise),
    )
    assert equivalents.competing_sets(search, chosen) == ([play] if told else [])


@pytest.mark.parametrize(
    ("order", "line_port", "in_one"),
    [(4.0, "mesh", True), (3.5, "mesh", False), (4.0, "sensor", False), (1.0, "mesh", False)],
)
def test_a_play_with_a_line_may_be_a_play_that_varies_otherwise_than_as_a_cosine(
    order, line_port, in_one
):
    """A clearance with a harmonic was named a kinematic error of order 4 with a backlash."""
    line = a_law("kinematic_error", line_port, order=order)
    wide = a_set(VARYING)
    search = SimpleNamespace(
        candidates=[PLAY, line, VARYING],
        alone=lambda one: wide,
        finished=lambda one: one,
        forms=forms_that_explain(lambda one: one is wide),
        data=SimpleNamespace(rules=RULES),
    )
    assert choice.in_one_law(search, a_set(line, PLAY)) == ([wide] if in_one else [])
    assert choice.in_one_law(search, a_set(PLAY)) == []


@pytest.mark.parametrize(("acts_at", "earned"), [("input", False), ("mesh", True)])
def test_a_damping_out_of_tolerance_may_be_the_form_of_a_drag_at_its_port(
    acts_at, earned, monkeypatch
):
    """A fluid that thins was named a drag with a damping that had not changed."""
    drag = a_law("drag", "input")
    freed = Candidate("parameter", "b", (), ((),), lambda v: (), "", releases="b", acts_at=acts_at)
    monkeypatch.setattr(
        "pymoo_hdte.discrepancy._selection.fitted_sets.ill_explained", lambda *arguments: [0]
    )
    whole = {"base": 1e6, "rest": 4000.0, "both": 100.0}

    def fitted(name):
        return SimpleNamespace(name=name, chi_square=1000.0 + whole[name], residuals=np.zeros(1000))

    base = fitted("base")
    base.values = np.zeros(0)
    data = SimpleNamespace(
        rules=RULES,
        model_error_share=RULES.model_accuracy**2,
        excess=lambda fit: SimpleNamespace(of_parts=np.array([whole[fit.name]])),
    )
    rest = SimpleNamespace(fit=fitted("rest"), exact=False, candidates=(drag,))
    both = SimpleNamespace(fit=fitted("both"), candidates=(drag, freed))
    assert is_significant(data, base, both, rest, (freed,)) == earned


class Bristles(Aperiodic):
    """Dahl's friction of 1.2 N.m, whose bristles bend by 25 urad."""

    def respond(self, state):
        path = state.path(state.position)
        torque = np.zeros_like(path)
        for step in range(path.shape[1]):
            way = path[:, step] - (path[:, step - 1] if step else 0.0)
            before = torque[:, step - 1] if step else 0.0
            slipped = 1.2 * np.sign(way)
            torque[:, step] = slipped + (before - slipped) * np.exp(-np.abs(way) / 25e-6)
        return Response(state.back(torque), (1.2 + 0.0 * state.position) / 25e-6)


class DryWithBristles(CoulombFriction):
    """Dry friction in a record that turns on, and bristles in a sweep with the input locked."""

    before_slip = Bristles()


def test_dry_friction_whose_bristles_bend_is_no_hysteresis_of_the_mesh():
    """The sweep shows a loop as that of a hysteresis, of which no record has the lines."""
    effect = Correction("output", DryWithBristles(1.2))
    rng = np.random.default_rng(2)
    data = with_sweep(measured((effect,), rng, FEW)[0], (effect,), rng)
    wanted = {"hysteresis:mesh", "presliding_friction:output"}
    laws = [one for one in library(data) if one.label in wanted]
    found = judge(data, fit(data), laws)
    assert (found.status, found.chosen.label) == ("named", "presliding_friction:output")
    (_, place), covariance = found.chosen.fit.places[0], found.chosen.fit.covariance
    deviation = np.sqrt(np.diag(covariance)[place][0])
    assert found.chosen.fit.values[place][0] == pytest.approx(1.2, abs=3.0 * deviation + 1e-3)


def test_a_reaction_that_lags_behind_is_a_reaction():
    """The generator's answer need not be in phase with the slope of the error."""

    def lag(state):
        return Response(1e-3 * np.asarray(state.load) * np.cos(state.phase(2.0) + 0.3))

    effects = (KinematicReaction(1.0), Correction("input", AnyForceOfLoad(lag, (2.0,))))
    data = measured(effects, np.random.default_rng(1), DATA)[0]
    found = judge(data, fit(data), [one for one in library(DATA) if one.label == REACTION])
    assert found.leaves_more_than_noise
    assert (found.status, found.chosen.label) == ("named", REACTION)


@pytest.fixture(scope="module")
def moved():
    """A search in data of a reaction and more inertia, which its covered parameter explains."""
    data = measured((KinematicReaction(1.0), LoadInertia(0.05)), np.random.default_rng(3), DATA)[0]
    laws = [one for one in library(DATA) if one.label in (REACTION, LOAD)]
    search = Search(data, fit(data), laws)
    freed = data.out_of_tolerance(["load_inertia", "output_damping"], together=True)
    (reaction,) = [one for one in laws if one.label == REACTION]
    values = np.append(search.base.values, 1.0)
    return search, search.finished(search.fitted((reaction, *freed), values))


def test_a_parameter_that_an_effect_covers_is_told_as_that_effect(moved):
    search, one = moved
    search._prune(one)
    assert {each.label for each in search.hypotheses[0].candidates} == {REACTION, LOAD}
    assert "parameter:load_inertia" not in {
        c.label for one in search.hypotheses for c in one.candidates
    }


IN_A_CLUTCH = "load_inertia/coupled:output"


@pytest.mark.nightly
def test_an_inertia_in_a_clutch_is_named_as_such():
    """Not as a rigid one beside a damping of the torsion that imitates what the clutch loses."""
    data = measured((CoupledInertia(0.05, 3e-4),), np.random.default_rng(1), DATA)[0]
    laws = (LOAD, IN_A_CLUTCH, "damping_reference:mesh")
    found = judge(data, fit(data), [one for one in library(DATA) if one.label in laws])
    assert (found.status, found.chosen.label) == ("named", IN_A_CLUTCH)
    values = found.chosen.values_of(found.chosen.candidates)[-2:]
    deviations = np.sqrt(np.diag(found.chosen.fit.covariance)[-2:])
    assert np.all(np.abs(values - (0.05, 3e-4)) < 4.0 * deviations)


def test_values_that_an_effect_covers_are_replaced_by_a_form_of_it():
    """A damping and an inertia out of tolerance stood for an inertia in a clutch."""
    truth = (KinematicReaction(1.0), CoupledInertia(0.05, 3e-4))
    data = measured(truth, np.random.default_rng(3), DATA)[0]
    laws = [one for one in library(DATA) if one.label in (REACTION, LOAD, IN_A_CLUTCH)]
    search = Search(data, fit(data), laws)
    freed = data.out_of_tolerance(["load_inertia", "damping"], together=True)
    (reaction,) = [one for one in laws if one.label == REACTION]
    one = search.fitted((reaction, *freed), np.append(search.base.values, 1.0))
    search._exchange_forms(one)
    found = {frozenset(each.label for each in other.candidates) for other in search.hypotheses}
    assert {REACTION, IN_A_CLUTCH} in found
    assert {REACTION, IN_A_CLUTCH, "parameter:damping"} not in found


BOTH = {REACTION, LOAD, "damping_reference:mesh"}


@pytest.mark.nightly
def test_no_parameter_is_freed_beside_the_effect_that_covers_it():
    truth = (LoadInertia(0.03), DampingReference(3.0), KinematicReaction(1.0))
    data = measured(truth, np.random.default_rng(3), DATA)[0]
    found = judge(data, fit(data), [one for one in library(DATA) if one.label in BOTH])
    assert {one.label for one in found.chosen.candidates} == BOTH


@pytest.mark.nightly
def test_two_covered_parameters_that_are_both_needed_stay(moved, monkeypatch):
    """No one effect covers both."""
    monkeypatch.setattr(Search, "_needless", lambda self, one, fewer: False)
    data = moved[0].data
    search = Search(data, fit(data), [one for one in library(DATA) if one.label in BOTH])
    freed = data.out_of_tolerance(["load_inertia", "damping"], together=True)
    one = search.fitted(tuple(freed), search.base.values)
    assert search._prune(one).released == tuple(freed)


def test_a_parameter_is_covered_only_by_an_effect_that_may_be_missing(moved):
    """A believed effect stands for nothing else."""
    search, _ = moved
    freed = search.data.out_of_tolerance(["load_inertia", "damping"], together=True)
    assert search._covered(freed) == {"parameter:load_inertia"}


def test_a_parameter_out_of_tolerance_removes_more_than_the_misfit_lets_it(moved, monkeypatch):
    """Where eight times the noise is left, what removes thrice the cost of a parameter is noise."""
    search, one = moved
    cost, freedom = np.log(len(one.fit.residuals)), search.degrees_of_freedom
    monkeypatch.setattr(Search, "enough", lambda self, one: False)

    def needless(left, removed):
        sets = [
            replace(one, fit=SimpleNamespace(chi_square=value, residuals=one.fit.residuals,
                                             candidates=one.candidates))
            for value in (left, left + removed)
        ]  # fmt: skip
        return search._needless(*sets)

    assert needless(freedom, 0.9 * cost)
    assert not needless(freedom, 3.0 * cost)
    assert needless(8.0 * freedom, 3.0 * cost)
    assert not needless(8.0 * freedom, 9.0 * cost)
    monkeypatch.setattr(Search, "enough", lambda self, one: True)
    assert needless(freedom, 3.0 * cost)


@pytest.mark.nightly
def test_the_force_of_uneven_springs_lies_in_the_interval_that_is_told_of_it():
    """On a bench written apart two of nine did: the error of a form counted as noise."""
    rng = np.random.default_rng(1)
    shares, slips = rng.exponential(1.0, 12), np.exp(rng.uniform(np.log(3e-5), np.log(6e-4), 12))
    effects = tuple(
        Correction("mesh", MaxwellSlip(2.0 * share, slip, 1e-3))
        for share, slip in zip(shares / shares.sum(), slips, strict=True)
    )
    records = known_data([(40.0, 40.0), (500.0, 5.0)], [1.0, 2.0])
    data = with_sweep(measured(effects, rng, records)[0], effects, rng)
    found = judge(data, fit(data), [one for one in library(data) if one.label == "hysteresis:mesh"])
    lower, upper = effects_of(found)[0]["parameters"]["force"]["interval95"]
    assert lower < 2.0 < upper
    assert upper - lower < 0.2 * 2.0

    def half_width(left):
        """Without noise, were so many times as much left."""
        quiet = replace(found.chosen.fit, jacobian=1e6 * found.chosen.fit.jacobian)
        quiet = replace(quiet, residuals=np.sqrt(left) * quiet.residuals)
        (effect,) = effects_of(replace(found, chosen=replace(found.chosen, fit=quiet)))
        stated = effect["parameters"]["force"]
        return (stated["interval95"][1] - stated["value"]) / stated["value"]

    assert half_width(1e-3) == pytest.approx(RULES.model_accuracy, rel=1e-3)
    most = 1.96 * np.sqrt(1.0 - RULES.explained_share)
    assert RULES.model_accuracy < half_width(1.0) < half_width(2.0) < half_width(1e5)
    assert [half_width(1e5), half_width(1e6)] == pytest.approx([most, most], rel=1e-2)


@pytest.mark.nightly
def test_uneven_springs_of_the_mesh_need_no_friction_whose_contacts_bend():
    """Friction that shows in the sweep alone could follow whatever another form leaves there."""
    effects = tuple(
        Correction("mesh", MaxwellSlip(force, torsion, spread))
        for force, torsion, spread in ((1.2, 3e-5, 1.0), (1.2, 3e-4, 2.5))
    )
    rng = np.random.default_rng(2)
    records = known_data([(40.0, 40.0), (150.0, 5.0), (500.0, 20.0), (1200.0, 40.0)], [1.0, 2.0])
    data = with_sweep(measured(effects, rng, records)[0], effects, rng)
    wanted = {"hysteresis", "coulomb_friction", "presliding_friction"}
    found = judge(data, fit(data), [one for one in library(data) if one.name in wanted])
    assert found.leaves_more_than_noise
    assert found.chosen.label == "hysteresis:mesh"
    assert not any("presliding" in one.label for one in (*found.equivalent, *found.alternatives))
