"""What is said of scatter beyond all runs, for responses whose moments there are closed forms."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev
from scipy.stats import norm

from pymoo_hdte.surrogate._sparse.axes import TAIL, Axis, noise_axis, standard_normal
from pymoo_hdte.surrogate._sparse.polynomial import SparsePolynomial
from pymoo_hdte.surrogate._sparse.tails import STEPS, _added, _slabs, beyond_all_runs

DESIGN, NOISE = Axis("x", None, (-1.0, 1.0)), noise_axis("a", standard_normal())
AXES, HERE = [DESIGN, NOISE], np.zeros((1, 1))
LAST = norm.isf(TAIL)
"""The outermost run."""


def interpolant(response, degree):
    """The polynomial through a response of standard normal noise, where there are runs."""
    coefficients = chebyshev.chebinterpolate(lambda z: response(NOISE.physical(z)), degree)
    degrees = np.arange(degree + 1)
    return SparsePolynomial(np.column_stack([0 * degrees, degrees]), coefficients[None])


def judged(polynomial, std):
    """Mean and deviation to use, and their errors in units of the response."""
    moments, errors = beyond_all_runs(polynomial, AXES, HERE, np.array([[std]]), error=0.01)
    return np.ravel(moments(HERE)), std * errors[:, 0]


def moments_of(values, weights):
    mean = values @ weights / weights.sum()
    return np.array([mean, np.sqrt((values - mean) ** 2 @ weights / weights.sum())])


def test_a_line_goes_on_beyond_all_runs_and_might_stop_at_the_last():
    """No run tells which, so the error covers both; it is less than all that lies beyond adds."""
    (mean, std), errors = judged(interpolant(lambda a: a, 1), 1.0)
    assert (mean, std) == pytest.approx((0.0, 1.0), abs=1e-9)
    # Integrals of a^2 phi(a): those between the last runs, and of their squares beyond.
    between = 1.0 - 2.0 * TAIL - 2.0 * LAST * norm.pdf(LAST)
    stopped = np.sqrt(between + 2.0 * TAIL * LAST**2)
    inside = np.sqrt(between / (1.0 - 2.0 * TAIL))
    assert std - stopped < errors[1] < std - inside


def test_what_runs_away_beyond_all_runs_counts_where_there_are_runs_only():
    """Through a bell a polynomial of degree 10 adds a hundred times what the bell may."""

    def bell(a):
        return 1.0 / (1.0 + a**2)

    polynomial = interpolant(bell, 10)
    cut, whole = NOISE.cut, NOISE.measure
    cube = np.column_stack([np.zeros(len(cut.nodes)), NOISE.cube(cut.nodes)])
    inside = moments_of(polynomial(cube)[:, 0], cut.weights)
    moments, errors = judged(polynomial, inside[1])
    assert moments == pytest.approx(inside, rel=1e-9)
    # The error covers what the bell itself has beyond, and is still no more than a thousandth.
    beyond = moments_of(bell(whole.nodes), whole.weights) - moments_of(bell(cut.nodes), cut.weights)
    assert np.all(np.abs(beyond) < errors)
    assert np.all(errors < 1e-3 * inside[1])


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("mean", [0.0, -2.0])
def test_a_step_of_the_probability_adds_its_squares_about_the_mean(upper, mean):
    """Of a line the integral of (a - m)^2 phi(a), in which squares of means outweigh scatter."""
    polynomial, about = interpolant(lambda a: a, 1), np.array([[mean]])
    slabs = _slabs(NOISE.measure, upper)
    added = [_added(polynomial, AXES, 1, slab, HERE, about).item() for slab in slabs]
    first, last = norm.isf(STEPS[0]), norm.isf(STEPS[-1])
    zeroth = STEPS[0] - STEPS[-1]
    once = (norm.pdf(first) - norm.pdf(last)) * (1.0 if upper else -1.0)
    twice = zeroth + first * norm.pdf(first) - last * norm.pdf(last)
    # The nodes of the rule fall on one side or the other of a border.
    assert sum(added) == pytest.approx(twice - 2.0 * mean * once + mean**2 * zeroth, rel=0.05)
