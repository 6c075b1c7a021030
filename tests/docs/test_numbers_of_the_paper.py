"""The page on the paper's numbers, and what paper.md says about the paper."""

import numpy as np
import pytest
from places import ROOT

from experiments.paper_page import PAGE, in_short, page
from pymoo_hdte.problems import RobustDTE


@pytest.mark.nightly
def test_the_page_is_what_the_experiments_say():
    written = PAGE.read_text(encoding="utf-8").splitlines()
    assert written == page().splitlines(), "run python -m experiments.paper_page"


@pytest.mark.slow
def test_paper_says_it_in_the_same_sentences():
    words = " ".join((ROOT / "paper.md").read_text(encoding="utf-8").split())
    for sentence in in_short():
        assert sentence in words


def test_the_front_of_order_3_is_dominated_at_order_5():
    finer = RobustDTE(order=5)
    front = finer.pareto_front()
    values = finer.evaluate(RobustDTE().pareto_set())
    assert all(np.any(np.all(front < row, axis=1)) for row in values)
