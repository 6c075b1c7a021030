"""Costly evaluations on many workers: pymoo's runner, and swarms without generations."""

from pymoo_hdte.parallel.asynchronous import minimize_asynchronously
from pymoo_hdte.parallel.counts import Counts
from pymoo_hdte.parallel.executor import ExecutorParallelization
from pymoo_hdte.parallel.virtual import VirtualWorkers

__all__ = ["Counts", "ExecutorParallelization", "VirtualWorkers", "minimize_asynchronously"]
