"""Held-out records are simulated in windows, and contradict what they do not show."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import measured_oscillator as rig
import numpy as np
import pytest
from measured_oscillator import OSCILLATOR, nothing

from pymoo_hdte.discrepancy._report.mechanism import validation_sentence
from pymoo_hdte.discrepancy._report.mechanism_document import limits
from pymoo_hdte.discrepancy._selection.reason import NOT_VALIDATED
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import validate_mechanism
from pymoo_hdte.discrepancy._verdicts.windows import Reach, windows_of
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.simulation import simulate_mechanism

JOINT = Mechanism(
    {"q": BelievedValue(0.5, 0.5)},
    [Port("bearing", {"q": 1.0}, damping=BelievedValue(3.0, 1.0))],
    [Input("torque", {"q": 1.0})],
)
TRUE_JOINT = JOINT.with_values({"inertia of q": 0.4, "damping of bearing": 2.0})
DRY = LawAt("coulomb_friction", "bearing", CoulombFriction(1.0))


def dry(x, v, z, t):
    """Dry friction."""
    return 2.0 * np.tanh(v / 1e-3), 0.0


def of_joint(role, seed, wander):
    """Return a record of a free joint on which a torque acts that no sensor sees."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 20.0, 0.01)
    lines = np.arange(1, 30) / 15.0
    phases = rng.uniform(0.0, 2.0 * np.pi, (2, len(lines)))
    waves = np.cos(2.0 * np.pi * lines * time[:, None, None] + phases).sum(axis=2)
    torque, unseen = (waves / waves.std(axis=0)).T
    plan = Record("plan", role, time, {"torque": 4.0 * torque + wander * unseen})
    q = simulate_mechanism(TRUE_JOINT, plan, [DRY], start={"q": (0.0, 0.0)}).position["q"]
    channels = {"q": q + 1e-5 * rng.standard_normal(len(time)), "torque": 4.0 * torque}
    return Record(f"{role} {seed}", role, time, channels)


@cache
def found_on_joint(wander):
    records = [of_joint(role, seed, wander) for seed, role in enumerate(("train", "held_out"), 1)]
    return examine_mechanism(JOINT, records)


@pytest.mark.slow
def test_a_name_that_the_held_out_record_contradicts_is_not_given():
    # The friction of the fitted record is gone from the other one.
    held_out = rig.record_of(nothing, "held_out", seed=3, duration=rig.HELD_OUT)
    told = []
    finding = examine_mechanism(
        OSCILLATOR,
        [rig.record_of(dry, seed=4), held_out],
        progress=lambda done, total: told.append((done, total)),
    )
    assert told == [(one, len(told)) for one in range(1, len(told) + 1)]
    assert len(told) == finding.simulated[0].extent.windows
    assert finding.verdict.status == "unlisted"
    assert finding.verdict.has_reason(NOT_VALIDATED)
    assert finding.accepted is finding.verdict.base
    (told,) = (one for one in limits(finding) if "does not shrink as it should" in one)
    assert told.startswith("coulomb friction")
    (one,) = finding.simulated
    before, after, _ = one.powers("x")
    assert after > before
    simulated, _ = validate_mechanism(finding)
    assert simulated.before == simulated.after == pytest.approx(before**0.5)


@pytest.mark.nightly
def test_a_name_that_the_held_out_record_shows_is_given_and_one_at_rest_says_nothing():
    train = rig.record_of(dry, seed=4)
    shown = rig.record_of(dry, "held_out", seed=3, duration=rig.HELD_OUT)
    noise = np.random.default_rng(2).standard_normal((2, len(shown.time)))
    still = {"x": rig.POSITION_NOISE * noise[0], "force": rig.FORCE_NOISE * noise[1]}
    for record in (shown, replace(shown, channels=still)):
        verdict = examine_mechanism(OSCILLATOR, [train, record], cutoff=15.0).verdict
        assert verdict.status == "named"
        assert verdict.shown_in_held_out == (record is shown)


@pytest.mark.nightly
def test_a_free_joint_is_simulated_until_it_drifts_and_its_name_stands():
    finding = found_on_joint(0.05)
    assert [one.name for one in finding.accepted.candidates] == ["coulomb_friction"]
    simulated, _ = validate_mechanism(finding)
    whole, _ = validate_mechanism(finding, whole=True)
    extent = simulated.extent
    assert extent.windows == extent.room >= RULES.fewest_windows
    assert whole.extent.windows == 1
    assert whole.extent.length == pytest.approx(20.0, rel=0.1)
    assert simulated.after < 0.5 * simulated.before
    assert simulated.before < 0.5 * whole.before
    # The drift is what the rule allows, for what the training record leaves of forces.
    assert simulated.after < 2.0 * RULES.window_drift * simulated.measured.std()
    assert simulated.determination[1] > 0.98
    told = simulated.as_dict()
    assert told["r2_after"] == simulated.determination[1]
    assert (told["windows"], told["window_s"]) == (extent.windows, extent.length)
    sentence = f"{extent.windows} of {extent.room} windows of {extent.length:.3g} s in held_out 2"
    assert sentence in validation_sentence(finding, [simulated])


@pytest.mark.nightly
def test_the_worse_the_model_the_shorter_the_windows():
    lengths = [found_on_joint(one).simulated[0].extent.length for one in (0.05, 0.8)]
    assert lengths[1] < 0.8 * lengths[0]


def drifting(time, memory=np.inf):
    return Reach(time, memory, 1.0, np.ones((1, 1)))


def plain(n, step):
    time = step * np.arange(n)
    return Record("plain", "held_out", time, {"q": np.sin(time)})


@pytest.mark.parametrize("step", [0.0011, 0.005, 0.03])
def test_windows_tile_the_record_and_are_thinned_evenly_within_the_budget(step):
    record, cutoff = plain(20_000, step), 3.0
    reach = drifting(min(7.0, 1500.0 * step))
    every = windows_of(record, cutoff, reach, replace(RULES, proof_samples=10**9))
    assert len(every.rows) == every.count
    assert all(one.stop - 1 == other.start for one, other in pairwise(every.rows))
    first = every.rows[0]
    assert (first.stop - 1 - first.start) * step == pytest.approx(reach.drift, rel=0.02)
    few = windows_of(record, cutoff, reach, replace(RULES, proof_samples=8000))
    samples = sum(len(range(*one.indices(20_000))) - 1 for one in few.rows) * few.finer
    assert samples <= 8000
    assert few.count == every.count
    between = np.diff([one.start for one in few.rows])
    assert np.ptp(between) <= first.stop - 1 - first.start
    assert few.rows[-1] == every.rows[-1]


def test_what_forgets_its_start_is_simulated_for_ten_decay_times():
    record = plain(20_000, 0.005)
    (first, *_) = windows_of(record, 3.0, drifting(0.1, memory=0.5), RULES).rows
    assert (first.stop - 1 - first.start) * 0.005 == pytest.approx(5.0, rel=0.02)


def test_springs_that_slip_go_on_from_their_history():
    (port,) = JOINT.ports
    sprung = replace(
        JOINT, ports=(replace(port, stiffness=BelievedValue(300.0), damping=BelievedValue(2.0)),)
    )
    law = [LawAt("hysteresis", "bearing", MaxwellSlip(8.0, 0.01, 1.5))]
    time = np.arange(0.0, 6.0, 0.005)
    torque = 12.0 * np.sin(9.0 * time) + 5.0 * np.sin(31.0 * time)
    whole = simulate_mechanism(sprung, Record("one", "train", time, {"torque": torque}), law)
    row = 700
    later = Record("two", "train", time[row:], {"torque": torque[row:]})
    start = {"q": (whole.position["q"][row], whole.speed["q"][row])}
    past = {"q": whole.position["q"][: row + 1]}
    found = simulate_mechanism(sprung, later, law, start=start, history=past).position["q"]
    forgotten = simulate_mechanism(sprung, later, law, start=start).position["q"]
    expected = whole.position["q"][row:]
    # Between two samples of the history a reversal is seen a little late.
    assert np.abs(found - expected).max() < 0.01 * np.abs(forgotten - expected).max()
