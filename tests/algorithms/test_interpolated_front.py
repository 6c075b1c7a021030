"""The front of expensive objectives: exact where known, in few evaluations, lost ones told."""

import numpy as np
import pytest

from pymoo_hdte.algorithms import interpolated_front

LOWER, UPPER = np.array([-1.0, 2.0, 0.0]), np.array([1.0, 6.0, 1e-3])
ENDS = np.array([[0.2, 0.3, 0.5], [0.7, 0.9, 0.5]])
"""Optima of both objectives in the unit cube; the front is the line between them."""


def objectives(designs):
    cube = (designs - LOWER) / (UPPER - LOWER)
    square = ((cube[:, None] - ENDS) ** 2 * [1.0, 1.0, 0.2]).sum(axis=2)
    return 1.0 + square


def front_at(share):
    return objectives(LOWER + (UPPER - LOWER) * (ENDS[0] + share[:, None] * (ENDS[1] - ENDS[0])))


def search(evaluate, seed=1, **options):
    settings = {"accuracy": 0.01, "least_width": 1e-3, "most": 300} | options
    return interpolated_front(evaluate, LOWER, UPPER, np.random.default_rng(seed), **settings)


def test_a_known_front_is_found_in_few_evaluations():
    asked = []

    def evaluate(designs):
        asked.append(len(designs))
        return objectives(designs)

    told = []
    found = search(evaluate, notify=lambda *words: told.append(words))
    assert told[-1] == (found.evaluated, found.difference)
    assert told[0] == (16, np.inf)
    known = front_at(np.linspace(0.0, 1.0, 2001))
    assert found.difference <= 0.01
    assert found.evaluated == sum(asked) < 200
    assert found.width == pytest.approx(np.ptp(known, axis=0), rel=0.05)
    gap = ((found.front[:, None] - known) / found.width).max(axis=2).min(axis=1)
    assert np.median(gap) < 0.01
    ends = np.abs((known[[0, -1], None] - found.front) / found.width).max(axis=2).min(axis=1)
    assert ends.max() < 0.05
    assert np.array_equal(objectives(found.designs), found.front)
    assert np.all(np.diff(found.front, axis=0) * [1.0, -1.0] > 0.0)
    assert len(found.lost) == 0


def test_the_same_generator_gives_the_same_front():
    one, again = (search(objectives, accuracy=0.05) for _ in range(2))
    assert np.array_equal(one.front, again.front)


def test_designs_without_objectives_are_left_out_and_told():
    def evaluate(designs):
        values = objectives(designs)
        # The end with the least second objective is lost.
        values[designs[:, 1] > 5.0] = np.nan
        return values

    found = search(evaluate)
    assert np.all(found.lost[:, 1] > 5.0)
    assert len(found.lost) > 10
    assert found.designs[:, 1].max() <= 5.0
    assert np.isfinite(found.front).all()


def test_one_best_design_is_a_front_of_one():
    def evaluate(designs):
        values = objectives(designs)
        return np.column_stack([values[:, 0], 2.0 * values[:, 0]])

    found = search(evaluate, least_width=0.02)
    assert found.front[0] == pytest.approx([1.0, 2.0], rel=1e-3)
    assert found.width == pytest.approx([0.02, 0.04], rel=1e-2)


def test_without_agreement_it_ends_and_says_so():
    rng = np.random.default_rng(3)

    def noise(designs):
        return np.exp(rng.normal(size=(len(designs), 2)))

    found = search(noise, most=80)
    assert found.evaluated < 150
    assert found.difference > 0.01


def test_a_design_beyond_an_end_of_the_front_is_no_agreement():
    """One design anywhere has a far better first objective, and a worse second one."""
    designs = []

    def evaluate(some):
        designs.extend(some)
        return objectives(some)

    first = search(evaluate, accuracy=0.05)
    # The last 16 were those anywhere.
    pit = designs[-1]

    def with_pit(some):
        values = objectives(some)
        values[np.all(some == pit, axis=1)] = [0.8, 3.0]
        return values

    again = search(with_pit, accuracy=0.05, most=first.evaluated + 1)
    assert again.evaluated > first.evaluated
    assert again.front[0] == pytest.approx([0.8, 3.0])


def test_nothing_can_be_said_of_a_box_without_objectives():
    with pytest.raises(ArithmeticError, match=r"none of .* designs over the whole box has values"):
        search(lambda designs: np.full((len(designs), 2), np.nan))


def test_designs_to_start_from_are_evaluated():
    start = front_at(np.array([0.5]))
    centre = LOWER + (UPPER - LOWER) * ENDS.mean(axis=0)
    found = search(objectives, start=centre[None], most=40)
    assert ((found.front <= start + 1e-9).all(axis=1)).any()
