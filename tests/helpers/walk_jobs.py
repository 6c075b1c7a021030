"""Jobs for workers of a cluster: quick to import; some kill their worker."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pymoo_hdte._runner.campaign import Run


@dataclass(frozen=True)
class Walk:
    """A job whose result holds the id of its process instead of the seconds of its parts."""

    seed: int

    @property
    def key(self) -> str:
        return f"walk_seed{self.seed}"

    def execute(self) -> Run:
        time.sleep(0.1)
        steps = np.random.default_rng(self.seed).normal(size=(4, 2))
        return Run(("x", "y"), steps.cumsum(axis=0), 0.1, (float(os.getpid()),))


@dataclass(frozen=True)
class DeadlyWalk(Walk):
    """The same job, but it kills its process once, if the file ``cartridge`` exists."""

    cartridge: Path

    def execute(self) -> Run:
        if self.cartridge.exists():
            self.cartridge.unlink()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().execute()


@dataclass(frozen=True)
class EndlesslyDeadlyWalk(Walk):
    """The same job, but it kills every process that runs it."""

    def execute(self) -> Run:
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError
