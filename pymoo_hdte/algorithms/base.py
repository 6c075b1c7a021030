"""What all swarms share: population size, first positions and checks of the problem."""

from __future__ import annotations

import inspect
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.algorithm import Algorithm
from pymoo.core.individual import Individual
from pymoo.core.initialization import Initialization
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.core.result import Result
from pymoo.core.sampling import Sampling
from pymoo.operators.sampling.rnd import FloatRandomSampling
from pymoo.util.display.multi import MultiObjectiveOutput

from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.checks import InvalidInput, whole_number

# First positions computed from the bounds miss them by a few roundings; those are accepted.
_EDGE = 1e-12


class Swarm(Algorithm):
    """Base of `ParticleSwarm` and `ElitistSwarm`, which document its parameters and errors."""

    def __init__(
        self,
        pop_size: int,
        sampling: Sampling | NDArray | Population | None,
        **kwargs: Any,
    ) -> None:
        # pymoo's base class ignores misspelt arguments silently.
        unknown = set(kwargs) - set(inspect.signature(Algorithm.__init__).parameters)
        if unknown:
            raise TypeError(f"{type(self).__name__} has no argument {', '.join(sorted(unknown))}")
        super().__init__(**{"output": MultiObjectiveOutput(), **kwargs})
        self.pop_size = whole_number("pop_size", pop_size, at_least=2)
        self.initialization = Initialization(
            FloatRandomSampling() if sampling is None else sampling
        )

    # Not `_setup`, which pymoo's wrappers for constraint handling replace by their own.
    def setup(self, problem: Problem, **kwargs: Any) -> Algorithm:
        """Prepare a run; a running swarm goes on from where it is.

        Parameters
        ----------
        problem : Problem
            A problem with real variables, finite bounds and two objectives or more.
        **kwargs
            What `pymoo.core.algorithm.Algorithm.setup` takes: termination, seed and others.

        Returns
        -------
        Algorithm
            The swarm itself.

        Raises
        ------
        InvalidInput
            If the problem does not fit.
        """
        self._check(problem)
        super().setup(problem, **kwargs)
        self._plan()
        return self

    def _check(self, problem: Problem) -> None:
        """Refuse a problem that does not fit."""
        check_problem(problem)

    def _plan(self) -> None:
        """Fix what depends on how long the run will be."""

    def _n_requested(self) -> int:
        """Return the number of particles in a generation."""
        return self.pop_size

    def _initialize_infill(self) -> Population:
        particles = self.initialization.do(
            self.problem, self.pop_size, algorithm=self, random_state=self.random_state
        )
        X = particles.get("X")
        lowest, highest = self.problem.bounds()
        if X.shape != (self.pop_size, self.problem.n_var):
            wanted = f"{(self.pop_size, self.problem.n_var)}, a position for every particle"
            raise InvalidInput("shape of sampling", X.shape, wanted)
        beyond = np.maximum(lowest - X, X - highest)
        outside = np.argwhere(~(beyond <= _EDGE * (highest - lowest)))
        if len(outside):
            row, column = map(int, outside[0])
            allowed = f"{lowest[column]!s} to {highest[column]!s}, the bounds of the problem"
            raise InvalidInput(f"sampling[{row}, {column}]", float(X[row, column]), allowed)
        particles = particles.copy()
        for number in np.flatnonzero(np.any(beyond > 0.0, axis=1)):
            particles[number] = Individual(X=np.clip(X[number], lowest, highest))
        return particles

    def result(self) -> Result:
        """Return the result so far, with what became of evaluations if the runner counts them."""
        result = super().result()
        result.evaluations = self._counts()
        return result

    def _counts(self) -> Any:
        return getattr(getattr(self.problem, "elementwise_runner", None), "counts", None)

    def _finalize(self) -> None:
        counts = self._counts()
        if counts is not None and counts.n_lost:
            warnings.warn(f"designs were lost: {counts}", RuntimeWarning, stacklevel=4)

    def _points(self, population: Population) -> Points:
        return Points.of(population, self.problem.has_constraints())

    def _evaluated(self, infills: Population | None) -> Points:
        """Return the points of a swarm that comes back from evaluation, in the order of ``ask``."""
        n = 0 if infills is None else len(infills)
        if infills is None or n != self._n_requested():
            allowed = f"the {self._n_requested()} particles of ask(), in their order"
            raise InvalidInput("number of infills", n, allowed)
        points = self._points(infills)
        expected = (n, self.problem.n_obj)
        if points.F.shape != expected:
            raise InvalidInput("shape of F of infills", points.F.shape, f"{expected}, evaluated")
        return points


def particles_at(X: NDArray[np.float64]) -> Population:
    """Return particles at ``X`` (n, d), faster than Population.new."""
    config = Individual.default_config()
    particles = [Individual(config) for _ in X]
    for particle, x in zip(particles, X, strict=True):
        particle.X = x.copy()
    return Population(particles)


def twin(particle: Individual) -> Individual:
    """Return a particle of its own with the same arrays, which nobody changes in place."""
    other = object.__new__(type(particle))
    vars(other).update(vars(particle))
    other.data, other.evaluated = dict(particle.data), set(particle.evaluated or ())
    return other


def check_problem(problem: Problem, integers: bool = False) -> None:
    """Refuse a problem that no swarm can take; one with ``integers`` where a repair makes them."""
    mixed = getattr(problem, "vars", None) is not None
    if mixed or problem.vtype not in ((None, float, int) if integers else (None, float)):
        with_repair = "real variables, or integers with repair=RoundingRepair() in an elitist swarm"
        raise InvalidInput("vtype of problem", "mixed" if mixed else problem.vtype, with_repair)
    if problem.n_obj < 2:
        raise InvalidInput("n_obj of problem", problem.n_obj, "at least 2")
    bounds = problem.bounds()
    if any(bound is None or not np.all(np.isfinite(bound)) for bound in bounds):
        raise InvalidInput("bounds of problem", bounds, "finite lower and upper bounds")
    if np.any(bounds[0] > bounds[1]):
        raise InvalidInput("bounds of problem", bounds, "lower bounds up to the upper ones")
