"""Records of a machine of any kind, and what its model predicts of them, as evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.own_machine import ModelEvidence
from pymoo_hdte.discrepancy._selection.candidate import Candidate, out_of_tolerance
from pymoo_hdte.discrepancy._selection.excess import Excess
from pymoo_hdte.discrepancy._selection.fitting import Fit, Response, Unknowns, Vector, built
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.mechanism import LawAt

_LOST = 1e3
"""Whitened residual where a model has no finite prediction, which a fit leaves again."""


@dataclass(frozen=True, eq=False)
class PredictedRecords:
    """Records beside the predictions of a user's model, in the form of `fitting.Evidence`.

    Attributes
    ----------
    model : ModelEvidence
    held_out : PredictedRecords or None
        Records kept out of the fit.
    rules : Rules
        Thresholds of the verdict.

    Raises
    ------
    InvalidInput
        If there are no residuals at the start of the base, or some are not finite.
    """

    model: ModelEvidence
    held_out: PredictedRecords | None = None
    rules: Rules = RULES

    def __post_init__(self) -> None:
        # A model of a user is judged here, before a fit meets what is none.
        assert self._layout

    @property
    def base(self) -> tuple[Parameter, ...]:
        """Unknowns of the model without effects."""
        return tuple(self.model.base)

    @property
    def evident(self) -> frozenset[str]:
        """Return no names: no effect shows by itself."""
        return frozenset()

    def objective(self, candidates: Sequence[Candidate]) -> PredictionObjective:
        """Return the whitened residuals with candidates, and their derivatives."""
        return PredictionObjective(self, candidates)

    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""
        base = fitted.values[: len(self.base)]
        before = self.whitened(base, fitted.effects)
        priors = np.zeros(len(fitted.residuals) - len(before))

        def change(added: Sequence[Any]) -> Vector:
            after = self.whitened(base, (*fitted.effects, *added))
            return np.concatenate([after - before, priors])

        return change

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return the indices of the residuals of each channel."""
        return [np.flatnonzero(self.layout[1] == part) for part in range(len(self.parts))]

    def excess(self, fitted: Fit) -> Excess:
        """Return the excess chi-square of a fit by record and channel."""
        record, part = self.layout
        chi_square, degrees_of_freedom = np.zeros((2, record.max() + 1, len(self.parts)))
        np.add.at(chi_square, (record, part), fitted.residuals[: len(record)] ** 2)
        np.add.at(degrees_of_freedom, (record, part), 1.0)
        return Excess(chi_square - degrees_of_freedom, degrees_of_freedom)

    def out_of_tolerance(self, at_bounds: Sequence[str], together: bool = False) -> list[Candidate]:
        """Return a candidate for each unknown of the base that a fit left at a bound."""
        names = [parameter.name for parameter in self.base]
        return [out_of_tolerance(name, name) for name in at_bounds if name in names]

    def left_by(self, fitted: Fit) -> Vector:
        """Return the whitened residuals of these records, (n,), by a fit of any records."""
        return self.whitened(fitted.values[: len(self.base)], fitted.effects)

    def whitened(self, base: Vector, effects: Sequence[LawAt]) -> Vector:
        """Return all whitened residuals, shape (n,), record by record and channel by channel."""
        names = [parameter.name for parameter in self.base]
        values = dict(zip(names, base.tolist(), strict=True))
        found = [
            np.asarray(channels[part], dtype=float)
            for channels in self.model.residuals(values, tuple(effects))
            for part in channels
        ]
        return np.nan_to_num(np.concatenate(found), nan=_LOST, posinf=_LOST, neginf=-_LOST)

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the channels."""
        return self._layout[0]

    @property
    def layout(self) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
        """Record and channel of each residual, both of shape (n,)."""
        return self._layout[1:]

    @cached_property
    def _layout(self) -> tuple[tuple[str, ...], NDArray[np.int_], NDArray[np.int_]]:
        start = {parameter.name: parameter.start for parameter in self.base}
        by_record = self.model.residuals(start, ())
        parts = tuple(dict.fromkeys(part for channels in by_record for part in channels))
        if not parts:
            raise InvalidInput("residuals", by_record, "one channel or more for each record")
        places = []
        for record, channels in enumerate(by_record):
            for part, values in channels.items():
                row = np.asarray(values, dtype=float)
                if row.ndim != 1 or not np.all(np.isfinite(row)):
                    allowed = "finite numbers of shape (n,) at the start of the base"
                    raise InvalidInput(f"residuals of {part} in record {record}", values, allowed)
                places += [(record, parts.index(part))] * len(row)
        record_of, part_of = np.array(places).T
        return parts, record_of, part_of


class PredictionObjective(Unknowns):
    """Whitened residuals of a model with candidates, those of priors last."""

    def __init__(self, data: PredictedRecords, candidates: Sequence[Candidate]) -> None:
        super().__init__(data.base, candidates)
        self.data = data

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n_parameters,)."""
        n_base = len(self.data.base)
        effects = [part for parts in built(self.candidates, values[n_base:]) for part in parts]
        return np.concatenate([self.data.whitened(values[:n_base], effects), self.priors(values)])

    def jacobian(self, values: Vector) -> NDArray[np.float64]:
        """Return derivatives (n_residuals, n_parameters) in units of the parameters' scale."""
        here, steps = self.residuals(values), self.steps(values)
        moved = values + np.diag(steps * self.scale)
        changes = [self.residuals(vector) - here for vector in moved]
        return np.array(changes).T / steps
