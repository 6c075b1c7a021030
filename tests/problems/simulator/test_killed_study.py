"""A study that is killed at any moment goes on: no call is made twice, and the bytes are the same."""

import multiprocessing
import os
import pickle
import signal
import time
from functools import partial
from pathlib import Path

import chaospy
import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import Design, robust_problem
from pymoo_hdte.problems.simulator.run_file import identity

DESIGNS, NOISE = {"x": Design(0.5, 1.0, deviation=0.05)}, {"a": chaospy.Uniform(0.0, 1.0)}


def noting(log, x, a):
    """Note the call on disk, as a kill would not leave it in memory; then work for a while."""
    with open(log, "a") as file:
        file.write(f"{x.hex()} {a.hex()}\n")
    time.sleep(1e-3)
    return {"y": np.exp(x * a), "z": x - a}


def study(folder):
    """Return the problem; its cache and its log of calls are in the folder."""
    objectives = [chosen(response="y") for chosen in OBJECTIVES]
    return robust_problem(
        partial(noting, str(folder / "log")),
        DESIGNS,
        NOISE,
        objectives,
        cache=folder / "runs.jsonl",
        progress=False,
    )


def to_the_end(folder):
    study(folder).save(folder / "problem.npz")


def calls(folder):
    log = folder / "log"
    return log.read_text().splitlines() if log.exists() else []
