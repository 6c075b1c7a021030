"""Who is ahead, level or the same on the seeds of a comparison, and how that is drawn."""

import numpy as np
import pytest
from scipy.stats import wilcoxon

from pymoo_hdte._comparing.figures import fronts
from pymoo_hdte._comparing.paired import SIGNIFICANT, Comparison, least_seeds, standing
from pymoo_hdte._comparing.pictures import run_pictures
from pymoo_hdte._comparing.quality import Quality, TrueFront
from pymoo_hdte._comparing.setting import Setting
from pymoo_hdte._comparing.statistics import wilcoxon_p
from pymoo_hdte._comparing.tables import answer
from pymoo_hdte._runner.campaign import Run


def comparison(igd, n_obj=2):
    """A comparison in which algorithms have these values of IGD, one a seed, and one front."""
    axes = np.eye(n_obj)
    seeds = range(1, 1 + len(next(iter(igd.values()))))
    run = Run(("f",), np.zeros((1, 1)), 0.1, trace=np.empty((0, 3)))
    return Comparison(
        "problem",
        TrueFront(axes, in_pieces=False),
        False,
        seeds,
        tuple(f"f{1 + place}" for place in range(n_obj)),
        {name: [axes[::-1] * 0.5 + 0.5] * len(seeds) for name in igd},
        {name: [10] * len(seeds) for name in igd},
        {name: [run] * len(seeds) for name in igd},
        {name: [Quality(value, 0.0, 0.0, 0) for value in values] for name, values in igd.items()},
    )


def shifted(start, n=10):
    return (start + np.linspace(0.0, 0.5, n)).tolist()


def test_clear_differences_put_one_ahead():
    found = standing(comparison({"b": shifted(2.0), "a": shifted(1.0), "c": shifted(3.0)}), "igd")
    assert found.ordered == ("a", "b", "c")
    assert set(found.behind) == {"b", "c"}
    assert found.level == found.ahead == {}
    assert found.same == ()
    # Ten of ten pairs: 2 / 2^10, times three pairs of algorithms.
    assert found.behind["b"] == pytest.approx(3 * 2.0**-9)


def test_the_same_values_are_no_lead():
    igd = {"b": shifted(1.0), "a": shifted(1.0)}
    found = standing(comparison(igd), "igd")
    assert found.level == {found.ordered[1]: 1.0}
    assert found.same == (("b", "a"),)
    said = answer([comparison(igd)], range(1, 11))
    assert "ahead" not in said
    assert "least" not in said


def test_noise_is_level(rng):
    values = rng.normal(1.0, 0.1, (2, 20))
    found = standing(comparison({"a": values[0].tolist(), "b": values[1].tolist()}), "igd")
    p = wilcoxon(values[0] - values[1]).pvalue
    assert p > SIGNIFICANT
    assert found.level == {found.ordered[1]: pytest.approx(p)}


def test_a_larger_mean_by_one_bad_seed_is_no_defeat():
    """Nineteen seeds of twenty are better, one is terrible: the tests speak for the other."""
    steady, mostly = shifted(1.0, 20), [*shifted(0.9, 19), 30.0]
    found = standing(comparison({"mostly": mostly, "steady": steady}), "igd")
    assert found.ordered[0] == "steady"
    assert set(found.ahead) == {"mostly"}


@pytest.mark.parametrize("tests", [1, 2, 3, 6, 10, 45])
def test_so_many_seeds_make_the_smallest_p_possible(tests):
    n = least_seeds(tests)
    p = [wilcoxon_p(np.arange(1.0, k + 1.0), np.zeros(k)) * tests for k in (n - 1, n)]
    assert p[1] < SIGNIFICANT <= p[0]


def test_fewer_seeds_decide_nothing():
    igd = {"a": shifted(1.0, 5), "b": shifted(2.0, 5)}
    found = standing(comparison(igd), "igd")
    assert not found.decidable
    assert not found.behind
    assert "ahead" not in answer([comparison(igd)], range(1, 6))


@pytest.mark.parametrize("igd", [[np.inf, 1.0], [np.inf, np.inf]])
def test_runs_without_a_feasible_design_have_an_answer(igd):
    one = comparison({"a": igd * 5, "b": shifted(1.0)})
    assert standing(one, "igd").ordered[0] == "b"
    assert answer([one], range(1, 11))
    both = comparison({"a": igd * 5, "b": [np.inf] * 10})
    assert "feasible" in answer([both], range(1, 11))


def test_three_objectives_are_drawn_in_three_and_more_in_full():
    (axis,) = fronts(comparison({"a": [1.0]}, 3)).axes
    assert axis.name == "3d"
    drawn = np.array(axis.lines[1].get_data_3d()).T
    np.testing.assert_array_equal(drawn, np.eye(3)[::-1] * 0.5 + 0.5)
    (axis,) = fronts(comparison({"a": [1.0]}, 5)).axes
    lines = np.array([line.get_ydata() for line in axis.lines])
    np.testing.assert_array_equal(lines, np.eye(5)[::-1] * 0.5 + 0.5)


def test_pictures_of_one_algorithm_rank_nothing():
    names = [
        {picture.name for picture in run_pictures([comparison(igd)], Setting(), "a")}
        for igd in ({"a": [1.0, 2.0]}, {"a": [1.0, 2.0], "b": [1.0, 2.0]})
    ]
    assert names[1] - names[0] == {"ranks"}
