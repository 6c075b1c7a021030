"""What is said of posterior probabilities."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_hdte.discrepancy._selection.decision import (
    IMPOSSIBLE,
    MOST_IN_CLASS,
    OUTSIDE,
    PRESENT,
    Explanation,
    decide,
    log_prior,
)

A, B, C = (frozenset({(name, "input")}) for name in ("a", "b", "c"))
NOTHING = frozenset()
VALUE = frozenset({("parameter", "stiffness")})


def said(*shares, worst_chance=1.0):
    """Return what is said of (names, outside, posterior share)."""
    explanations = [
        Explanation(
            "+".join(sorted(dict(names))),
            names,
            np.log(share),
            outside,
            worst_chance,
            "parameter" in dict(names),
        )
        for names, outside, share in shares
    ]
    return decide(explanations, [0.0] * len(explanations))


@pytest.mark.parametrize(
    ("shares", "status", "members"),
    [
        ([(NOTHING, False, 0.97), (A, False, 0.03)], "adequate", ()),
        ([(NOTHING, False, 0.6), (A, False, 0.4)], "adequate", ()),
        ([(NOTHING, False, 0.02), (A, False, 0.98)], "named", (A,)),
        ([(A, False, 0.9), (A, True, 0.1)], "partial", (A,)),
        ([(A, False, 0.3), (B, False, 0.66), (C, False, 0.04)], "class", (B, A)),
        ([(A | B, True, 0.5), (A | C, True, 0.5)], "partial", (A,)),
        # That something is missing is a claim, too.
        ([(NOTHING, False, 0.2), (A, False, 0.5), (NOTHING, True, 0.3)], "adequate", ()),
        ([(NOTHING, True, 1.0)], "unlisted", (NOTHING,)),
        ([(VALUE, False, 1.0)], "parameter", None),
        # A value alone may stand for what is outside.
        ([(VALUE, True, 1.0)], "unlisted", (VALUE,)),
        ([(VALUE | A, True, 1.0)], "partial", (VALUE | A,)),
    ],
)
def test_levels_of_probability_decide(shares, status, members):
    decision = said(*shares)
    assert decision.status == status
    if members is not None:
        assert decision.members == members


def test_a_class_is_short():
    many = [(frozenset({(str(k), "input")}), False, 0.1) for k in range(10)]
    decision = said(*many)
    assert decision.status == "unlisted"
    assert len(decision.members) <= MOST_IN_CLASS


def test_one_of_two_names_is_sure_whatever_there_is_beside_them():
    beside = [frozenset({(str(k), "input")}) for k in range(6)]
    decision = said(*((A | more, False, 0.1) for more in beside), (B, False, 0.4))
    assert (decision.status, decision.members) == ("class", (A, B))
    assert decision.probability == pytest.approx(1.0)
    assert said(*((A | more, True, 0.1) for more in beside), (B, True, 0.4)).status == "unlisted"


@given(st.lists(st.floats(0.01, 1.0), min_size=3, max_size=3))
def test_nothing_is_said_plainly_that_cannot_be(shares):
    decision = said(
        *zip((A, B, NOTHING), (False,) * 3, shares, strict=True), worst_chance=IMPOSSIBLE / 2.0
    )
    assert not decision.possible
    assert decision.status in ("partial", "unlisted")


@given(st.lists(st.floats(-50.0, 50.0), min_size=4, max_size=4))
def test_probabilities_are_shares_of_the_whole(lns):
    sets = ((A, False), (B, True), (A | B, False), (NOTHING, False))
    decision = decide(
        [
            Explanation("", names, ln, outside)
            for (names, outside), ln in zip(sets, lns, strict=True)
        ],
        [0.0] * 4,
    )
    shares = np.exp(np.array(lns) - np.logaddexp.reduce(lns))
    assert decision.outside == pytest.approx(shares[1])
    of_names = decision.of_names
    assert of_names["a", "input"] == pytest.approx(shares[0] + shares[2])
    assert of_names["b", "input"] == pytest.approx(shares[1] + shares[2])


def test_forms_share_the_prior_of_a_name():
    alone = log_prior([("a", "input")], [1], False)
    assert np.exp(alone) == pytest.approx(PRESENT / (1.0 - PRESENT))
    shared = [log_prior([("a", port)], [4], False) for port in ("input", "output", "mesh", "")]
    assert np.sum(np.exp(shared)) == pytest.approx(np.exp(alone))
    outside = log_prior([], [], True)
    assert np.exp(outside) == pytest.approx(OUTSIDE / (1.0 - OUTSIDE))
