"""Jobs for workers of a cluster: quick to import, and deadly if need be."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.runner.campaign import Run


@dataclass(frozen=True)
class Walk:
    """A job that tells which process did it, in the place of the seconds of its parts."""

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
    """The same job, but its process is killed in its midst if ``cartridge`` is loaded."""

    cartridge: Path

    def execute(self) -> Run:
        if self.cartridge.exists():
            self.cartridge.unlink()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().execute()


@dataclass(frozen=True)
class EndlesslyDeadlyWalk(Walk):
    """The same job, but whoever runs it is killed."""

    def execute(self) -> Run:
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError
