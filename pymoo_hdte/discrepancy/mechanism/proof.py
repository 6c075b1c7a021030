"""Validation on records that were not fitted: gaps of motion and forces before and after.

A simulation with the measured inputs, or with the references where a loop is closed, shows the
quality of the model's predictions; the force balances show its error at each moment, without the
drift that an open loop accumulates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.engine.fitting import Fit
from pymoo_hdte.discrepancy.engine.rules import RULES
from pymoo_hdte.discrepancy.mechanism.analysis import MechanismFinding, root_mean_square
from pymoo_hdte.discrepancy.mechanism.evidence import measured_data
from pymoo_hdte.discrepancy.mechanism.rest import fitted_values
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.records import FINER
from pymoo_hdte.mechanism.simulation import simulate_mechanism

Values = NDArray[np.float64]

_FEWEST = 5
_QUARTER = 0.25
"""Share of a period of the cutoff in which a motion is nearly a parabola."""


@dataclass(frozen=True, eq=False)
class MeasuredGap:
    """Root mean squares of measured minus predicted.

    Attributes
    ----------
    record : str
    quantity : str
        A coordinate that was simulated, or a force balance.
    kind : str
        ``simulation`` or ``balance``.
    before, after : float
        Of the fitted base and of the revised model, SI; nan where the model diverges.
    noise_floor : float
        Of the sensors.
    time, measured : ndarray, shape (n,)
        s and SI; zero for a balance.
    predicted_before, predicted_after : ndarray, shape (n,)
        Predictions of the models; minus their residual for a balance.
    least_share : float
        Least excess of a gap over the noise floor, as a share of it, for a shrinkage to be stated.
    """

    record: str
    quantity: str
    kind: str
    before: float
    after: float
    noise_floor: float
    time: Values
    measured: Values
    predicted_before: Values
    predicted_after: Values
    least_share: float = RULES.least_gap_share

    @property
    def shrinkage(self) -> float | None:
        """1 - (after - floor) / (before - floor), or None where there was no gap to shrink."""
        excess = self.before - self.noise_floor
        if not excess > self.least_share * self.noise_floor:
            return None
        return min(1.0 - (self.after - self.noise_floor) / excess, 1.0)

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
            "unit": "SI",
        }


def prove_measured(finding: MechanismFinding) -> tuple[MeasuredGap, ...]:
    """Return the gaps on the held-out records; none where none was held out.

    Where nothing is named, before and after are equal.
    """
    held_out = [record for record in finding.records if record.role == "held_out"]
    found: list[MeasuredGap] = []
    for record in held_out:
        found += _simulated(finding, record)
        found += _balanced(finding, record)
    return tuple(found)


def fitted_mechanism(mechanism: Mechanism, fitted: Fit) -> Mechanism:
    """Return a mechanism with the values of a fit, as known ones."""
    return mechanism.with_values(fitted_values(mechanism, fitted))


def _simulated(finding: MechanismFinding, record: Record) -> list[MeasuredGap]:
    base, accepted = finding.verdict.base, finding.accepted
    before_all = _positions(finding, record, base)
    after_all = before_all if accepted is base else _positions(finding, record, accepted)
    found = []
    for name in finding.mechanism.coordinates:
        measured = record.channels[name]
        before, after = before_all[name], after_all[name]
        found.append(
            MeasuredGap(
                record.name,
                name,
                "simulation",
                _size(measured - before),
                _size(measured - after),
                record.noise_of(name),
                record.time,
                measured,
                before,
                after,
                finding.data.rules.least_gap_share,
            )
        )
    return found


def _positions(finding: MechanismFinding, record: Record, fitted: Fit) -> dict[str, Values]:
    """Return the simulated positions at the samples of a record, nan where a model diverges."""
    mechanism = fitted_mechanism(finding.mechanism, fitted)
    # A ripple beyond the band moves nothing that could be measured, and takes a solver many steps.
    effects = (*finding.believed, *laws_of(fitted.effects))
    try:
        start = {name: _start(record, name, finding.cutoff) for name in mechanism.coordinates}
        fine = simulate_mechanism(mechanism, record.finer(FINER), effects, start=start).position
        return {name: one[::FINER] for name, one in fine.items()}
    except ArithmeticError:
        lost = np.full(len(record.time), np.nan)
        return {name: lost for name in mechanism.coordinates}


def _start(record: Record, name: str, cutoff: float) -> tuple[float, float]:
    """Return position and speed at the first sample, of a parabola through the first ones."""
    count = max(_FEWEST, int(_QUARTER / (cutoff * record.step)))
    time = record.time[:count] - record.time[0]
    curve = Polynomial.fit(time, record.channels[name][:count], 2)
    return float(curve(0.0)), float(curve.deriv()(0.0))


def _balanced(finding: MechanismFinding, record: Record) -> list[MeasuredGap]:
    data = measured_data(finding.mechanism, [record], finding.cutoff, finding.data.known)
    n_base = len(data.base)
    (balance,) = data.spectra
    residual = []
    for one in (finding.verdict.base, finding.accepted):
        whitened = data.residuals(one.values[:n_base], laws_of(one.effects))
        residual.append((root_mean_square(data, whitened), data.coefficients(whitened)[0]))
    floor = root_mean_square(data, np.ones(len(data.frequency)))
    return [
        MeasuredGap(
            record.name,
            name,
            "balance",
            float(residual[0][0][place]),
            float(residual[1][0][place]),
            float(floor[place]),
            balance.time,
            np.zeros(len(balance.time)),
            -balance.in_time(residual[0][1][place]),
            -balance.in_time(residual[1][1][place]),
            finding.data.rules.least_gap_share,
        )
        for place, name in enumerate(data.names)
    ]


def laws_of(effects: Sequence[Any]) -> tuple[LawAt, ...]:
    """Return the effects of a fit, which are laws at ports in a mechanism."""
    return tuple(effects)


def _size(difference: Values) -> float:
    return float(np.sqrt(np.mean(difference**2)))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
