"""Problems and algorithms by the names that a command line gives, those of strangers included.

A name is one of this package, one of pymoo, or ``module:name`` of a module that can be imported.
"""

from __future__ import annotations

import inspect
import pkgutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pymoo.algorithms.moo
from moocore import is_nondominated
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.util.ref_dirs import get_reference_directions

from pymoo_hdte._comparing.runs import ALGORITHMS, FINAL_SIZE, final_rows, robust_problem
from pymoo_hdte._comparing.setting import Setting
from pymoo_hdte._comparing.trace import TracingEvaluator
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte._runner.provenance import fingerprint
from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import PRESETS
from pymoo_hdte.problems import robust_benchmarks, robust_dte_family

OF_PROBLEMS, OF_ALGORITHMS = "--problems", "--algorithms"
_OF_PYMOO = "a name of this package or of pymoo, or module:name of a module that can be imported"

_OURS: dict[str, Callable[..., Any]] = {
    "ElitistSwarm": ElitistSwarm,
    # Its size follows from the evaluations spent.
    "CompactSwarm": lambda: CompactSwarm(n_result=FINAL_SIZE),
}


def check_setting(setting: Setting) -> None:
    """Refuse names that are unknown, and algorithms that cannot be made for a problem.

    Raises
    ------
    InvalidInput
        Naming the option, the name and what is allowed.
    """
    for problem in setting.problems:
        problem_named(problem)
        for algorithm in setting.algorithms:
            algorithm_named(algorithm, setting.population, problem)


@cache
def problem_named(name: str) -> Problem:
    """Return the problem of that name, built once per process.

    Raises
    ------
    InvalidInput
        If there is none, or it has fewer than two objectives or variables that are not real.
    """
    own: dict[str, Callable[[], Problem]] = {**robust_dte_family(), **robust_benchmarks()}
    if name in PRESETS:
        problem = robust_problem(name)
    elif name in own:
        problem = own[name]()
    else:
        make = _imported(OF_PROBLEMS, name) if ":" in name else lambda: get_problem(name)
        problem = make if isinstance(make, Problem) else _made(OF_PROBLEMS, name, make)
    if not isinstance(problem, Problem) or problem.n_obj < 2 or problem.vtype not in (None, float):
        allowed = "a pymoo problem of real variables and two objectives or more"
        raise InvalidInput(OF_PROBLEMS, name, allowed)
    return problem


def algorithm_named(name: str, population: int, problem: str) -> Algorithm:
    """Return a new algorithm of that name for the problem of a name.

    It is given ``pop_size``, ``archive_size`` and ``ref_dirs`` as far as its constructor names
    them, and ``pop_size`` also if it takes any keyword and no directions.

    Raises
    ------
    InvalidInput
        If there is none, or if it cannot be made from these arguments alone.
    """
    if name in ALGORITHMS:
        return ALGORITHMS[name](population, FINAL_SIZE)
    if name in _OURS:
        factory = _OURS[name]
    else:
        factory = _imported(OF_ALGORITHMS, name) if ":" in name else _pymoo_algorithm(name)
    if not callable(factory):
        raise InvalidInput(OF_ALGORITHMS, name, "a class or a function that makes an algorithm")
    n_obj = problem_named(problem).n_obj
    algorithm = _made(
        OF_ALGORITHMS, name, lambda: factory(**_arguments(factory, population, n_obj))
    )
    if not isinstance(algorithm, Algorithm):
        raise InvalidInput(OF_ALGORITHMS, name, "something that makes a pymoo Algorithm")
    return algorithm


def source_of(*names: str) -> str:
    """Identify the files behind the names of strangers: a changed file gives other runs.

    Empty for names of this package and of pymoo, which the origin of a run covers.
    """
    modules = [import_module(name.partition(":")[0]) for name in names if ":" in name]
    files = [Path(module.__file__) for module in modules if module.__file__]
    return fingerprint(*_with_neighbours(files)) if files else ""


def _with_neighbours(files: list[Path]) -> list[Path]:
    """Return the files with all others of their packages."""
    given = set(files)
    for path in files:
        if (path.parent / "__init__.py").is_file():
            given |= set(path.parent.rglob("*.py"))
    return sorted(given)


def _arguments(factory: Callable[..., Any], population: int, n_obj: int) -> dict[str, Any]:
    takes = inspect.signature(factory).parameters
    any_keyword = any(part.kind is part.VAR_KEYWORD for part in takes.values())
    arguments: dict[str, Any] = {}
    if "pop_size" in takes or (any_keyword and "ref_dirs" not in takes):
        arguments["pop_size"] = population
    if "archive_size" in takes:
        arguments["archive_size"] = FINAL_SIZE
    if "ref_dirs" in takes:
        arguments["ref_dirs"] = _directions(n_obj, population)
    return arguments


@cache
def _directions(n_obj: int, population: int) -> Any:
    """Return as many reference directions as there are individuals."""
    if n_obj == 2:
        return get_reference_directions("das-dennis", n_obj, n_partitions=population - 1)
    return get_reference_directions("energy", n_obj, population, seed=1)


def _pymoo_algorithm(name: str) -> Any:
    """Return a class of `pymoo.algorithms.moo` by its name."""
    for module in pkgutil.iter_modules(pymoo.algorithms.moo.__path__):
        try:
            algorithm_class = getattr(
                import_module(f"pymoo.algorithms.moo.{module.name}"), name, None
            )
        except ModuleNotFoundError:
            # One module of pymoo (kgb) needs scikit-learn, which pymoo does not ask for.
            continue
        if inspect.isclass(algorithm_class) and issubclass(algorithm_class, Algorithm):
            return algorithm_class
    raise InvalidInput(OF_ALGORITHMS, name, f"{', '.join((*ALGORITHMS, *_OURS))}, {_OF_PYMOO}")


def _imported(option: str, name: str) -> Any:
    module_name, _, attribute = name.partition(":")
    try:
        module = import_module(module_name)
    # A stranger's module may fail in any way, or end the process.
    except (Exception, SystemExit) as error:
        allowed = f"a module that can be imported ({type(error).__name__}: {error})"
        raise InvalidInput(option, name, allowed) from error
    if not hasattr(module, attribute):
        raise InvalidInput(option, name, f"a name in {module_name}, which has no {attribute!r}")
    return getattr(module, attribute)


def _made(option: str, name: str, make: Callable[[], Any]) -> Any:
    try:
        return make()
    # pymoo raises plain exceptions for unknown names, and a stranger's code any.
    except (Exception, SystemExit) as error:
        allowed = f"{_OF_PYMOO}, made without further arguments ({type(error).__name__}: {error})"
        raise InvalidInput(option, name, allowed) from error


SPENT = "evaluations"


@dataclass(frozen=True)
class OpenRun:
    """One algorithm, one problem, one seed and a budget, all by name.

    ``source`` identifies the files of a stranger's problem or algorithm, see `named.source_of`, so
    that a changed file is not taken for the one that made a stored run.
    """

    problem: str
    algorithm: str
    seed: int
    population: int
    evaluations: int
    source: str = ""

    @property
    def key(self) -> str:
        """All settings in one name."""
        names = f"{self.problem}_{self.algorithm}".replace(":", "..")
        budget = f"pop{self.population}_{self.evaluations}_final{FINAL_SIZE}"
        return "_".join(filter(None, (names, budget, f"seed{self.seed}", self.source)))

    def execute(self) -> Run:
        """Optimise, and reduce what is found to `FINAL_SIZE` designs in the same way for all.

        Columns are the evaluations spent, the design variables and the objectives, rows by rising
        objectives. Where nothing feasible is found, one row holds the evaluations alone.
        """
        problem = problem_named(self.problem)
        algorithm = algorithm_named(self.algorithm, self.population, self.problem)
        evaluator, budget = TracingEvaluator(), ("n_eval", self.evaluations)
        with seeded_default_rng(self.seed):
            ended = minimize(problem, algorithm, budget, seed=self.seed, evaluator=evaluator)
        spent = ended.algorithm.evaluator.n_eval
        columns = (SPENT, *(f"x{1 + i}" for i in range(problem.n_var)))
        columns += tuple(f"f{1 + i}" for i in range(problem.n_obj))
        X, F = np.empty((0, problem.n_var)), np.empty((0, problem.n_obj))
        # Without a feasible design, the optimum is the least infeasible one and F is None.
        if ended.F is not None:
            X, F = ended.opt.get("X", "F")
            sound = np.isfinite(F).all(axis=1)
            X, F = X[sound], F[sound]
        if not len(F):
            nothing = np.full((1, len(columns)), np.nan)
            nothing[0, 0] = spent
            return Run(columns, nothing, ended.exec_time, trace=evaluator.trace)
        best = is_nondominated(F, keep_weakly=True)
        X, F = X[best], F[best]
        final = final_rows(F)
        rows = np.hstack([np.full((len(final), 1), spent), X[final], F[final]])
        return Run(columns, rows, ended.exec_time, trace=evaluator.trace)


@contextmanager
def seeded_default_rng(seed: int) -> Iterator[None]:
    """Seed the generators that pymoo's MOPSO_CD and CMOPSO make without a seed.

    Both truncate their archive with ``numpy.random.default_rng(None)``, so that the same seed would
    not give the same run.
    """
    original = np.random.default_rng
    children = np.random.SeedSequence(seed)

    def seeded(given: Any = None) -> np.random.Generator:
        return original(children.spawn(1)[0] if given is None else given)

    with patch.object(np.random, "default_rng", seeded):
        yield
