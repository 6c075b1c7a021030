"""The verdict on any mechanism: a user's oscillator with effects hidden, or none."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import measured_oscillator as rig
import numpy as np
import pytest
from measured_oscillator import (
    OSCILLATOR,
    bouc_wen,
    cubic,
    cubic_analysis,
    nothing,
    swinging_stiffness,
    with_held_out,
)

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.next_test_mechanism import _how, next_test
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.intervals import Spread
from pymoo_hdte.discrepancy._evidence.force_balances.preconditions import check_scale, usual_cutoff
from pymoo_hdte.discrepancy._report.mechanism_document import limits, record_remarks, unexplained
from pymoo_hdte.discrepancy._report.mechanism_values import _parameters, effects, quantities
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.reason import ZERO_IN_INTERVAL
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts import mechanism_choice
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import validate_mechanism
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record


def dry(x, v, z, t):
    """Dry friction."""
    return 2.0 * np.tanh(v / 1e-3), 0.0


@cache
def finding_on(hidden, seed=1):
    """Return what is found in a record alone."""
    return examine_mechanism(OSCILLATOR, [rig.record_of(hidden, seed=seed)])


@pytest.mark.slow
def test_a_user_finds_the_cubic_spring_of_a_duffing_oscillator():
    analysis, _ = cubic_analysis()
    finding, errors = analysis.finding, analysis.validate()
    assert finding.verdict.status == "named"
    (effect,) = effects(finding)
    assert (effect["name"], effect["port"]) == ("hardening_stiffness", "spring")
    assert effect["parameters"]["coefficient"]["value"] == pytest.approx(4e6, rel=0.01)
    simulated, balanced = errors
    assert (simulated.kind, balanced.kind) == ("simulation", "balance")
    assert simulated.shrinkage > 0.95
    assert balanced.shrinkage > 0.95
    assert quantities(finding)["stiffness of spring"]["value"] == pytest.approx(4000.0, rel=0.01)


@pytest.mark.nightly
def test_hysteresis_of_another_form_is_named():
    finding = examine_mechanism(OSCILLATOR, with_held_out(bouc_wen))
    assert [one["name"] for one in effects(finding)] == ["hysteresis"]
    simulated, balanced = validate_mechanism(finding)
    assert simulated.shrinkage > 0.95
    # What the other form leaves shows in the forces more than in the motion.
    assert balanced.shrinkage > 0.9


def test_nothing_hidden_is_adequate_and_proved_to_be():
    first, *others = with_held_out(nothing)
    holed = Record(first.name, first.role, first.time, first.channels, dropped=3)
    finding = examine_mechanism(OSCILLATOR, [holed, *others])
    assert finding.verdict.status == "adequate"
    assert limits(finding) == []
    (told,) = record_remarks(finding)
    assert "Rows of train 1 with values that are not finite: 3." in told
    assert effects(finding) == []
    assert np.all(finding.base_misfit < 1.3 * finding.sensor_noise)
    simulated, balanced = validate_mechanism(finding)
    assert simulated.record == balanced.record == others[0].name
    assert simulated.before == simulated.after
    assert balanced.after < 1.3 * balanced.noise_floor


@pytest.mark.parametrize("force_noise", [pytest.param(1e-3, marks=pytest.mark.nightly), 1.0])
@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (2, 3))]
)
def test_a_force_that_jumps_between_samples_is_no_missing_effect(seed, force_noise):
    finding = examine_mechanism(OSCILLATOR, [rig.relay_record(seed, force_noise)])
    assert finding.verdict.status == "adequate"
    # The instants of the jumps are an error of the size that is said, not one of any size.
    assert np.all(finding.base_misfit > 0.5 * finding.sensor_noise)


@pytest.mark.nightly
def test_a_force_that_jumps_finds_the_damper_that_was_forgotten():
    (port,) = OSCILLATOR.ports
    forgetful = replace(OSCILLATOR, ports=(replace(port, damping=BelievedValue(0.0)),))
    (effect,) = effects(examine_mechanism(forgetful, [rig.relay_record(1)]))
    assert effect["name"] == "viscous_friction"
    assert effect["parameters"]["coefficient"]["value"] == pytest.approx(rig.DAMPING, rel=0.03)


@pytest.mark.parametrize("force_noise", [0.0, rig.FORCE_NOISE, 1.0])
def test_a_known_gain_sets_no_scale_where_its_input_is_noise(force_noise):
    record = rig.decay_record(force_noise)
    with pytest.raises(InvalidInput, match=r"known exactly \(gain of force\) .* drive the mech"):
        examine_mechanism(OSCILLATOR, [record], cutoff=15.0)
    weighed = replace(OSCILLATOR, inertias={"x": BelievedValue(rig.MASS)})
    (port,) = OSCILLATOR.ports
    sprung = replace(OSCILLATOR, ports=(replace(port, stiffness=BelievedValue(rig.STIFFNESS)),))
    for known in (weighed, sprung):
        check_scale(measured_data(known, [record], 15.0))
    # One record in which it drives is enough, among others in which it does not.
    check_scale(measured_data(OSCILLATOR, [record, rig.record_of(nothing)], 12.0))


def with_zero(record, zero):
    return replace(record, channels=record.channels | {"force": record.channels["force"] + zero})


@pytest.mark.parametrize("zero", [0.03, 0.5, -20.0])
def test_the_zero_of_a_force_sensor_drives_nothing(zero):
    record = rig.decay_record(rig.FORCE_NOISE)
    off = with_zero(record, zero)
    ratio = measured_data(OSCILLATOR, [record], 15.0).known_over_noise()
    moved = measured_data(OSCILLATOR, [off], 15.0)
    assert moved.known_over_noise() == pytest.approx(ratio, rel=0.01)
    with pytest.raises(InvalidInput, match="drive the mechanism"):
        check_scale(moved)


def test_steady_forces_that_differ_from_record_to_record_are_no_zero():
    record = rig.decay_record(rig.FORCE_NOISE)
    other = replace(with_zero(record, 0.5), name="other")
    check_scale(measured_data(OSCILLATOR, [record, other], 15.0))


def test_the_motion_is_known_up_to_where_the_noisiest_record_knows_it():
    clear = rig.relay_record(1)
    noise = 1e-3 * np.random.default_rng(7).standard_normal(len(clear.time))
    noisy = replace(clear, channels=clear.channels | {"x": clear.channels["x"] + noise})
    highest, lowest = (usual_cutoff(OSCILLATOR, [record]) for record in (clear, noisy))
    assert lowest < highest
    for records in ([clear, noisy], [noisy, clear]):
        assert usual_cutoff(OSCILLATOR, records) == lowest


def test_a_held_out_record_that_cannot_be_judged_is_refused_by_name_at_once():
    record = rig.record_of(nothing)

    def held_out(name, rows):
        channels = {channel: values[rows] for channel, values in record.channels.items()}
        return Record(name, "held_out", record.time[rows], channels)

    with pytest.raises(InvalidInput, match=r"sampling rate of record slow is 25.* a cutoff of at"):
        examine_mechanism(OSCILLATOR, [record, held_out("slow", slice(None, None, 10))])
    with pytest.raises(InvalidInput, match=r"duration of record brief .* at least"):
        examine_mechanism(OSCILLATOR, [record, held_out("brief", slice(100))])
    with pytest.raises(InvalidInput, match=r"rate of record train 1 is 250.*most 83.33 Hz"):
        examine_mechanism(OSCILLATOR, [record], cutoff=84.0)


def test_an_interval_does_not_leave_the_tolerance():
    data = measured_data(OSCILLATOR, [rig.record_of(nothing)], 12.0)
    fitted = fit(data)
    spread = Spread(data, fitted)
    inside = _parameters(fitted, spread, range(3))["damping of spring"]["interval95"]
    assert 2.5 < inside[0] < rig.DAMPING < inside[1] < 7.5
    spread.covariance = 1e10 * spread.covariance
    assert _parameters(fitted, spread, range(3))["damping of spring"]["interval95"] == [2.5, 7.5]


def test_what_no_law_explains_is_unlisted_and_described():
    finding = finding_on(swinging_stiffness)
    assert finding.verdict.status == "unlisted"
    assert effects(finding) == []
    assert "force balance of x" in unexplained(finding)["sentence"]
    assert any("held out" in sentence for sentence in limits(finding))


def test_a_quantity_out_of_tolerance_is_a_parameter():
    port = replace(OSCILLATOR.ports[0], stiffness=BelievedValue(3000.0, 0.05))
    finding = examine_mechanism(replace(OSCILLATOR, ports=(port,)), [rig.record_of(nothing)])
    assert finding.verdict.status == "parameter"
    (candidate,) = finding.accepted.candidates
    assert candidate.port == "stiffness of spring"
    values = dict(
        zip([p.name for p in finding.accepted.parameters], finding.accepted.values, strict=True)
    )
    assert values["stiffness of spring"] == pytest.approx(4000.0, rel=0.01)


@pytest.mark.slow
def test_an_effect_that_is_known_is_not_found_again():
    records = [rig.record_of(dry, seed=4)]
    assert [one["name"] for one in effects(finding_on(dry, 4))] == ["coulomb_friction"]
    friction = LawAt("coulomb_friction", "spring", CoulombFriction(2.0))
    finding = examine_mechanism(OSCILLATOR, records, known=[friction])
    assert "coulomb_friction" not in [one["name"] for one in effects(finding)]
    assert finding.base_misfit < 0.2 * finding_on(dry, 4).base_misfit


@pytest.mark.nightly
def test_the_verdict_does_not_hang_on_units():
    # In mm, N and g: the same physics.
    record = rig.record_of(cubic)
    milli = Record(
        "mm", "train", record.time, dict(record.channels) | {"x": 1e3 * record.channels["x"]}
    )
    scaled = Mechanism(
        inertias={"x": BelievedValue(1e-3, 0.1)},
        ports=[Port("spring", {"x": 1.0}, BelievedValue(4.1, 0.1), BelievedValue(5e-3, 0.5))],
        inputs=[Input("force", {"x": 1.0})],
    )
    one, other = cubic_analysis()[0].finding, examine_mechanism(scaled, [milli])
    assert one.verdict.status == other.verdict.status == "named"
    coefficient = [effects(each)[0]["parameters"]["coefficient"]["value"] for each in (one, other)]
    assert coefficient[1] == pytest.approx(1e-9 * coefficient[0], rel=1e-3)


def test_the_next_test_sets_what_was_found_against_its_rival():
    test = next_test(finding_on(dry, 4))
    assert test.separates == ("coulomb_friction:spring", "stribeck_friction:spring")
    assert "train 4" in test.description or "another motion" in test.description
    alone = cubic_analysis()[0].next_experiment()
    assert "no competing hypothesis" in alone.description
    unknown = next_test(finding_on(swinging_stiffness))
    assert "validates" not in unknown.description


def test_a_repetition_is_told_by_its_travel_its_rate_and_the_speed_that_they_make():
    test = next_test(finding_on(dry, 4))
    if (test.size, test.rate) != (1.0, 1.0) and test.separation >= 1.0:
        assert f"({test.size * test.rate:.2g} times its speed)" in test.description
    assert _how(0.3, 0.3) == "with 0.3 times its travel, 3.3 times slower (0.09 times its speed)"
    alone = cubic_analysis()[0].next_experiment()
    assert "with 3 times its travel (3 times its speed)" in alone.description


@pytest.mark.nightly
def test_a_gain_of_the_wrong_sign_is_the_first_thing_to_check():
    record = rig.record_of(nothing)
    channels = {**record.channels, "force": -record.channels["force"]}
    turned = Record("turned", "train", record.time, channels)
    sized = replace(OSCILLATOR, inputs=[Input("force", {"x": 1.0}, BelievedValue(1.0))])
    wrong = examine_mechanism(sized, [turned])
    assert wrong.verdict.status == "unlisted"
    assert "sign of the gain of force" in next_test(wrong).description
    unknown = next_test(finding_on(swinging_stiffness))
    assert "sign" not in unknown.description


@pytest.mark.parametrize("roles", [(), ("held_out",)])
def test_without_training_records_nothing_is_fitted(roles):
    with pytest.raises(InvalidInput, match="number of train records is 0"):
        examine_mechanism(OSCILLATOR, [rig.record_of(nothing, role) for role in roles])


def test_a_missing_a_dead_and_a_short_channel_are_named():
    record = rig.record_of(nothing)
    for channels, message in (
        ({"x": record.channels["x"]}, "force among them"),
        (dict(record.channels) | {"x": np.full(len(record.time), 2.0)}, "dead"),
    ):
        with pytest.raises(InvalidInput, match=message):
            examine_mechanism(OSCILLATOR, [Record("bad", "train", record.time, channels)])
    short = {name: channel[:20] for name, channel in record.channels.items()}
    with pytest.raises(InvalidInput, match=r"duration of record short .* at least"):
        measured_data(OSCILLATOR, [Record("short", "train", record.time[:20], short)], 12.0)


def test_a_position_of_noise_only_is_refused():
    record = rig.record_of(nothing)
    noise = np.random.default_rng(1).standard_normal(len(record.time))
    with pytest.raises(InvalidInput, match="power of a position over that of its noise"):
        examine_mechanism(
            OSCILLATOR,
            [Record("noise", "train", record.time, dict(record.channels) | {"x": noise})],
        )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ports": ()}, "at least one: effects are looked for there"),
        (
            {"inputs": [Input("force", {"x": 1.0}, BelievedValue(1.0, 0.5))]},
            "only ratios are known",
        ),
    ],
)
def test_a_mechanism_that_says_too_little_is_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        examine_mechanism(replace(OSCILLATOR, **change), [rig.record_of(nothing)])


def test_two_records_of_one_name_and_a_held_out_one_without_a_channel_are_refused_at_once():
    record = rig.record_of(nothing)
    with pytest.raises(InvalidInput, match="a name of its own for each record"):
        examine_mechanism(OSCILLATOR, [record, record])
    held_out = Record("other", "held_out", record.time, {"x": record.channels["x"]})
    with pytest.raises(InvalidInput, match="channels of record other"):
        examine_mechanism(OSCILLATOR, [record, held_out])


@pytest.mark.nightly
def test_a_spring_and_a_damper_that_were_forgotten_are_named():
    (port,) = OSCILLATOR.ports
    for lost, name, size in (
        ("stiffness", "linear_stiffness", rig.STIFFNESS),
        ("damping", "viscous_friction", rig.DAMPING),
    ):
        forgetful = replace(OSCILLATOR, ports=(replace(port, **{lost: BelievedValue(0.0)}),))
        (effect,) = effects(examine_mechanism(forgetful, [rig.record_of(nothing)]))
        assert effect["name"] == name
        assert effect["parameters"]["coefficient"]["value"] == pytest.approx(size, rel=0.01)


@pytest.mark.nightly
def test_play_takes_the_stiffness_that_is_fitted_and_not_the_believed_one():
    def play(x, v, z, t):
        return rig.STIFFNESS * (np.clip(x, -0.002, 0.002) * -1.0), 0.0

    finding = examine_mechanism(OSCILLATOR, with_held_out(play))
    (effect,) = effects(finding)
    assert effect["name"] == "backlash"
    assert effect["parameters"]["half_width"]["value"] == pytest.approx(0.002, rel=0.02)
    assert quantities(finding)["stiffness of spring"]["value"] == pytest.approx(4000.0, rel=0.005)
    simulated, balanced = validate_mechanism(finding)
    assert simulated.shrinkage > 0.9
    assert balanced.shrinkage > 0.9


@pytest.mark.nightly
def test_an_interval_that_is_printed_with_zero_in_it_leaves_no_plain_name(monkeypatch):
    """Of coloured residuals it is wider than the curvature of the fit says."""

    def wide(data, fitted):
        places = [place for _, place in fitted.places]
        deviation = np.zeros(len(fitted.values))
        for place in places:
            deviation[place] = np.abs(fitted.values[place])
        reach = np.full(len(deviation), data.rules.certain_deviations)
        return SimpleNamespace(covariance=np.diag(deviation**2), reach=reach)

    assert finding_on(dry).verdict.status == "named"
    monkeypatch.setattr(mechanism_choice, "Spread", wide)
    verdict = examine_mechanism(OSCILLATOR, [rig.record_of(dry)]).verdict
    assert verdict.status == "partial"
    assert verdict.has_reason(ZERO_IN_INTERVAL)


@pytest.mark.slow
def test_an_effect_that_removes_less_than_the_rule_asks_for_is_not_named():
    finding = finding_on(dry)
    assert finding.verdict.status == "named"
    removed = finding.share_removed
    assert removed < 1.0
    stricter = replace(RULES, main_share=(1.0 + removed) / 2.0)
    again = examine_mechanism(OSCILLATOR, [rig.record_of(dry, seed=1)], rules=stricter)
    assert again.verdict.status == "unlisted"


def test_a_sign_that_is_swapped_is_no_parameter_out_of_tolerance():
    record = rig.record_of(nothing)
    swapped = dict(record.channels) | {"force": -record.channels["force"]}
    finding = examine_mechanism(OSCILLATOR, [Record("swapped", "train", record.time, swapped)])
    assert finding.verdict.status == "unlisted"
