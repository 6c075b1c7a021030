"""Runs of a simulator as data: those a user has in hand, and those a study has made."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.problems._simulator.inputs import Inputs

Array = NDArray[np.float64]

_ROUNDING = 1e-9
"""Distance beyond -1..1 that is taken for rounding: of a value printed with ten digits."""


class Runs(NamedTuple):
    """Inputs and responses of runs; `robust_problem` takes them as ``data``.

    Attributes
    ----------
    X : ndarray, shape (n, d)
        All inputs, the designs first, in their units.
    Y : ndarray, shape (n, r)
        All responses in their units, NaN where a run failed.

    Examples
    --------
    >>> problem = robust_problem(lambda x: x**2, {"x": Design(1.0, 2.0)}, progress=False)
    >>> X, Y = problem.runs
    >>> bool(np.allclose(X**2, Y))
    True
    """

    X: Array
    Y: Array


class Data(NamedTuple):
    """Runs in hand: points in -1..1, (n, d), responses, (n, r), and their names, if known."""

    points: Array
    values: Array
    responses: tuple[str, ...]


def read_data(data: Any, inputs: Inputs) -> Data:
    """Return runs in hand, those outside the reach of the inputs left out.

    Parameters
    ----------
    data : tuple
        Inputs X: an array of shape (n, d), columns in the order of ``inputs.names``, or a table of
        these by name. Responses Y: an array of shape (n,) or (n, r), or a table by name; NaN for a
        run that failed.
    inputs : Inputs

    Returns
    -------
    Data

    Raises
    ------
    InvalidInput
        If shapes or names do not fit, an input is not finite, or no run is within the reach.

    Warns
    -----
    RuntimeWarning
        If runs are left out.
    """
    if not isinstance(data, tuple | list) or len(data) != 2:
        raise InvalidInput("data", data, "a pair (X, Y) of inputs and responses")
    given_X, given_Y = data
    if _is_table(given_X):
        missing = [name for name in inputs.names if name not in given_X]
        if missing:
            raise InvalidInput("inputs in data", tuple(given_X), f"all of {inputs.names}")
        given_X = np.column_stack([np.asarray(given_X[name], float) for name in inputs.names])
    X = finite_array("X of data", given_X, (None, len(inputs.names)))
    Y, responses = _responses(given_Y, len(X))
    with np.errstate(all="ignore"):
        points = inputs.cube(X)
        inside = np.all(np.abs(points) <= 1.0 + _ROUNDING, axis=1)
    if not inside.any():
        ends = ", ".join(
            f"{n} {low:.4g} to {high:.4g}" for n, (low, high) in inputs.reach().items()
        )
        raise InvalidInput("runs of data within the reach of the inputs", 0, f"some in {ends}")
    if not inside.all():
        message = f"{np.sum(~inside)} of {len(X)} runs of data are outside the reach of the inputs"
        warnings.warn(message + " and left out", RuntimeWarning, stacklevel=4)
    return Data(np.clip(points[inside], -1.0, 1.0), Y[inside], responses)


def _is_table(given: Any) -> bool:
    """Whether it is a mapping or a data frame: columns by name."""
    return isinstance(given, Mapping) or (hasattr(given, "keys") and hasattr(given, "columns"))


def _responses(given: Any, count: int) -> tuple[Array, tuple[str, ...]]:
    names: tuple[str, ...] = ()
    if _is_table(given):
        names = tuple(given)
        given = np.column_stack([np.asarray(given[name], dtype=float) for name in names])
    try:
        Y = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput("Y of data", given, "numbers") from None
    Y = Y[:, None] if Y.ndim == 1 else Y
    if Y.ndim != 2 or len(Y) != count or not Y.shape[1]:
        raise InvalidInput("shape of Y of data", np.shape(given), f"({count},) or ({count}, r)")
    return Y, names
