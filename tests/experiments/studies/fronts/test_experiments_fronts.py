"""The searches behind the stored fronts, on the toy whose front is closed form."""

import numpy as np
import pytest

from experiments.studies.fronts import tolerance_front
from experiments.studies.fronts.tolerance_front import (
    LevelSearch,
    disagreement,
    on_level,
    without_local_optima,
)
from pymoo_hdte.problems import RobustToy
from pymoo_hdte.problems.reference import ReferenceFront

TOY = RobustToy()
WIDTH = np.ptp(TOY.pareto_front(), axis=0)


def every(step):
    rows = np.r_[0 : len(TOY.pareto_front()) : step, len(TOY.pareto_front()) - 1]
    return ReferenceFront(TOY.pareto_front()[rows], TOY.pareto_set()[rows])


def test_two_samples_of_one_front_agree():
    assert disagreement(TOY, every(100), every(70), WIDTH) < 1e-9


@pytest.mark.parametrize(("row", "objective"), [(0, 0), (5, 1), (-1, 1)])
def test_a_point_beside_the_front_is_noticed(row, objective):
    wrong = every(100)
    wrong.front[row, objective] += 1e-4 * WIDTH[objective]
    assert disagreement(TOY, wrong, every(70), WIDTH) == pytest.approx(1e-4, rel=1e-3)


def test_a_search_at_fixed_tolerance_finds_the_front(monkeypatch):
    monkeypatch.setattr(tolerance_front, "_COARSE_POINTS", 6)
    designs = tolerance_front.front_designs(TOY, 12, np.random.default_rng(1))
    front = TOY.evaluate(designs)
    # The closed form at the u_1 that has this mean: u_2 = 1, so the mean is u_1 + 1.
    best = TOY.pareto_set()[0] * [0.0, 1.0, 1.0] + np.outer(front[:, 0] - 1.0, [1.0, 0.0, 0.0])
    assert len(front) == 12
    # u_3 does not move the mean: where that is least, the search only breaks ties by the deviation.
    assert front[0] == pytest.approx(TOY.pareto_front()[0], rel=1e-3)
    assert front[1:, 1] == pytest.approx(TOY.closed_form(best)[1][1:], abs=1e-8)
    steps = np.hypot(*(np.diff(front, axis=0) / WIDTH).T)
    assert steps.max() < 1.02 * steps.min()


def test_a_design_is_moved_on_to_a_level_close_by_and_left_below_one_far_off():
    design = np.array([1.5, 1.0, 1.4])
    mean = TOY.evaluate(design)[0]
    for level in (mean * (1.0 + 5e-7), mean * (1.0 - 5e-7)):
        moved = on_level(TOY, design, level)
        assert TOY.evaluate(moved)[0] == pytest.approx(level, rel=1e-14)
        # The second variable rests on its bound.
        assert np.array_equal(moved[1:], design[1:])
    assert np.array_equal(on_level(TOY, design, mean + 0.1), design)


def test_local_optima_give_way_to_the_solution_beside_them():
    front = every(100)
    stuck = ReferenceFront(front.front.copy(), front.designs.copy())
    stuck.designs[4, 1:] = 1.3, 1.9
    stuck.front[4, 1] += 0.05
    mended = without_local_optima(TOY, stuck, np.random.default_rng(1))
    assert mended.front == pytest.approx(front.front, rel=1e-8)
    assert mended.designs == pytest.approx(front.designs, abs=1e-3)
    others = np.arange(len(front.front)) != 4
    assert np.array_equal(mended.front[others], front.front[others])
    assert np.array_equal(mended.designs[others], front.designs[others])


def test_solutions_lie_on_their_level():
    search = LevelSearch(TOY, np.random.default_rng(1))
    for level in (2.1, 2.5, 2.9):
        found = search.best(level, search.starts(level))
        assert found.objectives[0] == pytest.approx(level, rel=1e-14)


class LimitedToy(RobustToy):
    """The toy where x_1^2 + x_2^2 is at least 13/4: x_1 is from 3/2 on where x_2 is 1."""

    def __init__(self):
        super().__init__()
        self.n_ieq_constr = 1

    def _evaluate(self, x, out, *args, **kwargs):
        super()._evaluate(x, out, *args, **kwargs)
        out["G"] = 1.0 - np.sum(x[:, :2] ** 2, axis=1, keepdims=True) / 3.25
        if "dG" in out:
            out["dG"] = np.column_stack([-2.0 * x[:, :2] / 3.25, np.zeros(len(x))])[:, None]


def test_a_search_keeps_to_the_constraints():
    toy = LimitedToy()
    search = LevelSearch(toy, np.random.default_rng(1))
    for found in (search.lowest(0), search.best(2.5 + 1e-7, search.starts(2.6))):
        # Both ends of the arc have this mean; a large x_1 lowers the scatter.
        assert search.designs(found.cube)[:2] == pytest.approx([1.5, 1.0], abs=1e-6)
    # Above it the constraint is free, and the front is that of the toy.
    free = LevelSearch(TOY, np.random.default_rng(1))
    found, plain = (one.best(2.8, one.starts(2.8)) for one in (search, free))
    assert found.objectives == pytest.approx(plain.objectives, rel=1e-9)


def test_a_design_is_moved_to_its_level_along_an_active_constraint():
    toy = LimitedToy()
    design = np.array([np.sqrt(3.25) * np.cos(0.7), np.sqrt(3.25) * np.sin(0.7), 1.4])
    level = toy.evaluate(design)[0][0] * (1.0 + 5e-7)
    moved = on_level(toy, design, level)
    mean, limit = (values[0] for values in toy.evaluate(moved))
    assert mean == pytest.approx(level, rel=1e-11)
    # Steps of 1e-6 leave what is of second order.
    assert limit == pytest.approx(0.0, abs=1e-10)
