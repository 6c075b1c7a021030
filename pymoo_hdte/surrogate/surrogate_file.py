"""The file of a surrogate: what its header holds, and that this fits the coefficients."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, real_number, whole_number
from pymoo_hdte.storage import FileFormat
from pymoo_hdte.surrogate.box import Box

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
        If they are too large for a file (`pymoo_hdte.storage`).
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
        As `FileFormat.read`; if the box is none, or the orders are not those of the coefficients.
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
