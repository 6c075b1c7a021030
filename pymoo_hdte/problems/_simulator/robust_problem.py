"""Robust design of anyone's simulator: from a function to a pymoo problem."""

from __future__ import annotations

import inspect
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from pymoo_hdte.checks import InvalidInput, one_of, real_number, whole_number
from pymoo_hdte.problems._simulator.crashes import CrashProbability
from pymoo_hdte.problems._simulator.data import read_data
from pymoo_hdte.problems._simulator.inputs import Design, Inputs
from pymoo_hdte.problems._simulator.problem import SimulatorProblem
from pymoo_hdte.problems._simulator.replicates import SEED, Replicates
from pymoo_hdte.problems._simulator.requested import least_tail, places_of
from pymoo_hdte.problems._simulator.runs import Simulator, no_simulator, opened
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
    unresolved,
)
from pymoo_hdte.surrogate._sparse.adaptive import (
    IN_A_ROW,
    AdaptiveFit,
    fit_adaptively,
    least_runs,
)
from pymoo_hdte.surrogate.trust import UntrustedSurrogate

Array = NDArray[np.float64]

_NUMBERS_PER_TERM = 4096 + 2048
"""Values of a term at common samples, and in arrays for the designs of a block."""


ACCEPTED = ("accurate", "best")


def robust_problem(
    simulator: Callable[..., Any] | None,
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
    accept: str = "accurate",
    data: tuple[Any, Any] | None = None,
    replicates: int | None = None,
    surrogate: str = "polynomial",
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
    simulator : callable or None
        Takes all designs and all noise by name; returns a number, a mapping of names to numbers, or
        a sequence. None where ``data`` is all there is.
    designs : mapping of str to Design
        Design variables with their bounds and scatter.
    noise : mapping, optional
        From a name to its distribution (of `chaospy`, or a frozen one of `scipy.stats`, with a
        variance, continuous or of whole numbers), to `Scenarios` or to an `Interval`; or from a
        tuple of names to a joint one of `chaospy` or `Scenarios`. Together with the designs at most
        20 inputs.
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
        How often a run is made that raises or gives NaN, before it counts as failed. Where a
        vectorised simulator raises, its runs are made one by one.
    time_limit : float, optional
        Seconds after which a run is ended and has failed, imports not counted; it then has a
        process of its own beside the worker, and may crash there.
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
    accept : {"accurate", "best"}
        ``"best"`` returns the problem even where the surrogate is not as accurate as asked for, or
        a positive response becomes negative; its ``trusted`` then is False, ``refusal`` says
        why, and its band is as wide as its errors are.
    data : tuple of array_like or of tables, optional
        Runs in hand, which the budget does not count: inputs X, shape (n, d), in the order of
        designs and noise, and responses Y, shape (n,) or (n, r), NaN where a run failed; or both as
        mappings or data frames of columns by name. ``runs`` of a problem or of a refusal fits.
        One of them is made again, to see whether they are this simulator's.
    replicates : int, optional
        Runs at each point of a random simulator, 2 or more; each counts in the budget. A simulator
        that takes an argument ``seed``, which is no design and no noise, is given a whole number
        there and has 2 by default. What it scatters by itself is part of standard deviations and,
        as a normal deviation, of quantiles and probabilities; a `WorstCase` is that of the mean.
        A point at which one of its runs fails has failed.
    surrogate : {"polynomial", "auto"}
        A polynomial of the response, or of its logarithm or logit where that predicts runs left out
        better: it takes fewer runs for responses over decades. With ``"auto"``, a normal process
        (needs scikit-learn, extra ``process``) is tried, too: it takes fewer runs for kinks, and
        seconds more of computing; its stated errors have been held against true ones less often.

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
        becomes negative, or runs around some design are likelier to fail than to succeed and no
        `CrashProbability` is asked for; tells where. It holds all ``runs``
        and the ``problem`` on the surrogate that is refused.
    SimulatorFailed
        If every run so far failed.

    Warns
    -----
    RuntimeWarning
        If runs failed; their inputs are in ``failed`` of the result, whose statistics are those of
        the runs that succeed. If the budget is spent before
        an error that is small enough was confirmed. If ``accept="best"`` accepts what is refused
        otherwise.

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
    _check_statistics(objectives, constraints)
    one_of("surrogate", surrogate, ("auto", "polynomial"))
    inputs = Inputs(designs, {} if noise is None else noise, least_tail(objectives, constraints))
    accuracy = _share("accuracy", accuracy)
    one_of("accept", accept, ACCEPTED)
    least = least_runs(len(inputs.axes))
    given = None if data is None else read_data(data, inputs)
    takes_seed = _takes_seed(simulator, inputs.names, replicates)
    if takes_seed is not None:
        replicates = whole_number("replicates", 2 if replicates is None else replicates, 2)
    each, names = replicates or 1, (*inputs.names, *([SEED] if takes_seed is not None else []))
    least = max(0, each * least - (0 if given is None else len(given.points)))
    if simulator is None and given is not None and not least:
        simulator, vectorised, budget, cache = no_simulator, False, 0, None
    else:
        budget = whole_number("budget", budget, least)
    batch = whole_number("at_once", at_once, 1)
    random_state = np.random.default_rng(whole_number("seed", seed, 0))

    def bar() -> tqdm:
        return _announce(inputs, least, budget) if progress else tqdm(disable=True)

    making = vectorised, executor, tries, time_limit, cache, bar, takes_seed
    with opened(simulator, names, *making) as simulate:
        at_points: Callable[[Array], Array] = simulate
        in_hand = None if given is None else (given.points, given.values)
        if given is not None:
            simulate.check_data(inputs.values(given.points), given.values, given.responses)
        repeated = None if takes_seed is None else Replicates(simulate, each, seed)
        if repeated is not None:
            at_points = repeated
            if given is not None:
                repeated.keep(inputs.values(given.points), given.values)
                in_hand = repeated.grouped(given)
        statistics = [*objectives, *(limit.statistic for limit in constraints)]

        def requested_places() -> list[int]:
            return _places(statistics, simulate.responses)

        fit = fit_adaptively(
            inputs.axes,
            lambda cube: at_points(inputs.values(cube)),
            accuracy,
            budget // each,
            random_state,
            lambda fit: (
                not negative_somewhere(inputs, fit, positive_places(positive, simulate.responses))
            ),
            -(-batch // each),
            lambda fit: largest_error(fit, requested_places())[0],
            in_hand,
            repeated is not None,
            surrogate == "auto",
        )
        refusal = _refusal(inputs, fit, accuracy, simulate, positive, (objectives, constraints))
        responses = simulate.responses
        runs = None if repeated is None else repeated.runs
        n_runs = fit.n_runs if runs is None else len(runs.X)
        parts = inputs, fit, responses, objectives, constraints, n_runs
        problem = SimulatorProblem(*parts, str(refusal) if refusal else None, runs)
        if refusal is not None and accept == "accurate":
            refusal.problem, refusal.runs = problem, problem.runs
            raise refusal
    _warn_of_failures(problem)
    if refusal:
        warnings.warn(f"accepted as the best there is: {refusal}", RuntimeWarning, stacklevel=2)
    elif not fit.confirmed:
        _warn_of_budget(fit, responses, requested_places())
    return problem


def _places(statistics: Sequence[Statistic], responses: tuple[str, ...]) -> list[int]:
    """Return the positions of the responses that statistics belong to; all if they name none."""
    named = {place for statistic in statistics for place in places_of(statistic, responses)}
    return sorted(named) or list(range(len(responses)))


def _refusal(
    inputs: Inputs,
    fit: AdaptiveFit,
    accuracy: float,
    simulate: Simulator,
    positive: Sequence[str] | bool,
    requested: tuple[Sequence[Statistic], Sequence[RobustConstraint]],
) -> UntrustedSurrogate | None:
    """Return why the surrogate is not what was asked for, or None."""
    objectives, constraints = requested
    statistics = [*objectives, *(limit.statistic for limit in constraints)]
    # Of a probability as an objective, the band tells what is resolved.
    rarest = [entry.rarest() for entry in objectives if entry.relative_to_scatter]
    rarest += [limit.rarest for limit in constraints]
    responses = simulate.responses
    places = _places(statistics, responses)
    limited = any(isinstance(statistic, CrashProbability) for statistic in statistics)
    unsure = inaccurate(inputs, fit, accuracy, responses, places)
    reason = (
        (unsure and fit.own is None and random(inputs, fit, accuracy, responses, simulate.again))
        or (None if limited else failing(inputs, fit))
        or unresolved(fit, min(rarest, default=0.5))
        or unsure
        or negative_somewhere(inputs, fit, positive_places(positive, responses))
    )
    return UntrustedSurrogate(*reason) if reason else None


def _warn_of_budget(fit: AdaptiveFit, responses: tuple[str, ...], places: Sequence[int]) -> None:
    error, _, place = largest_error(fit, places)
    message = (
        f"the budget of {fit.n_runs} runs is used up: the error of {responses[place]!r} is "
        f"{error:.2g} of its scatter, no more than asked for, but that is not confirmed by "
        f"{IN_A_ROW} checks in a row"
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


def _takes_seed(
    simulator: Callable[..., Any] | None, names: Sequence[str], replicates: int | None
) -> bool | None:
    """Return whether a random simulator takes a seed; None for one that is not random."""
    if SEED in names or simulator is None:
        takes = False
    else:
        try:
            parameters = inspect.signature(simulator, follow_wrapped=False).parameters
        except (TypeError, ValueError):
            parameters = {}  # type: ignore[assignment]
        parameter = parameters.get(SEED)
        # One with a default is a random simulator whose seed was fixed, unless runs are repeated.
        takes = parameter is not None and (parameter.default is parameter.empty or bool(replicates))
    return takes if takes or replicates is not None else None


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
    message = (
        f"{len(problem.failed)} of {problem.n_runs} runs failed: {'; '.join(rows)}{ending}. "
        "Statistics are those of the runs that succeed; CrashProbability tells how often they fail"
    )
    warnings.warn(message, RuntimeWarning, stacklevel=3)
