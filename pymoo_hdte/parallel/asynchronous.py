"""Swarms without generations: a worker that is free gets the next design at once."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.individual import Individual
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.core.result import Result
from pymoo.core.termination import Termination
from pymoo.operators.sampling.rnd import FloatRandomSampling

from pymoo_hdte.algorithms.elitist import ElitistSwarm
from pymoo_hdte.algorithms.horizon import evaluation_limit
from pymoo_hdte.checks import InvalidInput, whole_number
from pymoo_hdte.parallel.executor import ExecutorParallelization


def minimize_asynchronously(
    problem: Problem,
    algorithm: ElitistSwarm,
    termination: Termination | tuple[Any, ...],
    *,
    at_once: int | None = None,
    **kwargs: Any,
) -> Result:
    """Do as pymoo's `minimize`, but have every worker busy all the time.

    Each design that is finished enters the swarm alone, and the worker gets the next one, from what
    is known then: nobody waits for the slowest of a generation. The first swarm are the
    first ``pop_size`` designs to be finished, random ones being added as long as workers are free.

    The result depends on the order in which evaluations end, and thus on the machine. It is the
    same again on `VirtualWorkers`, and after a kill if the runner has a ``cache``, and seed and
    ``at_once`` are as before: what is in the file is replayed in its order. A design that is quick
    to evaluate has more offspring: where the time depends on the design, the search leans to
    the quick ones.

    Parameters
    ----------
    problem : Problem
        Elementwise, with an `ExecutorParallelization` as its ``elementwise_runner``.
    algorithm : ElitistSwarm
        Or a `CompactSwarm`; it is copied.
    termination : Termination or tuple
        Termination of pymoo, as ``("n_eval", 500)`` or a time. Each design is a generation. What
        is under way when another termination ends the run is dropped.
    at_once : int, optional
        Evaluations under way; by default as many as the executor says that it has workers.
    **kwargs
        As of `minimize`: seed, verbose, callback and others.

    Returns
    -------
    Result
        As of `minimize`, with ``evaluations``: how many designs were evaluated, or lost and why.

    Raises
    ------
    InvalidInput
        If problem or algorithm are none of these, or the number of workers is not known.
    SimulatorFailed
        If none of the first ``pop_size`` designs gives a result.

    Warns
    -----
    RuntimeWarning
        If designs were lost.

    Examples
    --------
    >>> from pymoo.problems.functional import FunctionalProblem
    >>> parabolas = [lambda x: x @ x, lambda x: (x - 1) @ (x - 1)]
    >>> clock = VirtualWorkers(3, np.random.default_rng(1).exponential)  # unequal times
    >>> with ExecutorParallelization(clock) as runner:
    ...     problem = FunctionalProblem(2, parabolas, xl=-1, xu=2, elementwise_runner=runner)
    ...     result = minimize_asynchronously(problem, CompactSwarm(), ("n_eval", 200), seed=1)
    >>> print(result.evaluations, f"workers busy {clock.efficiency:.0%} of the time")
    200 designs evaluated workers busy 98% of the time
    """
    runner = problem.elementwise_runner
    if not problem.elementwise or not isinstance(runner, ExecutorParallelization):
        allowed = "an ExecutorParallelization, of an elementwise problem"
        raise InvalidInput("elementwise_runner of problem", runner, allowed)
    if not isinstance(algorithm, ElitistSwarm):
        raise InvalidInput("algorithm", algorithm, "an ElitistSwarm or a CompactSwarm")
    count = runner.number if at_once is None else at_once
    if count is None:
        raise InvalidInput("at_once", at_once, "the number of workers, which the executor hides")
    swarm = copy.deepcopy(algorithm)
    swarm.n_offsprings = 1
    swarm.setup(problem, termination=termination, **kwargs)
    run = _SteadyState(swarm, runner, whole_number("at_once", count, 1))
    try:
        run.to_the_end()
    finally:
        runner.evaluations.cancel()
    result = swarm.result()
    result.algorithm = swarm
    return result


class _SteadyState:
    """A swarm of which designs are asked one by one, and told as they come back."""

    def __init__(self, swarm: ElitistSwarm, runner: ExecutorParallelization, at_once: int) -> None:
        self._swarm, self._runner, self._at_once = swarm, runner, at_once
        self._evaluations = runner.evaluations
        self._f = swarm.problem.elementwise_func(swarm.problem, (), {})
        self._limit = evaluation_limit(swarm.termination)
        self._initial = list(swarm.ask().tolist())
        self._arrived: list[Individual] = []
        # Which move made a design, to be credited; None of a first or random one.
        self._under_way: dict[int, tuple[Individual, NDArray[np.int_] | None]] = {}
        self._started = 0

    def to_the_end(self) -> None:
        """Evaluate until the termination ends the run."""
        while self._swarm.has_next():
            while len(self._under_way) < self._at_once and self._started < self._limit:
                self._start()
            if not self._under_way:
                break
            number, output = self._evaluations.next()
            self._report(*self._under_way.pop(number), output)
        if not self._swarm.is_initialized and self._arrived:
            # Fewer evaluations than the first swarm has designs.
            self._swarm.pop_size = len(self._arrived)
            self._report_initial()

    def _start(self) -> None:
        move = None
        if self._initial:
            particle = self._initial.pop(0)
        elif not self._swarm.is_initialized:
            particle = self._random()
        else:
            particle = self._swarm.ask()[0]
            move = self._swarm.chosen
        self._under_way[self._started] = particle, move
        self._evaluations.start(self._started, self._f, particle.X)
        self._started += 1

    def _random(self) -> Individual:
        swarm = self._swarm
        drawn = FloatRandomSampling().do(swarm.problem, 1, random_state=swarm.random_state)
        return swarm.repair.do(swarm.problem, drawn, random_state=swarm.random_state)[0]

    def _report(self, particle: Individual, move: NDArray[np.int_] | None, output: Any) -> None:
        swarm = self._swarm
        self._runner.deliver(self._evaluations.filled(self._f, output))
        reported = Population([particle])
        swarm.evaluator.eval(swarm.problem, reported, algorithm=swarm)
        if move is not None:
            swarm.chosen = move
            swarm.tell(infills=reported)
        elif swarm.is_initialized:
            # Not asked for as an offspring: it joins the swarm as from a callback.
            swarm.pop = Population.merge(swarm.pop, reported)
        else:
            self._arrived.append(particle)
            if len(self._arrived) == swarm.pop_size:
                self._report_initial()

    def _report_initial(self) -> None:
        self._evaluations.refuse_failures()
        self._swarm.tell(infills=Population(self._arrived))
