"""What the documentation of AMP-MOPSO says it does: a weight next to constant, a split in two."""

import numpy as np
import pytest
from pymoo.core.callback import Callback
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_hdte.algorithms import AMPMOPSO, Pyramid
from pymoo_hdte.problems import RobustDTE


class Weights(Callback):
    """The inertia weight that each generation's archive gives."""

    def notify(self, algorithm):
        found = self.data.setdefault("w", [])
        found.append(algorithm.inertia(0.0, algorithm.leaders.points.F))


@pytest.mark.parametrize(
    ("problem", "median"),
    [
        pytest.param(get_problem("zdt1"), 0.421, marks=pytest.mark.nightly),
        (get_problem("dtlz2"), 0.400),
        (RobustDTE(), 0.414),
    ],
    ids=["ZDT1", "DTLZ2", "RobustDTE"],
)
def test_the_adaptive_weight_hardly_adapts(problem, median):
    noted = Weights()
    minimize(problem, AMPMOPSO(), ("n_gen", 100), seed=1, callback=noted)
    weights = np.array(noted.data["w"])
    assert np.median(weights) == pytest.approx(median, abs=0.006)
    # Of the range .4 to .9 that it is given, it uses a sixth at most once the archive is filled and
    # no longer replaced as a whole, which takes some ten generations, and mostly a fifteenth.
    assert weights.min() >= 0.4
    assert weights[20:].max() < 0.48
    assert np.mean(weights < 0.433) > 0.8


def test_the_pyramid_is_a_split_in_two_by_rank():
    ranks = np.arange(1, 9)
    own, leaders = Pyramid().acceleration(ranks)
    assert own.tolist() == [1.0] * 2 + [2.0] * 6
    assert leaders.tolist() == [2.0] * 2 + [1.0] * 6
    rng = np.random.default_rng(1)
    shifts = Pyramid().mutation(np.repeat(ranks, 200), 0.0, np.ones(3), rng)
    struck = np.any(shifts != 0.0, axis=1).reshape(8, 200).mean(axis=1)
    assert struck[:2].tolist() == [0.0, 0.0]
    assert struck[2:] == pytest.approx(0.4, abs=0.12)
