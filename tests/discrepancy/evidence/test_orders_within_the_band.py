"""Orders of the position that the band of a motion holds."""

from types import SimpleNamespace

import numpy as np
import pytest

from pymoo_hdte.discrepancy._evidence.force_balances.orders import periods_within
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.joint_torsion import _low_orders
from pymoo_hdte.mechanism import Port

STEP = 0.002


def test_periods_are_counted_where_a_motion_is_slow_enough():
    """Three seconds at 4 rad/s, then two at 1 rad/s: 10 Hz hold order 20 only there."""
    way = STEP * np.cumsum(np.r_[np.full(1500, 4.0), np.full(1000, 1.0)])
    periods = periods_within(10.0, way, STEP, np.array([10.0, 20.0, 100.0]))
    whole, part = 14.0 * 10.0 / (2.0 * np.pi), 2.0 * 20.0 / (2.0 * np.pi)
    assert periods == pytest.approx([whole, part, 0.0], rel=1e-2)


@pytest.mark.parametrize(("seconds", "expected"), [(4.0, True), (0.2, False)])
def test_a_way_that_takes_less_than_a_period_of_the_band_resolves_no_order(seconds, expected):
    """The lowest order that a hundredth of a radian resolves has one period on it."""
    time = STEP * np.arange(2500)
    shaft = 0.01 * np.minimum(time / seconds, 1.0)
    port = Port("gear", {"q": 1.0})
    motions = {port.name: SimpleNamespace(shaft=shaft)}
    balance = SimpleNamespace(ports=motions, time=time, cutoff=1.0)
    data = SimpleNamespace(spectra=[balance], rules=RULES)
    assert bool(_low_orders(data, port, ())) == expected
