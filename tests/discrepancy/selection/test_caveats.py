"""What forbids a plain name."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.caveats import varies
from pymoo_hdte.discrepancy._selection.excess import HeldOutTest
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    contains,
)
from pymoo_hdte.discrepancy._selection.rules import RULES

FREEDOM = 1000
JUDGED = SimpleNamespace(rules=RULES, evident=frozenset())


def one(label, *, exact, releases=None):
    """A candidate without unknowns of its own."""
    name, _, place = label.partition(":")
    port, _, order = place.partition("@")
    of_place = {"name": name, "port": port, "order": float(order) if order else None}
    return SimpleNamespace(label=label, exact=exact, releases=releases, parameters=(), **of_place)


FRICTION, LINE = one("stribeck:input", exact=False), one("kinematic_error:mesh@3", exact=True)
FREED = one("parameter:damping", exact=True, releases="damping")


CLEARANCE = one("clearance_variation:mesh@2", exact=False)


def test_two_lines_of_one_name_are_no_special_case_of_one_of_them_and_another():
    """An eccentricity with its harmonic beside one with another line ended in an error."""

    def lines(*names):
        return set_of(*(Candidate(name, "sensor", (), ((),), None, "") for name in names), left=5.0)

    twice, mixed = lines("eccentricity", "eccentricity"), lines("eccentricity", "encoder_line")
    assert not contains(twice, mixed)
    assert not contains(mixed, twice)
    assert contains(twice, lines("eccentricity", "eccentricity"))


def set_of(*members, left, explained=0.9):
    """A set of laws, and values set free, that leaves so many times the noise beyond it."""
    chi_square = (1.0 + left) * FREEDOM
    fitted = SimpleNamespace(
        candidates=members, chi_square=chi_square, evidence=chi_square, n_base=0
    )
    return Hypothesis(fitted, bic=chi_square, explained=explained)


def denials(change, share, misfit=1.0):
    """How often records kept out of the fit deny a change of which a share is true, in 4000.

    Beside what the model leaves unexplained: a misfit of so many times the noise's square.
    """
    rng = np.random.default_rng(5)
    predicted = np.zeros(40)
    predicted[0] = np.sqrt(change)
    measured = share * predicted + misfit**0.5 * rng.normal(size=(4000, 40))
    before, after = (np.sum((measured - one) ** 2, axis=1) for one in (0.0, predicted))
    held_out_tests = [HeldOutTest(*pair, change) for pair in zip(before, after, strict=True)]
    return np.mean([one.denies(RULES, misfit) for one in held_out_tests])


@pytest.mark.parametrize("misfit", [1.0, 4.0])
@pytest.mark.parametrize("change", [64.0, 200.0, 1e3, 1e6])
def test_records_deny_a_true_change_as_rarely_as_is_stated(change, misfit):
    # At most 2.3 %, two standard deviations of a normal value, and 0.5 % for 4000 draws.
    assert denials(change, 1.0, misfit) < 0.028


@pytest.mark.parametrize(("share", "denied"), [(0.0, 1.0), (0.5, 1.0), (0.9, 0.0)])
def test_records_deny_a_change_of_which_half_is_true_and_none_of_which_a_tenth_is_not(
    share, denied
):
    assert denials(1e3, share) == pytest.approx(denied, abs=0.01)


def test_a_play_that_stood_for_an_error_that_grows_with_load_is_denied():
    """As it was fitted from one start to a published case: its error shrinks by 0.02 of 54."""
    assert HeldOutTest(803.54, 803.52, 54.2).denies(RULES, 1.0)


def test_records_deny_a_change_with_which_their_prediction_diverges_and_none_that_prevents_it():
    assert HeldOutTest(1.0, np.inf, np.inf).denies(RULES, 1.0)
    assert not HeldOutTest(1.0, 0.0, np.inf).denies(RULES, 1.0)


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_a_line_that_is_noise_in_both_parts_is_seen_as_rarely_as_a_value(correlation):
    """Beyond a radius of r deviations lies exp(-r^2 / 2) of a plane, erfc(k / sqrt 2) of a line."""
    both_sides = math.erfc(RULES.certain_deviations / math.sqrt(2.0))
    radius = math.sqrt(-2.0 * math.log(both_sides))
    covariance = 0.04 * np.array([[1.0, correlation], [correlation, 1.0]])
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    border = radius * np.column_stack([np.cos(turns), np.sin(turns)])
    border = border @ np.linalg.cholesky(covariance).T
    line = SimpleNamespace(lines=[[0, 1]])
    for parts in border:
        assert varies(line, 1.001 * parts, covariance, RULES)
        assert not varies(line, 0.999 * parts, covariance, RULES)
