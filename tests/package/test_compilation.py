"""Compilation where nothing may be written, as in a container with a read-only installation."""

import math
import subprocess
import sys

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_hdte.algorithms import ElitistSwarm, hypervolume
from pymoo_hdte.algorithms.hypervolume import (
    _selected_of_two,
    _selected_of_two_in_numpy,
    most_hypervolume,
)
from pymoo_hdte.algorithms.spread import _selected, _selected_in_numpy
from pymoo_hdte.problems import RobustDTE

NOWHERE = """
from numba.core import caching
for locator in caching.CacheImpl._locator_classes:
    locator.from_function = classmethod(lambda cls, function, file: None)
import pymoo_hdte.algorithms, pymoo_hdte.drive, pymoo_hdte.mechanism, pymoo_hdte.problems
from experiments.studies.virtual_rig.laws import softplus
print(softplus(0.0), softplus.stats.cache_path)
"""


def test_functions_are_compiled_without_a_place_to_keep_them():
    command = [sys.executable, "-c", NOWHERE]
    done = subprocess.run(command, timeout=120, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(math.log(2.0)), "None"]


WITHOUT = """
import sys
sys.modules["numba"] = None
import numpy as np
from pymoo.optimize import minimize
import pymoo_hdte.discrepancy, pymoo_hdte.drive, experiments.studies.virtual_rig.rig
from pymoo_hdte.algorithms import ElitistSwarm
from pymoo_hdte.problems import RobustDTE
result = minimize(RobustDTE(), ElitistSwarm(), ("n_eval", 1000), seed=1)
print(result.F.tobytes().hex())
"""


@pytest.mark.slow
def test_without_numba_swarms_and_problems_give_the_same():
    command = [sys.executable, "-c", WITHOUT]
    done = subprocess.run(command, timeout=120, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    result = minimize(RobustDTE(), ElitistSwarm(), ("n_eval", 1000), seed=1)
    assert bytes.fromhex(done.stdout) == result.F.tobytes()


@pytest.mark.parametrize(("n_obj", "size"), [(2, 1), (2, 30), (3, 7), (5, 59)])
def test_both_truncations_by_spread_keep_the_same(n_obj, size, rng):
    # Steps of a tenth give equal distances.
    scaled = np.round(rng.uniform(0.0, 1.0, (60, n_obj)), 1)
    order = np.argsort(scaled[:, 0], kind="stable")
    np.testing.assert_array_equal(_selected_in_numpy(scaled, size), _selected(scaled, order, size))


@pytest.mark.parametrize("size", [3, 20, 59])
def test_both_truncations_of_three_objectives_keep_the_same(size, rng, monkeypatch):
    F = rng.dirichlet(np.ones(3), 60)
    kept = most_hypervolume(F, size)
    monkeypatch.setattr(hypervolume, "COMPILES", False)
    np.testing.assert_array_equal(most_hypervolume(F, size), kept)


@pytest.mark.parametrize("size", [1, 2, 7, 40])
def test_both_truncations_of_two_objectives_keep_the_same(size, rng):
    # Steps of a tenth give equal contributions, where the number decides.
    first = np.sort(np.round(rng.uniform(0.0, 4.0, 60), 1))
    scaled = np.column_stack([first, 4.0 - first])
    number = rng.permutation(60)
    kept = _selected_of_two(scaled, number, size)
    np.testing.assert_array_equal(_selected_of_two_in_numpy(scaled, number, size), kept)
    assert np.count_nonzero(kept) == size
