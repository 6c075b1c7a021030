"""Robust design of anyone's simulator: from a function to a pymoo problem."""

from __future__ import annotations

import inspect
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from pymoo_hdte.checks import InvalidInput, real_number, whole_number
from pymoo_hdte.problems._simulator.identity import identity
from pymoo_hdte.problems._simulator.inputs import Design, Inputs
from pymoo_hdte.problems._simulator.problem import SimulatorProblem
from pymoo_hdte.problems._simulator.requested import place_of
from pymoo_hdte.problems._simulator.run_file import RunFile
from pymoo_hdte.problems._simulator.runs import Simulator
from pymoo_hdte.problems._simulator.statistics import (
    Mean,
    RobustConstraint,
    Statistic,
    Std,
)
from pymoo_hdte.problems._simulator.trust import (
    failing,
    inaccurate,
    largest_error,
    negative_somewhere,
    positive_places,
    random,
)
from pymoo_hdte.problems._simulator.workers import Workers
from pymoo_hdte.surrogate._sparse.adaptive import (
    IN_A_ROW,
    LOOSEST,
    AdaptiveFit,
    fit_adaptively,
    least_runs,
)
from pymoo_hdte.surrogate.trust import UntrustedSurrogate

Array = NDArray[np.float64]

_NUMBERS_PER_TERM = 4096 + 2048
"""Values of a term at common samples, and in arrays for the designs of a block."""


def robust_problem(
    simulator: Callable[..., Any],
    designs: Mapping[str, Design],
    noise: Mapping[Any, Any] | None = None,
    objectives: Sequence[Statistic] = (Mean(), Std()),
    constraints: Sequence[RobustConstraint] = (),
    accuracy: float = 0.01,
    budget: int = 1000,
    positive: Sequence[str] | bool = False,
    vectorised: bool = False,
    executor: Any = None,
    at_once: int = 1,
    tries: int = 2,
    time_limit: float | None = None,
    cache: str | os.PathLike[str] | None = None,
    seed: int = 1,
    progress: bool = True,
) -> SimulatorProblem:
    """Return the robust design problem of a simulator.

    A sparse polynomial surrogate, the most probable one given the runs, gets more of them until
    mean and standard deviation of every response that an objective or a constraint names are as
    accurate as asked for, twice in a row. Others are kept for `SimulatorProblem.predict` as they
    are then known: see `SimulatorProblem.response_errors`.
    These and their gradients are exact for the surrogate, whatever the independent distributions.

    The simulator is called within the support of a scatter, or between its quantiles of 1e-5 where
    that is unbounded. What lies beyond is estimated from what the last runs before it add to the
    variance, and half of that is added to the error, unless the response is a polynomial of low
    degree. If the surrogate adds more than four times the estimate there, it runs away: what lies
    beyond is left out, and four times the estimate is added.

    What no run meets is not seen: a jump or peak that takes up a share p of the inputs' reach is
    missed by all of n runs with probability (1 - p)^n. At least 33 runs and one more for each input
    are made.

    Parameters
    ----------
    simulator : callable
        Takes all designs and all noise by name; returns a number, a mapping of names to numbers, or
        a sequence.
    designs : mapping of str to Design
        Design variables with their bounds and scatter.
    noise : mapping, optional
        From a name to its distribution (of `chaospy`, or a frozen one of `scipy.stats`, with a
        variance), or from a tuple of names to a joint one of `chaospy`. Together with the designs
        at most 20 inputs.
    objectives : sequence of Statistic
        Objectives to be minimised; ``-Mean()`` is maximised.
    constraints : sequence of RobustConstraint
        As ``Quantile(0.99, response="stress") <= 250e6``.
    accuracy : float
        Largest error of mean and standard deviation, as a share of the standard deviation, above 0
        and below 1: 0.01 for 1 %. Where the standard deviation is below a tenth of its median over
        the designs, of this tenth.
    budget : int
        Most points; a failing one is run up to ``tries`` times.
    positive : sequence of str, or bool
        Responses that cannot be negative; True for all. A surrogate that is so is refused.
    vectorised : bool
        Whether the simulator takes and returns arrays of shape (n,) in the place of numbers.
    executor : int or object, optional
        Makes the runs: of `concurrent.futures`, a client of Dask, or a number of processes.
    at_once : int
        Least number of runs that are chosen together; the number of workers of the executor.
    tries : int
        How often a run is made that raises or gives NaN, before it is left out. What a vectorised
        simulator raises is passed on.
    time_limit : float, optional
        Seconds after which a run is ended and left out, imports not counted; it then has a process
        of its own beside the worker, and may crash there.
    cache : path, optional
        File of finished and of failed runs: with it, none is made twice, though the process be
        killed. The
        first that does not fail is made again, to see whether the file is this simulator's, where
        the study that wrote it came to its end, or the simulator's source, state, globals, closure
        or the modules that it names are others or cannot be told. What else it reads or calls, as
        files and programs, is not seen: delete the file where that has changed.
    seed : int
        Seed of the positions of the runs.
    progress : bool
        Whether to tell runs and memory on the error stream before the first run, and show a bar.

    Returns
    -------
    SimulatorProblem
        The problem, with ``accuracy`` and ``n_runs``.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed, or a simulator that is random.
    UntrustedSurrogate
        If the budget is spent and the error is still larger than asked for, a positive response
        becomes negative, or more than a fifth of the runs fail; tells where.
    SimulatorFailed
        If every run so far failed.

    Warns
    -----
    RuntimeWarning
        If runs failed; their inputs are in ``failed`` of the result. If the budget is spent before
        an error that is small enough was confirmed.

    Examples
    --------
    >>> problem = robust_problem(
    ...     lambda x, load: load * x**2,
    ...     {"x": Design(1.0, 2.0, tolerance=0.1)},
    ...     {"load": TruncatedNormal(5.0, 0.5)},
    ...     progress=False,
    ... )
    >>> print(f"{problem.evaluate(np.array([[1.0]]))[0, 0]:.2f}")
    5.02
    """
    inputs = Inputs(designs, {} if noise is None else noise)
    _check_signature(simulator, inputs.names)
    accuracy = _share("accuracy", accuracy)
    least = least_runs(len(inputs.axes))
    budget = whole_number("budget", budget, least)
    _check_statistics(objectives, constraints)
    file = None if cache is None else RunFile(cache, inputs.names, identity(simulator))
    count, batch = whole_number("tries", tries, 1), whole_number("at_once", at_once, 1)
    random_state = np.random.default_rng(whole_number("seed", seed, 0))
    if vectorised and time_limit is not None:
        raise InvalidInput("time_limit", time_limit, "None for a vectorised simulator")
    bar = _announce(inputs, least, budget) if progress else tqdm(disable=True)
    with bar, closing(Workers(executor, time_limit)) as workers:
        simulate = Simulator(simulator, inputs.names, vectorised, workers, count, file, bar)
        statistics = [*objectives, *(limit.statistic for limit in constraints)]

        def requested_places() -> list[int]:
            return sorted({place_of(statistic, simulate.responses) for statistic in statistics})

        fit = fit_adaptively(
            inputs.axes,
            lambda cube: simulate(inputs.values(cube)),
            accuracy,
            budget,
            random_state,
            lambda fit: (
                not negative_somewhere(inputs, fit, positive_places(positive, simulate.responses))
            ),
            batch,
            lambda fit: largest_error(fit, requested_places())[0],
        )
        _refuse_untrusted(inputs, fit, accuracy, simulate, positive, requested_places())
    if file:
        file.finish()
    responses = simulate.responses
    problem = SimulatorProblem(inputs, fit, responses, objectives, constraints, fit.n_runs)
    _warn_of_failures(problem)
    if not fit.confirmed:
        _warn_of_budget(fit, responses, requested_places())
    return problem


def _refuse_untrusted(
    inputs: Inputs,
    fit: AdaptiveFit,
    accuracy: float,
    simulate: Simulator,
    positive: Sequence[str] | bool,
    places: Sequence[int],
) -> None:
    responses = simulate.responses
    unsure = inaccurate(inputs, fit, accuracy, responses, places)
    if unsure and (cause := random(inputs, fit, accuracy, responses, simulate.again)):
        raise cause
    refusal = (
        failing(inputs, fit)
        or unsure
        or negative_somewhere(inputs, fit, positive_places(positive, responses))
    )
    if refusal:
        raise UntrustedSurrogate(*refusal)


def _warn_of_budget(fit: AdaptiveFit, responses: tuple[str, ...], places: Sequence[int]) -> None:
    error, _, place = largest_error(fit, places)
    message = (
        f"the budget of {fit.n_runs} runs is used up: the error of {responses[place]!r} is "
        f"{error:.2g} of its scatter, no more than asked for, but not confirmed: {IN_A_ROW} checks "
        f"in a row have to find that, and at most {LOOSEST:g}"
    )
    warnings.warn(message, RuntimeWarning, stacklevel=3)


def _announce(inputs: Inputs, least: int, budget: int) -> tqdm:
    megabytes = max(1, round(8e-6 * budget * (_NUMBERS_PER_TERM + 20 * len(inputs.axes))))
    tqdm.write(
        f"robust_problem: {len(inputs.axes)} inputs, {least} to {budget} runs, at most"
        f" {megabytes} MB; called where "
        + ", ".join(f"{n} is {low:.4g} to {high:.4g}" for n, (low, high) in inputs.reach().items()),
        file=sys.stderr,
    )
    return tqdm(total=budget, desc="runs", unit="run", mininterval=1.0)


def _share(field: str, given: Any) -> float:
    """Return a share above 0 and below 1; whoever means per cent is told how to write them."""
    share = real_number(field, given, above=0.0)
    if share >= 1.0:
        allowed = f"above 0 and below 1, a share: {share / 100.0:g} for {share:g} %"
        raise InvalidInput(field, given, allowed)
    return share


def _check_signature(simulator: Callable[..., Any], names: Sequence[str]) -> None:
    """Refuse a simulator that cannot be called with these inputs, as far as it tells."""
    if not callable(simulator):
        raise InvalidInput("simulator", simulator, "a function of the designs and the noise")
    try:
        # What a decorator wraps is not what is called.
        signature = inspect.signature(simulator, follow_wrapped=False)
    except (TypeError, ValueError):
        return
    parameters = signature.parameters.values()
    named = [
        parameter
        for parameter in parameters
        if parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
    ]
    optional = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    takes = {parameter.name for parameter in named}
    anything = any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters)
    surplus = [] if anything else [name for name in names if name not in takes]
    missing = [
        parameter.name
        for parameter in parameters
        if parameter.default is parameter.empty
        and parameter.kind not in optional
        and parameter.name not in names
    ]
    if surplus or missing:
        reasons = [f"it takes no {', '.join(surplus)}"] if surplus else []
        reasons += [f"it needs {', '.join(missing)}"] if missing else []
        allowed = f"those of designs and noise ({', '.join(names)}); {' and '.join(reasons)}"
        raise InvalidInput("arguments of the simulator", str(signature), allowed)


def _check_statistics(
    objectives: Sequence[Statistic], constraints: Sequence[RobustConstraint]
) -> None:
    for field, given, kind in (
        ("objectives", objectives, Statistic),
        ("constraints", constraints, RobustConstraint),
    ):
        allowed = f"a list of {kind.__name__}s"
        if not isinstance(given, Sequence):
            raise InvalidInput(field, given, allowed + _hint(field, given))
        for place, entry in enumerate(given):
            if not isinstance(entry, kind):
                raise InvalidInput(
                    f"{field}[{place}]", entry, f"a {kind.__name__}{_hint(field, entry)}"
                )
    if not objectives:
        raise InvalidInput("objectives", objectives, "one or more")


def _hint(field: str, given: Any) -> str:
    """Return what was probably meant, as the end of a sentence."""
    if field == "constraints" and isinstance(given, Statistic):
        name = type(given).__name__
        return f", as {name}(...) <= bound or {name}(...) >= bound make it"
    if field == "objectives" and isinstance(given, RobustConstraint):
        return "; a statistic with a bound belongs into constraints"
    return ""


def _warn_of_failures(problem: SimulatorProblem) -> None:
    if not len(problem.failed):
        return
    rows = [
        ", ".join(f"{n} = {v:.6g}" for n, v in zip(problem.input_names, row, strict=True))
        for row in problem.failed[:5]
    ]
    ending = "" if len(problem.failed) <= len(rows) else ", .."
    message = f"{len(problem.failed)} runs failed and are left out: {'; '.join(rows)}{ending}"
    warnings.warn(message, RuntimeWarning, stacklevel=3)
