"""An input whose record is a multiple of the force that acts."""

import math

import pytest
from test_input_delay import CUTOFF, DAMPING, INERTIA, LEVEL, STEP, WEIGHT, record_of

from pymoo_hdte.discrepancy._evidence.force_balances.delay import delays
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.gain import gains
from pymoo_hdte.discrepancy._report.mechanism_document import limits
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record

WEIGHED = LawAt("gravity", "bearing", Gravity(WEIGHT, -0.5 * math.pi))
FREE = BelievedValue(DAMPING, factor=10.0)


def joint(inertia, damping=FREE, gain=1.0):
    believed = gain if isinstance(gain, BelievedValue) else BelievedValue(gain)
    return Mechanism(
        {"q": inertia},
        [Port("bearing", {"q": 1.0}, damping=damping)],
        [Input("torque", {"q": 1.0}, believed)],
        angles=["q"],
    )


def scaled(share, **made):
    """Return a record that shows a share of the torque."""
    record = record_of(**{"delay": 0.0, "friction": LEVEL, "weight": WEIGHT, **made})
    channels = record.channels | {"torque": share * record.channels["torque"]}
    return Record(record.name, record.role, record.time, channels)


@pytest.mark.parametrize("share", [0.5, 3.0])
def test_the_gain_is_as_uncertain_as_the_inertia_is_stated(share):
    """Friction and gravity, of which nothing is known, are fitted beside it."""
    data = measured_data(joint(BelievedValue(INERTIA, 0.1)), [scaled(share)], CUTOFF)
    (found,) = gains(data)
    assert found.evident
    assert found.quantities == ("inertia of q",)
    assert [found.lower, found.upper] == pytest.approx([0.9 / share, 1.1 / share], rel=0.01)


def test_a_known_weight_tells_the_gain():
    wide = joint(BelievedValue(INERTIA, factor=10.0))
    data = measured_data(wide, [scaled(0.5)], CUTOFF, [WEIGHED])
    (found,) = gains(data)
    assert found.quantities == ("gravity at bearing",)
    assert found.lower < 2.0 < found.upper
    assert found.upper - found.lower < 0.1


def test_no_gain_is_told_that_is_right_or_that_nothing_tells():
    stated, wide = BelievedValue(INERTIA, 0.02), BelievedValue(INERTIA, factor=10.0)
    for seed in range(9):
        data = measured_data(joint(stated), [scaled(1.0, seed=seed)], CUTOFF)
        assert not any(found.evident for found in gains(data))
    assert not gains(measured_data(joint(wide), [scaled(0.5)], CUTOFF))[0].evident


def test_quantities_that_contradict_each_other_tell_no_gain():
    data = measured_data(
        joint(BelievedValue(INERTIA, 0.1), BelievedValue(0.5 * DAMPING, 0.1)),
        [scaled(1.0)],
        CUTOFF,
    )
    assert gains(data) == []


def test_a_delay_beside_it_is_taken_out_first():
    data = measured_data(
        joint(BelievedValue(INERTIA, 0.1)), [scaled(0.5, delay=6.0 * STEP)], CUTOFF
    )
    late = tuple(delays(data))
    (found,) = gains(data, (), late)
    assert late[0].value == pytest.approx(6.0 * STEP, rel=0.05)
    assert math.sqrt(found.lower * found.upper) == pytest.approx(2.0, rel=0.02)


@pytest.mark.slow
def test_it_is_told_and_corrected_where_the_rig_allows():
    records = [scaled(0.5, weight=0.0), scaled(0.5, weight=0.0, seed=1, role="held_out")]
    told = limits(examine_mechanism(joint(BelievedValue(INERTIA, 0.1)), records, CUTOFF))
    assert any("1.8 to 2.2 times what its column says" in sentence for sentence in told)
    corrected = joint(BelievedValue(INERTIA), gain=BelievedValue(1.0, factor=4.0))
    friction = LawAt("coulomb_friction", "bearing", CoulombFriction(LEVEL))
    data = measured_data(corrected, records[:1], CUTOFF, [friction])
    fitted = dict(zip((one.name for one in data.base), fit(data).values, strict=True))
    assert fitted == pytest.approx({"damping of bearing": DAMPING, "gain of torque": 2.0}, rel=0.01)
