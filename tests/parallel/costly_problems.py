"""Elementwise problems whose evaluations fail, hang, crash or take a while, by design.

Few imports: processes that are ended and started again import this file.
"""

import os
import signal
import subprocess
import time

import numpy as np
from pymoo.core.problem import ElementwiseProblem

MISHAPS = ("raises", "gives NaN", "hangs", "crashes")


def share(x):
    """A number within 0 and 1 that a design always has, unrelated to where it lies."""
    return float(np.random.default_rng(np.asarray(x, dtype=float).view(np.uint64)).random())


class Parabolas(ElementwiseProblem):
    """Two parabolas and a constraint; some designs come to grief, and calls are noted in a file.

    ``mishaps`` are shares of the designs by kind, ``seconds`` the longest an evaluation takes.
    """

    def __init__(self, mishaps=None, log=None, seconds=0.0, **kwargs):
        super().__init__(n_var=3, n_obj=2, n_ieq_constr=1, xl=-1.0, xu=2.0, **kwargs)
        self.mishaps, self.log, self.seconds = mishaps or {}, log, seconds

    def fate(self, x):
        """The mishap of a design, or None."""
        edges = np.cumsum([self.mishaps.get(kind, 0.0) for kind in MISHAPS])
        place = int(np.searchsorted(edges, share(x), side="right"))
        return MISHAPS[place] if place < len(MISHAPS) else None

    def _evaluate(self, x, out, *args, **kwargs):
        if self.log:
            with open(self.log, "a") as file:
                file.write(" ".join(v.hex() for v in x.tolist()) + "\n")
        if self.seconds:
            time.sleep(self.seconds * share(2.0 * x))
        fate = self.fate(x)
        if fate == "raises":
            raise RuntimeError("no convergence")
        if fate == "hangs":
            subprocess.run(["sleep", "1000"], check=True)
        if fate == "crashes":
            os.kill(os.getpid(), signal.SIGKILL)
        lost = np.nan if fate == "gives NaN" else 0.0
        out["F"] = [float(x @ x) + lost, float((x - 1.0) @ (x - 1.0))]
        out["G"] = [0.25 - x[0]]


class KillsOnce:
    """A function of which the first call of all kills its worker."""

    def __init__(self, file):
        self.file = file

    def __call__(self, x):
        try:
            os.close(os.open(self.file, os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            return {"F": [float(x @ x)]}
        os.kill(os.getpid(), signal.SIGKILL)


def calls(log):
    """The designs that were evaluated, in the order of their beginnings."""
    return log.read_text().splitlines() if log.exists() else []
