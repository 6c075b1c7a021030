"""Distributions as words and numbers for a file, and back.

chaospy's own text of a distribution names its class and arguments; it is read as data, and nothing
but classes of distributions is ever called. A distribution that does not come back to the last bit
cannot be written.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

import numpy as np

# Its statistics load when they are first used.
import scipy

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.problems._simulator.kinds_of_noise import Interval, Scenarios
from pymoo_hdte.surrogate.inputs import TruncatedNormal

_TESTED = 64
"""Quantiles that have to come back to the last bit."""
_KINDS = ("chaospy", "scipy", "truncated_normal", "scenarios", "interval")


def joint_distribution(field: str, given: Any, count: int) -> Any:
    """Return a joint distribution as one of `chaospy`.

    Parameters
    ----------
    field : str
        Name of the distribution in an error.
    given : object
        A joint distribution of `chaospy`, or a frozen ``multivariate_normal`` of `scipy.stats`.
    count : int
        Number of its variables.

    Raises
    ------
    InvalidInput
        If it is none of these, has another number of variables or a discrete one, or its parts
        cannot be drawn one after the other.
    """
    allowed = f"a joint distribution of chaospy of {count} continuous variables"
    try:
        given = _as_chaospy(given)
    except Exception as error:  # chaospy wants more of a covariance than scipy.
        raise InvalidInput(field, given, f"{allowed} ({error})") from error
    if isinstance(given, type) or not hasattr(given, "inv") or len(given) != count:
        raise InvalidInput(field, given, allowed)
    if np.any(given.interpret_as_integer):
        raise InvalidInput(field, given, allowed)
    try:
        medians = np.asarray(given.inv(np.full((count, 1), 0.5)))
    except Exception as error:
        raise InvalidInput(field, given, f"{allowed} ({error})") from error
    if not np.all(np.isfinite(medians)):
        raise InvalidInput(field, given, allowed + " with finite medians")
    return given


def _as_chaospy(given: Any) -> Any:
    """Return a dependent normal distribution of `scipy.stats` as one of `chaospy`, others as is."""
    # Of other distributions the covariance is no array but a method, or there is none.
    if not all(isinstance(getattr(given, name, None), np.ndarray) for name in ("mean", "cov")):
        return given
    import chaospy  # Takes longer to load than a study without dependent noise.

    return chaospy.MvNormal(given.mean, given.cov)


def described(field: str, given: Any) -> dict[str, Any]:
    """Return a distribution as words and numbers.

    Parameters
    ----------
    field : str
        Name of the distribution in an error.
    given : object
        A distribution of `chaospy`, of several variables too, a frozen one of `scipy.stats`, a
        `TruncatedNormal`, `Scenarios` or an `Interval`.

    Raises
    ------
    InvalidInput
        If its words and numbers do not make the same distribution: one of a user's own class, one
        that was fitted to data, or a dependent one whose parts share a variable.
    """
    allowed = "a distribution that its class and numbers make anew: others cannot be saved"
    try:
        description: dict[str, Any]
        if isinstance(given, Scenarios):
            return {"scenarios": [list(given.values), list(given.weights)]}
        if isinstance(given, Interval):
            return {"interval": [given.lower, given.upper]}
        given = _as_chaospy(given)
        if isinstance(given, TruncatedNormal):
            description = {"truncated_normal": [given.mean, given.std, given.cut]}
        elif hasattr(given, "kwds"):
            numbers = [_number(number) for number in given.args]
            named = {name: _number(number) for name, number in given.kwds.items()}
            description = {"scipy": [given.dist.name, numbers, named]}
        else:
            description = {"chaospy": repr(given)}
        again = rebuilt(field, description)
        same = np.array_equal(_quantiles(given), _quantiles(again))
    except Exception:  # Libraries raise anything for what they cannot ask.
        same = False
    if not same:
        raise InvalidInput(field, given, allowed)
    return description


def rebuilt(field: str, described: Any) -> Any:
    """Return the distribution of a description that `described` made.

    Raises
    ------
    InvalidInput
        If it is none of these, or no distribution has such numbers.
    """
    wanted = f"one of {', '.join(_KINDS)} with the numbers of a distribution"
    if not isinstance(described, dict) or len(described) != 1:
        raise InvalidInput(field, described, wanted)
    ((kind, value),) = described.items()
    # Libraries raise anything for numbers that do not fit.
    try:
        if kind == "chaospy":
            return _of_chaospy(value)
        if kind == "scipy":
            name, numbers, named = value
            return _of_scipy(name)(*map(_number, numbers), **_table(named))
        if kind == "truncated_normal":
            return TruncatedNormal(*value)
        if kind == "scenarios":
            return Scenarios(*value)
        if kind == "interval":
            return Interval(*value)
    except Exception as error:
        raise InvalidInput(field, described, f"{wanted} ({error})") from error
    raise InvalidInput(field, described, wanted)


def _number(value: Any) -> float | int:
    return value if isinstance(value, int) else real_number("argument of a distribution", value)


def _table(named: dict[str, Any]) -> dict[str, float | int]:
    return {name: _number(value) for name, value in named.items()}


def _of_scipy(name: str) -> Callable[..., Any]:
    distribution = getattr(scipy.stats, name, None)
    if not isinstance(distribution, scipy.stats.rv_continuous):
        raise ValueError(f"{name!r} is no continuous distribution of scipy.stats")
    return distribution


def _of_chaospy(text: str) -> Any:
    distribution = _value(ast.parse(text, mode="eval").body)
    if not hasattr(distribution, "inv"):
        raise ValueError(f"{text!r} is no distribution of chaospy")
    return distribution


def _value(node: ast.expr) -> Any:
    """Return what a part of chaospy's text stands for: a number, a list or a distribution."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        arguments = [_value(argument) for argument in node.args]
        named = {str(keyword.arg): _value(keyword.value) for keyword in node.keywords}
        return _class(node.func.id)(*arguments, **named)
    if isinstance(node, ast.List | ast.Tuple):
        return [_value(element) for element in node.elts]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_value(node.operand)
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return node.value
    raise ValueError(f"{ast.unparse(node)[:50]!r} is no number, list or distribution")


def _class(name: str) -> Callable[..., Any]:
    import chaospy  # Takes longer to load than a study without a file.

    kind = getattr(chaospy, name, None)
    if not (isinstance(kind, type) and issubclass(kind, chaospy.Distribution)):
        raise ValueError(f"{name!r} is no distribution of chaospy")
    return kind


def _quantiles(distribution: Any) -> np.ndarray:
    """Return some quantiles, of dependent variables at independent probabilities."""
    if isinstance(distribution, TruncatedNormal):
        return np.array([distribution.mean, distribution.std, distribution.cut])
    random_state = np.random.default_rng(0)
    if hasattr(distribution, "inv"):
        return np.asarray(distribution.inv(random_state.random((len(distribution), _TESTED))))
    return np.asarray(distribution.ppf(random_state.random(_TESTED)))
