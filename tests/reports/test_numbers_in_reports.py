"""Numbers as pages show them: no interval narrower than it is, no digit that it does not leave."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_hdte._reports.html import with_error


@given(st.floats(-1e4, 1e4), st.floats(-9.0, 4.0).map(lambda power: 10.0**power))
def test_a_half_width_is_rounded_up_and_the_value_has_its_digits(value, half_width):
    shown, half = with_error(value, half_width).replace("\N{MINUS SIGN}", "-").split(" ± ")
    assert half_width <= float(half) <= 1.1 * half_width + 1e-12
    places = [len(one.partition(".")[2]) for one in (shown, half)]
    assert places[0] == places[1]
    assert float(shown) == pytest.approx(value, abs=0.5 * 10.0 ** -places[1] + 1e-11)


@pytest.mark.parametrize("half_width", [0.00149, 0.014, 1.4, 0.0995])
def test_no_half_width_is_rounded_down(half_width):
    assert float(with_error(6.0, half_width).partition(" ± ")[2]) >= half_width
