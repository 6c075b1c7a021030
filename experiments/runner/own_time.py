"""Seconds of a run of pymoo that are the algorithm's own, and those of its evaluations."""

from __future__ import annotations

from collections.abc import Callable

from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator

Clock = Callable[[], float]


class TimedEvaluator(Evaluator):
    """Adds up the seconds of a clock that go into evaluations."""

    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self.clock, self.seconds = clock, 0.0

    def eval(self, *args: object, **kwargs: object) -> object:
        """Evaluate as pymoo does, with the clock running."""
        begin = self.clock()
        try:
            return super().eval(*args, **kwargs)
        finally:
            self.seconds += self.clock() - begin


def seconds_of_run(algorithm: Algorithm, clock: Clock) -> tuple[float, float]:
    """Run an algorithm that is set up; return its seconds without and with evaluations."""
    algorithm.evaluator = TimedEvaluator(clock)
    begin = clock()
    algorithm.run()
    total = clock() - begin
    return total - algorithm.evaluator.seconds, total
