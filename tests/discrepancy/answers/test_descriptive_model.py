"""The model that describes: it predicts whatever the verdict, and names nothing."""

import numpy as np
import pytest
from measured_oscillator import OSCILLATOR, cubic_analysis, swinging_stiffness, with_held_out
from places import SHARED

from pymoo_hdte.discrepancy import (
    MeasuredMechanism,
    analyse,
    read_mechanism_model,
    read_rig,
)
from pymoo_hdte.discrepancy._answers.descriptive_model import DESCRIPTIVE_FILE
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import laws_of
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record
from pymoo_hdte.mechanism.balances import ForceBalance, quantity_names
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force

LOGS = SHARED / "cases" / "real"
INERTIA, VISCOUS, DRY, WEIGHT, PHASE, OFFSET = 0.02, 0.05, 0.3, 0.8, 0.4, 0.15
ARM = Mechanism(
    {"q": BelievedValue(0.03, factor=10.0)},
    [Port("bearing", {"q": 1.0}, damping=BelievedValue(0.02, factor=10.0))],
    [Input("torque", {"q": 1.0})],
    angles=["q"],
)


def arm_record(role, seed, torque, noise=1e-3):
    """Return a record of an arm whose ``torque(q, v)`` acts beside its inertia."""
    generator = np.random.default_rng(seed)
    time = np.arange(0.0, 20.0, 0.005)
    lines, phases = np.arange(1, 13) * 0.15, generator.uniform(0.0, 2.0 * np.pi, 12)
    angles, omega = np.outer(time, 2.0 * np.pi * lines) + phases, 2.0 * np.pi * lines
    size = 0.6 / np.sqrt(np.arange(1, 13))
    q = np.cos(angles) @ size
    v, a = -np.sin(angles) @ (omega * size), -np.cos(angles) @ (omega**2 * size)
    measured = INERTIA * a + torque(q, v) + noise * generator.standard_normal(len(time))
    channels = {"q": q + 1e-6 * generator.standard_normal(len(time)), "torque": measured}
    return Record(f"{role} {seed}", role, time, channels)


def arm(torque):
    """Return the analysis of an arm, a record of which is held out."""
    records = (arm_record("train", 1, torque), arm_record("held_out", 2, torque))
    return analyse(MeasuredMechanism(ARM, records, 8.0))


def six_terms(q, v):
    return VISCOUS * v + DRY * np.sign(v) + WEIGHT * np.cos(q + PHASE) + OFFSET


def unlisted_friction(q, v):
    """Return a friction that rises, falls and rises with the speed, one way more than back."""
    size = np.abs(v)
    level = 0.3 * np.sin(3.0 * size) + 0.1 * size + 0.2 * (v > 0.0) * np.tanh(size - 1.0)
    return level * np.tanh(v / 0.02) + 0.3 * np.cos(q) * np.abs(np.sin(2.0 * v))


def balance_of(model, record):
    """Return the root mean square that a model leaves of the balance of a record."""
    balance = ForceBalance(model.mechanism, record, model.cutoff)
    values = {name: one.value for name, one in model.mechanism.quantities.items()}
    quantities = np.array([values[name] for name in quantity_names(model.mechanism)])
    left = np.einsum("bqk,q->bk", balance.terms, quantities) - balance.forces(
        laws_of(model.effects)
    )
    return float(np.sqrt(np.sum((left * balance.kept) ** 2) / balance.moving.count))


@pytest.mark.slow
def test_six_terms_are_recovered():
    described = arm(six_terms).descriptive_model()
    numbers = {
        (effect.name, name): value
        for effect, values in described.effects
        for name, value in values.items()
    }
    truth = {
        ("coulomb_friction", "level"): DRY,
        ("gravity", "torque"): WEIGHT,
        ("gravity", "phase"): PHASE,
        ("force_offset", "force"): OFFSET,
    }
    for name, value in truth.items():
        assert numbers[name].value == pytest.approx(value, rel=0.03)
        lower, upper = numbers[name].interval95
        assert lower < numbers[name].value < upper
    assert described.values["inertia of q"].value == pytest.approx(INERTIA, rel=0.03)
    assert described.values["damping of bearing"].value == pytest.approx(VISCOUS, rel=0.03)
    (held_out,) = described.held_out
    assert held_out.descriptive <= 1.05 * held_out.six_terms < 0.1 * held_out.base


@pytest.mark.slow
def test_a_friction_of_no_library_is_predicted_as_well_as_by_six_terms(tmp_path):
    analysis = arm(unlisted_friction)
    described = analysis.descriptive_model()
    (trained,), (held_out,) = described.cross_validated, described.held_out
    assert trained.descriptive < trained.six_terms
    assert held_out.descriptive < held_out.six_terms < held_out.base
    # The file predicts what the document says.
    document = analysis.report(tmp_path / "report")["descriptive_model"]
    model = read_mechanism_model(tmp_path / "report" / DESCRIPTIVE_FILE)
    assert (model.mechanism, model.effects) == (
        described.model.mechanism,
        described.model.effects,
    )
    (record,) = [one for one in analysis.finding.records if one.role == "held_out"]
    assert balance_of(model, record) == pytest.approx(held_out.descriptive, rel=1e-6)
    assert document["held_out"] == [held_out.as_dict()]


def test_a_stiffness_is_released_where_no_law_bends_with_it():
    records = with_held_out(swinging_stiffness)
    analysis = analyse(MeasuredMechanism(OSCILLATOR, records, 12.0))
    described = analysis.descriptive_model()
    (held_out,) = described.held_out
    assert held_out.descriptive <= 1.05 * min(held_out.six_terms, held_out.accepted)


def test_what_a_verdict_accepts_is_kept_where_it_predicts_best():
    described = cubic_analysis()[0].descriptive_model()
    assert "hardening_stiffness" in [effect.name for effect, _ in described.effects]
    for held_out in described.held_out:
        assert held_out.descriptive <= 1.1 * held_out.accepted


def test_no_term_is_large_where_nothing_was_measured():
    """Of a friction that falls at speeds where those of the library have long faded."""
    generator = np.random.default_rng(3)
    time = np.arange(0.0, 12.0, 0.005)
    tones = np.arange(1, 9) * 0.37
    angles = np.outer(time, 2.0 * np.pi * tones) + generator.uniform(0.0, 6.3, 8)
    q = 1.5 * time + np.sin(angles) @ (0.02 / tones)
    v = 1.5 + np.cos(angles) @ np.full(8, 2.0 * np.pi * 0.02)
    a = -np.sin(angles) @ (4.0 * np.pi**2 * 0.02 * tones)
    dry = DRY + 0.05 * np.exp(-((v - v.min()) / 0.1))
    noise = generator.standard_normal((2, len(time)))
    channels = {
        "q": q + 1e-6 * noise[0],
        "torque": INERTIA * a + VISCOUS * v + dry + 1e-3 * noise[1],
    }
    halves = [
        Record(role, role, time[rows], {name: one[rows] for name, one in channels.items()})
        for role, rows in (("train", slice(0, 1400)), ("held_out", slice(1400, 2400)))
    ]
    described = analyse(MeasuredMechanism(ARM, halves, 5.0)).descriptive_model()
    slow = PortMotion(q[:400], np.linspace(0.01, v.max(), 400))
    for effect, _ in described.effects:
        size = np.abs(law_force(effect.law, slow, 0.0)).max()
        assert size < 3.0 * np.abs(channels["torque"]).max()


@pytest.mark.nightly
@pytest.mark.parametrize(
    "name",
    [
        *("damper_vote", "delayed_torque", "gravity_hides_coulomb", "inertia_zero"),
        *("kinova5_missing_is_certain", "named_though_gap_grows", "one_way_push"),
        *("rests_and_breakaway", "vote_kills_gravity"),
        *(f"rest_hides_coulomb/rest_{seconds}s" for seconds in (0, 10, 20)),
    ],
)
def test_a_real_log_is_described_as_well_as_by_six_terms(name):
    folder = LOGS / name
    if not folder.is_dir():
        pytest.skip(f"needs {folder}, which is no part of the project")
    for held_out in analyse(read_rig(folder)).descriptive_model().held_out:
        assert held_out.descriptive <= 1.05 * held_out.six_terms
