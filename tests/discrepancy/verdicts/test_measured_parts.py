"""Orders, intervals, rests and limits of measured records, each where the truth is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import curve_fit
from scipy.stats import t

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.next_test_mechanism import next_test
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.order_search import phasors
from pymoo_hdte.discrepancy._evidence.force_balances.candidates import mechanism_candidates
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.intervals import Spread
from pymoo_hdte.discrepancy._evidence.force_balances.orders import position_orders
from pymoo_hdte.discrepancy._report.mechanism_document import limits
from pymoo_hdte.discrepancy._report.mechanism_values import effects
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record
from pymoo_hdte.mechanism.motion import motion_of

STEP, DURATION, CUTOFF = 2e-3, 6.0, 25.0
TIME = np.arange(0.0, DURATION, STEP)
INERTIA, VISCOUS = 0.05, 0.4
PERIODIC = ("kinematic_error", "torque_ripple", "position_dependent_friction")

JOINT = Mechanism(
    {"q": BelievedValue(0.06, 0.5)},
    [Port("bearing", {"q": 1.0}, damping=BelievedValue(0.5, 0.5))],
    [Input("torque", {"q": 1.0})],
)


def turning(name, speed, friction, noise=1e-3, swing=0.2, seed=0):
    """Return a record of a joint that turns, its speed swinging; ``friction(q, v)`` is hidden."""
    generator = np.random.default_rng([seed, int(1e6 * abs(speed))])
    omega = 2.0 * np.pi * np.array([0.7, 1.9, 4.3])
    angle = np.outer(TIME, omega) + generator.uniform(0.0, 6.0, 3)
    q = speed * TIME + swing * np.sin(angle) @ (speed / omega)
    q += 1e-7 * generator.standard_normal(len(q))
    motion = motion_of(q, STEP, CUTOFF)
    torque = INERTIA * motion.acceleration + VISCOUS * motion.speed + friction(q, motion.speed)
    torque = torque + noise * generator.standard_normal(len(q))
    return Record(name, "train", TIME, {"q": q, "torque": torque})


def dry(q, v):
    return 0.8 * np.tanh(v / 1e-4)


def test_what_a_sensor_reads_is_kinematic_there_and_a_torque_where_it_moves():
    ports = [*JOINT.ports, Port("cell", {"q": 1.0}, read=True)]
    joint = Mechanism(JOINT.inertias, ports, JOINT.inputs)
    one = turning("one", 1.5, dry)
    record = Record(one.name, one.role, one.time, one.channels | {"cell": one.channels["torque"]})
    data = measured_data(joint, [record], CUTOFF)
    found = mechanism_candidates(data, {"bearing": 1.0, "cell": 1.0}, {"cell": (17.0, 34.0)})
    periodic = {(one.name, one.port) for one in found if one.name in PERIODIC}
    assert periodic == {("kinematic_error", "cell"), ("torque_ripple", "bearing")}


def test_the_orders_of_a_ripple_are_found_and_none_in_noise():
    def rippled(q, v):
        return 0.05 * np.cos(17.0 * q) + 0.03 * np.cos(34.0 * q + 1.0)

    for friction, strongest in ((rippled, (17.0, 34.0)), (lambda q, v: 0.0 * q, ())):
        records = [turning(f"{speed}", speed, friction) for speed in (0.8, 1.5, 2.5)]
        data = measured_data(JOINT, records, CUTOFF)
        found = position_orders(data, fit(data))["bearing"]
        assert found[:2] == strongest


@pytest.mark.parametrize("n", [1, 2, 7, 150])
def test_phasors_at_many_orders_are_the_sums_that_define_them(n, rng):
    position, signal = np.cumsum(rng.random(400)), rng.standard_normal(400)
    orders = 3.5 + 0.37 * np.arange(n)
    expected = np.exp(-1j * np.outer(orders, position)) @ signal
    np.testing.assert_allclose(phasors(position, signal, orders), expected, atol=1e-9)


@pytest.mark.slow
def test_a_ripple_is_one_effect_with_its_orders():
    def rippled(q, v):
        return 0.05 * np.cos(17.0 * q + 0.5) + 0.03 * np.cos(34.0 * q + 1.0)

    finding = examine_mechanism(JOINT, [turning(f"{v}", v, rippled) for v in (-0.8, 1.5, 2.5)])
    assert finding.verdict.status == "named"
    (effect,) = effects(finding)
    assert effect["name"] == "torque_ripple"
    # A driving torque: it acts with the motion, where what is hidden here resists it.
    values = effect["parameters"]
    assert values["order_17_amplitude"]["value"] == pytest.approx(0.05, rel=0.05)
    assert values["order_34_amplitude"]["value"] == pytest.approx(0.03, rel=0.05)
    phase = values["order_17_amplitude_phase"]["value"]
    assert np.cos(phase - 0.5) == pytest.approx(-1.0, abs=0.01)


@pytest.mark.nightly
def test_one_direction_is_said_and_the_reverse_run_proposed():
    one_way = examine_mechanism(JOINT, [turning(f"{v}", v, dry) for v in (0.5, 1.5, 2.5)])
    assert [one["name"] for one in effects(one_way)] == ["coulomb_friction"]
    assert any("cannot separate Coulomb friction" in sentence for sentence in limits(one_way))
    assert next_test(one_way).rate < 0.0
    assert "reverse" in next_test(one_way).description

    both = examine_mechanism(JOINT, [turning(f"{v}", v, dry) for v in (0.5, -1.5, 2.5)])
    assert [one["name"] for one in effects(both)] == ["coulomb_friction"]
    assert not any("cannot separate" in sentence for sentence in limits(both))
    assert next_test(both).rate > 0.0


@pytest.mark.nightly
def test_friction_and_an_offset_are_told_apart_by_two_directions():
    def offset(q, v):
        return 0.8 + 0.0 * q

    finding = examine_mechanism(JOINT, [turning(f"{v}", v, offset) for v in (0.5, -1.5, 2.5)])
    (effect,) = effects(finding)
    assert effect["name"] == "force_offset"
    assert effect["parameters"]["force"]["value"] == pytest.approx(0.8, rel=0.01)


@pytest.mark.nightly
def test_a_rest_that_nobody_explains_does_not_hide_the_main_effect():
    generator = np.random.default_rng(3)
    # A slow wander, a hundred times the sensors' noise and a sixth of the friction.
    wander = np.convolve(generator.standard_normal(len(TIME) + 400), np.hanning(401), "valid")
    wander *= 0.13 / wander.std()

    finding = examine_mechanism(
        JOINT, [turning(f"{v}", v, lambda q, v: dry(q, v) + wander) for v in (0.5, -1.5, 2.5)]
    )
    assert effects(finding)[0]["name"] == "coulomb_friction"
    assert len(effects(finding)) == 1
    assert finding.unexplained > 10.0 * finding.sensor_noise
    assert finding.unexplained < 0.35 * finding.base_misfit


@pytest.mark.nightly
def test_intervals_cover_when_the_rest_is_coloured():
    """95 % intervals of 120 fits; those of a white rest would cover far less."""
    truth = np.array([INERTIA, VISCOUS])
    generator = np.random.default_rng(11)
    covered = {"coloured": 0, "white": 0}
    record = turning("one", 1.5, lambda q, v: 0.0 * q, noise=0.0, swing=0.9)
    trials = 120
    for _ in range(trials):
        drawn = generator.standard_normal(len(TIME) + 200)
        rest = 0.01 * np.convolve(drawn, np.hanning(201), "valid")
        channels = dict(record.channels) | {"torque": record.channels["torque"] + rest}
        sensors = measured_data(JOINT, [Record("one", "train", TIME, channels)], CUTOFF)
        data = sensors.with_residual_as_noise(fit(sensors).residuals)
        fitted = fit(data)
        off, spread = np.abs(fitted.values - truth), Spread(data, fitted)
        covered["coloured"] += int(off[1] <= spread.reach[1] * np.sqrt(spread.covariance[1, 1]))
        covered["white"] += int(off[1] <= 1.96 * np.sqrt(fitted.covariance[1, 1]))
    assert 0.88 <= covered["coloured"] / trials <= 0.99
    assert covered["white"] / trials < 0.8


def line(n):
    """Return frequencies, and slopes by three quantities, as of a motion that falls with them."""
    frequency = np.arange(n) / n
    motion = np.random.default_rng(n).standard_normal(n) / (1.0 + np.arange(n))
    return frequency, np.column_stack([motion * frequency**2, motion, np.roll(motion, 1)])


def spread_of(frequency, slopes, residuals):
    parameters = tuple(Parameter(f"p{k}", 0.0, -1e9, 1e9, 1.0) for k in range(slopes.shape[1]))
    fitted = Fit((), parameters, np.zeros(len(parameters)), residuals, slopes)
    rows = [np.arange(len(frequency))]
    return Spread(SimpleNamespace(frequency=frequency, rows_of_parts=lambda: rows), fitted)


@pytest.mark.parametrize("n", [8, 11, 20])
def test_intervals_of_one_band_are_those_of_least_squares(n):
    frequency, slopes = line(n)
    noise = np.random.default_rng(1).standard_normal(n)
    values, expected = curve_fit(lambda _, *p: slopes @ p, frequency, noise, p0=[0.0] * 3)
    found = spread_of(frequency, slopes, slopes @ values - noise)
    np.testing.assert_allclose(found.covariance, expected, rtol=1e-4)
    np.testing.assert_allclose(found.reach, t.ppf(0.975, n - 3), rtol=1e-6)


@pytest.mark.parametrize("n", [11, 25, 60])
def test_intervals_of_short_records_cover(n):
    frequency, slopes = line(n)
    generator, trials, covered = np.random.default_rng(2), 1500, np.zeros(3)
    for _ in range(trials):
        noise = generator.standard_normal(n)
        off = np.linalg.lstsq(slopes, noise, rcond=None)[0]
        found = spread_of(frequency, slopes, slopes @ off - noise)
        covered += np.abs(off) <= found.reach * np.sqrt(np.diag(found.covariance))
    # Four standard deviations of a count of so many trials.
    assert covered / trials == pytest.approx(0.95, abs=0.0225)


@pytest.mark.parametrize("share", [0.0, 1e-14])
def test_what_no_record_determines_reaches_as_far_as_its_bounds(share):
    frequency, slopes = line(40)
    found = spread_of(frequency, share * slopes, np.ones(40))
    np.testing.assert_allclose(np.diag(found.covariance), 2e9**2 / 12.0, rtol=1e-6)
    np.testing.assert_allclose(found.reach, 1.96, atol=0.001)


def test_the_rest_is_never_less_than_the_sensors_noise():
    record = turning("one", 1.5, lambda q, v: 0.0 * q)
    data = measured_data(JOINT, [record], CUTOFF)
    rested = data.with_residual_as_noise(np.zeros(len(data.frequency)))
    assert np.array_equal(rested.deviation[0], data.deviation[0])
    louder = data.with_residual_as_noise(np.full(len(data.frequency), 3.0))
    assert np.all(louder.deviation[0] > data.deviation[0])
    # What was left then counts as noise: its power is that of the deviation.
    power = np.mean((3.0 * data.deviation[0][data.spectra[0].kept]) ** 2)
    assert np.mean(louder.deviation[0][data.spectra[0].kept] ** 2) == pytest.approx(power)


def test_noise_that_is_known_is_used_and_checked():
    record = turning("one", 1.5, lambda q, v: 0.0 * q)
    louder = Record("one", "train", TIME, record.channels, {"torque": 1.0})
    plain, stated = (measured_data(JOINT, [one], CUTOFF) for one in (record, louder))
    assert np.all(stated.deviation[0] > 50.0 * plain.deviation[0])
    assert louder.finer(2).noise == {"torque": 1.0}
    for noise, message in (
        ({"torque": 0.0}, "noise of channel torque"),
        ({"force": 1.0}, "one of 'q', 'torque'"),
    ):
        with pytest.raises(InvalidInput, match=message):
            Record("one", "train", TIME, record.channels, noise)


def test_a_stop_with_noise_is_no_second_direction():
    omega = 2.0 * np.pi * 0.5
    q = 1.5 * (TIME - np.sin(omega * TIME) / omega)
    q += 1e-5 * np.random.default_rng(2).standard_normal(len(TIME))
    motion = motion_of(q, STEP, CUTOFF)
    assert np.any(motion.speed < 0.0)
    torque = INERTIA * motion.acceleration + VISCOUS * motion.speed + 0.8
    torque += 1e-3 * np.random.default_rng(3).standard_normal(len(TIME))
    finding = examine_mechanism(JOINT, [Record("stops", "train", TIME, {"q": q, "torque": torque})])
    assert any("cannot separate" in sentence for sentence in limits(finding))
    assert "force_offset" not in [
        c.name for r in finding.verdict.alternatives for c in r.candidates
    ]


@pytest.mark.nightly
def test_a_port_with_a_small_share_of_the_motion_is_searched_in_its_own_forces():
    geared = Mechanism(
        JOINT.inertias,
        [Port("bearing", {"q": 1.0}, damping=BelievedValue(0.5, 0.5)), Port("slide", {"q": 0.05})],
        JOINT.inputs,
    )
    sized = turning("both", 1.5, lambda q, v: dry(q, v))
    back = turning("back", -1.0, lambda q, v: dry(q, v))
    finding = examine_mechanism(geared, [sized, back])
    first = effects(finding)[0]
    assert first["name"] == "coulomb_friction"
    assert first["at_bound"] == []
    size = {"bearing": 0.8, "slide": 16.0}[first["port"]]
    assert first["parameters"]["level"]["value"] == pytest.approx(size, rel=0.02)


@pytest.mark.nightly
def test_a_ripple_between_two_bodies_is_found():
    pair = Mechanism(
        {"a": BelievedValue(0.05), "b": BelievedValue(0.03)},
        [
            Port("between", {"a": 1.0, "b": -1.0}, damping=BelievedValue(0.2, 0.5)),
            Port("bearing", {"b": 1.0}, damping=BelievedValue(0.3, 0.5)),
        ],
        [Input("drive", {"a": 1.0})],
    )
    omega = 2.0 * np.pi * np.array([0.7, 1.9, 3.1])
    generator = np.random.default_rng(5)
    noise = 1e-7 * generator.standard_normal((2, len(TIME)))
    b = 1.5 * TIME + np.sin(np.outer(TIME, omega)) @ (0.3 / omega) + noise[0]
    moved = motion_of(b, STEP, CUTOFF)
    # What the second body asks for is what passes between them.
    passes = 0.03 * moved.acceleration + 0.3 * moved.speed
    d, a = np.zeros(len(TIME)), np.zeros(len(TIME))
    for k in range(1, len(TIME)):
        rate = (passes[k - 1] - 0.1 * np.cos(9.0 * d[k - 1])) / 0.2
        d[k] = d[k - 1] + STEP * rate
    a = b + d + noise[1]
    torque = 0.05 * motion_of(a, STEP, CUTOFF).acceleration + passes
    torque += 1e-4 * generator.standard_normal(len(TIME))
    record = Record("pair", "train", TIME, {"a": a, "b": b, "drive": torque})
    finding = examine_mechanism(pair, [record])
    assert effects(finding)[0]["name"] == "torque_ripple"
    assert effects(finding)[0]["port"] == "between"
    amplitude = effects(finding)[0]["parameters"]["order_9_amplitude"]["value"]
    assert amplitude == pytest.approx(0.1, rel=0.05)
