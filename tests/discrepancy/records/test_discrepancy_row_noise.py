"""The noise of the records beside the stated one, and what an analysis makes of it and of rows."""

import json
from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night
from places import SHARED
from quick_campaigns import CONDITIONS, quick_campaign
from virtual_rig_cases import BELIEVED, RIG, effect

from experiments.studies.virtual_rig.own_effects import with_effects
from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.discrepancy import analyse, order_lines, read_campaign
from pymoo_hdte.discrepancy._records.cleaning.cleaning import cleaned_rows
from pymoo_hdte.discrepancy._report.tables import rows_sentence
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.drive import expected_orders
from pymoo_hdte.drive._effects.static_error import KinematicErrorLine
from pymoo_hdte.units import ARCSEC

NOISES = ("angle_noise", "input_torque_noise", "output_torque_noise", "torsion_angle_noise")
CASES = SHARED / "cases" / "campaigns"


def examined(campaign, rules=RULES):
    return cleaned_rows(campaign, expected_orders(campaign), rules)


def with_stated(campaign, name, factor):
    rig = replace(campaign.rig, **{name: factor * getattr(campaign.rig, name)})
    return replace(campaign, rig=rig)


def broken(campaign, place, channel, rows, size):
    running = list(campaign.running)
    values = getattr(running[place], channel).copy()
    values[rows] += size
    running[place] = replace(running[place], **{channel: values})
    return replace(campaign, running=tuple(running))


@pytest.fixture(scope="module")
def clean():
    return quick_campaign(1)


def test_a_sound_campaign_is_left_as_it_is(clean):
    same, found = examined(clean)
    assert same is clean
    assert found.faults == ()
    assert found.left_out == ()
    assert not any(one.replaced for one in found.noise)
    assert rows_sentence(found) == ""
    for one in found.noise:
        if one.found is not None:
            assert one.found == pytest.approx(one.stated, rel=0.15)


# A shared case, below, has all of them three times as stated.
@pytest.mark.parametrize("factor", others_at_night([1.0 / 3.0, 1.25], 1.25))
@pytest.mark.parametrize("name", others_at_night(NOISES, *NOISES[1::2]))
def test_a_misstated_noise_is_replaced_by_that_of_the_records(clean, name, factor):
    changed, found = examined(with_stated(clean, name, factor))
    assert [one.name for one in found.noise if one.replaced] == [name]
    rel = 0.15 if name == "torsion_angle_noise" else 0.03
    assert getattr(changed.rig, name) == pytest.approx(getattr(clean.rig, name), rel=rel)
    assert name.removesuffix("_noise").replace("_", " ") in rows_sentence(found)


def test_a_noise_within_what_the_rules_allow_stays(clean):
    stated = with_stated(clean, "angle_noise", 1.25)
    changed, found = examined(stated, replace(RULES, noise_mismatch=1.5))
    assert changed is stated
    assert not any(one.replaced for one in found.noise)


@pytest.mark.parametrize(("factor", "replaced"), [(1.0, False), (0.2, True)])
def test_repeated_conditions_show_the_repeatability(clean, factor, replaced):
    rng = np.random.default_rng(7)
    spread = clean.rig.repeatability / np.sqrt(3.0)
    copies = []
    for record in clean.running[:4]:
        for copy in range(4):
            lines = spread * (rng.standard_normal(3) + 1j * rng.standard_normal(3))
            waves = np.exp(1j * np.outer(record.input_angle, clean.believed.error_orders))
            noise = clean.rig.angle_noise * rng.standard_normal(len(record.time))
            angle = record.output_angle - (waves @ lines).real + noise
            copies.append(replace(record, name=f"{record.name}_{copy}", output_angle=angle))
    campaign = replace(clean, running=tuple(copies))
    _, found = examined(with_stated(campaign, "repeatability", factor))
    (one,) = (one for one in found.noise if one.name == "repeatability")
    assert one.found == pytest.approx(clean.rig.repeatability, rel=0.25)
    assert one.replaced == replaced


def spiky(campaign):
    return broken(campaign, 4, "output_angle", [500, 1200, 2500], 0.03)


def jumping(campaign):
    return broken(campaign, 5, "output_angle", slice(1500, None), 20.0 * ARCSEC)


def misstated(campaign):
    return with_stated(campaign, "output_torque_noise", 1.0 / 3.0)


@pytest.mark.nightly
@pytest.mark.parametrize("spoil", [spiky, jumping, misstated])
def test_a_clean_drive_with_one_kind_of_fault_is_adequate(clean, spoil):
    assert analyse(spoil(clean)).verdict.status == "adequate"


@pytest.fixture(scope="module")
def spoilt(clean):
    return analyse(spiky(jumping(misstated(clean))))


@pytest.mark.nightly
def test_a_clean_drive_with_bad_records_is_adequate(spoilt):
    assert spoilt.verdict.status == "adequate"
    document = json.loads(json.dumps(spoilt.finding.rows.as_dict()))
    faults = [(one["kind"], one["row"] + 1) for one in document["rows"]["faults"]]
    assert faults == [("spike", 502), ("spike", 1202), ("spike", 2502), ("jump", 1502)]
    assert document["rows"]["left_out"] == 3


@pytest.mark.nightly
def test_what_was_found_stands_in_the_verdict_and_on_the_page(spoilt, clean, tmp_path):
    verdict = spoilt.report(tmp_path / "out")
    assert [one["name"] for one in verdict["noise"] if one["replaced"]] == ["output_torque_noise"]
    names = {clean.running[place].name for place in (4, 5)}
    assert {one["record"] for one in verdict["rows"]["faults"]} == names
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "3 spikes and 1 jump in 2 records" in page


def test_a_record_of_two_loads_is_left_out_and_said(clean):
    campaign = clean
    for channel, size in (("output_torque", 2.0), ("input_torque", 0.02), ("output_angle", -8e-5)):
        campaign = broken(campaign, 6, channel, slice(1500, None), size)
    changed, found = examined(campaign)
    assert found.left_out == (clean.running[6].name,)
    assert len(changed.running) == len(clean.running) - 1
    assert clean.running[6].name in rows_sentence(found)


def unsettled(campaign, sizes, constant=lambda record: 0.15):
    """Let the motor run out into the motion at the beginning of each record: sizes (r,), rad."""
    running = []
    for one, size in zip(campaign.running, sizes, strict=True):
        decay = size * np.exp(-(one.time - one.time[0]) / constant(one))
        turned = one.output_angle + decay / campaign.believed.ratio
        running.append(replace(one, input_angle=one.input_angle + decay, output_angle=turned))
    return replace(campaign, running=tuple(running))


@pytest.mark.nightly
def test_a_clean_drive_in_records_that_begin_unsettled_is_adequate(clean):
    loads = np.array([one.load_torque for one in clean.running])
    campaign = unsettled(clean, 2e-4 * loads)
    analysis = analyse(campaign)
    assert analysis.verdict.status == "adequate"
    faults = analysis.finding.rows.faults
    assert {one.kind for one in faults} == {"settling"}
    assert "beginnings that have not settled" in rows_sentence(analysis.finding.rows)


@pytest.mark.parametrize(
    "constant",
    [
        pytest.param(lambda record: 0.15, marks=pytest.mark.nightly),
        lambda record: 15.0 / abs(record.input_speed),
    ],
)
def test_where_several_records_begin_unsettled_all_are_fitted_so(clean, constant):
    """Of a decay below the noise a slow line of a short record takes the most."""
    number = len(clean.running)
    slight = number - 1
    for several in (1, 3):
        sizes = np.zeros(number)
        sizes[:several] = 6e-3
        sizes[slight] = 2e-4
        changed, found = examined(unsettled(clean, sizes, constant))
        plain = [one for one in found.faults if one.channel == "input_angle"]
        assert len(plain) == several
        last = changed.running[slight]
        if several == 1:
            assert last.settling is None
            assert found.faults == tuple(plain)
        else:
            assert last.name in {one.record for one in found.faults}
            hidden = len(found.faults) - several
            assert f"also in {hidden} more" in rows_sentence(found)
            assert last.settling == pytest.approx(constant(last), rel=0.3)


def in_session(campaign, change):
    """Change the output angle of each record by its place in the session, from 0 to 1."""
    last = max(record.elapsed for record in campaign.running)
    running = tuple(
        replace(one, output_angle=one.output_angle + change(one.elapsed / last))
        for one in campaign.running
    )
    return replace(campaign, running=running)


@pytest.mark.parametrize("channel", ["input_angle", "output_angle"])
def test_a_new_zero_between_two_records_is_found_and_taken_out(clean, channel):
    ordered = sorted(clean.running, key=lambda one: one.elapsed)
    size = 200.0 * ARCSEC * (clean.believed.ratio if channel == "input_angle" else 1.0)
    late = {one.name for one in ordered[5:]}
    running = tuple(
        replace(one, **{channel: getattr(one, channel) + size}) if one.name in late else one
        for one in clean.running
    )
    changed, found = examined(replace(clean, running=running))
    (fault,) = found.faults
    assert (fault.kind, fault.record, fault.channel) == ("new zero", ordered[5].name, channel)
    assert fault.size == pytest.approx(size, rel=0.01)
    for one, before in zip(changed.running, clean.running, strict=True):
        apart = getattr(one, channel) - getattr(before, channel)
        np.testing.assert_allclose(apart, 0.0, atol=0.01 * size)


@pytest.mark.parametrize(
    "course",
    [
        pytest.param(lambda t: t, marks=pytest.mark.nightly),
        pytest.param(lambda t: -np.expm1(-t / 0.2), marks=pytest.mark.nightly),
        lambda t: -np.expm1(-t / 0.05),
        lambda t: t**2,
    ],
)
def test_a_drift_over_the_session_is_no_new_zero(clean, course):
    _, found = examined(in_session(clean, lambda t: 40.0 * ARCSEC * course(t)))
    assert found.faults == ()


@pytest.mark.nightly
@pytest.mark.skipif(not CASES.is_dir(), reason="the shared cases are not here")
@pytest.mark.parametrize(
    ("case", "faults", "replaced"),
    [
        ("nothing-encoder-spikes", ["spike"] * 3, 0),
        ("nothing-encoder-jump", ["jump"], 0),
        ("coulomb-gap", ["gap"], 0),
        ("coulomb-noise-x3", [], 4),
    ],
)
def test_shared_cases_show_the_faults_that_were_planted(case, faults, replaced):
    _, found = examined(read_campaign(CASES / case))
    assert [one.kind for one in found.faults] == faults
    assert sum(one.replaced for one in found.noise) == replaced
    for one in found.noise:
        if one.replaced:
            assert one.used == pytest.approx(3.0 * one.stated, rel=0.05)


def reading(campaign, channel, change):
    """Return a campaign in which a channel of each record reads ``change(record)``."""
    running = tuple(replace(one, **{channel: change(one)}) for one in campaign.running)
    return replace(campaign, running=running)


def along(record):
    return (record.time - record.time[0]) / np.ptp(record.time)


def drifting(campaign, channel, sizes):
    """Return a campaign in which a torque reads more by and by, up to sizes (r,), N.m."""
    by_name = {one.name: size for one, size in zip(campaign.running, sizes, strict=True)}
    return reading(
        campaign, channel, lambda one: getattr(one, channel) + by_name[one.name] * along(one)
    )


def told(found, kind):
    return {(one.record, one.channel): one.size for one in found.faults if one.kind == kind}


@pytest.mark.parametrize(("channel", "size"), [("input_torque", 0.05), ("output_torque", -2.0)])
def test_a_torque_that_drifts_in_every_record_is_told_and_its_zero_is_less_certain(
    clean, channel, size
):
    changed, found = examined(drifting(clean, channel, np.full(len(clean.running), size)))
    sizes = told(found, "drift")
    assert sizes.keys() == {(one.name, channel) for one in clean.running}
    np.testing.assert_allclose(list(sizes.values()), size, rtol=0.05)
    name = f"{channel}_zero"
    stated, used = getattr(clean.rig, name), getattr(changed.rig, name)
    assert used == pytest.approx(np.hypot(stated, size / 2.0), rel=0.02)
    assert [one.name for one in found.noise if one.replaced] == [name]
    assert "drift" in rows_sentence(found)
    # What is left of a drift is its mean.
    for before, after in zip(clean.running, changed.running, strict=True):
        rest = getattr(after, channel) - getattr(before, channel) - size / 2.0
        assert np.abs(rest).max() < 0.03 * abs(size)


def test_records_that_drift_apart_are_uncertain_by_what_they_differ(clean):
    sizes = np.linspace(0.0, 0.05, len(clean.running))
    changed, found = examined(drifting(clean, "input_torque", sizes))
    assert len(told(found, "drift")) >= len(sizes) - 1
    apart = [one.reading_errors[0].size for one in changed.running]
    np.testing.assert_allclose(apart, np.abs(sizes - np.median(sizes)) / 2.0, atol=2e-3)


def test_a_load_that_rises_moves_both_torques_and_is_no_drift(clean):
    ratio = clean.believed.ratio
    rising = reading(clean, "output_torque", lambda one: one.output_torque + 2.0 * along(one))
    rising = reading(
        rising, "input_torque", lambda one: one.input_torque + 2.4 / ratio * along(one)
    )
    changed, found = examined(rising)
    assert told(found, "drift") == {}
    assert changed.rig is clean.rig


BOTH_WAYS = tuple(
    Condition(speed, load, 500.0 if abs(speed) < 1000.0 else 1000.0, 1, role)
    for speed, load, role in (
        (600.0, 0.0, "train"),
        (-600.0, 20.0, "train"),
        (600.0, 40.0, "train"),
        (-1000.0, 10.0, "train"),
        (1400.0, 20.0, "train"),
        (2000.0, 0.0, "train"),
        (-2000.0, 40.0, "train"),
        (-600.0, 40.0, "held_out"),
        (2000.0, 10.0, "held_out"),
    )
)


def test_lines_beside_a_drift_that_is_not_straight_scatter_as_their_covariance_says(clean):
    ratio = clean.believed.ratio
    orders = [1.0 / ratio, 2.0 / ratio, 1.0]

    def read(record):
        return record.input_torque - 0.05 * np.expm1(-2.0 * along(record))

    changed, _ = examined(reading(clean, "input_torque", read))
    for before, after in zip(clean.running, changed.running, strict=True):
        true, found = (order_lines(one, changed.rig, ratio, orders) for one in (before, after))
        apart = (found.phasors - true.phasors)[1]
        triangle = np.linalg.cholesky(found.covariance[1, 1:, 1:])
        white = np.linalg.solve(triangle, np.r_[apart.real, apart.imag])
        assert np.sqrt(np.mean(white**2)) < 1.5


@pytest.mark.parametrize("power", others_at_night([2.0], 1.0))
def test_no_friction_is_named_for_a_drift(clean, power):
    """It was named with a probability of .97, and as large as half of the drift."""
    drift = reading(
        clean, "input_torque", lambda one: one.input_torque + 0.05 * along(one) ** power
    )
    assert analyse(drift).verdict.status == "adequate"


@pytest.mark.nightly
def test_friction_beside_a_drift_is_named_where_the_drive_turns_both_ways():
    rng = np.random.default_rng(1)
    rig = draw_rig(BELIEVED, (effect("input", coulomb=0.03),), rng)
    campaign = run_campaign(rig, BELIEVED, RIG, rng, BOTH_WAYS)
    drifts = drifting(campaign, "input_torque", np.full(len(BOTH_WAYS), 0.05))
    (friction,) = analyse(drifts).verdict.chosen.fit.effects
    assert friction.name == "coulomb_friction"
    assert friction.law.level == pytest.approx(0.03, rel=0.02)


@pytest.fixture(scope="module")
def twice(clean):
    """The clean campaign, and once more after it with other noise and other small changes."""
    rng, rig, last = np.random.default_rng(3), clean.rig, clean.running[-1].elapsed
    spread, again = rig.repeatability / np.sqrt(3.0), []
    noise = {"input_torque": rig.input_torque_noise, "output_torque": rig.output_torque_noise}
    for place, record in enumerate(clean.running):
        size = len(record.time)
        lines = spread * (rng.standard_normal(3) + 1j * rng.standard_normal(3))
        waves = np.exp(1j * np.outer(record.input_angle, clean.believed.error_orders))
        shift = spread * rng.standard_normal()
        other = {
            name: getattr(record, name) + deviation * rng.standard_normal(size)
            for name, deviation in noise.items()
        }
        angle = record.output_angle - (waves @ lines).real - shift
        elapsed = last + 100.0 * (place + 1)
        name = f"{record.name}_again"
        again.append(replace(record, name=name, elapsed=elapsed, output_angle=angle, **other))
    return replace(clean, running=(*clean.running, *again))


def test_a_session_with_one_zero_is_left_as_it_is(twice):
    assert told(examined(twice)[1], "new zero") == {}


@pytest.mark.parametrize(
    ("channel", "size"),
    [
        ("input_torque", 0.03),
        pytest.param("output_torque", 1.0, marks=pytest.mark.nightly),
        ("output_angle", 1e-4),
        pytest.param("input_angle", 0.1, marks=pytest.mark.nightly),
    ],
)
def test_a_zero_that_differs_in_one_record_is_told_and_taken_out(twice, channel, size):
    """It was called a thermal drift, or friction that grows with the load."""
    changed, found = examined(broken(twice, 2, channel, slice(None), size))
    name = twice.running[2].name
    assert told(found, "new zero") == {(name, channel): pytest.approx(size, rel=0.1)}
    (record,) = (one for one in changed.running if one.name == name)
    rest = getattr(record, channel) - getattr(twice.running[2], channel)
    assert np.abs(rest).max() < 0.1 * size
    lines = order_lines(record, twice.rig, twice.believed.ratio, [1.0])
    place, scale = {
        "input_torque": (1, 1.0),
        "output_torque": (2, 1.0),
        "output_angle": (0, 1.0),
        "input_angle": (0, twice.believed.ratio),
    }[channel]
    assert np.sqrt(lines.covariance[place, 0, 0]) == pytest.approx(size / scale, rel=0.1)


@pytest.mark.nightly
def test_a_drift_over_the_session_is_no_zero_of_one_record(twice):
    warming = reading(twice, "output_angle", lambda one: one.output_angle - 1e-8 * one.elapsed)
    first = twice.running[0].elapsed
    cooling = reading(
        twice,
        "output_angle",
        lambda one: one.output_angle - 5e-5 * np.exp(-(one.elapsed - first) / 300.0),
    )
    for campaign in (warming, cooling):
        assert told(examined(campaign)[1], "new zero") == {}


def coarse(values, step):
    return step * (np.round(values / step + 0.3) - 0.3)


@pytest.mark.parametrize(
    ("channel", "noise", "step", "scale"),
    [
        ("input_torque", "input_torque_noise", 0.02, 1.0),
        ("output_torque", "output_torque_noise", 1.0, 1.0),
        ("output_angle", "angle_noise", 3e-5, 1.0),
        ("input_angle", "angle_noise", 3e-3, 101.0),
    ],
)
def test_a_reading_in_steps_that_hide_the_noise_has_that_of_the_steps(
    clean, channel, noise, step, scale
):
    rows = reading(clean, channel, lambda one: coarse(getattr(one, channel), step))
    changed, found = examined(rows)
    (one,) = (one for one in found.noise if one.replaced)
    assert one.name == noise
    assert "steps" in one.reason
    assert json.loads(json.dumps(found.as_dict()))["noise"]
    averaged = np.sqrt(np.median([one.samples_averaged for one in clean.running]))
    row_noise = getattr(changed.rig, noise) / averaged
    assert row_noise >= 0.95 * step / scale / np.sqrt(12.0)


def test_steps_finer_than_the_noise_need_nothing(clean):
    rows = reading(clean, "input_torque", lambda one: coarse(one.input_torque, 1e-3))
    assert examined(rows)[0].rig is clean.rig


@pytest.mark.parametrize("step", others_at_night([0.006, 0.008, 0.012, 0.02], 0.008, 0.02))
def test_lines_of_a_coarse_torque_scatter_as_their_covariance_says(clean, step):
    believed, orders = clean.believed, [1.0, 2.0, 3.0]
    rows = reading(clean, "input_torque", lambda one: coarse(one.input_torque, step))
    changed, _ = examined(rows)
    wrong = []
    for before, after in zip(clean.running, changed.running, strict=True):
        true, read = (
            order_lines(one, changed.rig, believed.ratio, orders) for one in (before, after)
        )
        apart = (read.phasors - true.phasors)[1]
        parts = np.r_[(read.mean - true.mean)[1], apart.real, apart.imag]
        wrong.append(parts / np.sqrt(np.diag(read.covariance[1])))
    assert np.sqrt(np.mean(np.square(wrong))) < 1.5


@pytest.mark.nightly
@pytest.mark.parametrize("step", [0.01, 0.02])
def test_a_clean_drive_with_a_coarse_torque_is_adequate(clean, step):
    rows = reading(clean, "input_torque", lambda one: coarse(one.input_torque, step))
    assert analyse(rows).verdict.status == "adequate"


@pytest.mark.slow
@pytest.mark.parametrize("stated", others_at_night([True, False], True))
@pytest.mark.parametrize("bits", others_at_night([17, 18, 19], 18))
def test_scales_with_coarse_steps_make_tones_that_are_nothing_of_the_drive(bits, stated):
    """A clean drive was unlisted: tones of steps beyond the noise were lines of unknown origin."""
    rig = replace(RIG, angle_quantisation=2.0 * np.pi / 2**bits)
    rng = np.random.default_rng(1)
    campaign = run_campaign(draw_rig(BELIEVED, (), rng), BELIEVED, rig, rng, CONDITIONS)
    verdict = analyse(campaign if stated else replace(campaign, rig=RIG)).verdict
    assert verdict.status == "adequate"


@pytest.mark.nightly
def test_an_error_that_nobody_expected_shows_beside_coarse_steps():
    rig = replace(RIG, angle_quantisation=2.0 * np.pi / 2**18)
    rng = np.random.default_rng(1)
    drawn = draw_rig(BELIEVED, (), rng)
    campaign = run_campaign(drawn, BELIEVED, rig, rng, CONDITIONS)
    order = 17.0 / BELIEVED.ratio
    campaign = with_effects(campaign, drawn, (KinematicErrorLine(order, 2.0 * ARCSEC, 0.3),))
    (chosen,) = analyse(campaign).verdict.chosen.candidates
    # So slow an order does not tell the mesh from the encoder.
    assert chosen.label in ("kinematic_error:mesh@0.1683", "encoder_line:sensor@0.1683")
