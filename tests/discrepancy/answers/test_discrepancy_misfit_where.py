"""Words on a misfit describe what was planted, for effects that are not listed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted_features import known_data
from virtual_rig_cases import BELIEVED, RIG

from pymoo_hdte.discrepancy._answers.where.map import Location, WithinNoise
from pymoo_hdte.discrepancy._answers.where.nature import StrayLines, stray_lines
from pymoo_hdte.discrepancy._answers.where.where import sentences
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.effects.sentence_blanks import in_words
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

CONDITIONS = [(rpm, load) for rpm in (10.0, 200.0, 1000.0, 2000.0) for load in (0.0, 10.0, 40.0)]
SPEED, LOAD = np.array(CONDITIONS).T
ORDERS = np.array([0.0, 6.0 / 101.0, 1.0, 2.0, 6.0])
NOISE = np.array([0.02 * ARCSEC, 5e-6, 3e-4, 1e-7])
"""Of a line of each channel; smaller than everything planted."""


def planted(lines):
    """Return the map of complex misfits ``lines``: (channel, place of the order) to records."""
    misfit = np.zeros((len(SPEED), 4, len(ORDERS)), dtype=complex)
    for (channel, place), values in lines.items():
        misfit[:, channel, place] = values
    misfit[:, 2:, 0] = np.nan
    chi_square = np.abs(misfit / NOISE[:, None]) ** 2
    flagged = np.nan_to_num(chi_square) > 30.0
    return Location(
        records=tuple(f"run_{k}" for k in range(len(SPEED))),
        speed_rpm=SPEED,
        load_torque=LOAD,
        orders=ORDERS,
        misfit=misfit,
        change=np.zeros(misfit.shape, dtype=complex),
        noise=np.broadcast_to(NOISE[:, None], misfit.shape),
        chi_square=chi_square,
        p_value=np.where(flagged, 0.0, 1.0),
        moved=np.zeros(chi_square.shape),
        flagged=flagged,
        within_noise=WithinNoise(*(~flagged.any(axis=axes) for axes in ((0, 2), (0, 1), (1, 2)))),
        sweep_p_value=None,
        sweep_flagged=False,
        named=False,
    )


def said(lines, **changes):
    where, trusted = sentences(replace(planted(lines), **changes), known_data(), ())
    return where, trusted


def test_a_torque_of_the_load_is_no_compliance():
    torque = 0.02 * LOAD * np.exp(0.3j)
    lines = {(0, 1): torque / BELIEVED.stiffness, (1, 1): torque / BELIEVED.ratio, (2, 1): torque}
    where, trusted = said(lines)
    assert "order 0.05941 (6 per output turn)" in where
    assert "hardly changes with speed and grows with load" in where
    assert "torque-like and comes from the load" in where
    assert "compliance" not in where
    assert "in all records without load" in trusted


def test_a_torque_on_the_input_leaves_the_output_alone():
    where, trusted = said({(1, 4): np.full(12, 0.02), (3, 4): 1e-3 / SPEED})
    assert "At order 6 in the input torque and input angle." in where
    assert "is nearly the same at all speeds and loads" in where
    assert "torque-like and acts on the input" in where
    assert "in the transmission error and output torque" in trusted


def test_orders_that_the_input_angle_alone_shows_are_counted():
    lines = {(1, 4): np.full(12, 0.02), (3, 4): 1e-3 / SPEED, (3, 1): 1e-3 / SPEED}
    where, trusted = said(lines | {(3, 2): 1e-3 / SPEED})
    assert "At order 6 in the input torque and input angle; less at 2 further orders." in where
    assert "at all orders but order 0.05941 (6 per output turn), order 1 and order 6" in trusted


def test_friction_of_the_output_needs_torque_that_does_not_arrive():
    torque = np.full(12, 1.0)
    where, _ = said({(0, 0): torque / BELIEVED.stiffness, (1, 0): torque / BELIEVED.ratio})
    assert "At the mean in the transmission error and input torque." in where
    assert "acts on the output of the drive" in where


def test_an_encoder_s_line_is_kinematic():
    where, trusted = said({(0, 1): np.full(12, 3.0 * ARCSEC)})
    assert "At order 0.05941 (6 per output turn) in the transmission error." in where
    assert "is nearly the same at all speeds and loads" in where
    assert "kinematic" in where
    assert "at all orders but order 0.05941" in trusted


def test_a_stiffness_that_depends_on_speed_is_a_compliance():
    twist = LOAD / BELIEVED.stiffness * (0.02 + 0.1 * SPEED / 2000.0)
    where, _ = said({(0, 0): twist})
    assert "grows with speed" in where
    assert "grows with load" in where
    assert "compliance" in where
    assert "sweep" not in where
    assert (
        "the sweep with the input locked shows it" in said({(0, 0): twist}, sweep_flagged=True)[0]
    )


def test_a_further_inertia_shows_at_speed_only():
    torque = 2.0 * (SPEED / 2000.0) ** 6
    lines = {(0, 3): torque / BELIEVED.stiffness, (1, 3): torque / BELIEVED.ratio, (2, 3): torque}
    where, trusted = said(lines)
    assert "shows at speed only" in where
    assert "grows with speed" in where
    assert "in all records up to" in trusted


def test_nothing_is_said_of_nothing():
    where, trusted = said({})
    assert where == "Nowhere: all means and order lines agree within the noise."
    assert "wherever it was measured" in trusted


def test_a_model_that_a_sweep_contradicts_is_not_trusted_there():
    where, trusted = said({}, sweep_flagged=True)
    assert "The torsion sweep disagrees with the model." in where
    assert "wherever it was measured" not in trusted
    assert "but not in the torsion sweep" in trusted


@pytest.mark.parametrize(
    ("factor", "words"), [(1.0, "up to 10 N.m"), (0.01, "up to 0.1 N.m"), (100.0, "up to 1000 N.m")]
)
def test_a_limit_of_load_is_told_in_the_size_of_the_drive(factor, words):
    torque = np.where(LOAD > 10.0, 1.0, 0.0)
    _, trusted = said({(1, 4): torque}, load_torque=factor * LOAD)
    assert f"in all records {words}" in trusted
    _, trusted = said({(1, 4): np.where(LOAD > 0.0, 1.0, 0.0)}, load_torque=factor * LOAD)
    assert "in all records without load" in trusted


def recorded(torque_on_input, twist=None):
    """Return data of records with an input torque over time, and a twist over time and angle."""
    rng = np.random.default_rng(7)
    records = []
    for rpm in (600.0, 1000.0, 1400.0, 2000.0):
        speed = rpm * REVOLUTION_PER_MINUTE
        time = np.arange(0.0, 2.0 * np.pi * BELIEVED.ratio / speed, 2e-3)
        count = len(time)
        output = speed * time / BELIEVED.ratio
        output = output - (0.0 if twist is None else twist(time, speed * time))
        records.append(
            RunningRecord(
                name=f"run_{rpm:.0f}",
                role="train",
                time=time,
                input_angle=speed * time
                + BELIEVED.ratio * RIG.angle_noise * rng.standard_normal(count),
                output_angle=output + RIG.angle_noise * rng.standard_normal(count),
                input_torque=torque_on_input(time)
                + RIG.input_torque_noise * rng.standard_normal(count),
                output_torque=RIG.output_torque_noise * rng.standard_normal(count),
                input_speed=speed,
                load_torque=0.0,
                sample_rate=500.0,
                samples_averaged=1,
                elapsed=0.0,
            )
        )
    speeds = np.array([record.input_speed for record in records])
    features = SimpleNamespace(
        records=records,
        conditions=SimpleNamespace(input_speed=speeds),
        orders=np.array([1.0, 2.0, 3.5]),
    )
    campaign = SimpleNamespace(believed=BELIEVED, rig=RIG)
    return SimpleNamespace(campaign=campaign, features=features, rules=RULES)


def test_a_fixed_frequency_is_found_though_its_orders_differ():
    data = recorded(np.zeros_like, lambda time, _: 8.0 * ARCSEC * np.sin(2.0 * np.pi * 83.0 * time))
    found = stray_lines(data, (3.5,))
    assert found.frequency == pytest.approx(83.0, rel=5e-3)
    assert found.broad == ()
    # Without anything unexpected there is no search.
    assert stray_lines(data, ()) == StrayLines()


def test_a_line_of_an_order_is_no_fixed_frequency():
    data = recorded(np.zeros_like, lambda _, angle: 5.0 * ARCSEC * np.sin(3.5 * angle))
    assert stray_lines(data, (3.5,)) == StrayLines()


def test_bursts_fill_a_broad_band():
    def bursts(time):
        return 0.3 * np.sum(
            [np.exp(-(((time - at) / 0.01) ** 2)) for at in (0.7, 1.1, 2.4)], axis=0
        )

    found = stray_lines(recorded(bursts), (3.5,))
    assert found.broad == ("input_torque",)
    assert found.frequency is None


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ("torque_ripple:input@6", "torque ripple (input, order 6)"),
        ("eccentricity:sensor is one.", "eccentricity (sensor) is one."),
        ("turns at kinematic_error:mesh@0.0099.", "turns at kinematic error (mesh, order 0.0099)."),
        ("a_b:mesh+c:input@2", "a b (mesh) and c (input, order 2)"),
        ("nothing: to say", "nothing: to say"),
    ],
)
def test_labels_become_words(label, words):
    assert in_words(label) == words


def shown(torsion=0.0, on_input=0.0, on_output=0.0):
    """Return the words for misfits at order 6, in N.m of the output, in every record."""
    sizes = torsion / BELIEVED.stiffness, on_input / BELIEVED.ratio, on_output
    lines = {(channel, 4): np.full(12, size) for channel, size in enumerate(sizes) if size}
    return said(lines)[0]


PAIRS = {
    # Of each sentence: misfits for which it is true, and nearly the same for which it is not.
    "acts on the input": ({"on_input": 1.0}, {"on_input": 1.0, "torsion": 1.0}),
    "the torsion behind it hardly shows it": (
        {"on_input": 1.0, "torsion": 0.1},
        {"on_input": 1.0, "torsion": 1.0, "on_output": 1.0},
    ),
    "in the output torque alone": ({"on_output": 1.0}, {"on_output": 1.0, "torsion": 1.0}),
    "in both torques, but the torsion": (
        {"on_input": 1.0, "on_output": 1.0},
        {"on_input": 1.0, "on_output": 1.0, "torsion": 1.0},
    ),
    "comes from the load": (
        {"on_input": 1.0, "on_output": 1.0, "torsion": 1.0},
        {"on_input": 1.0, "torsion": 1.0},
    ),
    "acts on the output of the drive": (
        {"on_input": 1.0, "torsion": 1.0},
        {"on_input": 1.0, "torsion": 1.0, "on_output": 1.0},
    ),
    "no torque goes with it": ({"torsion": 1.0}, {"torsion": 1.0, "on_input": 1.0}),
}


@pytest.mark.parametrize("words", PAIRS)
def test_a_nature_is_said_where_the_torques_say_it_and_nowhere_else(words):
    true, false = PAIRS[words]
    assert words in shown(**true)
    assert words not in shown(**false)


OF_THE_ERROR = {
    "is kinematic: no torque": lambda load: 1.0 + 0.0 * load,
    "is a compliance: the torsion": lambda load: load / 40.0,
    "the load makes it smaller": lambda load: 1.0 - 0.9 * load / 40.0,
    "which these records do not tell": lambda load: 1.0 + 0.8 * np.cos(9.0 * np.arange(len(load))),
}


@pytest.mark.parametrize("words", OF_THE_ERROR)
def test_what_the_load_does_to_an_error_says_what_it_is(words):
    for other, change in OF_THE_ERROR.items():
        where, _ = said({(0, 4): 20.0 * ARCSEC * change(LOAD)})
        assert (words in where) == (other == words)
    one_load = said({(0, 4): np.full(12, 20.0 * ARCSEC)}, load_torque=np.full(12, 40.0))[0]
    assert ("which these records do not tell" in one_load) == ("do not tell" in words) or (
        words not in one_load
    )
    assert "do not tell" in one_load


def test_what_shows_at_speed_only_is_not_there_at_rest():
    fast = np.where(SPEED > 1500.0, 1.0, 0.0)
    assert "shows at speed only" in said({(1, 4): fast})[0]
    assert "shows at speed only" not in said({(1, 4): fast + 0.3})[0]


def test_what_is_judged_at_the_lower_speeds_is_said_of_these():
    everywhere = said({(1, 4): np.full(12, 0.02)})[0]
    assert "At the lower speeds it is torque-like" in everywhere
    assert "It is torque-like" in said({(1, 4): np.full(12, 0.02)}, speed_rpm=np.full(12, 9.0))[0]


def test_one_fast_record_that_is_off_is_no_inertia():
    one = np.where((SPEED > 1500.0) & (LOAD == 10.0), 20.0 * ARCSEC, 0.0)
    where, trusted = said({(0, 4): one})
    assert "shows at speed only" not in where
    assert "differs from record to record" in where
    assert "in 11 of 12 records" in trusted


def test_the_growth_of_a_broad_band_is_that_of_all_its_lines(monkeypatch):
    monkeypatch.setattr(
        "pymoo_hdte.discrepancy._answers.where.where.stray_lines",
        lambda *_: StrayLines(None, ("input_torque",)),
    )
    lines = {(1, place): 0.02 * np.exp(1j * place) * (1.0 + LOAD) for place in (1, 2, 3)}
    assert "hardly changes with speed and grows with load" in said(lines)[0]
    lines = {(1, place): np.full(12, 0.02) for place in (1, 2, 3)}
    assert "is nearly the same at all speeds and loads" in said(lines)[0]


def within(**groups):
    """Return groups within the noise, but for the places named."""
    sizes = {"channels": 4, "orders": len(ORDERS), "records": len(SPEED)}
    flags = {name: np.ones(size, dtype=bool) for name, size in sizes.items()}
    for name, places in groups.items():
        flags[name][places] = False
    return WithinNoise(**flags)


def test_trust_needs_the_gap_of_all_cells_together_to_be_noise():
    assert "wherever it was measured" in said({}, within_noise=within())[1]
    where, trusted = said({}, within_noise=within(channels=[1], records=[3]))
    assert "wherever" not in trusted
    assert "in the transmission error, output torque and input angle" in trusted
    assert "in 11 of 12 records" in trusted
    assert "together they do: in the input torque" in where
    where, trusted = said({}, within_noise=within(records=[3]))
    assert "in 1 of 12 records" in where
    assert "all orders but" not in trusted
    where, trusted = said({}, within_noise=within(orders=[2, 3]))
    assert "at all orders but order 1 and order 2" in trusted
    assert "together they do: in order 1 and order 2" in where
    # All records are met as a whole, which says nothing of any one of them.
    assert "record" not in trusted
    nothing = within(channels=range(4), orders=range(len(ORDERS)), records=range(len(SPEED)))
    assert "No channel, order or record" in said({}, within_noise=nothing)[1]


@pytest.mark.parametrize("channel", range(4))
@pytest.mark.parametrize("place", range(1, len(ORDERS)))
def test_what_is_flagged_is_never_trusted(channel, place):
    size = 100.0 * NOISE[channel]
    _, trusted = said({(channel, place): np.where(LOAD > 0.0, size, 0.0)}, within_noise=within())
    in_channels = trusted.split(";")[0]
    names = ["transmission error", "input torque", "output torque", "input angle"]
    assert [name in in_channels for name in names] == [k != channel for k in range(4)]
    assert f"at all orders but order {ORDERS[place]:.4g}" in trusted
    assert "in all records without load" in trusted
