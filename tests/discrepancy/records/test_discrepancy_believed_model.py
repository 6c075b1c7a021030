"""A model is what is believed: a revised one, fed back, holds its effects and misses nothing."""

import json
import re
from dataclasses import replace

import measured_oscillator as rig
import numpy as np
import pytest
from planted_features import SCALES
from quick_campaigns import ripple_analysis_and_report, ripple_campaign
from virtual_rig_cases import BELIEVED

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.discrepancy import (
    MeasuredMechanism,
    analyse,
    read_campaign,
    read_drive_model,
    read_rig,
    write_campaign,
)
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import training_data
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes
from pymoo_hdte.discrepancy._records.believed_model import believed_of_model
from pymoo_hdte.discrepancy._records.rig_model import model_text
from pymoo_hdte.drive import (
    DampingReference,
    KinematicErrorLine,
    LawAtPort,
    LoadInertia,
    preset,
)
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port
from pymoo_hdte.units import ARCSEC

FRICTION = LawAtPort("coulomb_friction", "input", CoulombFriction(0.02))
RIPPLE = LawAtPort("torque_ripple", "input", PeriodicTorque(3.0, 0.4, 0.01))
LINE = KinematicErrorLine(3.7, 2.0 * ARCSEC, 0.3)
SAME_FIT = 2.0
"""Chi-square by which two converged fits of one model may differ: starts and whitening differ."""


@pytest.fixture(scope="module")
def campaign():
    return ripple_campaign()


@pytest.fixture(scope="module")
def analysis():
    return ripple_analysis_and_report()[0]


@pytest.fixture(scope="module")
def believing(campaign, analysis, tmp_path_factory):
    """Return the folder of the campaign, with the revised model as what it believes."""
    folder = tmp_path_factory.mktemp("believing") / "campaign"
    write_campaign(campaign, folder)
    model = analysis.revised_model()
    (folder / "revised_model.toml").write_text(model_toml(model))
    (folder / "revised_model_sheet.toml").write_text(sheet_toml(model.sheet))
    text = (folder / "campaign.toml").read_text()
    head, rest = re.split(r"\n\[believed\]\n.*?(?=\n\[rig\])", text, flags=re.DOTALL)
    head += 'model = "revised_model.toml"\nsheet = "revised_model_sheet.toml"\n'
    tolerance = "\n[tolerance]\ndefault = 0.12\nstiffness = 0.05\nstatic_error = 0.25\n"
    (folder / "campaign.toml").write_text(head + tolerance + rest)
    return folder


@pytest.fixture(scope="module")
def again(believing):
    return analyse(read_campaign(believing))


@pytest.mark.nightly
def test_a_revised_model_fed_back_misses_nothing(analysis, again):
    assert analysis.verdict.status == "named"
    assert again.verdict.status == "adequate"
    before, after = analysis.verdict.accepted.chi_square, again.verdict.base.chi_square
    assert abs(after - before) < SAME_FIT


@pytest.mark.nightly
def test_a_revised_model_without_its_effects_misses_them(again):
    believed = replace(again.campaign.believed, effects=())
    assert analyse(replace(again.campaign, believed=believed)).verdict.status == "named"


@pytest.mark.slow
def test_believed_effects_stay_in_model_and_report(analysis, again, tmp_path):
    first, second = analysis.revised_model(), again.revised_model()
    assert [place_of(one) for one in second.effects] == [place_of(one) for one in first.effects]
    assert "torque_ripple" in second.description
    document = again.report(tmp_path / "report")
    believed = [one.to_dict() for one in again.campaign.believed.effects]
    assert (
        json.loads((tmp_path / "report" / "verdict.json").read_text())["believed_effects"]
        == (document["believed_effects"])
    )
    assert document["believed_effects"] == believed
    assert "torque ripple (input): order 3, " in (tmp_path / "report" / "report.html").read_text()


@pytest.mark.slow
def test_values_tolerances_and_effects_come_from_the_model(analysis, again):
    believed, model = again.campaign.believed, analysis.revised_model()
    values = dict(
        zip(
            [one.name for one in analysis.verdict.accepted.parameters],
            analysis.verdict.accepted.values,
            strict=True,
        )
    )
    for name in ("stiffness", "damping", "input_inertia", "load_inertia"):
        assert getattr(believed, name) == pytest.approx(values[name], rel=1e-9)
    amplitudes = [values[f"error_amplitude_{line}"] for line in range(3)]
    assert believed.error_amplitudes == pytest.approx(amplitudes, rel=1e-9)
    assert believed.tolerance_of("stiffness") == 0.05
    assert believed.tolerance_of("damping") == believed.tolerance == 0.12
    assert believed.error_tolerance == 0.25
    kinds = (LoadInertia, DampingReference)
    assert believed.effects == tuple(one for one in model.effects if not isinstance(one, kinds))
    bounds = {one.name: one for one in again.finding.data.base}
    assert bounds["stiffness"].upper == pytest.approx(1.05 * believed.stiffness)
    assert bounds["damping"].upper == pytest.approx(1.12 * believed.damping)


def test_an_ordinary_drive_model_can_be_believed():
    model = preset("calibrated")
    believed = believed_of_model(model)
    coefficients = model.coefficients(model.nominal[None])
    assert believed.damping == coefficients.damping[0]
    assert believed.output_inertia + believed.load_inertia == coefficients.output_inertia
    assert believed.error_amplitudes == pytest.approx(np.abs(coefficients.error_phasors[0]))
    assert [one.name for one in believed.effects] == ["mesh_stiffness_variation"]


@pytest.mark.slow
def test_a_believed_effect_predicts_as_an_added_one(campaign):
    effects = (FRICTION, RIPPLE, LINE)
    plain = campaign.believed
    orders = [*plain.error_orders, 3.0, 3.7]
    features = measure(campaign, campaign.train, orders)
    data = training_data(campaign, features)
    holding = replace(campaign, believed=replace(plain, effects=effects))
    start = np.array([[one.start for one in data.base]])
    expected = data.predict(start, effects)
    assert np.array_equal(replace(data, campaign=holding).predict(start, ()), expected)
    assert not np.allclose(data.predict(start, ()), expected, rtol=1e-3)


def test_no_candidate_stands_where_an_effect_is_believed():
    orders, seen = [1.0, 2.0, 2.02, 3.0, 3.7, 6.0], [3.0, 3.7]
    sizes = port_sizes(BELIEVED, orders, seen, SCALES)
    plain = drive_candidates(sizes)
    holding = replace(BELIEVED, effects=(FRICTION, RIPPLE, LINE))
    left = drive_candidates(sizes, holding.effects)
    places = {place_of(one) for one in holding.effects}
    assert all(any(one.places & {place} for one in plain) for place in places)
    assert not any(one.places & places for one in left)
    names = {(one.name, one.port) for one in left}
    assert {("coulomb_friction", "output"), ("stribeck_friction", "input")} <= names


@pytest.mark.slow
def test_believed_effects_survive_the_files_of_a_campaign(campaign, tmp_path):
    limits = {"stiffness": 0.05, "load_inertia": 0.4}
    believed = replace(campaign.believed, effects=(FRICTION, LINE), tolerances=limits)
    write_campaign(replace(campaign, believed=believed), tmp_path / "campaign")
    read = read_campaign(tmp_path / "campaign").believed
    assert read.effects == believed.effects
    assert read.tolerances == limits
    assert read.stiffness == pytest.approx(believed.stiffness, rel=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("revised_model.toml", "order = 3.0", "order = -3.0", r"revised_model.toml.*order is -3"),
        ("revised_model.toml", '"torque_ripple"', '"torque_riple"', r"revised_model.toml.*name"),
        ("campaign.toml", "stiffness = 0.05", "stiffness = 1.5", r"line \d+: tolerance.stiffness"),
        ("campaign.toml", "stiffness = 0.05", "stifness = 0.05", r"line \d+: tolerance.stifness"),
        ("campaign.toml", "default = 0.12", "default = 0.0", "tolerance is 0"),
        ("campaign.toml", "\n[rig]", "\n[believed]\nratio = 101\n\n[rig]", "believed"),
    ],
)
def test_a_model_that_cannot_be_believed_is_a_clear_error(
    file, old, new, words, believing, tmp_path
):
    folder = tmp_path / "campaign"
    folder.mkdir()
    for path in believing.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    with pytest.raises(InvalidInput, match=words):
        read_campaign(folder)


def test_what_is_no_effect_of_its_own_is_not_believed():
    for effects, words in (
        ((FRICTION, FRICTION), "each effect once"),
        ((LoadInertia(0.1),), "none that is a value"),
        ([FRICTION], "a tuple of effects"),
    ):
        with pytest.raises(InvalidInput, match=words):
            replace(BELIEVED, effects=effects)
    with pytest.raises(InvalidInput, match=r"tolerances\.damping is 1"):
        replace(BELIEVED, tolerances={"damping": 1.0})
    with pytest.raises(InvalidInput, match="tolerances is 'ratio'"):
        replace(BELIEVED, tolerances={"ratio": 0.1})


@pytest.mark.slow
def test_effects_without_a_steady_motion_are_refused(campaign):
    stuck = LawAtPort("coulomb_friction", "output", CoulombFriction(1e6))
    with pytest.raises(InvalidInput, match="steady motion in every record; not in run_"):
        analyse(replace(campaign, believed=replace(campaign.believed, effects=(stuck,))))


# --- of a mechanism -----------------------------------------------------------------------------

TABLE = """
[table]
format = "csv"
time = { column = "time", unit = "s" }
channels.x = { column = "x", unit = "m" }
channels.force = { column = "force", unit = "N" }
[[records]]
file = "train.csv"
role = "train"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a rig whose spring grows stiffer, which its model does not know."""
    folder = tmp_path_factory.mktemp("rig")
    record = rig.record_of(rig.cubic)
    rows = np.column_stack([record.time, record.channels["x"], record.channels["force"]])
    np.savetxt(folder / "train.csv", rows, "%.12g", ",", header="time,x,force", comments="")
    believed = model_text(MeasuredMechanism(rig.OSCILLATOR, [], title="oscillator").model)
    (folder / "rig.toml").write_text(believed + TABLE)
    return folder


@pytest.mark.nightly
def test_a_revised_mechanism_fed_back_misses_nothing(folder, tmp_path, capsys):
    first = analyse(read_rig(folder))
    assert [one.name for one in first.verdict.accepted.candidates] == ["hardening_stiffness"]
    first.report(tmp_path / "first")
    model = tmp_path / "first" / "revised_model.toml"
    (folder / "again.toml").write_text(f'title = "again"\nmodel = "{model}"\n' + TABLE)
    rig_again = read_rig(folder / "again.toml")
    assert rig_again.model == replace(first.revised_model(), title="again")
    again = analyse(rig_again)
    assert again.verdict.status == "adequate"
    assert again.finding.unexplained == pytest.approx(first.finding.unexplained, rel=1e-3)
    tolerances = [one.tolerance for one in again.measured.mechanism.quantities.values()]
    assert tolerances == [one.tolerance for one in rig.OSCILLATOR.quantities.values()]
    assert again.revised_model().effects == first.revised_model().effects

    out = ["--believed", str(model), "--out", str(tmp_path / "second")]
    assert cli.main(["discrepancy", str(folder), *out]) == 0
    assert "adequate" in capsys.readouterr().out
    document = json.loads((tmp_path / "second" / "verdict.json").read_text())
    (effect,) = document["believed_effects"]
    assert (effect["name"], effect["port"]) == ("hardening_stiffness", "spring")
    page = (tmp_path / "second" / "report.html").read_text()
    assert "hardening stiffness (spring): coefficient" in page


def test_a_wholly_known_mechanism_has_no_scale_in_question():
    known = Mechanism(
        inertias={"x": BelievedValue(rig.MASS)},
        ports=[
            Port("spring", {"x": 1.0}, BelievedValue(rig.STIFFNESS), BelievedValue(rig.DAMPING))
        ],
        inputs=[Input("force", {"x": 1.0})],
    )
    plain = rig.record_of(lambda x, v, z, t: (0.0, 0.0))
    assert analyse(MeasuredMechanism(known, [plain])).verdict.status == "adequate"


@pytest.mark.slow
def test_the_command_questions_a_model_of_a_drive(believing, tmp_path, monkeypatch, capsys):
    """What the campaign believes gives way to the model that is asked about."""
    asked = []

    def stop(measured, **_):
        asked.append(measured.believed)
        raise InvalidInput("stopped", None, "nothing")

    monkeypatch.setattr("pymoo_hdte.discrepancy.analyse", stop)
    model = preset("calibrated")
    (tmp_path / "mine.toml").write_text(model_toml(model))
    (tmp_path / "mine_sheet.toml").write_text(sheet_toml(model.sheet))
    options = ["discrepancy", str(believing), "--out", str(tmp_path / "out")]
    assert cli.main([*options, "--believed", str(tmp_path / "mine.toml")]) == cli.MISTAKE
    ratio = {"tolerance": 0.12, "error_tolerance": 0.25, "tolerances": {"stiffness": 0.05}}
    assert asked == [believed_of_model(read_drive_model(tmp_path / "mine.toml"), **ratio)]
    assert cli.main([*options, "--sheet", "x.toml"]) == cli.MISTAKE
    assert "--sheet" in capsys.readouterr().err
