"""Joints with encoders on both sides of their gear: what their torques and their torsion lack."""

import json
import re
from dataclasses import replace

import made_joint
import numpy as np
import pytest
from made_joint import ARCSECOND, DAMPING, STIFFNESS, Hidden, believed, record, records
from places import DOCS

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import JointAnalysis, analyse, read_rig
from pymoo_hdte.discrepancy._answers.joint_open_questions import (
    torsion_test,
    wiring_caveats,
)
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.joint_halves import (
    joint_of,
    rigid_half,
    torsion_half,
)
from pymoo_hdte.discrepancy._records.rig_model import model_text, read_mechanism_model
from pymoo_hdte.discrepancy._report.torsion import torsion_document, torsion_limits
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding, examine_joint
from pymoo_hdte.discrepancy._verdicts.joint_torsion import examine_torsion
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import sentences_on_rest
from pymoo_hdte.discrepancy._verdicts.validation_torsion import (
    predicted_torsion,
    torsion_after_held_out_test,
    torsion_errors,
)
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.stiffness import HardeningStiffness, SoftWindup
from pymoo_hdte.mechanism import (
    BelievedValue,
    Gear,
    Input,
    LawAt,
    Mechanism,
    Port,
    Record,
    simulate_mechanism,
)

CUTOFF = 5.0
WINDUP = SoftWindup(0.4, 6e-4, 3.0)


def torsion_of(hidden):
    """Return the finding on the torsion alone, and its errors."""
    joint = joint_of(believed())
    finding = examine_torsion(torsion_half(joint, records(hidden), ()), joint, CUTOFF)
    return finding, torsion_errors(finding)


def value(fitted, name):
    (found,) = (
        value
        for parameter, value in zip(fitted.parameters, fitted.values, strict=True)
        if parameter.name == name
    )
    return found


def test_with_nothing_missing_the_torsion_is_adequate_and_its_stiffness_found():
    finding, (error,) = torsion_of(Hidden())
    assert finding.verdict.status == "adequate"
    assert value(finding.accepted, "stiffness of gear") == pytest.approx(STIFFNESS, rel=1e-3)
    assert error.after < 2.0 * error.noise_floor
    assert np.std(error.measured) > 100.0 * error.after


def resting(seconds, seed):
    """Return a motion as `made_joint.motion` does, with half a second of rest after each move."""
    time = np.arange(0.0, seconds, made_joint.STEP)
    move = np.sin(np.linspace(0.0, np.pi, round(4.5 / made_joint.STEP))) ** 2
    still = np.zeros(round(0.5 / made_joint.STEP))
    sizes = np.random.default_rng(seed).uniform(0.8, 1.5, 8) * np.where(np.arange(8) % 2, -1.0, 1.0)
    speed = np.resize(np.outer(sizes, np.append(move, still)).ravel(), len(time))
    position = made_joint.STEP * (np.cumsum(speed) - 0.5 * speed)
    return time, position, speed, np.gradient(speed, made_joint.STEP)


@pytest.mark.nightly
def test_rests_that_are_left_out_are_told_and_count_as_no_prediction(monkeypatch):
    """Dry friction ahead of the gear is known: what it holds at rest is in no force balance."""
    monkeypatch.setattr(made_joint, "motion", resting)
    known = [LawAt("coulomb_friction", "shaft", CoulombFriction(6.0))]
    mechanism = believed()
    ports = [*mechanism.ports, Port("shaft", {"motor": 1.0})]
    joint = joint_of(replace(mechanism, ports=ports))
    made = records(Hidden(WINDUP, dry=6.0))
    finding = examine_torsion(torsion_half(joint, made, known), joint, 10.0)
    assert finding.data.spectra[0].left_out > 0
    assert any("at rest" in words for words in sentences_on_rest(finding))
    (error,) = torsion_errors(finding)
    # Where nothing is compared, a prediction would differ from what is measured by the same.
    differences = error.measured - error.predicted_before
    assert len(np.unique(np.round(differences / ARCSECOND, 9))) == len(differences)


@pytest.mark.parametrize(
    ("hidden", "name", "unknown", "truth"),
    [
        # The document below tells of this one as well.
        pytest.param(Hidden(WINDUP), "soft_windup", "torsion", 6e-4, marks=pytest.mark.nightly),
        pytest.param(
            Hidden(order=2.0, amplitude=20.0 * ARCSECOND),
            "kinematic_error",
            "",
            20.0 * ARCSECOND,
            marks=pytest.mark.nightly,
        ),
        pytest.param(
            Hidden(HardeningStiffness(coefficient=3e9)),
            "hardening_stiffness",
            "coefficient",
            3e9,
            marks=pytest.mark.nightly,
        ),
        pytest.param(
            Hidden(MaxwellSlip(6.0, 5e-4, 1.5)),
            "hysteresis",
            "force",
            6.0,
            marks=pytest.mark.nightly,
        ),
        pytest.param(Hidden(dry=6.0), "coulomb_friction", "level", 6.0, marks=pytest.mark.nightly),
        pytest.param(
            Hidden(order=9.0, amplitude=10.0 * ARCSECOND),
            "kinematic_error",
            "",
            10.0 * ARCSECOND,
            marks=pytest.mark.nightly,
        ),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_what_is_hidden_in_a_torsion_is_named_with_its_size(hidden, name, unknown, truth):
    finding, (error,) = torsion_of(hidden)
    assert finding.verdict.status == "named"
    (candidate,) = finding.accepted.candidates
    assert candidate.name == name
    size = (
        value(finding.accepted, unknown)
        if unknown
        else np.hypot(*finding.accepted.values[finding.accepted.n_base :])
    )
    assert size == pytest.approx(truth, rel=0.05)
    assert error.after < 0.4 * error.before


def test_an_error_beyond_the_band_is_found_in_the_torsion_with_its_order():
    finding, _ = torsion_of(Hidden(order=202.0, amplitude=5.0 * ARCSECOND))
    assert finding.verdict.status == "named"
    (line,) = finding.ripples.lines
    assert line.order == pytest.approx(202.0, abs=line.resolution)
    assert "2 per input turn" in line.meaning
    both = JointFinding(joint_of(believed()), finding, finding, ())
    (effect,) = torsion_document(both)["effects"]
    amplitude = effect["parameters"]["amplitude"]
    assert amplitude["unit"] == "arcsec"
    assert amplitude["value"] == pytest.approx(5.0, rel=0.05)
    assert effect["rms_Nm"] == pytest.approx(5.0 * ARCSECOND * STIFFNESS / 2.0**0.5, rel=0.05)


@pytest.fixture(scope="module")
def joint_analysis(tmp_path_factory):
    """Return the analysis of a log of counts by the rig's file of the page in the documentation.

    The wind-up of the gear and the motor's friction are hidden in it.
    """
    folder = tmp_path_factory.mktemp("joint")
    page = (DOCS / "two_encoders.md").read_text(encoding="utf-8")
    (folder / "rig.toml").write_text(re.search(r"```toml\n(.*?)```", page, re.S)[1])
    log = record(Hidden(WINDUP, dry=4.0), "train", 36.0)
    counts = {"motor": 2**20 * 101, "load": 2**24}
    columns = [np.round(log.channels[one] * n / (2.0 * np.pi)) for one, n in counts.items()]
    table = np.column_stack([log.time, *columns, log.channels["torque"]])
    titles = "time_s,motor,load,torque"
    np.savetxt(folder / "log.csv", table, "%.12g", ",", header=titles, comments="")
    return analyse(read_rig(folder))


@pytest.mark.slow
def test_one_document_tells_what_torques_and_torsion_lack(joint_analysis, tmp_path):
    analysis = joint_analysis
    assert isinstance(analysis, JointAnalysis)
    document = analysis.report(tmp_path / "report")
    stored = json.loads((tmp_path / "report" / "verdict.json").read_text())
    assert stored == json.loads(json.dumps(document))
    torsion = stored["torsion"]
    assert stored["status"] == "named"
    assert {one["name"] for one in stored["effects"]} == {"gravity", "coulomb_friction"}
    found = {one["name"]: one for one in torsion["effects"]}
    assert set(found) == {"soft_windup", "coulomb_friction"}
    corner = found["soft_windup"]["parameters"]["torsion"]
    assert corner["unit"] == "arcsec"
    assert corner["value"] == pytest.approx(6e-4 / ARCSECOND, rel=0.02)
    # Friction turns its sign only, so that its size is its level.
    assert found["coulomb_friction"]["rms_Nm"] == pytest.approx(4.0, rel=0.05)
    share = found["coulomb_friction"]["rms_arcsec"] * ARCSECOND * STIFFNESS
    assert share == pytest.approx(4.0, rel=0.05)
    assert torsion["remainder"]["share_removed"] > 0.99
    (error,) = torsion["held_out"]
    assert error["after_arcsec"] < 1.0 < 20.0 < error["before_arcsec"]
    assert "Torsion between the encoders" in (tmp_path / "report" / "report.html").read_text()


@pytest.mark.slow
def test_the_revised_joint_explains_the_records(joint_analysis, tmp_path):
    model = joint_analysis.revised_model()
    (tmp_path / "model.toml").write_text(model_text(model))
    again = read_mechanism_model(tmp_path / "model.toml")
    assert {(one.name, one.port) for one in again.effects} == {
        ("gravity", "bearing"),
        ("coulomb_friction", "input"),
        ("soft_windup", "gear"),
    }
    joint = joint_of(again.mechanism)
    half = torsion_half(joint, joint_analysis.measured.records, again.effects)
    cutoff = joint_analysis.finding.cutoff
    assert examine_torsion(half, joint, cutoff).verdict.status == "adequate"


def test_the_delay_of_an_encoder_is_not_told_from_friction():
    late = 2e-3
    joint = joint_of(believed())
    finding = examine_joint(joint, records(Hidden(late=late)), CUTOFF)
    assert finding.status == "class"
    (candidate,) = finding.torsion.accepted.candidates
    assert candidate.name == "viscous_friction"
    # The torque of the delay at a speed is that of the spring over the way in that time.
    assert value(finding.torsion.accepted, "coefficient") == pytest.approx(
        late * STIFFNESS, rel=0.02
    )
    (told,) = (one for one in torsion_limits(finding) if "encoder is read 2 ms" in one)
    assert f"whole joint is only {DAMPING:.3g}" in told
    assert "in the other order" in torsion_test(finding)


@pytest.mark.nightly
def test_effects_that_make_the_held_out_torsion_worse_are_not_named():
    train, _ = records(Hidden(WINDUP))
    _, other = records(Hidden())
    joint = joint_of(believed())
    finding = examine_torsion(torsion_half(joint, [train, other], ()), joint, CUTOFF)
    assert finding.verdict.status == "named"
    verdict = torsion_after_held_out_test(finding, torsion_errors(finding))
    assert verdict.status == "unlisted"
    assert verdict.accepted is verdict.base
    told = replace(finding, verdict=verdict)
    both = JointFinding(joint, torque=told, torsion=told, errors=())
    assert wiring_caveats(both) == []
    (words,) = (one for one in torsion_limits(both) if "None is named" in one)
    assert "soft windup" in words


def test_the_predicted_torsion_winds_spring_and_laws_to_the_measured_torque():
    """Where the model is exact, the measured torsion is predicted, whatever the records' noise."""
    joint = joint_of(believed())
    laws = [LawAt("soft_windup", "gear", SoftWindup(0.9, 4e-4, 4.0))]
    half = torsion_half(joint, records(Hidden(laws[0].law)), laws)
    finding = examine_torsion(half, joint, CUTOFF)
    assert finding.verdict.status == "adequate"
    data = measured_data(half.mechanism, half.records[1:], CUTOFF, laws, RULES)
    measured = data.spectra[0].ports["gear"].position
    assert predicted_torsion(data, finding.accepted) == pytest.approx(measured, abs=3 * ARCSECOND)


def test_the_halves_of_a_joint_have_its_values():
    motor, load = BelievedValue(2.0, factor=2.0), BelievedValue(1.0, tolerance=0.5)
    mechanism = Mechanism(
        {"motor": motor, "load": load},
        [
            Port("gear", {"motor": 1.0, "load": -1.0}, BelievedValue(1e4), gear=Gear(50.0)),
            Port("rotor", {"motor": 1.0}, damping=BelievedValue(3.0)),
            Port("arm", {"load": 1.0}, damping=BelievedValue(4.0, tolerance=1.0)),
        ],
        [Input("torque", {"motor": 1.0}), Input("push", {"load": -1.0})],
        angles=("motor", "load"),
    )
    joint, time = joint_of(mechanism), np.arange(0.0, 4.0, 0.01)
    angle = np.sin(time)
    one = Record(
        "one",
        "train",
        time,
        {"motor": angle + 3.0, "load": angle, "torque": 0 * time, "push": angle},
    )
    known = [LawAt("gravity", "arm", Gravity(1.0, 0.0)), LawAt("soft_windup", "gear", WINDUP)]
    rigid, torsion = (half(joint, [one], known) for half in (rigid_half, torsion_half))
    (inertia,), (port,) = rigid.mechanism.inertias.values(), rigid.mechanism.ports
    assert inertia.value == 3.0
    assert inertia.limits[0] <= 1.5 < 5.5 <= inertia.limits[1] + 1e-12
    assert port.damping.limits == (3.0, 11.0)
    assert [one.name for one in rigid.known] == ["gravity"]
    assert [one.acts for one in rigid.mechanism.inputs] == [{"load": 1.0}, {"load": -1.0}]
    assert [one.name for one in torsion.known] == ["soft_windup"]
    assert torsion.mechanism.inertias == {"motor": motor}
    (moved,) = torsion.records
    assert np.mean(moved.channels["motor"] - moved.channels["load"]) == pytest.approx(0.0)
    with pytest.raises(InvalidInput, match="followed"):
        simulate_mechanism(torsion.mechanism, moved)


def test_a_gear_between_two_encoders_takes_angles_of_the_output_only():
    def built(motion):
        port = Port("gear", motion, BelievedValue(1e4), gear=Gear(101.0))
        shafts = {name: BelievedValue(1.0) for name in ("motor", "load")}
        return Mechanism(shafts, [port], [Input("torque", {"motor": 1.0})])

    assert joint_of(built({"motor": 1.0, "load": -1.0})).motor == "motor"
    assert joint_of(built({"load": 1.0})) is None
    with pytest.raises(InvalidInput, match="divided by the ratio already"):
        built({"motor": 1.0 / 101.0, "load": -1.0})


def test_what_the_analysis_of_a_joint_cannot_take_is_refused():
    mechanism = believed()
    gear, bearing = mechanism.ports
    limp = replace(mechanism, ports=[replace(gear, stiffness=BelievedValue(0.0)), bearing])
    with pytest.raises(InvalidInput, match="stiffness of gear"):
        joint_of(limp)
    twice = replace(mechanism, ports=[gear, bearing, Port("seal", {"load": 1.0})])
    across = replace(mechanism, ports=[gear, Port("frame", {"motor": 1.0, "load": 1.0})])
    for one in (twice, across):
        with pytest.raises(InvalidInput, match="one port on each side"):
            joint_of(one)
    pushed = joint_of(replace(mechanism, inputs=[Input("torque", {"load": 1.0})]))
    with pytest.raises(InvalidInput, match="torque of the motor"):
        torsion_half(pushed, records(Hidden()), ())
