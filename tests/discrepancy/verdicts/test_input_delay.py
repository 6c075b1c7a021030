"""An input whose record is early or late by a part of a sample."""

import numpy as np
import pytest
from scipy.signal import StateSpace, butter, lsim, sosfilt

from pymoo_hdte.discrepancy._evidence.force_balances.delay import delays
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.lower_band import moved_by_band
from pymoo_hdte.discrepancy._records.rig_model import (
    MechanismModel,
    model_text,
    read_mechanism_model,
)
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record

INERTIA, DAMPING, LEVEL, WEIGHT = 0.5, 3.0, 2.0, 4.0
STEP, CUTOFF = 0.005, 15.0


def joint(delay=0.0):
    return Mechanism(
        {"q": BelievedValue(0.6, 0.5)},
        [Port("bearing", {"q": 1.0}, damping=BelievedValue(3.5, 1.0))],
        [Input("torque", {"q": 1.0}, delay=delay)],
        angles=["q"],
    )


def record_of(delay, friction=0.0, weight=0.0, seed=0, role="train"):
    """Return a motion of several frequencies, with a torque that acts later by a delay."""
    time = STEP * np.arange(6000)
    tones = np.random.default_rng(3).uniform(0.2, 4.0, (9, 1))
    phases = np.random.default_rng(4).uniform(0.0, 6.3, (9, 1))

    def tone(order, at):
        turned = 2.0 * np.pi * tones * at + phases + 0.5 * np.pi * order
        return np.sum(0.3 * (2.0 * np.pi * tones) ** (order - 1) * np.sin(turned), axis=0)

    later = time + delay
    torque = INERTIA * tone(2, later) + DAMPING * tone(1, later)
    torque += friction * np.sign(tone(1, later)) + weight * np.sin(tone(0, later))
    noise = np.random.default_rng(seed).standard_normal((2, len(time)))
    channels = {"q": tone(0, time) + 1e-5 * noise[0], "torque": torque + 0.02 * noise[1]}
    return Record(role, role, time, channels)


@pytest.mark.parametrize("delay", [0.4, -0.3, 6.0])
@pytest.mark.parametrize("missing", [{}, {"friction": LEVEL, "weight": WEIGHT}])
def test_a_part_of_a_sample_is_estimated_within_its_interval(delay, missing):
    """Also where friction and gravity are missing in the base."""
    data = measured_data(joint(), [record_of(delay * STEP, **missing)], CUTOFF)
    (found,) = delays(data)
    assert found.evident
    assert found.samples == pytest.approx(found.value / STEP)
    assert abs(found.value - delay * STEP) < 2.0 * found.spread
    assert found.spread < 0.3 * STEP


def test_no_delay_is_evident_where_there_is_none():
    data = [measured_data(joint(), [record_of(0.0, LEVEL, seed=seed)], CUTOFF) for seed in range(9)]
    assert sum(delays(one)[0].evident for one in data) <= 1


def in_a_loop(seed):
    """Return a record of the joint under control, moved as much by an unseen torque as by it."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(24_000)
    tones, phases = rng.uniform(0.2, 3.0, (9, 1)), rng.uniform(0.0, 6.3, (9, 1))
    turned = 2.0 * np.pi * tones * time + phases
    wanted = 0.02 * np.sum(np.sin(turned), axis=0)
    speed = 0.02 * np.sum(2.0 * np.pi * tones * np.cos(turned), axis=0)
    unseen = sosfilt(butter(2, 3.0, fs=1.0 / STEP, output="sos"), rng.standard_normal(len(time)))
    unseen *= 2.0 / unseen.std()
    stiff, damped = 200.0, 20.0
    loop = StateSpace(
        [[0.0, 1.0], [-stiff / INERTIA, -(DAMPING + damped) / INERTIA]],
        [[0.0, 0.0, 0.0], [stiff / INERTIA, damped / INERTIA, 1.0 / INERTIA]],
        [[1.0, 0.0], [-stiff, -damped]],
        [[0.0, 0.0, 0.0], [stiff, damped, 0.0]],
    )
    q, torque = lsim(loop, np.column_stack([wanted, speed, unseen]), time)[1].T
    noise = rng.standard_normal((2, len(time)))
    channels = {"q": q + 1e-5 * noise[0], "torque": torque + 0.01 * noise[1]}
    return Record("loop", "train", time, channels)


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_a_disturbance_in_a_loop_is_no_delay(seed):
    """The motion answers to what is unseen, and the controller to the motion: a bias of 20 ms."""
    data = measured_data(joint(), [in_a_loop(seed)], 10.0)
    (found,) = delays(data.with_residual_as_noise(fit(data).residuals))
    assert found.value > 3.0 * STEP
    assert not found.evident


@pytest.mark.slow
@pytest.mark.parametrize("stated", [3.4 * STEP, None])
def test_a_delay_is_taken_out_where_it_is_allowed(stated):
    records = [record_of(3.4 * STEP), record_of(3.4 * STEP, seed=1, role="held_out")]
    assert examine_mechanism(joint(), records, CUTOFF).verdict.status != "adequate"
    finding = examine_mechanism(joint(stated), records, CUTOFF)
    assert finding.mechanism.inputs[0].delay == pytest.approx(3.4 * STEP, rel=0.02)
    assert finding.verdict.status == "adequate"
    assert finding.accepted.values == pytest.approx([INERTIA, DAMPING], rel=0.01)
    assert all(record.remarks for record in finding.records)


@pytest.mark.parametrize("delay", [0.0, -0.05, None])
def test_a_delay_is_kept_in_the_file_of_a_model(tmp_path, delay):
    path = tmp_path / "model.toml"
    path.write_text(model_text(MechanismModel("A joint", joint(delay))), encoding="utf-8")
    assert read_mechanism_model(path).mechanism.inputs[0].delay == delay


def test_values_of_a_right_model_do_not_depend_on_the_band():
    moved = []
    for seed in range(8):
        data = measured_data(joint(), [record_of(0.0, seed=seed)], CUTOFF)
        data = data.with_residual_as_noise(fit(data).residuals)
        moved += moved_by_band(data, fit(data))
    # Of sixteen values one is outside of a 95 % interval by chance; four are in one of 140 tests.
    assert len(moved) < 4


def test_a_delay_makes_values_depend_on_the_band():
    """It takes from a damper in proportion to the square of the frequency."""
    data = measured_data(joint(), [record_of(4.0 * STEP)], 5.0)
    data = data.with_residual_as_noise(fit(data).residuals)
    assert moved_by_band(data, fit(data))
