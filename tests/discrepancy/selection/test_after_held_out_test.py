"""What held-out records, and values beyond what is stated, withdraw from a verdict."""

from types import SimpleNamespace

import numpy as np
import pytest
from made_verdicts import made_set, made_verdict

from pymoo_hdte.discrepancy._evidence.order_lines.candidates import out_of_tolerance
from pymoo_hdte.discrepancy._selection.excess import HeldOutTest
from pymoo_hdte.discrepancy._selection.reason import HELD_OUT_ERROR_GROWS, NOT_VALIDATED, Reason
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.prediction_error import PredictionError, grows
from pymoo_hdte.discrepancy._verdicts.validation_torsion import without_unvalidated_lines

FIT = SimpleNamespace(misfit=1.0)


def verdict(status, probability=RULES.named_right):
    chosen = made_set(FIT, *(["parameter"] if status == "parameter" else []))
    return made_verdict(status, FIT, chosen, freedom=100, probability=probability)


@pytest.mark.parametrize("status", ["named", "parameter"])
def test_an_error_that_grows_leaves_no_unqualified_status(status):
    found = verdict(status).after_held_out_test(worse={"output torque": 1.5})
    assert found.status == "partial"
    assert found.reasons == (Reason.of(HELD_OUT_ERROR_GROWS, numbers={"output torque": 1.5}),)
    # As probable as other partial verdicts are.
    assert found.probability == pytest.approx(RULES.partial_right)
    assert verdict(status).after_held_out_test().status == status


@pytest.mark.parametrize("status", ["named", "parameter", "class", "partial"])
def test_a_model_that_is_not_to_be_used_is_not_offered(status):
    found = verdict(status).after_held_out_test(HeldOutTest(426.1, 451.3, 9.36))
    assert (found.status, found.probability) == ("unlisted", None)
    assert found.has_reason(NOT_VALIDATED)
    assert found.accepted is found.base


def test_noise_alone_seldom_makes_a_true_change_look_denied(rng):
    """The error of a true change falls by its square, with a deviation of twice its root."""
    for change in (0.1, 1.0, 9.0, 15.0):
        direction = np.array([change**0.5, 0.0, 0.0])
        noise = rng.standard_normal((20_000, 3))
        before = np.sum((noise + direction) ** 2, axis=1)
        after = np.sum(noise**2, axis=1)
        denied = [
            HeldOutTest(*pair, change).denies(RULES, 1.0)
            for pair in zip(before, after, strict=True)
        ]
        assert np.mean(denied) < 0.03


def test_a_small_change_that_makes_it_worse_than_chance_allows_is_denied():
    """Those of two campaigns with an error that grows with load, named a zero and a clearance."""
    assert HeldOutTest(426.1, 451.3, 9.36).denies(RULES, 1.0)
    assert HeldOutTest(417.3, 420.3, 14.08).denies(RULES, 1.0)
    assert not HeldOutTest(586.2, 586.4, 0.02).denies(RULES, 1.0)
    assert not HeldOutTest(500.0, 500.0, 0.0).denies(RULES, 1.0)


def test_a_growth_within_the_noise_of_the_metric_is_none():
    """Of a true drag the error in one record grew by half a deviation, from .676 to .713."""
    assert grows(0.676, 0.713, 0.592, 0.0)
    deviation = (0.713**2 - 0.676**2) / 0.5
    assert not grows(0.676, 0.713, 0.592, deviation)
    assert not PredictionError(0.676, 0.713, 0.592, "arcsec", chance=deviation).worse
    assert not grows(0.2, 0.62, 0.592, 0.0)


def test_noise_makes_one_of_several_errors_grow_as_seldom_as_one(rng):
    """Of nine errors one grew by 2.1 deviations, and a right name went."""
    rises = rng.standard_normal((1_000, 9))
    after = np.sqrt(4.0 + 0.1 * rises)
    together = [any(grows(2.0, one, 1.0, 0.1, among=9) for one in row) for row in after]
    assert np.mean(together) < 0.04


def test_a_value_out_of_tolerance_and_its_effect_are_one_answer():
    base = [SimpleNamespace(name=name, start=1.0) for name in ("load_inertia", "stiffness")]
    inertia, stiffness = out_of_tolerance(base, ["load_inertia", "stiffness"], (), together=True)
    assert inertia.named_effect == ("load_inertia", "output")
    assert stiffness.named_effect == ("parameter", "stiffness")


def line(order, side):
    parameter = SimpleNamespace(name="amplitude", linear=True, lower=-1.0, limited_at=bool)
    label = f"kinematic_error:gear@{order}"
    law = SimpleNamespace(name="kinematic_error", label=label, order=order, parameters=(parameter,))
    fitted = SimpleNamespace(
        places=[(law, slice(0, 1))], bound_sides=np.array([side]), values=np.ones(1)
    )
    return SimpleNamespace(candidates=(law,), fit=fitted, listed=True)


@pytest.mark.parametrize(
    ("order", "side", "after", "named"),
    [
        (7.0, 0.0, 0.5, True),
        (7.0, 1.0, 0.5, False),
        (7.0, 0.0, 1.01, False),
        # Of other laws the bounds and the validation are judged elsewhere.
        (None, 1.0, 1.1, True),
    ],
)
def test_an_order_at_its_bound_or_without_validation_is_not_named(order, side, after, named):
    chosen, other = line(order, side), line(2.0, 0.0)
    found = made_verdict("partial", FIT, chosen, (other,), freedom=100)
    error = SimpleNamespace(before=1.0, after=after)
    found = without_unvalidated_lines(found, chosen.fit, [error])
    assert (found.chosen is chosen) == named
    assert (found.status == "partial") == named
    assert chosen not in found.alternatives
