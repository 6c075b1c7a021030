"""Inverse dynamics: derivatives, closed balances, and the noise that sensors bring into them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import dct
from scipy.signal import butter, sosfiltfilt

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.effects.friction import CoulombFriction, NonlinearDrag
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.effects.linear import ConstantForce, DirectionalFriction, LinearDamper, LinearSpring
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.effects.stiffness import HardeningStiffness
from pymoo_hdte.mechanism import BelievedValue, ErrorLine, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.balances import ForceBalance, balance_names, quantity_names
from pymoo_hdte.mechanism.motion import highest_frequency, motion_of, noise_of, smooth, timing_noise
from pymoo_hdte.mechanism.port_motion import law_force

STEP = 1e-3
TIME = np.arange(0.0, 8.0, STEP)
CUTOFF = 20.0
MASSES = {"a": 2.0, "b": 0.5}


def course(frequencies, seed=0):
    """Return position, speed and acceleration of a sum of sines, shape (n,) each."""
    generator = np.random.default_rng(seed)
    omega = 2.0 * np.pi * np.asarray(frequencies)
    size = generator.uniform(0.5, 1.0, len(omega)) / (1.0 + omega)
    angle = np.outer(TIME, omega) + generator.uniform(0.0, 6.0, len(omega))
    return np.sin(angle) @ size, np.cos(angle) @ (size * omega), -np.sin(angle) @ (size * omega**2)


def two_masses(**ports):
    """Return masses a and b with a spring between them; both are driven."""
    return Mechanism(
        {name: BelievedValue(mass) for name, mass in MASSES.items()},
        [Port("between", {"a": 1.0, "b": -1.0}, BelievedValue(300.0), BelievedValue(4.0), **ports)],
        [Input("push", {"a": 1.0}), Input("pull", {"b": 2.0}, BelievedValue(3.0))],
    )


def closed(laws=(), noise=0.0, seed=5):
    """Return a record whose forces are what an analytic motion asks for."""
    (a, va, aa), (b, vb, ab) = course((0.6, 2.3, 6.1), 1), course((0.9, 3.7, 8.3), 2)
    d, vd = a - b, va - vb
    between = 300.0 * d + 4.0 * vd + sum(law(d, vd) for law in laws)
    generator = np.random.default_rng(seed)
    channels = {
        "a": a,
        "b": b,
        "push": MASSES["a"] * aa + between,
        "pull": (MASSES["b"] * ab - between) / 6.0,
    }
    noisy = {
        name: one + noise * generator.standard_normal(len(one)) for name, one in channels.items()
    }
    return Record("closed", "train", TIME, noisy)


def left(balance, laws=()):
    """Return what is left of the balances, (n_balances, n_bins), at the believed values."""
    values = np.array([one.value for one in balance.mechanism.quantities.values()])
    zeros = np.zeros(len(quantity_names(balance.mechanism)) - len(values))
    terms = np.einsum("bqk,q->bk", balance.terms, np.concatenate([values, zeros]))
    return balance.constant + terms - balance.forces(laws)


def test_derivatives_of_sines_are_those_of_the_closed_form():
    position, speed, acceleration = course((0.5, 3.0, 11.0))
    motion = motion_of(position, STEP, CUTOFF)
    inside = slice(200, -200)
    assert motion.position[inside] == pytest.approx(position[inside], abs=1e-6)
    assert motion.speed[inside] == pytest.approx(speed[inside], abs=1e-4)
    assert motion.acceleration[inside] == pytest.approx(acceleration[inside], abs=5e-3)


@given(st.floats(1e-9, 1e3), st.integers(0, 2**31))
@settings(max_examples=20, deadline=None)
def test_noise_is_told_from_a_smooth_signal(size, seed):
    signal = 1e3 * size * np.sin(2.0 * np.pi * 0.5 * TIME)
    noise = size * np.random.default_rng(seed).standard_normal(len(TIME))
    assert noise_of(signal + noise) == pytest.approx(size, rel=0.06)


def test_a_jump_of_a_force_is_no_noise():
    noise = 0.01 * np.random.default_rng(4).standard_normal(len(TIME))
    force = np.sign(np.sin(2.0 * np.pi * 3.0 * TIME)) + noise
    assert noise_of(force, jumps=True) == pytest.approx(0.01, rel=0.1)
    assert noise_of(force) > 0.05
    # Coarse steps have no median.
    assert noise_of(np.round(force), jumps=True) > 0.0


def test_the_timing_of_jumps_is_white_noise_of_the_stated_size():
    """Samples of a relay against the means over their steps, which know each instant."""
    generator, low = np.random.default_rng(9), slice(1, 400)
    power, said = [], []
    for _ in range(40):
        jumps = np.cumsum(generator.uniform(40.0, 200.0, 300))
        jumps = jumps[jumps < len(TIME) - 1.0]
        sizes = generator.uniform(1.0, 3.0, len(jumps)) * np.where(np.arange(len(jumps)) % 2, -1, 1)
        places = np.arange(len(TIME))[:, None]
        sampled = (places > jumps) @ sizes
        exact = np.clip(places + 0.5 - jumps, 0.0, 1.0) @ sizes
        power.append(dct(sampled - exact, type=2, norm="ortho") ** 2)
        said.append(timing_noise(sampled))
    by_frequency = np.mean(power, axis=0)
    expected = np.mean(np.square(said))
    assert by_frequency[low].mean() == pytest.approx(expected, rel=0.1)
    assert by_frequency[5000:].mean() == pytest.approx(expected, rel=0.1)


def test_smooth_signals_have_no_jumps_and_noise_hides_none():
    sweep = 15.0 * np.sin(2.0 * np.pi * (0.2 + 0.5 * TIME) * TIME)
    relay = 10.0 * np.sign(np.sin(2.0 * np.pi * 0.37 * TIME + 0.3))
    jumps = np.count_nonzero(np.diff(relay))
    expected = 20.0 * np.sqrt(jumps / 12.0 / len(TIME))
    for size in (0.0, 1e-3, 0.1):
        noise = size * np.random.default_rng(5).standard_normal(len(TIME))
        assert timing_noise(sweep + noise) < 0.1 * size + 1e-5 * np.ptp(sweep)
        assert timing_noise(relay + sweep + noise) == pytest.approx(expected, rel=0.03)
    record = Record("relay", "train", TIME, {"f": relay, "x": sweep}, {"f": 0.2, "x": 0.1})
    assert record.noise_of("f", jumps=True) == pytest.approx(np.hypot(0.2, expected))
    assert record.noise_of("f") == 0.2


def test_a_motion_is_known_up_to_where_it_ends():
    position, *_ = course(np.arange(0.5, 15.0, 0.25))
    noise = 1e-6 * np.random.default_rng(1).standard_normal(len(TIME))
    # It ends at 14.75 Hz; the window of the spectrum blurs that.
    assert 14.0 < highest_frequency(position + noise, STEP, noise_of(position + noise)) < 30.0


def test_smoothing_has_no_delay_and_keeps_what_is_below_the_cutoff():
    signal = np.sin(2.0 * np.pi * CUTOFF * TIME)
    inside = slice(500, -500)
    assert smooth(signal, STEP, CUTOFF)[inside] == pytest.approx(signal[inside], abs=1e-4)
    beyond = np.sin(2.0 * np.pi * 5.0 * CUTOFF * TIME)
    assert np.abs(smooth(beyond, STEP, CUTOFF)[inside]).max() < 1e-3


LAWS = [
    ("coulomb_friction", CoulombFriction(2.0), lambda d, v: 2.0 * np.tanh(v / 1e-4)),
    ("hardening_stiffness", HardeningStiffness(5e3), lambda d, v: 5e3 * d**3),
    ("force_offset", ConstantForce(-3.0), lambda d, v: -3.0),
    (
        "direction_dependent_friction",
        DirectionalFriction(1.0, 0.5),
        lambda d, v: np.tanh(v / 1e-4) ** 2 * (1.0 + 0.5 * np.abs(v)),
    ),
    (
        "nonlinear_drag",
        NonlinearDrag(3.0, 0.5, 0.2),
        lambda d, v: 3.0 * 0.2**2 * np.sign(v) * np.sqrt(np.abs(v) / 0.2),
    ),
    ("torque_ripple", PeriodicTorque(7.0, 0.3, 2.0), lambda d, v: -2.0 * np.cos(7.0 * d + 0.3)),
]


@pytest.mark.parametrize(("name", "law", "force"), LAWS, ids=[name for name, *_ in LAWS])
def test_the_balances_of_an_analytic_motion_close(name, law, force):
    balance = ForceBalance(two_masses(), closed([force]), CUTOFF)
    effect = LawAt(name, "between", law)
    scale = np.sqrt(np.sum(balance.terms[:, 0] ** 2))
    assert np.sqrt(np.sum(left(balance, [effect]) ** 2)) < 2e-3 * scale
    # Without the law they do not close, so that the test can fail.
    assert np.sqrt(np.sum(left(balance) ** 2)) > 1e-2 * scale


@pytest.mark.parametrize(("cutoff", "finer"), [(20.0, 1), (30.0, 2), (80.0, 4)])
def test_a_law_that_is_linear_takes_what_the_port_of_its_coefficient_does(cutoff, finer):
    balance = ForceBalance(two_masses(), closed(), cutoff)
    assert len(balance._fine["between"].speed) == finer * len(balance.time)
    laws = [
        LawAt("linear_stiffness", "between", LinearSpring(7.0)),
        LawAt("viscous_friction", "between", LinearDamper(0.3)),
    ]
    names = quantity_names(balance.mechanism)
    spring, damper = (f"{name} of between" for name in ("stiffness", "damping"))
    terms = (
        7.0 * balance.terms[:, names.index(spring)] + 0.3 * balance.terms[:, names.index(damper)]
    )
    assert balance.forces(laws) == pytest.approx(-terms, abs=1e-6 * np.abs(terms).max())


@pytest.mark.parametrize(
    "law", [DirectionalFriction(1.0, 0.5), LinearDamper(0.3), NonlinearDrag(2.0, 0.4, 0.1)]
)
def test_damping_of_a_law_is_its_derivative_by_the_speed(law):
    # The smoothed sign turns within 1e-4; beyond it only what is viscous is left.
    speed = np.array([-0.3, -2e-4, -5e-5, 3e-5, 1e-4, 0.2])

    def respond(at):
        return law.respond(PortState(0.0 * at, at, periodic_phase(0.0 * at), np.ones(1)))

    step = 1e-9
    slope = (respond(speed + step).torque - respond(speed - step).torque) / (2.0 * step)
    assert np.broadcast_to(respond(speed).damping, slope.shape) == pytest.approx(slope, rel=1e-4)


def test_slipping_springs_follow_the_order_of_the_samples():
    law = MaxwellSlip(3.0, 0.05)
    record = closed()
    balance = ForceBalance(two_masses(), record, CUTOFF)
    motion = balance.ports["between"]
    torque = law_force(law, motion, 300.0)
    work = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(motion.position))
    assert np.abs(torque).max() <= 3.0 + 1e-12
    # Springs that slip take energy out of any motion.
    assert work > 0.0


def test_forces_are_the_same_when_asked_again():
    balance = ForceBalance(two_masses(), closed(), CUTOFF)
    effects = [LawAt("coulomb_friction", "between", CoulombFriction(float(k))) for k in range(100)]
    first = [balance.forces([effect]) for effect in effects]
    again = [balance.forces([effect]) for effect in effects]
    assert np.array_equal(first, again)
    assert balance.forces(effects[:3]) == pytest.approx(sum(first[:3]))


def test_a_force_sensor_reads_its_port_and_touches_nothing():
    sensor = Port("sensor", {"a": 1.0}, BelievedValue(50.0), BelievedValue(2.0), read=True)
    mechanism = two_masses()
    mechanism = Mechanism(mechanism.inertias, [*mechanism.ports, sensor], mechanism.inputs)
    record = closed()
    position, speed, _ = course((0.6, 2.3, 6.1), 1)
    reading = 50.0 * position + 2.0 * speed
    record = Record("read", "train", TIME, dict(record.channels) | {"sensor": reading})
    balance = ForceBalance(mechanism, record, CUTOFF)
    assert balance_names(mechanism) == ("a", "b", "sensor")
    assert np.sqrt(np.sum(left(balance)[2] ** 2)) < 1e-4 * np.sqrt(np.sum(balance.constant[2] ** 2))
    before = left(balance)
    after = left(balance, [LawAt("kinematic_error", "sensor", PeriodicTorque(3.0, 0.0, 1.0))])
    assert np.array_equal(before[:2], after[:2])
    assert not np.array_equal(before[2], after[2])
    # It is held against the motion beyond the frequency to which forces are known.
    assert balance.kept[2].sum() > balance.kept[0].sum() == balance.kept[1].sum()


def test_a_kinematic_error_moves_the_port():
    line = ErrorLine("a", 5.0, 0.01, 0.4)
    balance = ForceBalance(two_masses(error=(line,)), closed(), CUTOFF)
    plain = ForceBalance(two_masses(), closed(), CUTOFF)
    (a, va, _) = course((0.6, 2.3, 6.1), 1)
    rows = slice(len(TIME) // 2 - 5, len(TIME) // 2)
    moved = balance.ports["between"].position - plain.ports["between"].position
    expected = 0.01 * np.sin(5.0 * a + 0.4)
    index = np.searchsorted(TIME, balance.time)
    assert moved == pytest.approx(expected[index], abs=1e-7)
    rate = balance.ports["between"].speed - plain.ports["between"].speed
    assert rate[rows] == pytest.approx((0.05 * np.cos(5.0 * a + 0.4) * va)[index][rows], abs=1e-5)


def test_sensor_noise_is_carried_into_the_balances():
    exact, ratios = left(ForceBalance(two_masses(), closed(), CUTOFF)), []
    for seed in range(12):
        balance = ForceBalance(two_masses(), closed(noise=1e-5, seed=seed), CUTOFF)
        difference = (left(balance) - exact) / balance.noise
        ratios.append(np.mean(difference[balance.kept] ** 2))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.08)


def test_in_time_undoes_the_transform():
    balance = ForceBalance(two_masses(), closed(), CUTOFF)
    signal = balance.in_time(balance.terms[0, 0])
    assert np.sum(signal**2) == pytest.approx(np.sum(balance.terms[0, 0] ** 2))


def test_a_motion_without_slow_parts_is_known_up_to_its_band(rng):
    """A pendulum swings about its own frequency only; noise below it says nothing."""
    band = butter(6, (0.7, 2.5), "bandpass", fs=1.0 / 0.03, output="sos")
    position = 0.1 * sosfiltfilt(band, rng.standard_normal(6000))
    noise = 1e-3 * rng.standard_normal(len(position))
    assert 2.0 < highest_frequency(position + noise, 0.03, 1e-3) <= 10.0 / 3.0


def test_noise_alone_is_no_motion(rng):
    refused = 0
    for _ in range(50):
        try:
            highest_frequency(1e-3 * rng.standard_normal(900), 0.01, 1e-3)
        except InvalidInput:
            refused += 1
    assert refused >= 47
