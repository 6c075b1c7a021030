"""Cards of the problems: hardness, merged campaigns, separation, pages."""

import re

import numpy as np
import pytest
from pymoo.core.problem import Problem

from experiments.runner.committed import read_rows
from experiments.studies.cards import pages
from experiments.studies.cards.data import (
    BUDGETS,
    Numbers,
    committed_numbers,
    format_hardness,
    merged,
    part_of,
    read_hardness,
)
from experiments.studies.cards.hardness import Hardness, hardness, modality_of, weights_of
from experiments.studies.cards.tables import separation_table, separations
from experiments.studies.contest.peers_data import Scores
from experiments.studies.contest.problems import CARDS
from pymoo_hdte.problems import RobustToy

FLOOR = 0.01
PLAIN = Hardness(1, 1.0, 1, 1.0, 0.1, 0.5, FLOOR)


class Wells(Problem):
    """One variable, wells of depth 0 at 0.2 and of depth 0.1 at 0.8 in both objectives."""

    def __init__(self):
        super().__init__(n_var=1, n_obj=2, xl=np.zeros(1), xu=np.ones(1))

    def _evaluate(self, x, out, *args, **kwargs):
        wave, slope = -np.cos(2 * np.pi * (x - 0.2) / 0.6), np.sin(2 * np.pi * (x - 0.2) / 0.6)
        value = 1.0 + wave + (x - 0.2) / 6.0
        out["F"] = np.hstack([value, value])
        gradient = slope * 2 * np.pi / 0.6 + 1.0 / 6.0
        out["dF"] = np.stack([gradient, gradient], axis=1)


def planted(medians, problem="RobustToy", budget=500, seeds=5):
    """Scores in which every algorithm has its own IGD, give and take a tenth."""
    algorithms = tuple(f"algorithm {place}" for place in range(len(medians)))
    runs = np.array(medians)[:, None] * np.linspace(0.9, 1.1, seeds)
    values = np.broadcast_to(runs[None, None, :, None], (6, 1, len(medians), 1, seeds)).copy()
    spent = np.full(values.shape[1:], budget)
    names = tuple(range(1, seeds + 1))
    return Scores(
        (problem,), algorithms, (budget,), names, values, spent, np.ones((1, len(medians)))
    )


def test_weights_add_up_and_hold_the_corners():
    weights = weights_of(3)
    assert np.all(weights.sum(axis=1) == 1.0)
    assert len(weights) == 15
    assert {tuple(row) for row in np.eye(3)} <= {tuple(row) for row in weights}


def test_two_wells_are_two_optima_and_half_of_the_starts_reach_the_better():
    front = np.array([[0.0, 1.0], [1.0, 0.0]])
    optima, reached = modality_of(Wells(), front, np.random.default_rng(1), 40)
    assert optima == 2
    assert reached == pytest.approx(0.5, abs=0.2)


@pytest.mark.nightly
def test_the_toy_has_one_optimum_and_one_piece():
    found = hardness(RobustToy(), np.random.default_rng(1), starts=3)
    assert (found.optima, found.best_reached, found.pieces, found.feasible) == (1, 1.0, 1, 1.0)
    # Means reach from 2 to 4, those of the front to 3: none lies farther behind than its width.
    assert 0.0 < found.near < found.wide == 1.0
    # Fifty points evenly along a straight front of length sqrt(2) would give sqrt(2) / 196.
    assert found.floor == pytest.approx(np.sqrt(2.0) / 196.0, rel=0.2)


def test_hardness_survives_the_file(tmp_path):
    found = {"a": PLAIN, "b": Hardness(None, None, None, 0.25, 0.125, 0.5, 0.0625)}
    path = tmp_path / "hardness.csv"
    path.write_text(format_hardness(found))
    assert read_hardness(read_rows(path)) == found


def test_merged_campaigns_keep_every_run_and_leave_the_rest_empty():
    first = planted([1.0, 2.0])
    second = planted([3.0], "RobustDTE-calibrated", 2_000)
    both = merged([first, second])
    assert both.spent.shape == (2, 2, 2, 5)
    assert both.spent[0, :, 0].min() == 500
    assert both.spent[1, 0, 1].min() == 2_000
    assert np.count_nonzero(both.spent) == 15
    again = part_of(both, first.problems, first.budgets, first.seeds)
    np.testing.assert_array_equal(again.values, first.values)


@pytest.mark.parametrize(
    ("medians", "separates"),
    [
        ([FLOOR] * 8, False),
        ([FLOOR] * 4 + [10 * FLOOR] * 4, True),
        ([FLOOR] * 7 + [10 * FLOOR], False),
        ([FLOOR] * 4 + [1.5 * FLOOR] * 4, False),
        ([FLOOR] * 4 + [np.inf] * 4, True),
    ],
)
def test_a_problem_separates_where_the_quartiles_of_the_algorithms_lie_apart(medians, separates):
    (found,) = separations(planted(medians), {"RobustToy": PLAIN})
    assert found.separates == separates
    assert found.spread == pytest.approx(medians[5] / medians[2])
    assert found.scatter == pytest.approx(1.1 / 0.9)
    assert found.reached == sum(median <= 2.0 * FLOOR for median in medians)


def test_two_algorithms_are_too_few_for_quartiles():
    (found,) = separations(planted([FLOOR, 10 * FLOOR]), {"RobustToy": PLAIN})
    assert found.separates is None
    assert (
        "too few"
        in separation_table(Numbers(planted([1.0, 9.0]), {"RobustToy": PLAIN})).rows[0][-1]
    )


@pytest.fixture(scope="module")
def numbers():
    return committed_numbers()


def test_every_problem_has_numbers_at_every_budget_it_was_given(numbers):
    scores = numbers.scores
    assert set(scores.problems) == set(CARDS) == set(numbers.hardness)
    assert scores.budgets == BUDGETS
    assert len(scores.algorithms) == 12
    assert len(scores.seeds) >= 5
    least = [scores.spent[row, :, 0].min(axis=-1) > 0 for row in range(len(scores.problems))]
    assert min(np.count_nonzero(ran) for ran in least) >= 3


def test_a_problem_separates_algorithms_at_the_largest_budget(numbers):
    (finding,) = separation_table(numbers).findings
    assert finding.agrees
    assert "direct" not in finding.sentence


def test_by_the_earlier_rule_none_does(numbers):
    """As the note says: a quarter reaches the front, and a quarter does not."""
    for one in separations(*numbers):
        if one.evaluations == max(BUDGETS):
            assert min(one.reached, one.algorithms - one.reached) < 0.25 * one.algorithms


def test_a_card_says_what_the_problem_is(numbers):
    text = pages.page(numbers, "RobustToy")
    for words in ("| x_1 | 1 | 2 | 1 |", "a_2 | normal", "10,000 evaluations", "random search"):
        assert words in text
    runs = pages.runs_text(numbers, "RobustToy").splitlines()
    assert len(runs) == 1 + 12 * 3 * len(numbers.scores.seeds)


def test_every_card_is_reached_from_the_index(numbers):
    text = pages.index_page(numbers)
    for name in CARDS:
        assert f"\n{pages.stem_of(name)}\n" in text


def test_tables_keep_their_shape_in_markdown(numbers):
    rows = pages.table_text(separation_table(Numbers(*numbers))).splitlines()
    assert len({row.count("|") for row in rows}) == 1


@pytest.mark.parametrize("library", ["pymoo", "pygmo"])
def test_the_index_shows_how_to_reproduce_numbers_of_its_cards(library, numbers, capsys):
    pytest.importorskip(library)
    shown = re.findall(
        r"IGD ([\d.]+):\n\n```python\n(.*?)```", pages.index_page(numbers), re.DOTALL
    )
    ((igd, lines),) = [one for one in shown if one[1].split()[1].partition(".")[0] == library]
    assert len([*filter(None, lines.splitlines())]) == 5
    exec(lines, {})
    (found,) = re.findall(r"igd=([\d.]+)", capsys.readouterr().out)
    assert float(found) == pytest.approx(float(igd), rel=5e-3)
