"""What forbids a plain name."""

from types import SimpleNamespace

import numpy as np
import pytest

from pymoo_hdte.discrepancy.engine.rules import RULES
from pymoo_hdte.discrepancy.engine.verdict import doubts_of

FREEDOM = 1000


def one(label, *, exact, frees=None):
    """A candidate without unknowns of its own."""
    return SimpleNamespace(label=label, exact=exact, frees=frees, parameters=())


def doubts(chi_square_per_degree, *candidates):
    """Doubts about a set that leaves so much, with no held-out record."""
    fitted = SimpleNamespace(
        chi_square=chi_square_per_degree * FREEDOM,
        at_bounds=(),
        bound_sides=np.zeros(0),
        places=[(each, slice(0, 0)) for each in candidates],
    )
    quiet = chi_square_per_degree < 1.1
    search = SimpleNamespace(
        data=SimpleNamespace(rules=RULES), degrees_of_freedom=FREEDOM, enough=lambda chosen: quiet
    )
    return doubts_of(search, SimpleNamespace(fit=fitted, candidates=candidates), None)


FRICTION, LINE = one("stribeck:input", exact=False), one("kinematic_error:mesh@3", exact=True)
FREED = one("parameter:damping", exact=True, frees="damping")


@pytest.mark.parametrize(
    ("left", "candidates", "doubtful"),
    [
        (6.0, (FRICTION, FREED), True),
        (1.0, (FRICTION, FREED), False),
        (6.0, (FRICTION,), False),
        (6.0, (LINE, FREED), False),
        (6.0, (FREED,), False),
    ],
)
def test_values_beside_a_curve_that_does_not_quite_fit_are_not_certain(left, candidates, doubtful):
    """A rational fall of a friction was named Stribeck's with a damping that had not changed."""
    assert bool(doubts(left, *candidates)) == doubtful


def test_what_is_left_in_multiples_of_the_noise_is_a_doubt():
    limit = RULES.contradicting_chi_square
    assert not doubts(0.99 * limit, LINE)
    assert doubts(1.01 * limit, LINE)
