"""Validation on records that were not fitted: errors of motion and forces before and after.

Simulations in windows, see `held_out`, show the quality of the model's predictions; the force
balances show its error at each moment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import root_mean_square
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import (
    Extent,
    SimulatedRecord,
    laws_of,
    simulate_held_out,
)
from pymoo_hdte.discrepancy._verdicts.prediction_error import grows
from pymoo_hdte.mechanism import Record
from pymoo_hdte.mechanism.quantity_units import unit_of

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MechanismPredictionError:
    """Root mean squares of measured minus predicted.

    Of a simulation at the samples of its windows but those at which they start.

    Attributes
    ----------
    record : str
    quantity : str
        A coordinate that was simulated, a force balance, or a gear.
    kind : str
        ``simulation``, ``balance`` or ``torsion``.
    before, after : float
        Of the fitted base and of the revised model, in ``unit``; nan where the model diverges.
    noise_floor : float
        Of the sensors.
    unit : str
        Of the position of a coordinate, or of a force; ``"SI"`` where the files do not tell it.
    time, measured : ndarray, shape (n,)
        s and ``unit``; zero for a balance.
    predicted_before, predicted_after : ndarray, shape (n,)
        Predictions of the models; minus their residual for a balance.
    expected : float
        What the revised model leaves to be expected of it, by what it leaves of the training
        records, in ``unit``.
    chance : float
        Standard deviation of the difference of the squares of the errors, if only that is left.
    rules : Rules
        Thresholds by which it shrinks or grows.
    extent : Extent or None
        How much of the record was simulated; None for a balance.
    """

    record: str
    quantity: str
    kind: str
    before: float
    after: float
    noise_floor: float
    unit: str
    time: Values
    measured: Values
    predicted_before: Values
    predicted_after: Values
    expected: float
    chance: float
    rules: Rules = RULES
    extent: Extent | None = None

    @property
    def shrinkage(self) -> float | None:
        """1 - (after - floor) / (before - floor), or None where there was no error to shrink."""
        excess = self.before - self.noise_floor
        if not excess > self.rules.least_gap_share * self.noise_floor:
            return None
        return min(1.0 - (self.after - self.noise_floor) / excess, 1.0)

    def worse(self, among: int) -> bool:
        """Tell whether the correction made it larger: see `grows`. One that diverges does not."""
        return grows(self.before, self.after, self.expected, self.chance, among, self.rules)

    @property
    def determination(self) -> tuple[float, float] | None:
        """1 - power of the error over that of the motion about its mean, before and after.

        The R2 of a simulation; None for a balance. nan where the model diverges.
        """
        if self.extent is None:
            return None
        power = float(np.var(self.measured)) or np.nan
        return 1.0 - self.before**2 / power, 1.0 - self.after**2 / power

    def as_dict(self) -> dict[str, Any]:
        """Return its numbers as plain values."""
        return {
            "record": self.record,
            "quantity": self.quantity,
            "kind": self.kind,
            "before": _finite(self.before),
            "after": _finite(self.after),
            "noise_floor": self.noise_floor,
            "shrinkage": None if self.shrinkage is None else _finite(self.shrinkage),
            "unit": self.unit,
            **self._of_simulation(),
        }

    def _of_simulation(self) -> dict[str, Any]:
        if self.extent is None or self.determination is None:
            return {}
        before, after = self.determination
        return {
            "r2_before": _finite(before),
            "r2_after": _finite(after),
            "window_s": self.extent.length,
            "windows": self.extent.windows,
            "windows_possible": self.extent.room,
        }


def validate_mechanism(
    finding: MechanismFinding, whole: bool = False
) -> tuple[MechanismPredictionError, ...]:
    """Return the errors on the held-out records; none where none was held out.

    Where nothing is named, before and after are equal.

    Parameters
    ----------
    finding : MechanismFinding
    whole : bool
        Simulate whole records without a break, which may take minutes.
    """
    simulated = finding.simulated
    if whole:
        fits = finding.verdict.base, finding.accepted
        known = finding.believed
        simulated = simulate_held_out(
            finding.mechanism, finding.records, finding.data, fits, known, whole=True
        )
    by_name = {record.record: record for record in simulated}
    errors: list[MechanismPredictionError] = []
    for record in finding.records:
        if record.role == "held_out":
            errors += _simulated(finding, by_name[record.name])
            errors += _balanced(finding, record)
    return tuple(errors)


def _simulated(
    finding: MechanismFinding, record: SimulatedRecord
) -> list[MechanismPredictionError]:
    after = record.before if finding.accepted is finding.verdict.base else record.after
    values = record.extent.windows * record.independent
    return [
        MechanismPredictionError(
            record.record,
            name,
            "simulation",
            _size(measured - record.before[name]),
            _size(measured - after[name]),
            record.noise[name],
            unit_of(finding.mechanism, name, "position"),
            record.time,
            measured,
            record.before[name],
            after[name],
            expected := (record.expected[name] + record.noise[name] ** 2) ** 0.5,
            chance_of(expected, _size(after[name] - record.before[name]), values),
            finding.data.rules,
            record.extent,
        )
        for name, measured in record.measured.items()
    ]


def _balanced(finding: MechanismFinding, record: Record) -> list[MechanismPredictionError]:
    data = measured_data(finding.mechanism, [record], finding.cutoff, finding.data.known)
    n_base = len(data.base)
    (balance,) = data.spectra
    if data.says_nothing_of(laws_of(finding.accepted.effects)):
        return []
    whitened = [
        data.residuals(fitted.values[:n_base], laws_of(fitted.effects))
        for fitted in (finding.verdict.base, finding.accepted)
    ]
    residual = [
        (root_mean_square(data, residuals), data.coefficients(residuals)[0])
        for residuals in whitened
    ]
    floor = root_mean_square(data, np.ones(len(data.frequency)))
    change = root_mean_square(data, whitened[1] - whitened[0])
    counts = [len(rows) for rows in data.rows_of_parts()]
    expected = np.maximum(finding.unexplained, floor)
    return [
        MechanismPredictionError(
            record.name,
            name,
            "balance",
            float(residual[0][0][place]),
            float(residual[1][0][place]),
            float(floor[place]),
            unit_of(finding.mechanism, name),
            balance.time,
            np.zeros(len(balance.time)),
            -balance.in_time(residual[0][1][place]),
            -balance.in_time(residual[1][1][place]),
            float(expected[place]),
            chance_of(float(expected[place]), float(change[place]), counts[place]),
            finding.data.rules,
        )
        for place, name in enumerate(data.names)
    ]


def chance_of(expected: float, change: float, values: float) -> float:
    """Return the standard deviation of the growth of a mean square error by what is expected of it.

    Parameters
    ----------
    expected, change : float
        Root mean squares of the error to be expected, and of the change of the prediction.
    values : float
        Number of independent values.
    """
    return 2.0 * expected * change / max(values, 1.0) ** 0.5


def sentences_on_rest(finding: MechanismFinding) -> list[str]:
    """Return a sentence for each training record of which rows at rest are left out."""
    return [
        f"{balance.left_out} rows of {balance.record.name} at rest are left out, because at "
        "rest dry friction may take any value up to its breakaway force. Effects that act "
        "only at or near rest, such as friction that falls at the slowest speeds, cannot be seen."
        for balance in finding.data.spectra
        if balance.left_out
    ]


def grown(errors: Sequence[MechanismPredictionError]) -> dict[str, float]:
    """Return the errors that the correction made worse: after over before."""
    worse = [error for error in errors if error.worse(among=len(errors))]
    return {
        f"{error.quantity} by {error.kind} in {error.record}": error.after
        / max(error.before, 1e-300)
        for error in worse
    }


def _size(difference: Values) -> float:
    return float(np.sqrt(np.mean(difference**2)))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
