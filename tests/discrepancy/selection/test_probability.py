"""The probability of a verdict: a share of the evidence, and never more than experience allows."""

import math
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_hdte.discrepancy._selection import probability
from pymoo_hdte.discrepancy._selection.rules import RULES

evidences = st.lists(st.floats(0.0, 40.0), min_size=1, max_size=5)


def compared(evidence, *names, chi_square=100.0):
    """A set of effects with what its probability depends on."""
    fitted = SimpleNamespace(evidence=evidence, chi_square=chi_square)
    return SimpleNamespace(fit=fitted, names=frozenset((name, "input") for name in names))


def of_named(found, status="named", rivals=()):
    return probability.of_names(status, found[0], rivals, found, 100, RULES)


@given(evidences)
def test_probabilities_of_single_names_add_up_to_what_experience_allows(values):
    found = [compared(value, str(place)) for place, value in enumerate(values)]
    total = sum(of_named([one, *(two for two in found if two is not one)]) for one in found)
    assert total == pytest.approx(RULES.named_right)


@given(st.floats(0.0, 30.0))
def test_odds_of_two_names_follow_the_difference_of_their_evidence(difference):
    likely = of_named([compared(0.0, "a"), compared(difference, "b")])
    odds = likely / (RULES.named_right - likely)
    assert odds == pytest.approx(math.exp(difference / 2.0), rel=1e-6)


def test_a_set_that_contains_a_name_speaks_for_it():
    alone, both, other = compared(1.0, "a"), compared(0.0, "a", "b"), compared(0.0, "c")
    assert of_named([alone, both]) == pytest.approx(RULES.named_right)
    assert of_named([both, alone]) < 0.7
    assert of_named([alone, both, other]) < 0.7


def test_a_class_counts_all_its_members():
    one, two = compared(0.0, "a"), compared(0.0, "b")
    assert of_named([one, two], "class", [two]) == pytest.approx(RULES.class_right)
    assert of_named([one, two]) == pytest.approx(RULES.named_right / 2.0)


def test_sets_of_more_evidence_are_rivals_of_an_improbable_name():
    chosen, likely, other = compared(10.0, "a"), compared(0.0, "b"), compared(20.0, "c")
    richer = compared(0.0, "a", "b")
    assert probability.likelier(chosen, [], [chosen, likely, other], 100) == [likely]
    assert probability.likelier(chosen, [likely], [chosen, likely, other], 100) == []
    assert probability.likelier(likely, [], [chosen, likely, other], 100) == []
    # What contains the names of the chosen set speaks for them.
    assert probability.likelier(chosen, [], [chosen, richer, likely], 100) == []


def test_what_a_model_leaves_beyond_noise_blurs_the_evidence():
    far, clear = (
        [compared(0.0, "a", chi_square=chi), compared(10.0, "b")] for chi in (1000.0, 100.0)
    )
    assert of_named(far) < of_named(clear)


def test_what_names_nothing_has_no_probability():
    assert of_named([compared(0.0, "a")], "unlisted") is None


@given(st.lists(st.floats(0.0, 25.0), min_size=1, max_size=9))
def test_nothing_is_less_likely_the_more_a_candidate_would_explain(gains):
    def of(values):
        candidate = SimpleNamespace(unknowns=2)
        screened = [SimpleNamespace(reduction=one, candidate=candidate) for one in values]
        return probability.of_nothing(screened, 1000, RULES)

    assert of([*gains, 60.0]) < of(gains) <= RULES.adequate_right
