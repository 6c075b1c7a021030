"""The bench of the blind campaigns: its physics, its integrator, and that it stands alone."""

import ast
import math
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from experiments.studies.blind.cases import BELIEVED, RIG
from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig import integrator
from experiments.studies.blind.rig.campaign import Shown, made_visible, seen_of, shown
from experiments.studies.blind.rig.elements import element
from experiments.studies.blind.rig.files import write_campaign_folder
from experiments.studies.blind.rig.forms import FORMS, LISTED, UNLISTED, draw_effect
from experiments.studies.blind.rig.hidden import equipped
from experiments.studies.blind.rig.machine import EXTRA, SENSOR, ThirdBody, linear_part
from experiments.studies.blind.rig.runs import Condition, locked_torsion, plant_of, run
from experiments.studies.blind.rig.session import (
    ARCSEC,
    SHEET,
    UNCERTAIN,
    averaged_rows,
    draw_circumstances,
    running,
    sweep,
    sweep_torque,
)
from experiments.studies.blind.rig.visible import LEAST, features, means, orders_seen, response
from experiments.studies.blind.truth import one_name
from experiments.studies.virtual_rig.rig import HiddenEffect, TrueRig
from experiments.studies.virtual_rig.runs import Condition as TheirCondition
from experiments.studies.virtual_rig.runs import simulate_run
from pymoo_hdte.discrepancy import read_campaign
from pymoo_hdte.drive._effects import drive_effects

RATED = Condition(2000.0, 40.0, 1000.0, 1, "train")
SHORT = (RATED, replace(RATED, load=0.0, role="held_out"))
ABOUT = replace(
    draw_circumstances(np.random.default_rng(5), conditions=SHORT),
    clocks=np.array([500.0, 600.0]),
)
MACHINE = ABOUT.machine
NOISE = np.array(
    [SHEET.angle_noise * 101.0, SHEET.angle_noise, SHEET.input_noise, SHEET.output_noise]
)
"""Standard deviations of a sample of each channel."""


def transmission_error(seen, ratio=101.0):
    return seen[0] / ratio - seen[1]


def test_it_imports_nothing_but_numerical_libraries():
    folder = Path(integrator.__file__).parent
    allowed = {"numpy", "scipy", "numba", *sys.stdlib_module_names}
    for path in folder.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [one.name for one in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module]
            for name in names:
                own = name.startswith("experiments.studies.blind.rig")
                assert own or name.partition(".")[0] in allowed, (path.name, name)


def measured_line(seen, condition, order):
    """Phasor of a line of the four channels, by least squares over the set angle."""
    turned = ABOUT.starts[0] + condition.speed * np.arange(seen.shape[1]) / condition.rate
    orders = np.array([1.0, 2.0, 2.02])
    waves = np.outer(turned, orders)
    basis = np.column_stack([np.ones(len(turned)), np.cos(waves), -np.sin(waves)])
    channels = np.column_stack([transmission_error(seen), seen[2], seen[3]])
    parts = np.linalg.lstsq(basis, channels, rcond=None)[0]
    place = int(np.flatnonzero(orders == order)[0])
    return parts[0], parts[1 + place] + 1j * parts[4 + place]


@pytest.mark.parametrize(
    "third",
    [None, ThirdBody(SENSOR, 0.0, 6e4, 1.0), ThirdBody(EXTRA, 0.05, 3e5, 5.0)],
    ids=["two bodies", "compliant sensor", "coupled inertia"],
)
def test_a_linear_machine_moves_as_its_transfer_function_says(third):
    machine = replace(MACHINE, third=third)
    seen = run(machine, RATED, 40.0, float(ABOUT.starts[0]), 0.0)
    for order, amplitude, phase in zip(
        machine.orders, machine.amplitudes, machine.phases, strict=True
    ):
        mean, line = measured_line(seen, RATED, order)
        exact = response(machine, order, RATED.speed)
        exact = exact * amplitude * np.exp(1j * (phase - math.pi / 2.0))
        # The error is one of the true input angle, which swings by a few parts in a thousand.
        assert np.abs(line - exact) == pytest.approx(0.0, abs=4e-3 * np.abs(exact).max())
        assert np.abs(line - exact)[0] < 4e-3 * abs(exact[0])
    if third is None:
        assert mean == pytest.approx(means(machine, 40.0, RATED.speed), rel=2e-5)


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.nightly
def test_two_benches_that_were_written_apart_move_alike(share):
    believed = replace(
        BELIEVED,
        error_amplitudes=MACHINE.amplitudes,
        **{name: getattr(MACHINE, name) for name in UNCERTAIN},
    )
    other = TrueRig(believed, MACHINE.phases, (HiddenEffect("input", {"reaction": share}),))
    same = TheirCondition(2000.0, 40.0, 1000.0, 1, "train")
    theirs = simulate_run(other.mechanics(RIG), same, 40.0, 0.3)
    machine = replace(MACHINE, elements=(element(el.REACTION, share),))
    ours = run(machine, RATED, 40.0, 0.3, 0.0)
    # Their motor begins without the friction of the output's bearing, so that the input lags.
    lag = np.mean((ours - theirs)[0])
    change = np.abs(ours - theirs - np.array([[lag], [lag / 101.0], [0.0], [0.0]])).max(axis=1)
    assert np.all(change < 2e-3 * NOISE)


def test_what_the_motor_gives_is_load_and_loss():
    row = element(el.STRIBECK, 0.01, 0.02, 20.0, 0, 0.2)
    machine = replace(MACHINE, elements=(row,))
    seen = run(machine, RATED, 40.0, 0.3, 0.0)
    turns = round(len(seen[0]) * RATED.speed / RATED.rate / (2.0 * math.pi))
    samples = round(turns * 2.0 * math.pi / RATED.speed * RATED.rate)
    speed = np.gradient(seen[0], 1.0 / RATED.rate)[:samples]
    out = np.gradient(seen[1], 1.0 / RATED.rate)[:samples]
    error = transmission_error(seen)
    wound = np.gradient(error - _static(machine, seen[0]), 1.0 / RATED.rate)[:samples]
    lost = machine.input_damping * np.mean(speed**2) + machine.output_damping * np.mean(out**2)
    lost += machine.damping * np.mean(wound**2) + 0.01 * np.mean(speed)
    given = np.mean(seen[2][:samples] * speed) - np.mean(seen[3][:samples] * out)
    # Eq. (9) has no reaction of the static error on the input: what the mesh does there is not
    # taken from the motor.
    mesh = machine.stiffness * (error - _static(machine, seen[0]))[:samples]
    mesh += machine.damping * wound
    slope = np.gradient(_static(machine, seen[0]), 1.0 / RATED.rate)[:samples]
    assert given - np.mean(mesh * slope) == pytest.approx(lost, rel=2e-3)


def _static(machine, angle):
    lines = zip(machine.orders, machine.amplitudes, machine.phases, strict=True)
    return sum(a * np.sin(o * angle + p) for o, a, p in lines)


def test_halving_the_step_changes_far_less_than_the_noise():
    rng = np.random.default_rng(3)
    names = ("hysteresis", "soft_windup", "stribeck_friction")
    hidden = tuple(draw_effect(name, 1, rng).hidden for name in names)
    machine, _ = equipped(MACHINE, ABOUT.sensors, hidden)
    for condition in (RATED, replace(RATED, rpm=600.0, averaged=2)):
        coarse, fine = (run(machine, condition, 20.0, 0.3, 0.0, times) for times in (1, 2))
        assert np.all(np.abs(fine - coarse).max(axis=1) < 0.03 * NOISE)
        # The mean of ten thousand samples is known to a hundredth of their noise.
        mean = np.abs((fine - coarse).mean(axis=1)) / NOISE
        assert np.all(mean < 5e-3)


def test_the_integrator_is_of_fourth_order():
    machine = replace(MACHINE, elements=(element(el.SINH, MACHINE.stiffness, 500.0),))
    slow = replace(RATED, rate=125.0)
    # The shortest steps stand for the truth.
    steps = (1, 2, 16)
    found = [run(machine, _Coarse(slow), 40.0, 0.3, 0.0, times) for times in steps]
    errors = [np.abs(one - found[-1])[1].max() for one in found[:-1]]
    assert 3.5 < math.log2(errors[0] / errors[1]) < 4.8


class _Coarse(Condition):
    """A condition whose steps are as long as its samples."""

    def __init__(self, other):
        super().__init__(other.rpm, other.load, other.rate, other.averaged, other.role)

    substeps = 2


def test_static_friction_holds_until_the_load_exceeds_it():
    torque = np.concatenate([np.linspace(0.0, 10.0, 101), np.linspace(10.0, 0.0, 101)])
    row = element(el.DRY, 2.0, 0.002, 0, 0.0, 0.0, 0.0, el.OUTPUT)
    torsion = locked_torsion(replace(MACHINE, elements=(row,)), torque, 0.1)
    spring = torsion * MACHINE.stiffness
    assert spring[:20] == pytest.approx(0.0, abs=1e-6)
    assert spring[100] == pytest.approx(8.0, abs=1e-6)
    # On the way back it holds over twice its level, then follows above the load.
    assert spring[101:140] == pytest.approx(8.0, abs=1e-6)
    assert spring[-1] == pytest.approx(2.0, abs=1e-6)
    # Bristles give way a little, and hold the rest.
    row = element(el.BRISTLES, 2.0, 0.0, 1.0, 2.0 * ARCSEC, 0.0, 0.0, el.OUTPUT)
    soft = locked_torsion(replace(MACHINE, elements=(row,)), torque, 0.1)
    assert 0.0 < soft[10] < 0.3 * torque[10] / MACHINE.stiffness
    assert soft[100] * MACHINE.stiffness == pytest.approx(8.0, abs=0.05)


@pytest.mark.parametrize("kind", ["springs", "bouc-wen"])
def test_hysteresis_loses_the_area_of_its_loop(kind):
    wound = 6.0 * ARCSEC
    row = element(el.SLIP, 1.0 / wound, 1.0)
    # A spring that slips at 1 N.m loses that over all of its way but twice what it is wound up.
    unused = 4.0 * wound
    if kind == "bouc-wen":
        # Here it is unwound along a line and wound up by an exponential: 2 (1 + 1/4) each way.
        row, unused = element(el.BOUC_WEN, 1.0, wound, 1.0, 0.5), 5.0 * wound
    corners = (0.0, 40.0, -40.0, 40.0)
    cycle = np.interp(np.linspace(0.0, 3.0, 1201), np.arange(4.0), corners)
    torsion = locked_torsion(replace(MACHINE, elements=(row,)), cycle, 0.1)
    area = abs(np.trapezoid(cycle[400:], torsion[400:]))
    assert area == pytest.approx(2.0 * np.ptp(torsion) - unused, rel=5e-3)


def test_a_gap_is_lost_torsion_and_elements_without_size_change_nothing():
    torque = np.array([0.0, 20.0, -20.0])
    for contact, lost in ((0, 5.0), (2, 5.0 * 1.25)):
        row = element(el.PLAY, 5.0 * ARCSEC, 0.0, 1.0, 0.0, contact)
        torsion = locked_torsion(replace(MACHINE, elements=(row,)), torque, 0.1)
        bare = torque / MACHINE.stiffness
        assert (torsion - bare)[1:] / ARCSEC == pytest.approx([lost, -lost], rel=2e-2)
    plain = run(MACHINE, RATED, 40.0, 0.3, 0.0)
    rows = [element(kind, 0.0, *[1.0] * 5) for kind in (el.DRY, el.RIPPLE, el.ERROR_WAVE)]
    same = run(replace(MACHINE, elements=tuple(rows)), RATED, 40.0, 0.3, 0.0)
    assert same == pytest.approx(plain, abs=1e-12)


@pytest.mark.parametrize("form", range(FORMS["soft_windup"]))
def test_a_soft_windup_is_softer_near_zero_and_loses_a_torsion_beyond(form):
    """Every form begins with the stiffness less the lost one and ends a fixed torsion behind."""
    effect = draw_effect("soft_windup", form, np.random.default_rng(1)).hidden
    lost, wound = effect.elements[0][1:3]
    machine = replace(MACHINE, elements=effect.elements)
    softened = MACHINE.stiffness - lost
    torque = np.array([0.0, 1e-3 * softened * wound, 1e3 * MACHINE.stiffness * wound])
    torsion = locked_torsion(machine, torque, 0.1)
    assert torsion[1] == pytest.approx(torque[1] / softened, rel=2e-3)
    behind = torsion[2] - torque[2] / MACHINE.stiffness
    assert behind == pytest.approx(lost * wound / MACHINE.stiffness, rel=2e-3)


def test_the_motor_carries_friction_from_the_start():
    row = element(el.DRY, 0.03, 0.2, 0)
    machine = replace(MACHINE, elements=(row,))
    plant = plant_of(machine, linear_part(machine), RATED, 40.0, 0.0, 0.0)
    assert plant.motor == pytest.approx(means(machine, 40.0, RATED.speed)[1] + 0.03, rel=1e-6)


def test_every_listed_effect_of_the_library_is_hidden_and_has_foreign_forms():
    names = {one.name for one in drive_effects() if not one.is_of_bench}
    # These campaigns have no temperatures.
    never = {"temperature_dependent_friction"}
    # These joined the library after the last cases were drawn.
    never |= {"load_dependent_error", "load_dependent_damping", "gravity"}
    never |= {"changed_static_error", "uneven_load_sharing"}
    assert set(LISTED) == {one_name(one, "") for one in names} - never
    assert min(FORMS.values()) >= 3
    assert not set(UNLISTED) & names
    assert len(UNLISTED) >= 8


@cache
def bare():
    """What sensors show of the first record and the sweep with nothing hidden."""
    return running(ABOUT, 0, MACHINE, ABOUT.sensors), sweep(MACHINE, ABOUT.sensors)


@pytest.mark.parametrize("name", [*LISTED, *UNLISTED])
def test_every_form_moves_the_bench(name):
    """A twin without the effect differs where it acts, and all readings stay finite."""
    plain, still = bare()
    for form in range(FORMS.get(name, 1)):
        effect = draw_effect(name, form, np.random.default_rng(form))
        machine, sensors = equipped(MACHINE, ABOUT.sensors, (effect.hidden,))
        seen = running(ABOUT, 0, machine, sensors)
        assert np.isfinite(seen).all()
        moved = np.abs(seen - plain).max(axis=1) / [ARCSEC * 101.0, ARCSEC, 0.003, 0.2]
        bent = np.abs(sweep(machine, sensors)[0] - still[0]).max() / ARCSEC
        assert max(*moved, bent) > 0.3, (name, form)


def test_visibility_counts_neither_what_a_base_fit_absorbs_nor_a_straight_sweep():
    about = draw_circumstances(np.random.default_rng(2), conditions=(RATED, RATED, RATED))
    orders = orders_seen(101.0)
    effect = draw_effect("eccentricity", 0, np.random.default_rng(1))
    plain = tuple(running(about, k, about.machine, about.sensors) for k in range(3))
    stiff = replace(about.machine, stiffness=1.02 * about.machine.stiffness)
    other = tuple(running(about, k, stiff, about.sensors) for k in range(3))
    still = sweep(about.machine, about.sensors)
    clean = Shown(plain, still)
    absorbed = seen_of(about, effect, Shown(other, sweep(stiff, about.sensors)), clean)
    hidden = equipped(about.machine, about.sensors, (effect.hidden,))
    shown = Shown(tuple(running(about, k, *hidden) for k in range(3)), sweep(*hidden))
    assert absorbed < 1.0
    assert seen_of(about, effect, shown, clean) > 20.0
    found = features(about, 0, shown.records[0] - plain[0], orders)
    line = np.hypot(found[0, 1], found[0, 1 + len(orders)])
    assert line == pytest.approx(effect.size, rel=2e-3)


@pytest.mark.nightly
def test_a_gap_that_varies_must_differ_visibly_from_one_that_does_not():
    conditions = tuple(replace(RATED, load=load) for load in (20.0, 40.0, 0.0))
    about = draw_circumstances(np.random.default_rng(2), conditions=conditions)
    clean = shown(about, ())
    effect = draw_effect("clearance_variation", 0, np.random.default_rng(1))
    assert seen_of(about, effect, shown(about, [effect]), clean) > 5.0
    steady = replace(effect, build=effect.simpler)
    assert seen_of(about, steady, shown(about, [steady]), clean) == 0.0
    # Without comparison a gap is plain to see in the sweep.
    assert seen_of(about, replace(steady, simpler=None), shown(about, [steady]), clean) > 100.0
    small = replace(effect, size=0.2 * effect.size)
    larger, _ = made_visible(about, small, clean, np.random.default_rng(3))
    assert seen_of(about, small, shown(about, [small]), clean) < LEAST
    assert seen_of(about, larger, shown(about, [larger]), clean) >= LEAST


def test_a_folder_is_what_was_measured_and_what_is_believed(tmp_path):
    rng = np.random.default_rng(1)
    rows = [
        averaged_rows(one, running(ABOUT, k, MACHINE, ABOUT.sensors)) for k, one in enumerate(SHORT)
    ]
    noisy = [ABOUT.sensors.sampled(row, 101.0, 1, rng) for row in rows]
    torsion = sweep(MACHINE, ABOUT.sensors)
    write_campaign_folder(tmp_path, "two records", ABOUT, noisy, torsion)
    found = read_campaign(tmp_path)
    assert found.believed == BELIEVED
    assert found.rig == RIG
    for record, row in zip(found.running, noisy, strict=True):
        channels = (record.input_angle, record.output_angle, record.input_torque,
                    record.output_torque)  # fmt: skip
        for channel, values, digits in zip(channels, row, (1e-8, 1e-11, 1e-8, 1e-6), strict=True):
            assert channel == pytest.approx(values, abs=digits)
    assert found.torsion[0].output_torque == pytest.approx(sweep_shown(), abs=1e-6)


def sweep_shown():
    return ABOUT.sensors.load_shown(sweep_torque())


def test_sensors_average_round_and_scatter_as_stated():
    rng = np.random.default_rng(4)
    sensors = ABOUT.sensors
    shown = np.zeros((4, 40000))
    rows = sensors.sampled(shown, 101.0, 4, rng)
    expected = np.array([101.0 * SHEET.angle_noise, SHEET.angle_noise, SHEET.input_noise,
                         SHEET.output_noise]) / 2.0  # fmt: skip
    rounding = np.array([101.0, 1.0, 0.0, 0.0]) * SHEET.angle_step / math.sqrt(12.0) / 2.0
    assert rows.std(axis=1) == pytest.approx(np.hypot(expected, rounding), rel=0.03)
    steps = sensors.sampled(shown[:, :100], 101.0, 1, rng)[1] / SHEET.angle_step
    assert steps == pytest.approx(np.rint(steps), abs=1e-9)
