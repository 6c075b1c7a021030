"""Checks on what users pass in: every error names the field, the value and what is allowed."""

from __future__ import annotations

import math
import numbers
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_SHOWN = 200
"""Largest number of characters shown of a field or value; a damaged file may hold a million."""


class InvalidInput(ValueError):
    """A value that a user supplied is not allowed; the message names it and what is allowed.

    Attributes
    ----------
    field : str
        Name of the argument or field.
    value : Any
        The value supplied.
    allowed : str
        Description of the allowed values.
    """

    def __init__(self, field: str, value: Any, allowed: str) -> None:
        super().__init__(f"{_short(field)} is {_short(_shown(value))}, allowed: {allowed}")
        self.field = field
        self.value = value
        self.allowed = allowed

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.field, self.value, self.allowed)


class SeveralComplaints(InvalidInput):
    """Several values are not allowed; the message has each of them in a line of its own.

    Field, value and what is allowed are those of the first.

    Attributes
    ----------
    complaints : tuple of InvalidInput
        At least two.
    """

    def __init__(self, complaints: Sequence[InvalidInput]) -> None:
        first_complaint = complaints[0]
        super().__init__(first_complaint.field, first_complaint.value, first_complaint.allowed)
        self.args = ("\n".join(str(complaint) for complaint in complaints),)
        self.complaints = tuple(complaints)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.complaints,)


class Complaints:
    """Collects what is not allowed, so that all of it can be raised at once.

    Examples
    --------
    >>> complaints = Complaints()
    >>> with complaints.noted():
    ...     real_number("speed", "fast")
    >>> with complaints.noted():
    ...     real_number("load", "heavy")
    >>> complaints.finish()
    Traceback (most recent call last):
        ...
    pymoo_hdte.checks.SeveralComplaints: speed is 'fast', allowed: a finite number
    load is 'heavy', allowed: a finite number
    """

    def __init__(self) -> None:
        self._noted: list[InvalidInput] = []

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Keep an `InvalidInput` that leaves the block for later."""
        try:
            yield
        except SeveralComplaints as several:
            self._noted += several.complaints
        except InvalidInput as error:
            self._noted.append(error)

    def finish(self) -> None:
        """Raise what was noted: as it was if it is one, as `SeveralComplaints` if there are more.

        Raises
        ------
        InvalidInput
            If anything was noted.
        """
        if len(self._noted) > 1:
            raise SeveralComplaints(self._noted)
        if self._noted:
            raise self._noted[0]


def complaints_of(error: InvalidInput) -> tuple[InvalidInput, ...]:
    """Return each complaint of an error, itself if it is one."""
    return error.complaints if isinstance(error, SeveralComplaints) else (error,)


def _shown(value: Any) -> str:
    try:
        return repr(value).replace("\n", " ")
    except (RecursionError, ValueError):
        # Nested too deeply, or a whole number of more digits than Python prints.
        return f"a {type(value).__name__} too large to print"


def _short(text: str) -> str:
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}... ({len(text)} characters)"


def whole_number(field: str, value: Any, at_least: int) -> int:
    """Return ``value`` as an ``int`` that is no less than ``at_least``, or raise `InvalidInput`."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Integral):
        raise InvalidInput(field, value, f"a whole number of at least {at_least}")
    if value < at_least:
        raise InvalidInput(field, int(value), f"a whole number of at least {at_least}")
    return int(value)


def real_number(
    field: str,
    value: Any,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    at_most: float = math.inf,
) -> float:
    """Return ``value`` as a finite ``float`` within the limits, or raise `InvalidInput`."""
    limits = [
        f"{word} {limit:g}"
        for word, limit in (
            ("above", above),
            ("at least", at_least),
            ("below", below),
            ("at most", at_most),
        )
        if math.isfinite(limit)
    ]
    allowed = " ".join(["a finite number", " and ".join(limits)]).strip()
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise InvalidInput(field, value, allowed)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    inside = above < number < below and at_least <= number <= at_most
    if not math.isfinite(number) or not inside:
        raise InvalidInput(field, number, allowed)
    return number


def one_of(field: str, value: Any, allowed: Collection[str]) -> str:
    """Return ``value`` if it is one of the ``allowed`` words, or raise `InvalidInput`."""
    if not isinstance(value, str) or value not in allowed:
        raise InvalidInput(field, value, "one of " + ", ".join(repr(word) for word in allowed))
    return value


def finite_array(
    field: str, value: ArrayLike, shape: tuple[int | None, ...]
) -> NDArray[np.float64]:
    """Return ``value`` as a new, finite float array of the given shape, or raise `InvalidInput`.

    ``None`` in ``shape`` stands for any length.
    """
    wanted = "(" + ", ".join("n" if size is None else str(size) for size in shape) + ")"
    try:
        # Words and truth values would be turned into numbers.
        if np.asarray(value).dtype.kind not in "iufO":
            raise TypeError
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput(field, value, f"real numbers of shape {wanted}") from None
    fits = array.ndim == len(shape) and all(
        size is None or size == actual for size, actual in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise InvalidInput(f"shape of {field}", array.shape, wanted)
    if not np.all(np.isfinite(array)):
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidInput(f"{field}[{', '.join(map(str, where))}]", float(array[where]), "finite")
    return array
