"""Numbers of known effects move within tolerances of their own; those without one stay."""

from dataclasses import replace

import numpy as np
import pytest
from quick_campaigns import ripple_analysis_and_report, ripple_campaign

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import analyse, read_campaign, write_campaign
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import out_of_tolerance
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import training_data
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_unit, words_of
from pymoo_hdte.discrepancy._records.believed_model import single_tolerances
from pymoo_hdte.discrepancy._records.known_values import known_values, with_known_values
from pymoo_hdte.discrepancy._report.document import base_parameters
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.drive import expected_orders
from pymoo_hdte.drive import KinematicErrorLine, LawAtPort
from pymoo_hdte.drive._effects import MeshStiffnessVariation
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.effects.sentence_blanks import in_words
from pymoo_hdte.effects.unknowns import Parameter

AMPLITUDE, LEVEL = "torque_ripple.input.3.amplitude", "coulomb_friction.input.level"
TRUE_AMPLITUDE = 0.02
FRICTION = LawAtPort("coulomb_friction", "input", CoulombFriction(0.01))


@pytest.fixture(scope="module")
def holding():
    """A campaign that believes the ripple it has, and a friction that it does not have."""
    analysis, _ = ripple_analysis_and_report()
    campaign = ripple_campaign().believing(analysis.revised_model())
    believed = replace(campaign.believed, effects=(*campaign.believed.effects, FRICTION))
    return replace(campaign, believed=believed)


def with_amplitude(campaign, share, **tolerances):
    """Return the campaign with a share of the ripple's amplitude, and tolerances by word."""
    believed = campaign.believed
    effects = with_known_values(believed.effects, {AMPLITUDE: share * TRUE_AMPLITUDE})
    named = {
        {"amplitude": AMPLITUDE, "level": LEVEL}[word]: one for word, one in tolerances.items()
    }
    return replace(campaign, believed=replace(believed, effects=effects, tolerances=named))


def data_of(campaign):
    orders = expected_orders(campaign, RULES)
    return training_data(campaign, measure(campaign, campaign.train, orders))


@pytest.mark.nightly
def test_a_number_that_may_move_explains_the_records_and_reaches_the_model(holding):
    campaign = with_amplitude(holding, 0.8, amplitude=0.3, level=0.99)
    analysis = analyse(campaign)
    assert analysis.verdict.status == "adequate"
    found = known_values(analysis.revised_model().effects)
    assert found[AMPLITUDE] == pytest.approx(TRUE_AMPLITUDE, rel=0.02)
    # The friction that is not there falls far below what is believed, the second ripple stays.
    assert found[LEVEL] < 0.5 * known_values(campaign.believed.effects)[LEVEL]
    second = AMPLITUDE.replace(".3.", ".6.")
    assert found[second] == known_values(campaign.believed.effects)[second]
    written = base_parameters(analysis.verdict.accepted, analysis.verdict.rules)[AMPLITUDE]
    assert written["unit"] == "N.m"
    assert written["value"] == found[AMPLITUDE]


def test_a_number_without_tolerance_stays_whatever_moves_beside_it(holding):
    moving = fit(data_of(with_amplitude(holding, 0.8, amplitude=0.3)))
    staying = fit(data_of(with_amplitude(holding, 0.8, level=0.99)))
    assert moving.chi_square < 1.3 * len(moving.residuals)
    assert staying.chi_square > 2.0 * len(staying.residuals)


def test_a_number_at_its_bound_is_a_candidate_that_explains_the_rest(holding):
    campaign = with_amplitude(holding, 0.6, amplitude=0.1)
    data = data_of(campaign)
    base = fit(data)
    (freed,) = [one for one in data.out_of_tolerance(base.at_bounds) if one.releases == AMPLITUDE]
    assert freed.sentence == (
        "The amplitude of the torque ripple of order 3 at the input lies outside its tolerance."
    )
    found = fit(data, (freed,), base.values)
    assert found.chi_square < 1.3 * len(found.residuals)
    assert base.chi_square > 2.0 * len(base.residuals)


@pytest.mark.nightly
def test_a_number_that_wants_to_leave_its_tolerance_is_the_verdict(holding):
    verdict = analyse(with_amplitude(holding, 0.6, amplitude=0.1)).verdict
    assert (verdict.status, verdict.chosen.label) == ("parameter", f"parameter:{AMPLITUDE}")


def test_a_number_whose_law_does_not_take_ten_times_as_much_is_no_candidate():
    effects = (MeshStiffnessVariation(0.2, 0.3), FRICTION)
    depth = "mesh_stiffness_variation.2.depth"
    base = [Parameter(depth, 0.2, 0.1, 0.3, 0.1), Parameter(LEVEL, 0.01, 0.005, 0.015, 0.005)]
    (found,) = out_of_tolerance(base, (depth, LEVEL), (), effects=effects)
    assert found.releases == LEVEL


def test_vectors_with_numbers_of_their_own_predict_as_each_alone(holding):
    """Every law is solved for its own numbers, sweeps included, in the order of the vectors."""
    hysteresis = LawAtPort("hysteresis", "mesh", MaxwellSlip(1.5, 3e-4))
    force = "hysteresis.mesh.force"
    believed = holding.believed
    believed = replace(
        believed,
        effects=(*believed.effects, hysteresis),
        tolerances={AMPLITUDE: 0.5, force: 0.5, "stiffness": 0.2},
    )
    campaign = replace(holding, believed=believed)
    data = training_data(campaign, measure(campaign, campaign.train, [1.0, 2.0, 2.02, 3.0]))
    names = [one.name for one in data.base]
    vectors = np.tile([one.start for one in data.base], (4, 1))
    changes = [{}, {force: 2.0}, {"stiffness": 1.1 * believed.stiffness}, {AMPLITUDE: 0.025}]
    for row, change in zip(vectors, changes, strict=True):
        for name, value in change.items():
            row[names.index(name)] = value
    together, swept = data.predict(vectors, ()), data.torsion_residuals(vectors, ())
    for place, vector in enumerate(vectors):
        numbers = dict(zip(names, vector, strict=True))
        effects = with_known_values(believed.effects, numbers)
        alone = replace(
            data, campaign=replace(campaign, believed=replace(believed, effects=effects))
        )
        # The numbers of the vector are those of the effects here, so that none is exchanged.
        np.testing.assert_allclose(alone.predict(vector[None], ())[0], together[place], rtol=1e-6)
        np.testing.assert_allclose(alone.torsion_residuals(vector[None], ())[0], swept[place])
    assert not np.allclose(together[0], together[1], rtol=1e-3)


def test_a_new_zero_is_told_with_its_time():
    """It was called new_zero/1446 s (sensor) on the first screen."""
    said = in_words("new_zero/1446 s:sensor+load_inertia:output")
    assert said == "new zero (sensor, 1446 s) and load inertia (output)"


def test_numbers_have_names_words_and_units():
    effects = (
        LawAtPort("torque_ripple", "input", PeriodicTorque(2.04, 0.4, 0.01)),
        KinematicErrorLine(3.7, 1e-5, 0.3),
        LawAtPort("hysteresis", "mesh", MaxwellSlip(1.5, 3e-4)),
    )
    assert known_values(effects)["torque_ripple.input.2.04.amplitude"] == 0.01
    assert words_of("kinematic_error.3.7.amplitude", ()) == (
        "amplitude of the kinematic error of order 3.7"
    )
    said = in_words("the nearest is parameter:kinematic_error.3.7.amplitude.")
    assert said == "the nearest is kinematic error 3.7 amplitude (out of tolerance)."
    assert base_unit("kinematic_error.3.7.amplitude") == "rad"
    assert base_unit("hysteresis.mesh.torsion") == "rad"
    assert not any(name.endswith(("order", "phase")) for name in known_values(effects))
    assert with_known_values(effects, {"kinematic_error.3.7.amplitude": 2e-5})[1].amplitude == 2e-5


@pytest.mark.parametrize(
    "text",
    ["coulomb_friction.input.level = 0.3", '"coulomb_friction.input.level" = 0.3'],
)
def test_a_file_takes_them_with_dots_or_in_quotes(text, holding, tmp_path):
    write_campaign(with_amplitude(holding, 0.8, amplitude=0.3), tmp_path / "rig")
    file = tmp_path / "rig" / "campaign.toml"
    table = "[believed.tolerances]\n"
    file.write_text(file.read_text().replace(table, f"{table}{text}\n"))
    read = read_campaign(tmp_path / "rig").believed
    assert read.tolerances == {AMPLITUDE: 0.3, LEVEL: 0.3}
    assert known_values(read.effects) == pytest.approx(
        known_values(with_amplitude(holding, 0.8).believed.effects), rel=1e-9
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("coulomb_friction.input.levle = 0.3", r"line \d+: believed.tolerances.*input.levle'"),
        ("coulomb_friction.output.level = 0.3", r"believed.tolerances is 'coulomb_friction.out"),
        ("torque_ripple.input.3.phase = 0.3", r"believed.tolerances is .*phase'"),
        ("torque_ripple.input.3.amplitude = 1.5", r"tolerances.*input.3.amplitude is 1.5"),
        ("coulomb_friction.input = 0.3", r"believed.tolerances is|coulomb_friction.input"),
        ("stifness = 0.3", r"believed.tolerances.stifness"),
    ],
)
def test_a_wrong_name_or_number_is_refused_by_its_field(text, words, holding, tmp_path):
    write_campaign(with_amplitude(holding, 0.8, level=0.3), tmp_path / "rig")
    file = tmp_path / "rig" / "campaign.toml"
    old = '"coulomb_friction.input.level" = 0.3'
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, text))
    with pytest.raises(InvalidInput, match=words):
        read_campaign(tmp_path / "rig")


def test_beside_a_model_they_stand_in_the_table_of_tolerances():
    table = Fields({"stiffness": 0.05, "coulomb_friction": {"input": {"level": 0.3}}}, "tolerance")
    assert single_tolerances(table) == {"stiffness": 0.05, LEVEL: 0.3}
