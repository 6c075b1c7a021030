"""The Chebyshev surrogate: a tensor polynomial that approximates a costly function on a box."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte._io.archive import FileFormat
from pymoo_hdte.checks import InvalidInput, finite_array, real_number, whole_number
from pymoo_hdte.surrogate.box import LARGEST, Box
from pymoo_hdte.surrogate.tensor import TensorPolynomial, chebyshev_nodes, coefficients_from_nodes


class ChebyshevSurrogate:
    """Tensor Chebyshev polynomial on a box (Section 2.3 of the paper, Eqs. 14-25). Immutable.

    Parameters
    ----------
    box : Box
        The d variables and their intervals.
    coefficients : array_like, shape (p_1, ..., p_d)
        Entry ``i`` multiplies T_i1 ... T_id of the variables mapped to [-1, 1]. The factor
        (1/2)^h of Eq. (23), the coefficients, is already in them. In the output's unit.
    provenance : mapping, optional
        What made the surrogate, e.g. the model and its parameters; must be writable as JSON.

    Attributes
    ----------
    polynomial : TensorPolynomial
        The same on the cube [-1, 1]^d.

    Raises
    ------
    InvalidInput
        If the coefficients are not finite or beyond +-1e150, have another number of axes than the
        box has variables, or an axis is empty; or if the provenance is no JSON.

    Examples
    --------
    >>> box = Box(("x", "y"), np.array([0.0, 0.0]), np.array([1.0, 2.0]))
    >>> surrogate = ChebyshevSurrogate.fit(lambda X: X[:, 0] ** 2 + X[:, 1], box, 3)
    >>> np.round(surrogate(np.array([[0.5, 1.0]])), 12)
    array([1.25])
    """

    def __init__(
        self, box: Box, coefficients: ArrayLike, provenance: Mapping[str, Any] | None = None
    ) -> None:
        array = finite_array("coefficients", coefficients, (None,) * len(box))
        if array.size == 0:
            raise InvalidInput("shape of coefficients", array.shape, "at least 1 on every axis")
        largest = float(np.abs(array).max())
        if largest > LARGEST:
            raise InvalidInput("largest coefficient", largest, f"at most {LARGEST:g}")
        self.box = box
        self.polynomial = TensorPolynomial(array[None])
        self._derivatives = self.polynomial.derivatives(range(len(box)))
        self._provenance = _as_json(provenance)

    @classmethod
    def fit(
        cls,
        function: Callable[[NDArray[np.float64]], ArrayLike],
        box: Box,
        order: int,
        provenance: Mapping[str, Any] | None = None,
    ) -> ChebyshevSurrogate:
        """Interpolate ``function`` at Chebyshev nodes (Eq. 20) by the sums of Eqs. (23) and (24).

        Parameters
        ----------
        function : callable
            Maps points of shape (n, d) in the box's units to n finite values. Called once, with
            all (order + 1)^d nodes; the last variable runs fastest.
        box : Box
            Where the surrogate shall hold.
        order : int
            Highest degree k in each variable, at least 1.
        provenance : mapping, optional
            As in the constructor.

        Returns
        -------
        ChebyshevSurrogate

        Raises
        ------
        InvalidInput
            If the order is below 1, or the function returns another shape or a value that is
            not finite.
        """
        size = whole_number("order", order, 1) + 1
        grid = np.meshgrid(*[chebyshev_nodes(size)] * len(box), indexing="ij")
        nodes = box.from_cube(np.stack(grid, axis=-1).reshape(-1, len(box)))
        values = finite_array("values of the function", function(nodes), (size ** len(box),))
        return cls(box, coefficients_from_nodes(values.reshape((size,) * len(box))), provenance)

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """Read-only coefficients, shape (p_1, ..., p_d), in the output's unit."""
        return self.polynomial.coefficients[0]

    @property
    def orders(self) -> tuple[int, ...]:
        """Highest degree in each of the d variables."""
        return tuple(size - 1 for size in self.coefficients.shape)

    @property
    def provenance(self) -> dict[str, Any]:
        """What made the surrogate, as a copy that may be changed freely."""
        return json.loads(self._provenance)

    def __call__(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the values of the surrogate.

        Parameters
        ----------
        points : array_like, shape (n, d)
            In the box's units.

        Returns
        -------
        ndarray, shape (n,)
            In the output's unit.

        Raises
        ------
        ExtrapolationError
            If a point lies outside the box.
        InvalidInput
            If ``points`` is no array of numbers of shape (n, d).
        """
        return self.polynomial(self.box.to_cube(points).T)[0]

    def gradient(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the gradient, shape (n, d), in the output's unit per unit of each variable.

        Parameters and errors as in `__call__`.
        """
        return self._derivatives(self.box.to_cube(points).T).T / self.box.half_width

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the surrogate to ``path``, replacing it in one step (``docs/file_format.md``).

        Raises
        ------
        InvalidInput
            If it is too large for a file: more than half a million coefficients.
        OSError
            If the file cannot be written.
        """
        write_surrogate(path, self.box, self.coefficients, self.provenance)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ChebyshevSurrogate:
        """Read a surrogate that `save` wrote.

        Parameters
        ----------
        path : str or path-like
            The file.

        Returns
        -------
        ChebyshevSurrogate

        Raises
        ------
        InvalidInput
            If the file is damaged, incomplete, of another format or of a later version.
        OSError
            If the file cannot be read.
        """
        return cls(*read_surrogate(path))


def _as_json(provenance: Mapping[str, Any] | None) -> str:
    if provenance is not None and not isinstance(provenance, Mapping):
        raise InvalidInput("provenance", provenance, "a mapping")
    try:
        return json.dumps(dict(provenance or {}), allow_nan=False)
    except (TypeError, ValueError):
        raise InvalidInput("provenance", provenance, "words, numbers, lists and mappings") from None


FORMAT = FileFormat(
    "pymoo_hdte Chebyshev surrogate",
    version=1,
    fields=("names", "lower", "upper", "orders", "provenance"),
    arrays=("coefficients",),
)


def write_surrogate(
    path: str | os.PathLike[str],
    box: Box,
    coefficients: NDArray[np.float64],
    provenance: dict[str, Any],
) -> None:
    """Write the parts of a surrogate, replacing the file in one step.

    Raises
    ------
    InvalidInput
        If they are too large for a file (`pymoo_hdte._io.archive`).
    OSError
        If the file cannot be written.
    """
    header = {
        "names": box.names,
        "lower": box.lower.tolist(),
        "upper": box.upper.tolist(),
        "orders": [size - 1 for size in coefficients.shape],
        "provenance": provenance,
    }
    FORMAT.write(path, header, coefficients=coefficients)


def read_surrogate(path: str | os.PathLike[str]) -> tuple[Box, NDArray[np.float64], dict[str, Any]]:
    """Return box, coefficients and provenance of a file that `write_surrogate` made.

    Raises
    ------
    InvalidInput
        As `FileFormat.read`; if the box is not valid or the orders do not fit the coefficients.
    OSError
        If the file cannot be read.
    """
    header, arrays = FORMAT.read(path)
    orders = [
        whole_number(f"orders[{axis}]", order, 0)
        for axis, order in enumerate(_listed("orders", header["orders"]))
    ]
    actual = [size - 1 for size in arrays["coefficients"].shape]
    box = Box(header["names"], _numbers("lower", header), _numbers("upper", header))
    if len(actual) == len(box) and actual != orders:
        raise InvalidInput("orders of the coefficients", actual, f"as stated: {orders}")
    if not isinstance(header["provenance"], dict):
        raise InvalidInput("provenance", header["provenance"], "a table")
    return box, arrays["coefficients"], header["provenance"]


def _numbers(field: str, header: dict[str, Any]) -> NDArray[np.float64]:
    values = _listed(field, header[field])
    return np.array([real_number(f"{field}[{i}]", value) for i, value in enumerate(values)])


def _listed(field: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise InvalidInput(field, value, "a list of numbers")
    return value
