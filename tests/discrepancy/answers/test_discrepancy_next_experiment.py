"""The next experiment: closed forms of the separation, and the twins that no record separates."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_verdicts import made_verdict
from planted_features import analysed, known_data, listed, measured

from pymoo_hdte.discrepancy._answers.next_test_drive import nearest_rivals, next_experiment
from pymoo_hdte.discrepancy._answers.planned_tests import Grid, Model, separation
from pymoo_hdte.discrepancy._answers.where.location import locate
from pymoo_hdte.discrepancy._report.document import verdict_document
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.units import ARCSEC


def judged(data, chosen, *others, equivalent=()):
    base = fit(data)
    verdict = made_verdict("class" if equivalent else "named", base, chosen, others, equivalent)
    return DriveFinding(data.campaign, data, verdict, ())


def hypothesis_of(data, candidate, start, bic=0.0):
    values = np.concatenate([[parameter.start for parameter in data.base], start])
    return Hypothesis(fit(data, (candidate,), values), bic, 1.0)


def test_separation_in_closed_form():
    # One feature, difference 3, noise 1, uncertainties 2 and 1 of the two predictions.
    steady = np.array([True])
    one = Model("one", np.array([[0.0]]), np.array([[[2.0]]]), steady)
    other = Model("other", np.array([[3.0]]), np.array([[[1.0]]]), steady)
    assert separation(one, other) == pytest.approx([9.0 / (1.0 + 4.0 + 1.0)])
    # Where the drive would rattle by one of the models nothing is predicted.
    assert separation(one, replace(other, steady=~steady)) == [0.0]


def test_an_eccentric_encoder_is_to_be_clocked_anew():
    data = known_data()
    candidate = listed(data, "eccentricity")
    data, _ = measured(candidate.build((3.0 * ARCSEC, 1.0 * ARCSEC)))
    chosen = hypothesis_of(data, candidate, candidate.starts[0])
    proposal = next_experiment(judged(data, chosen))
    assert proposal.test == "reclocked_encoder"
    assert proposal.separates == ("eccentricity:sensor@0.009901", "kinematic_error:mesh@0.009901")
    # Twice the line over its noise, 0.03 arcsec in each part of a correlation of 0.3.
    pair = 2.0 * np.array([3.0, 1.0])
    block = 0.03**2 * np.array([[1.0, 0.3], [0.3, 1.0]])
    expected = pair @ np.linalg.solve(block, pair)
    assert proposal.expected_separation == pytest.approx(expected, rel=0.05)


def test_dry_friction_at_the_input_asks_for_the_other_direction():
    data = known_data()
    candidate = listed(data, "coulomb_friction")
    assert candidate.port == "input"
    data, _ = measured(candidate.build((0.02,)))
    chosen = hypothesis_of(data, candidate, (0.02,))
    proposal = next_experiment(judged(data, chosen))
    assert proposal.speed_rpm < 0.0
    assert "tare" in proposal.description
    assert proposal.separates == ("coulomb_friction:input", "zero error of the input torque sensor")
    # Twice the level over the noise of 0.1 mN.m, which what the fit leaves open may half drown.
    clear = (2.0 * 0.02 / 1e-4) ** 2
    assert 0.5 * clear < proposal.expected_separation < clear


def test_the_level_of_a_friction_that_falls_asks_for_the_other_direction():
    """It was known to 70 %, and a test was proposed against what was 3·10⁵ of BIC away."""
    data = known_data()
    candidate = listed(data, "stribeck_friction")
    values = 0.01, 0.01, 20.0
    data, _ = measured(candidate.build(values))
    proposal = next_experiment(judged(data, hypothesis_of(data, candidate, values)))
    assert proposal.speed_rpm < 0.0
    assert proposal.description.startswith("The level of stribeck friction (input) and a zero")


def test_a_rival_is_told_apart_by_a_record_that_the_two_predict_apart():
    data = known_data()
    ripple, line = listed(data, "torque_ripple", [6.0]), listed(data, "kinematic_error", [6.0])
    data, _ = measured(ripple.build((0.005, 0.0)), np.random.default_rng(7))
    chosen, other = (
        hypothesis_of(data, ripple, ripple.starts[0]),
        hypothesis_of(data, line, line.starts[0], 50.0),
    )
    proposal = next_experiment(judged(data, chosen, other))
    assert proposal.separates == (chosen.label, other.label)
    assert proposal.expected_separation > 9.0
    assert (proposal.test == "running") == (proposal.speed_rpm is not None)


@pytest.mark.parametrize(
    ("of_class", "said"),
    [
        (True, "distinguish torque ripple (input, order 6) from kinematic error (mesh, order 6)."),
        (False, "against kinematic error (mesh, order 6) and nonlinear drag (input) is"),
    ],
)
def test_what_two_members_of_a_class_share_is_not_to_be_told_apart(of_class, said, monkeypatch):
    """Three values out of tolerance beside both were told twice of the next test."""
    data = known_data()
    ripple, line = listed(data, "torque_ripple", [6.0]), listed(data, "kinematic_error", [6.0])
    drag = listed(data, "nonlinear_drag")

    def beside_drag(candidate):
        alone = hypothesis_of(data, candidate, candidate.starts[0]).fit
        both, values = (candidate, drag), np.append(alone.values, drag.starts[0])
        return Hypothesis(fit(data, both, values), 0.0, 1.0)

    chosen, other = beside_drag(ripple), beside_drag(line)
    monkeypatch.setitem(
        next_experiment.__globals__, "separation", lambda *_: np.array([10.0, 90.0, 40.0])
    )
    finding = judged(data, chosen, other, equivalent=(other,) if of_class else ())
    assert said in next_experiment(finding).description


def test_the_test_to_make_tells_the_chosen_effect_from_its_nearest_rival(monkeypatch):
    """Of the least separations 10, 5 and 30 the last is largest, though 90 stands elsewhere."""
    data = known_data()
    ripple, line = listed(data, "torque_ripple", [6.0]), listed(data, "kinematic_error", [6.0])
    drag = listed(data, "nonlinear_drag")
    data, _ = measured(ripple.build((0.005, 0.0)), np.random.default_rng(7))
    chosen, *others = (hypothesis_of(data, one, one.starts[0]) for one in (ripple, line, drag))
    finding = judged(data, chosen, *others)

    def proposed(*separations):
        given = iter(np.array(separations))
        monkeypatch.setitem(next_experiment.__globals__, "separation", lambda *_: next(given))
        return next_experiment(finding)

    proposal = proposed([10.0, 90.0, 40.0], [80.0, 5.0, 30.0])
    assert proposal.expected_separation == 30.0
    assert proposal.separates == (chosen.label, others[1].label)
    # No test tells the first rival: the best one is for the second.
    proposal = proposed([1.0, 8.0, 4.0], [80.0, 5.0, 30.0])
    assert proposal.expected_separation == 80.0
    assert proposal.separates == (chosen.label, others[1].label)
    said = "from kinematic error (mesh, order 6)."
    assert said in proposal.description
    # No test tells both at once: the best one is for the nearer.
    proposal = proposed([10.0, 90.0, 4.0], [8.0, 5.0, 30.0])
    assert proposal.expected_separation == 90.0
    assert proposal.separates == (chosen.label, others[0].label)
    # No test tells either from the chosen one.
    proposal = proposed([1.0, 8.0, 4.0], [7.0, 5.0, 3.0])
    assert (proposal.test, proposal.speed_rpm, proposal.load_torque) == ("none", None, None)
    assert proposal.description.startswith("No test")
    assert proposal.expected_separation == 8.0


def test_an_adequate_model_asks_for_its_least_certain_record():
    data, _ = measured(rng=np.random.default_rng(8))
    analysis = analysed(data, "adequate")
    proposal = next_experiment(analysis)
    grid = Grid.of(analysis)
    variance = np.sum(grid.model(analysis.verdict.base).influence ** 2, axis=(1, 2))
    assert proposal.separates is None
    assert proposal.expected_separation == pytest.approx(variance[: len(grid.speed_rpm)].max())


def test_a_record_that_the_campaign_has_is_called_a_repeat():
    # The grid has loads 0, 20 and 40 N.m; nothing was measured at 20.
    data, _ = measured(data=known_data([(rpm, t) for rpm in (10.0, 2000.0) for t in (0.0, 40.0)]))
    grid = Grid.of(analysed(data, "adequate"))
    assert grid.load_torque.tolist() == [0.0, 20.0, 40.0, 0.0, 20.0, 40.0]
    said = [grid.condition(test)[0] for test in range(6)]
    for what, load in zip(said, grid.load_torque, strict=True):
        assert what.startswith("a record at" if load == 20.0 else "a repeat of the record at")
    assert grid.condition(6)[0].startswith("a torsion sweep")
    turned = [SimpleNamespace(**(vars(one) | {"input_speed": -one.input_speed}))
              for one in data.campaign.running]  # fmt: skip
    data.campaign.running = turned
    grid = Grid.of(analysed(data, "adequate"))
    assert not grid.repeats.any()


def fake(*names):
    return SimpleNamespace(
        names=frozenset(names),
        candidates=(SimpleNamespace(name="law", is_value=False),),
        listed=True,
        bic=0.0,
        fit=names,
    )


def test_a_superset_of_the_named_effects_is_no_rival():
    verdict = made_verdict("named", None, fake("a"), (fake("a", "b"), fake("c"), fake("c", "a")))
    assert nearest_rivals(verdict) == [("c",)]


def test_the_same_effect_beside_other_values_is_a_rival():
    """It was passed over, and a set that was rejected was said to be of the class."""
    a, values = ("a", "mesh"), [("parameter", one) for one in ("K", "J", "B")]
    one, other = fake(a, *values[:2]), fake(a, *values[1:])
    rejected = fake(a, ("c", "mesh"))
    verdict = made_verdict("class", None, one, (other, rejected), (other,))
    assert nearest_rivals(verdict) == [other.fit, rejected.fit]


def test_what_contains_the_chosen_effects_is_a_rival_in_their_class():
    one, more = fake(("a", "mesh")), fake(("a", "mesh"), ("b", "mesh"))
    assert nearest_rivals(made_verdict("class", None, one, (more,), (more,))) == [more.fit]


def test_a_record_in_which_a_clearance_would_rattle_separates_nothing():
    """A repeat of one was proposed that had been left out because no load held the flanks."""
    data = known_data([(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 40.0)])
    play, soft = listed(data, "backlash"), listed(data, "soft_windup")
    data, _ = measured(play.build((1e-5,)), np.random.default_rng(2), data)
    grid = Grid.of(analysed(data, "adequate"))
    models = [grid.model(hypothesis_of(data, one, one.starts[0]).fit) for one in (play, soft)]
    running = slice(len(grid.speed_rpm))
    assert models[1].steady.all()
    assert models[0].steady[running].tolist() == (grid.load_torque > 0.0).tolist()
    assert not separation(*models)[running][grid.load_torque == 0.0].any()


def test_no_test_is_made_up_between_effects_that_explain_nothing():
    verdict = made_verdict("unlisted", None, fake("a"), (fake("c"),))
    verdict.chosen.explained = 0.3
    data, _ = measured(data=known_data())
    finding = DriveFinding(data.campaign, data, replace(verdict, base=fit(data)), ())
    proposal = next_experiment(finding)
    assert (proposal.test, proposal.separates) == ("none", None)
    assert "comes near" in proposal.description


def test_a_planned_sweep_is_told_by_the_torques_at_which_it_turns():
    data, _ = measured(data=known_data([(10.0, 0.0), (200.0, 0.0), (2000.0, 40.0)]))
    grid = Grid.of(analysed(data, "adequate"))
    assert "between -10 and 10 N.m" in grid.condition(len(grid.speed_rpm))[0]


def test_the_verdict_gives_amplitude_and_phase_with_their_intervals():
    data = known_data()
    candidate = listed(data, "kinematic_error", [3.0])
    data, _ = measured(candidate.build((1.5 * ARCSEC, 0.5 * ARCSEC)), np.random.default_rng(9))
    analysis = analysed(data, "named", candidate, candidate.starts[0])
    proposal = next_experiment(analysis)
    document = verdict_document(analysis, locate(analysis), None, proposal)
    document = json.loads(json.dumps(document, allow_nan=False))
    effect = document["effects"][0]
    amplitude, phase = effect["parameters"]["amplitude"], effect["parameters"]["phase"]
    fitted = analysis.verdict.chosen.fit
    drawn = np.random.default_rng(10).multivariate_normal(
        fitted.values[-4:-2], fitted.covariance[-4:-2, -4:-2], 20000
    )
    for entry, sample in (
        (amplitude, np.hypot(*drawn.T)),
        (phase, np.arctan2(drawn[:, 1], drawn[:, 0])),
    ):
        half = (entry["interval95"][1] - entry["interval95"][0]) / 2.0
        assert half == pytest.approx(1.96 * sample.std(), rel=0.05)
        assert entry["value"] == pytest.approx(sample.mean(), abs=0.05 * half)
    assert amplitude["interval95"][0] < np.hypot(1.5, 0.5) * ARCSEC < amplitude["interval95"][1]
    assert (amplitude["unit"], phase["unit"]) == ("rad", "rad")
    assert "reason" in document["held_out"]
