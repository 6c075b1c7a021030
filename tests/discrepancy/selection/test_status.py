"""The status of a verdict follows from its content, so that no content has another one."""

from dataclasses import replace
from itertools import product

import pytest
from made_verdicts import made_set

from pymoo_hdte.discrepancy._selection.reason import MORE_MISSING, NOT_VALIDATED, Reason
from pymoo_hdte.discrepancy._selection.verdict import EXPLAINED, STATUSES, Verdict

FIT = object()
SETS = (None, made_set(FIT), made_set(FIT, "parameter"), made_set(FIT, listed=False))
REASONS = ((), (Reason(MORE_MISSING),), (Reason(NOT_VALIDATED),))
CONTENTS = list(product(SETS, (True, False), REASONS, ((), (made_set(FIT),))))


def verdict_with(chosen, certain, reasons, equivalent):
    return Verdict(object(), chosen, certain, (), equivalent, 1, reasons=reasons)


@pytest.mark.parametrize("content", CONTENTS, ids=range(len(CONTENTS)))
def test_status_says_no_more_than_the_content(content):
    chosen, certain, reasons, equivalent = content
    verdict = verdict_with(*content)
    assert verdict.status in STATUSES
    if verdict.status in EXPLAINED:
        assert certain
        assert chosen.listed
        assert verdict.accepted is FIT
        assert Reason(NOT_VALIDATED) not in reasons
    else:
        assert verdict.accepted is verdict.base
    if verdict.status in ("named", "parameter"):
        assert not reasons
        assert not equivalent
    if verdict.status == "adequate":
        assert chosen is None
        assert certain
    assert (verdict.status == "class") == bool(verdict.accepted is FIT and equivalent)


def test_what_is_seen_beyond_the_fit_is_named_without_a_fitted_set():
    nothing = verdict_with(None, True, (), ())
    assert nothing.status == "adequate"
    assert replace(nothing, seen_beyond=("torque_ripple",)).status == "named"
    assert replace(nothing, certain=False, seen_beyond=("torque_ripple",)).status == "unlisted"


def test_a_rival_that_is_in_no_fit_makes_a_class():
    named = verdict_with(made_set(FIT), True, (), ())
    assert named.status == "named"
    assert replace(named, rivals_beyond=("encoder_delay",)).status == "class"


def test_a_parameter_out_of_tolerance_does_not_hide_an_effect_beside_it():
    for names, status in (
        (("parameter",), "parameter"),
        (("parameter", "parameter"), "parameter"),
        (("parameter", "torque_ripple"), "named"),
    ):
        assert verdict_with(made_set(FIT, *names), True, (), ()).status == status
