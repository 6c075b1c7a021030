"""Stored fronts: reading, writing, and matching a front to its problem.

`experiments/studies/fronts` computes them: `reference_front.py` those of surrogates,
`direct_front.py` that of the drive model. A file is a CSV with one header comment that holds the
settings of the problem as JSON; a front is only used for a problem of the same settings.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files
from io import StringIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

_FOLDER = files("pymoo_hdte.problems") / "data"


@dataclass(frozen=True)
class ReferenceFront:
    """The true Pareto front of a surrogate, or of the drive model, and its set, row for row.

    Fronts of two objectives are sorted by the first.

    Attributes
    ----------
    front : ndarray, shape (n, n_obj)
    designs : ndarray, shape (n, n_var)
    """

    front: NDArray[np.float64]
    designs: NDArray[np.float64]


class StoredFront:
    """Mixin for a pymoo problem, the true front of which is stored.

    Parameters
    ----------
    variant : str
        Short name of the problem, under which its front is stored.
    settings : dict
        What determines that front, JSON-able.
    """

    n_obj: int

    def __init__(self, variant: str, settings: dict[str, Any]) -> None:
        self.variant = variant
        self._settings = settings

    @property
    def settings(self) -> dict[str, Any]:
        """What determines the stored front, JSON-able: model, surrogate, scatter, search box."""
        return dict(self._settings)

    def name(self) -> str:
        """Return the name that pymoo shows, with the variant."""
        return f"{type(self).__name__}({self.variant})"

    def _reference(self) -> ReferenceFront | None:
        return load_reference(self.variant, self.settings, self.n_obj)

    def _calc_pareto_front(self) -> NDArray[np.float64] | None:
        """Return the stored front, shape (n, n_obj), or None if none is stored."""
        reference = self._reference()
        return None if reference is None else reference.front

    def _calc_pareto_set(self) -> NDArray[np.float64] | None:
        """Return the designs of `pareto_front`, row for row, shape (n, n_var), or None."""
        reference = self._reference()
        return None if reference is None else reference.designs


def load_reference(name: str, settings: dict[str, Any], n_obj: int = 2) -> ReferenceFront | None:
    """Return the stored front of that name, or None if there is none for these settings."""
    file = _FOLDER / f"front_{name}.csv"
    if not file.is_file():
        return None
    header, _, rows = file.read_text(encoding="utf-8").partition("\n")
    if json.loads(header.removeprefix("# ")) != _normalised(settings):
        return None
    table = np.loadtxt(StringIO(rows), delimiter=",", skiprows=1, ndmin=2)
    return ReferenceFront(table[:, :n_obj], table[:, n_obj:])


def format_reference(
    reference: ReferenceFront, settings: dict[str, Any], columns: tuple[str, ...]
) -> str:
    """Return the text of the file that `load_reference` reads; numbers round-trip exactly."""
    lines = ["# " + json.dumps(_normalised(settings), sort_keys=True), ",".join(columns)]
    table = np.column_stack([reference.front, reference.designs])
    lines += [",".join(repr(float(value)) for value in row) for row in table]
    return "\n".join(lines) + "\n"


def _normalised(settings: dict[str, Any]) -> dict[str, Any]:
    """Return the settings after a round trip through JSON, to compare them with stored ones."""
    return json.loads(json.dumps(settings))
