"""A joint that stands still now and then: what dry friction does there is not in the records."""

import numpy as np
import pytest
from night import others_at_night

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import root_mean_square
from pymoo_hdte.discrepancy._report.mechanism_document import limits
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.balances import ForceBalance

INERTIA, DAMPING, LEVEL = 0.5, 3.0, 2.0
STEP, CUTOFF, MOVES = 0.005, 15.0, 12
JOINT = Mechanism(
    {"q": BelievedValue(0.6, 0.5)},
    [Port("bearing", {"q": 1.0}, damping=BelievedValue(3.5, 1.0))],
    [Input("torque", {"q": 1.0})],
)
DRY = LawAt("coulomb_friction", "bearing", CoulombFriction(LEVEL))


def record_of(rest, drag=0.0, noises=(1e-5, 0.02), seed=0):
    """Return a record of moves there and back, each with a rest of so many seconds after it."""
    generator = np.random.default_rng(31)
    move = np.sin(np.linspace(0.0, np.pi, round(1.5 / STEP))) ** 2
    still = np.zeros(round(rest / STEP))
    sizes = generator.uniform(0.3, 1.0, MOVES) * np.where(np.arange(MOVES) % 2, -1.0, 1.0)
    speed = np.concatenate([np.concatenate([size * move, still]) for size in sizes])
    friction = LEVEL * np.sign(speed) + drag * speed * np.abs(speed)
    # At rest the drive holds by some torque that friction balances.
    held = np.repeat(LEVEL * generator.uniform(-0.9, 0.9, MOVES), len(move) + len(still))
    friction[speed == 0.0] = held[speed == 0.0]
    torque = INERTIA * np.gradient(speed, STEP) + DAMPING * speed + friction
    noise = np.random.default_rng([31, seed]).standard_normal((2, len(speed)))
    channels = {
        "q": STEP * (np.cumsum(speed) - 0.5 * speed) + noises[0] * noise[0],
        "torque": torque + noises[1] * noise[1],
    }
    return Record("moves", "train", STEP * np.arange(len(speed)), channels)


@pytest.mark.parametrize("rest", others_at_night([1.0, 4.0], 4.0))
def test_a_complete_model_of_a_joint_that_rests_is_adequate_and_rests_are_told(rest):
    finding = examine_mechanism(JOINT, [record_of(rest)], CUTOFF, [DRY])
    assert finding.verdict.status == "adequate"
    assert finding.accepted.values == pytest.approx([INERTIA, DAMPING], rel=0.01)
    (told,) = (words for words in limits(finding) if "at rest" in words)
    # The rest after each move, and some periods of the cutoff, in which smoothed forces show it.
    (balance,) = finding.data.spectra
    assert MOVES * rest < balance.left_out * STEP < MOVES * (rest + 8.0 / CUTOFF)
    assert told.startswith(f"{balance.left_out} rows of moves at rest")


def test_what_is_missing_in_a_joint_that_rests_is_named():
    finding = examine_mechanism(JOINT, [record_of(1.0, drag=1.5)], CUTOFF, [DRY])
    assert finding.verdict.status == "named"
    (effect,) = finding.accepted.effects
    assert effect.name == "nonlinear_drag"
    speed = np.linspace(0.2, 1.0, 9)
    state = PortState(0.0 * speed, speed, periodic_phase(0.0 * speed), np.zeros(1))
    found = effect.law.respond(state).torque + finding.accepted.values[1] * speed
    assert found == pytest.approx(1.5 * speed**2 + DAMPING * speed, rel=0.02)


def test_rows_that_are_left_out_count_neither_for_intervals_nor_for_chi_square():
    """Of seventy per cent: with zeros in their place both would be off by a factor of 1.7."""
    distances, chi_squares = [], []
    for seed in range(30):
        data = measured_data(JOINT, [record_of(2.0, 0.0, (1e-5, 0.2), seed)], CUTOFF, [DRY])
        fitted = fit(data)
        spread = np.diag(fitted.covariance) ** 0.5
        distances.append((fitted.values - [INERTIA, DAMPING]) / spread)
        chi_squares.append(fitted.chi_square)
    degrees_of_freedom = len(fitted.residuals) - 2
    assert np.sqrt(np.mean(np.square(distances))) == pytest.approx(1.0, abs=0.3)
    assert np.std(chi_squares) / (2.0 * degrees_of_freedom) ** 0.5 == pytest.approx(1.0, abs=0.4)
    # The noise of the torque, as far as the band holds it.
    (noise,) = root_mean_square(data, np.ones(len(fitted.residuals)))
    assert noise == pytest.approx(0.2 * (2.0 * CUTOFF * STEP) ** 0.5, rel=0.15)


def standing(share):
    """Return a record that stands still for such a share of its time, held below breakaway."""
    moves = record_of(0.0)
    count = len(moves.time)
    rows = round(count * share / (1.0 - share))
    held = 0.8 * LEVEL * np.sin(0.7 * STEP * np.arange(rows))
    noise = np.random.default_rng(5).standard_normal((2, rows))
    before = {"q": 1e-5 * noise[0], "torque": held + 0.02 * noise[1]}
    channels = {name: np.concatenate([before[name], moves.channels[name]]) for name in before}
    return Record("standing", "train", STEP * np.arange(count + rows), channels)


@pytest.mark.parametrize("share", others_at_night([0.0, 0.2, 1.0 / 3.0], 1.0 / 3.0))
def test_a_joint_that_stands_still_has_the_same_friction(share):
    finding = examine_mechanism(JOINT, [standing(share)], CUTOFF)
    assert finding.verdict.status == "named"
    (effect,) = finding.accepted.effects
    assert effect.name == "coulomb_friction"
    fitted = finding.accepted
    spread = np.diag(fitted.covariance) ** 0.5
    assert np.all(np.abs(fitted.values - [INERTIA, DAMPING, LEVEL]) < 4.0 * spread)
    assert spread[2] < 0.02 * LEVEL


def test_friction_is_fitted_to_the_same_rows_whether_it_is_known_or_not():
    record = standing(0.3)
    unknown, known = (ForceBalance(JOINT, record, CUTOFF, laws) for laws in ([], [DRY]))
    assert unknown.left_out > 0.29 * len(record.time)
    assert np.array_equal(unknown.moving.weight, known.moving.weight)


def test_a_machine_of_which_a_part_moves_is_not_at_rest():
    """Only known friction may hold a single port: torsion tests lock the output."""
    resting = record_of(1.0)
    noise = 1e-5 * np.random.default_rng(2).standard_normal(len(resting.time))
    channels = {
        **resting.channels,
        "load": noise + 0.05 * np.sin(8.0 * resting.time),
    }
    drive = Mechanism(
        {"q": BelievedValue(0.6, 0.5), "load": BelievedValue(1.0, 0.5)},
        [Port("bearing", {"q": 1.0}), Port("shaft", {"q": 1.0, "load": -1.0})],
        [Input("torque", {"q": 1.0})],
    )
    record = Record("locked", "train", resting.time, channels)
    assert ForceBalance(drive, record, CUTOFF).left_out == 0
    assert ForceBalance(drive, record, CUTOFF, [DRY]).left_out > 0


def test_a_motion_without_rests_keeps_every_row():
    time = record_of(1.0).time
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(time))
    swing = {"q": np.sin(2.0 * time) + noise, "torque": np.cos(2.0 * time) + noise}
    for known in ([DRY], []):
        balance = ForceBalance(JOINT, Record("turning", "train", time, swing), CUTOFF, known)
        assert balance.left_out == 0
        assert np.all(balance.moving.weight == 1.0)
    # Of a record that moves once nothing is left out: it would tell nothing at all.
    once = slice(round(4.0 / STEP))
    channels = {name: signal[once] for name, signal in record_of(20.0).channels.items()}
    hardly = Record("once", "train", time[once], channels)
    assert ForceBalance(JOINT, hardly, CUTOFF, [DRY]).left_out == 0
