"""Orders of the position that a force balance shows within its band."""

from types import SimpleNamespace

import numpy as np
import pytest

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.orders import position_orders
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.joint_torsion import _low_orders
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record

STEP, CUTOFF = 0.002, 15.0
JOINT = Mechanism(
    {"q": BelievedValue(0.5, 0.5)},
    [Port("bearing", {"q": 1.0}, damping=BelievedValue(3.0, 1.0))],
    [Input("torque", {"q": 1.0})],
    angles=["q"],
)


def shown(order):
    """Return the orders that a joint shows, which turns fast, and for a short way slowly."""
    time = STEP * np.arange(10_000)
    fast, slow = np.full(8000, 1.5), np.full(2000, 0.2)
    speed = np.convolve(np.r_[fast, slow], np.hanning(201) / 100.0, mode="same")
    q = STEP * np.cumsum(speed)
    noise = np.random.default_rng(0).standard_normal((2, len(time)))
    torque = 0.5 * np.gradient(speed, STEP) + 3.0 * speed + 0.2 * np.sin(order * q)
    channels = {"q": q + 1e-6 * noise[0], "torque": torque + 0.02 * noise[1]}
    data = measured_data(JOINT, [Record("turns", "train", time, channels)], CUTOFF)
    return position_orders(data, fit(data))["bearing"]


def test_an_order_within_the_band_is_seen():
    assert shown(30.0)[0] == pytest.approx(30.0, abs=0.5)


def test_an_order_that_is_within_the_band_only_while_the_joint_creeps_is_not():
    """At 1.5 rad/s the band of 15 Hz ends at order 63."""
    assert all(order < 2.0 * np.pi * CUTOFF / 1.4 for order in shown(300.0))


@pytest.mark.parametrize(("seconds", "expected"), [(4.0, True), (0.2, False)])
def test_a_way_that_takes_less_than_a_period_of_the_band_resolves_no_order(seconds, expected):
    """The lowest order that a hundredth of a radian resolves has one period on it."""
    time = STEP * np.arange(2500)
    shaft = 0.01 * np.minimum(time / seconds, 1.0)
    (port,) = JOINT.ports
    motions = {port.name: SimpleNamespace(shaft=shaft)}
    balance = SimpleNamespace(ports=motions, time=time, cutoff=1.0)
    data = SimpleNamespace(spectra=[balance], rules=RULES)
    assert bool(_low_orders(data, port, ())) == expected
