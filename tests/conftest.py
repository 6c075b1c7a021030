"""What several test files share."""

import gc
import os
import shutil
import tempfile

# Before NumPy is loaded: workers of pytest-xdist and the processes that tests start fill the cores
# already, and small matrices are slower on two threads than on one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import settings
from kept_results import FOLDER

from pymoo_hdte.drive import PRESETS, DriveModel, preset

# The first call of a compiled function compiles it: no test is judged by its time.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def pytest_configure(config: pytest.Config) -> None:
    """Make the folder that all workers share; it goes with the process that made it."""
    # Until all tests are collected next to nothing becomes garbage; to look for it takes seconds.
    gc.disable()
    if FOLDER not in os.environ:
        os.environ[FOLDER] = tempfile.mkdtemp(prefix="kept_results_")
        config.add_cleanup(lambda: shutil.rmtree(os.environ.pop(FOLDER)))


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop() -> None:
    """Look for garbage from now on, but not among the modules and tests, which stay."""
    gc.freeze()
    gc.enable()


@pytest.fixture(params=PRESETS)
def model(request: pytest.FixtureRequest) -> DriveModel:
    """Every preset in turn."""
    return preset(request.param)


@pytest.fixture
def rng() -> np.random.Generator:
    """A fresh generator of fixed seed."""
    return np.random.default_rng(20261121)


def random_designs(model: DriveModel, n: int, rng: np.random.Generator) -> np.ndarray:
    """Draw designs in the +-35 % box around the nominal, shape (n, 5)."""
    return model.nominal * rng.uniform(0.65, 1.35, (n, 5))
