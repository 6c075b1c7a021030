"""Compilation where nothing may be written, as in a container with a read-only installation."""

import math
import subprocess
import sys

NOWHERE = """
from numba.core import caching
for locator in caching.CacheImpl._locator_classes:
    locator.from_function = classmethod(lambda cls, function, file: None)
import pymoo_hdte.algorithms, pymoo_hdte.drive, pymoo_hdte.mechanism, pymoo_hdte.problems
from pymoo_hdte.virtual.laws import softplus
print(softplus(0.0), softplus.stats.cache_path)
"""


def test_functions_are_compiled_without_a_place_to_keep_them():
    command = [sys.executable, "-c", NOWHERE]
    done = subprocess.run(command, timeout=120, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(math.log(2.0)), "None"]
