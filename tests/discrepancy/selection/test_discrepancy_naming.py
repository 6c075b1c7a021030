"""The verdict on planted features: what is named, what is not, and which rule decides."""

from dataclasses import replace

import numpy as np
import pytest
from planted_features import CONDITIONS, judged, known_data, library, measured
from scipy.stats import chi2

from pymoo_hdte.discrepancy._evidence.order_lines.objective import Objective
from pymoo_hdte.discrepancy._report.document import effects_of, sentence
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import adequate
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.units import ARCSEC

SCALE = 46.0 / 101.0
"""Order of a line that an encoder shows 46 times in its turn."""
ORDERS = [1.0, 2.0, 2.02, 3.0, 4.0, 5.0, 6.0]
EMPTY = known_data(CONDITIONS[::2], ORDERS)
LOADS = (5.0, 12.0, 20.0, 30.0, 40.0)
WITH_LOADS = known_data([(rpm, load) for rpm in (30.0, 300.0) for load in LOADS], ORDERS)
"""Flanks are held in all records."""
OF_ENCODER = known_data(CONDITIONS[::2], [1.0 / 101.0, SCALE, *ORDERS])
"""With orders of the output's encoder, which make every solution much longer."""
RIPPLE, LINE = "torque_ripple:input@5", "kinematic_error:mesh@3"
SOFT, CUBIC = "soft_windup:mesh", "hardening_stiffness:mesh"
CORNER = "hardening_stiffness/corner:mesh"
DRAG, OUTPUT_FRICTION = "nonlinear_drag:input", "coulomb_friction:output"
OF_LOAD = "load_dependent_friction:input"
REACTION, INERTIA = "kinematic_reaction:input", "load_inertia:output"
SEEN = [3.0, 5.0]
FEW = [RIPPLE, LINE, SOFT, REACTION, INERTIA, "nonlinear_drag:input"]
"""Rivals enough where the rule is tested and not the choice among all."""


def of_labels(labels, seen=SEEN, empty=EMPTY):
    found = {candidate.label: candidate for candidate in library(empty, seen)}
    return [found[label] for label in labels]


def planted(effects, seed=4, seen=SEEN, empty=EMPTY, **changes):
    """Data of a drive with effects, given as a mapping of labels to values."""
    built = [
        effect
        for candidate, values in zip(of_labels(effects, seen, empty), effects.values(), strict=True)
        for effect in candidate.build(values)
    ]
    return measured(tuple(built), np.random.default_rng(seed), empty, **changes)[0]


def disturbed(data, chi_square, record=3):
    """Add to one record's input torque a line that no drive has, worth so much of chi-square."""
    values, place = data.features.values.copy(), data.features.places(1)[ORDERS.index(4.0), 0]
    shift = np.zeros_like(values)
    shift[record, place] = 1.0
    worth = np.sum(data.whiten(shift) ** 2)
    return replace(
        data, features=replace(data.features, values=values + shift * np.sqrt(chi_square / worth))
    )


def verdict_on(data, labels=None, seen=SEEN, **changed):
    """The verdict by the rules of the data, or by those that are changed."""
    data = replace(data, rules=replace(data.rules, **changed))
    hypotheses = library(data, seen) if labels is None else of_labels(labels, seen)
    return judged(data, hypotheses)


def labels_of(verdict):
    return {candidate.label for candidate in verdict.chosen.candidates}


@pytest.fixture(scope="module")
def ripple():
    data = planted({RIPPLE: (0.003, 0.001)})
    return data, verdict_on(data)


def test_adequacy_in_closed_form():
    assert adequate(1400, RULES) == pytest.approx(1.0 + 4.0 * np.sqrt(2.0 / 1400.0))
    assert adequate(1400, RULES) == pytest.approx(1.15, abs=0.005)
    # Chi-square has the variance 2 f: four standard deviations, of a normal one in 30000.
    for degrees_of_freedom in (100, 1000, 10000):
        assert (
            chi2.sf(degrees_of_freedom * adequate(degrees_of_freedom, RULES), degrees_of_freedom)
            < 3e-4
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (2, 3))]
)
def test_a_clean_drive_within_its_tolerances_misses_nothing(seed):
    stiffness, inertia = np.random.default_rng(seed).uniform(0.92, 1.08, 2)
    verdict = verdict_on(planted({}, seed, stiffness=stiffness, input_inertia=inertia))
    assert verdict.status == "adequate"
    assert verdict.chosen is None
    assert verdict.base.chi_square == pytest.approx(
        verdict.degrees_of_freedom, abs=4.0 * np.sqrt(2.0 * verdict.degrees_of_freedom)
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "values", "rivals"),
    [
        (SOFT, (0.3, 3e-4, 3.0), FEW),
        # Straight pieces, as in catalogues: a corner sharper than any that points can resolve.
        pytest.param(SOFT, (0.3, 8e-4, 300.0), FEW, marks=pytest.mark.nightly),
        pytest.param(SOFT, (0.3, 3e-4, 3.0), None, marks=pytest.mark.nightly),
        pytest.param(REACTION, (1.0,), FEW, marks=pytest.mark.nightly),
        pytest.param(INERTIA, (0.03,), FEW, marks=pytest.mark.nightly),
    ],
)
def test_a_planted_effect_is_named_with_its_values(label, values, rivals):
    planted_data = planted({label: values})
    verdict = verdict_on(planted_data, rivals)
    assert verdict.status == "named"
    assert labels_of(verdict) == {label}
    fitted = verdict.chosen.fit
    # By the ratio of likelihoods: softening, torsion and sharpness trade off along a curve. The
    # noise is that of the drive with the effect.
    data = planted_data.with_noise_of(fitted) or planted_data
    objective = Objective(data, fitted.candidates)
    truth = objective.residuals(np.append(objective.start[: len(data.base)], values))
    assert truth @ truth - fitted.chi_square < chi2.isf(1e-4, len(fitted.values))
    degrees_of_freedom = verdict.degrees_of_freedom
    assert fitted.chi_square < adequate(degrees_of_freedom, RULES) * degrees_of_freedom


@pytest.mark.slow
def test_no_interval_is_narrower_than_the_error_of_the_model_itself(ripple):
    """Amplitudes of a ripple were stated to 5e-5 and were off by 3e-4 on a bench written apart."""
    _, verdict = ripple
    fitted = verdict.chosen.fit
    quiet = replace(fitted, jacobian=1e3 * fitted.jacobian)
    (effect,) = effects_of(replace(verdict, chosen=replace(verdict.chosen, fit=quiet)))
    stated = effect["parameters"]["amplitude"]
    lower, upper = stated["interval95"]
    half = RULES.exact_model_accuracy * stated["value"]
    assert (upper - lower) / 2.0 == pytest.approx(half, rel=0.01)
    # Its form is exact: what is left is no error of it.
    left = replace(quiet, residuals=1.5 * quiet.residuals)
    (again,) = effects_of(replace(verdict, chosen=replace(verdict.chosen, fit=left)))
    assert again["parameters"]["amplitude"]["interval95"] == pytest.approx([lower, upper], rel=1e-5)
    (loud,) = effects_of(verdict)
    lower, upper = loud["parameters"]["amplitude"]["interval95"]
    assert (upper - lower) / 2.0 > 2.0 * half


@pytest.mark.nightly
def test_the_same_data_give_the_same_verdict_to_the_last_bit(ripple):
    data, verdict = ripple
    again = verdict_on(data)
    assert again.status == verdict.status
    assert again.chosen.fit.values.tobytes() == verdict.chosen.fit.values.tobytes()
    assert [one.label for one in again.alternatives] == [one.label for one in verdict.alternatives]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "values"),
    [
        ("stribeck_friction:input", (0.0, 0.05, 80.0)),
        pytest.param(
            "position_dependent_friction:input@2", (0.01, 0.0, 0.0), marks=pytest.mark.nightly
        ),
    ],
)
def test_a_part_that_an_effect_does_not_have_speaks_not_against_it(label, values):
    """Friction that falls with speed without a level, or varies about a mean of zero."""
    verdict = verdict_on(planted({label: values}), [label, RIPPLE, "coulomb_friction:input"])
    assert labels_of(verdict) == {label}
    assert (verdict.status, verdict.reasons) == ("named", ())


@pytest.mark.slow
def test_two_effects_are_both_named():
    data = planted({RIPPLE: (0.003, 0.0), LINE: (1.0 * ARCSEC, 0.0)})
    verdict = verdict_on(data, FEW)
    assert verdict.status == "named"
    assert labels_of(verdict) == {RIPPLE, LINE}


NOWHERE = (0.0, 1e-3, 100.0)
"""A spring that is not stiffer beyond a torsion that no record reaches: no slope leads away."""


@pytest.mark.nightly
def test_no_interval_of_a_torsion_holds_what_is_below_zero():
    """A time of a clutch was told as -7e-4 to 7e-4 s."""
    verdict = verdict_on(planted({SOFT: (0.3, 3e-4, 3.0)}), [SOFT])
    fitted = verdict.chosen.fit
    vague = replace(fitted, jacobian=1e-3 * fitted.jacobian)
    (effect,) = effects_of(replace(verdict, chosen=replace(verdict.chosen, fit=vague)))
    lower, upper = effect["parameters"]["torsion"]["interval95"]
    assert lower == 0.0 < upper
    assert effect["parameters"]["softening"]["interval95"][0] < 0.0


@pytest.mark.nightly
def test_an_inertia_is_as_certain_as_the_interval_that_is_told_of_it():
    """The believed one may be at the end of its tolerance, which no record tells from the rest."""
    verdict = verdict_on(planted({INERTIA: (0.015,)}), [INERTIA, LINE])
    assert "load_inertia" in verdict.chosen.fit.at_bounds
    lower, upper = effects_of(verdict)[0]["parameters"]["inertia"]["interval95"]
    assert 0.0 < lower < 0.015 < upper
    assert (verdict.status, verdict.reasons) == ("named", ())


@pytest.mark.slow
def test_a_second_effect_shows_where_no_single_part_contradicts_the_first():
    """The whole does, by little, and friction of the load takes nearly all of it."""
    friction = "load_dependent_friction:input"
    data = planted({SOFT: (0.3, 8e-4, 3.0), friction: (0.095,)}, empty=WITH_LOADS)
    soft = fit(data, of_labels([SOFT], empty=WITH_LOADS))
    assert not data.excess(soft).significant(data.rules).any()
    verdict = verdict_on(data, [*FEW, friction])
    assert verdict.status == "named"
    assert labels_of(verdict) == {SOFT, friction}


def test_a_stiffness_out_of_tolerance_is_a_parameter_and_no_effect():
    verdict = verdict_on(planted({}, stiffness=1.2), FEW)
    assert verdict.status == "parameter"
    assert [candidate.releases for candidate in verdict.chosen.candidates] == ["stiffness"]
    place = Layout(verdict.base.parameters).index("stiffness")
    deviation = np.sqrt(verdict.chosen.fit.covariance[place, place])
    wanted = 1.2 * EMPTY.base[place].start
    assert verdict.chosen.fit.values[place] == pytest.approx(wanted, abs=4.0 * deviation)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "values"),
    [
        (LINE, (2e-6, 1e-6)),
        pytest.param(SOFT, (0.3, 3e-4, 3.0), marks=pytest.mark.nightly),
    ],
)
def test_a_value_out_of_tolerance_is_found_beside_an_effect(label, values):
    """An effect that left 1.84 per degree of freedom beside a wrong amplitude was named alone."""
    verdict = verdict_on(planted({label: values}, error_amplitude_0=1.6), FEW)
    assert verdict.status == "named"
    assert labels_of(verdict) == {label, "parameter:error_amplitude_0"}
    place = Layout(verdict.base.parameters).index("error_amplitude_0")
    fitted = verdict.chosen.fit
    deviation = np.sqrt(fitted.covariance[place, place])
    assert fitted.values[place] == pytest.approx(1.6 * EMPTY.base[place].start, abs=4.0 * deviation)


@pytest.mark.parametrize(
    ("label", "value", "beside"),
    [
        pytest.param(INERTIA, 0.02, {}, marks=pytest.mark.nightly),
        pytest.param(INERTIA, 0.02, {RIPPLE: (0.003, 0.001)}, marks=pytest.mark.nightly),
        ("damping_reference:mesh", 3.0, {}),
        pytest.param(
            "damping_reference:mesh", 3.0, {LINE: (2e-6, 1e-6)}, marks=pytest.mark.nightly
        ),
    ],
)
def test_an_effect_has_no_rival_in_the_base_parameter_that_it_changes(label, value, beside):
    """Not even where another parameter ended at its bound as well, before the effect was found."""
    verdict = verdict_on(planted({label: (value,), **beside}), [label, RIPPLE, LINE])
    assert (verdict.status, labels_of(verdict)) == ("named", {label, *beside})
    assert verdict.probability > 0.95


@pytest.mark.slow
def test_an_eccentric_encoder_comes_with_the_line_that_nothing_tells_it_from():
    label = "eccentricity:sensor@0.009901"
    seen = [1.0 / 101.0]
    verdict = verdict_on(
        planted({label: (2.0 * ARCSEC, 0.5 * ARCSEC)}, seen=seen, empty=OF_ENCODER), seen=seen
    )
    assert verdict.status == "class"
    names = {
        one.name
        for hypothesis in (verdict.chosen, *verdict.equivalent)
        for one in hypothesis.candidates
    }
    assert names == {"eccentricity", "kinematic_error"}


@pytest.mark.nightly
def test_what_nothing_tells_apart_is_a_class_beside_two_other_effects():
    """Of a line of the encoder or of the drive the likelier pair alone was extended by a third."""
    line = "eccentricity:sensor@0.009901"
    effects = {line: (2.0 * ARCSEC, 0.5 * ARCSEC), RIPPLE: (0.003, 0.001), INERTIA: (0.03,)}
    seen = [1.0 / 101.0, 5.0]
    data = planted(effects, seen=seen, empty=OF_ENCODER)
    verdict = verdict_on(data, [*effects, "kinematic_error:mesh@0.009901"], seen)
    assert verdict.status == "class"
    both = [
        labels_of(verdict),
        *({one.label for one in each.candidates} for each in verdict.equivalent),
    ]
    assert len(both) == 2
    assert {RIPPLE, INERTIA, line} in both


@pytest.mark.nightly
def test_an_error_of_the_encoder_s_scale_is_described_though_it_is_in_no_list():
    label = f"encoder_line:sensor@{SCALE:.4g}"
    verdict = verdict_on(
        planted({label: (2.0 * ARCSEC, 0.0)}, seen=[SCALE], empty=OF_ENCODER), seen=[SCALE]
    )
    assert verdict.status == "unlisted"
    assert labels_of(verdict) == {label}
    assert "encoder errs 46 times in its turn" in sentence(verdict)


def test_a_line_too_small_for_the_whole_chi_square_is_found_by_its_gain():
    data = planted({RIPPLE: (3e-5, 0.0)})
    verdict = verdict_on(data, [RIPPLE, LINE])
    degrees_of_freedom = verdict.degrees_of_freedom
    assert verdict.base.chi_square < adequate(degrees_of_freedom, RULES) * degrees_of_freedom
    assert (verdict.status, labels_of(verdict)) == ("named", {RIPPLE})


def test_the_excess_of_all_parts_is_that_of_the_fit_where_cells_are_independent():
    data = planted({CUBIC: (2e9,)})
    variances = np.diagonal(data.covariance, axis1=1, axis2=2)
    vars(data)["covariance"] = np.eye(variances.shape[1]) * variances[:, None]
    vars(data).pop("whiteners", None)
    found = fit(data)
    excess = data.excess(found)
    start, prior = (
        np.array([getattr(one, name) for one in found.parameters]) for name in ("start", "prior")
    )
    priors = np.sum(((found.values - start) / prior) ** 2)
    total = excess.of_parts.sum() + excess.degrees_of_freedom.sum()
    assert total == pytest.approx(found.chi_square - priors)
