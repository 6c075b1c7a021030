"""An effect of a user's own, defined in one file, goes everywhere an effect of the package goes."""

import json
from dataclasses import replace

import numpy as np
import pytest
from kept_results import kept, put_files
from measured_oscillator import EYRING_DRAG, OF_ROTOR, ROTOR, EyringDrag, reported, rotor_record
from quick_campaigns import CONDITIONS
from virtual_rig_cases import BELIEVED, RIG

from experiments.studies.virtual_rig.own_effects import with_effects
from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import MeasuredMechanism, analyse, read_mechanism_model
from pymoo_hdte.drive import (
    DriveModel,
    LawAtPort,
    harmonic_balance,
    load_datasheet,
    load_model,
    preset,
    simulate_drive,
)
from pymoo_hdte.effects import known_effects, register, registered
from pymoo_hdte.problems import RobustDTE

PLANTED = EyringDrag(level=0.03, knee=30.0)
SLOW = tuple(Condition(speed, 20.0, 500.0, 2, "train") for speed in (300.0, 400.0, 800.0))


@pytest.fixture(autouse=True, scope="module")
def known():
    with registered(EYRING_DRAG):
        yield


@pytest.fixture(scope="module")
def drive():
    calm = preset("calibrated")
    drag = LawAtPort("eyring_drag", "input", PLANTED)
    return replace(calm, name="draggy", effects=(*calm.effects, drag))


@kept
def analysis_and_report():
    """Return what is found on a rig whose motor has to overcome the drag too, and its files."""
    rng = np.random.default_rng(3)
    rig = draw_rig(BELIEVED, (), rng)
    campaign = run_campaign(rig, BELIEVED, RIG, rng, (*CONDITIONS, *SLOW))
    drag = LawAtPort("eyring_drag", "input", PLANTED)
    found = analyse(with_effects(campaign, rig, [drag]), effects=[EYRING_DRAG])
    return reported(found)


@pytest.fixture(scope="module")
def analysis():
    return analysis_and_report()[0]


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    out = tmp_path_factory.mktemp("own")
    put_files(analysis_and_report()[1], out)
    return out


@pytest.mark.slow
def test_drive_overcomes_it():
    calm = preset("published")
    draggy = replace(calm, effects=(LawAtPort("eyring_drag", "input", PLANTED),))
    mean = [
        harmonic_balance(model.coefficients(calm.nominal[None])).motor_torque[0, 0].real
        for model in (calm, draggy)
    ]
    expected = PLANTED.level * np.arcsinh(calm.sheet.input_speed / PLANTED.knee)
    assert mean[1] - mean[0] == pytest.approx(expected, rel=1e-4)
    steady = draggy.dte_arcsec(calm.nominal[None])[0]
    integrated = simulate_drive(draggy, calm.nominal, ramp=0.2, settle=0.3).dte_arcsec()
    assert integrated == pytest.approx(steady, rel=2e-3)


def test_model_files_hold_it(drive, tmp_path):
    drive.save(tmp_path / "model")
    assert DriveModel.load(tmp_path / "model") == drive
    assert drive.effects[-1].to_dict() == {
        "name": "eyring_drag",
        "port": "input",
        "level": {"value": 0.03, "unit": "N.m"},
        "knee": {"value": 30.0, "unit": "rad/s"},
    }


def test_robust_problem_takes_it(drive):
    calm = RobustDTE("calibrated", order=1)
    own = RobustDTE(drive, order=1)
    design = drive.nominal[None, 1:]
    difference = own.evaluate(design) - calm.evaluate(design)
    assert np.all(np.isfinite(difference))
    assert np.any(difference != 0.0)


@pytest.mark.slow
def test_campaign_names_it(analysis):
    verdict = analysis.verdict
    assert verdict.status == "named"
    assert [one.label for one in verdict.chosen.candidates] == ["eyring_drag:input"]


def test_report_tells_values_units_and_sentence(report):
    document = json.loads((report / "verdict.json").read_text())
    (effect,) = document["effects"]
    for name, unit in (("level", "N.m"), ("knee", "rad/s")):
        found = effect["parameters"][name]
        low, high = found["interval95"]
        assert low < getattr(PLANTED, name) < high
        assert high - low < 0.5 * getattr(PLANTED, name)
        assert found["unit"] == unit
    assert effect["sentence"] == EYRING_DRAG.sentence.format(port="input")
    gap = document["held_out"]["channels"]["input_torque"]
    assert gap["after"] < 1.5 * gap["noise_floor"] < 0.05 * gap["before"]


@pytest.fixture(scope="module")
def revised(report):
    """The model that the report leaves, read from its files."""
    sheet = load_datasheet(report / "revised_model_sheet.toml")
    return load_model(report / "revised_model.toml", sheet)


@pytest.mark.slow
def test_revised_model_has_it(revised, analysis):
    assert revised == analysis.revised_model()
    (drag,) = [one for one in revised.effects if one.name == "eyring_drag"]
    assert drag.law.level == pytest.approx(PLANTED.level, rel=0.2)


@pytest.mark.nightly
def test_believed_it_is_no_longer_missing(revised, analysis):
    again = analyse(analysis.campaign.believing(revised))
    assert again.verdict.status == "adequate"
    assert [one.name for one in again.revised_model().effects].count("eyring_drag") == 1
    # Nothing is left to be explained, neither more nor less than beside the fitted effect.
    assert again.verdict.base.chi_square == pytest.approx(
        analysis.verdict.accepted.chi_square, abs=4.0
    )


def test_robust_problem_of_the_revised_model(revised):
    mean, std = RobustDTE(revised, order=1).evaluate(revised.nominal[None, 1:])[0]
    assert 0.0 < std < mean < 1e3


@pytest.mark.nightly
def test_mechanism_is_slowed_down_and_names_it(tmp_path):
    """As the command does in the gate, by the calls that a user makes."""
    records = [rotor_record(seed, role) for seed, role in ((1, "train"), (2, "held_out"))]
    measured = MeasuredMechanism(ROTOR, records, title="rotor")
    analysis = analyse(measured, effects=[EYRING_DRAG])
    document = analysis.report(tmp_path / "rotor")
    assert document["status"] == "named"
    (effect,) = document["effects"]
    assert (effect["name"], effect["port"]) == ("eyring_drag", "bearing")
    for name in ("level", "knee"):
        low, high = effect["parameters"][name]["interval95"]
        assert low < getattr(OF_ROTOR, name) < high
    model = read_mechanism_model(tmp_path / "rotor" / "revised_model.toml")
    assert model.effects == analysis.verdict.accepted.effects
    assert analyse(measured.believing(model)).verdict.status == "adequate"


def test_name_belongs_to_one_effect_and_only_inside_its_block():
    with pytest.raises(InvalidInput, match="no other effect has"):
        register(replace(EYRING_DRAG, sentence="Another."))
    names = [one.name for one in known_effects()]
    with registered(replace(EYRING_DRAG, name="own_drag")):
        assert [one.name for one in known_effects()] == [*names, "own_drag"]
    assert [one.name for one in known_effects()] == names


def test_nothing_stays_registered_if_there_is_nothing_to_analyse():
    other = replace(EYRING_DRAG, name="own_drag")
    with pytest.raises(InvalidInput, match="measured"):
        analyse("a campaign", effects=[other])
    assert other not in known_effects()


@pytest.mark.parametrize(
    "changes",
    [
        {"name": "Eyring drag"},
        {"law": None},
        {"ports": ("wrist",)},
        {"quantities": {"heat": "torque"}},
        {"sentence": " "},
        {"sentence": "Drag of the {oil}."},
        {"sentence": "Drag at the {port."},
        {"ports": ("input",), "sought": ("output",)},
    ],
)
def test_effects_that_say_nothing_are_refused(changes):
    with pytest.raises(InvalidInput):
        replace(EYRING_DRAG, **changes)
