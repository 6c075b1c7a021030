"""Simpler tools than the workflow on the same campaigns: a rule and a sparse regression.

Each answers with the name of one effect, "adequate" or "unlisted". Both tools begin where the
workflow does, with its order lines, their covariance and the base model fitted to them.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pysindy.optimizers import STLSQ
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from experiments.studies.blind.candidate_terms import terms
from experiments.studies.blind.torque_balances import Regression, regression
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.objective import LOST
from pymoo_hdte.discrepancy._evidence.order_lines.observations import (
    as_lines,
    cell_chi_square,
    cell_degrees_of_freedom,
)
from pymoo_hdte.discrepancy._records.believed import MECHANICAL
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.effects.unknowns import Parameter

FALSE_ALARMS = 0.01
"""Chance that noise alone moves the largest of all cells, or the best of all terms, so far."""
LEAST_SHARE = 0.5
"""Share of the excess chi-square that the regression must explain to name anything."""
EFFECTS_IN_BASE = ("damping", "load_inertia")
"""Base parameters that are effects of the list where they lie beyond their tolerance."""
_THRESHOLDS = 30

Values = NDArray[np.float64]


def largest_residual_rule(analysis: DriveFinding) -> str:
    """Name the effect by the cell in which the base model is most wrong.

    A cell is a mean or an order line of a channel in all records together, the torsion sweeps, or
    the zero of the input torque; a table, such as an engineer would use, gives an effect for each.
    "adequate" if no cell is beyond what the largest of so many would be by chance (Bonferroni).

    Parameters
    ----------
    analysis : DriveFinding
        Of which the data and the base fit are used.
    """
    data, values = analysis.data, _base_values(analysis)
    difference = data.features.values - data.predict(values[None], ())[0]
    by_record = cell_chi_square(data, difference)
    degrees_of_freedom = np.where(np.isnan(by_record), np.nan, cell_degrees_of_freedom(data)).sum(
        axis=0
    )
    sweep = np.nan_to_num(data.torsion_residuals(values[None], ())[0], nan=LOST)
    place = Layout(data.base).index("input_torque_zero")
    zero = (values[place] - data.base[place].start) / data.base[place].prior
    total = np.append(by_record.sum(axis=0), [sweep @ sweep, zero**2])
    degrees_of_freedom = np.append(degrees_of_freedom, [sweep.size, 1.0])
    known = np.isfinite(total) & (degrees_of_freedom > 0.0)
    significant = known & (chi2.sf(total, degrees_of_freedom) < FALSE_ALARMS / known.sum())
    if not significant.any():
        return "adequate"
    size = np.full(total.shape, -np.inf)
    expected = degrees_of_freedom[significant]
    size[significant] = (total[significant] - expected) / np.sqrt(2.0 * expected)
    worst = int(np.argmax(size))
    if worst == len(size) - 1:
        return "coulomb_friction"
    if worst == len(size) - 2:
        return _named_by_sweep(data)
    channel, cell = np.unravel_index(worst, by_record.shape[1:])
    if cell == 0:
        return _named_by_mean(data, int(channel), as_lines(data, difference)[:, channel, 0].real)
    return _named_by_line(data, CHANNELS[channel], float(data.features.orders[cell - 1]))


def _named_by_line(data: Data, channel: str, order: float) -> str:
    """Return the table's entry for a line."""
    believed = data.campaign.believed
    expected = bool(np.any(np.isclose(believed.error_orders, order)))
    if channel == "output_torque":
        return "load_inertia" if expected else "unlisted"
    once = bool(np.isclose(order, 1.0 / believed.ratio))
    if channel == "transmission_error":
        table = {1.0: "clearance_variation", 2.0: "mesh_stiffness_variation"}
        return "eccentricity" if once else table.get(order, "kinematic_error")
    if once or order in (1.0, 2.0):
        return "position_dependent_friction"
    return "kinematic_reaction" if expected else "torque_ripple"


def _named_by_mean(data: Data, channel: int, misfit: Values) -> str:
    """Return the table's entry for a mean, from the condition that its misfit (r,) follows."""
    conditions = data.features.conditions
    if CHANNELS[channel] == "transmission_error":
        following = [abs(_correlation(misfit, c)) for c in (conditions.elapsed, _load(data))]
        return "thermal_drift" if following[0] > following[1] else "soft_windup"
    speed = np.abs(conditions.input_speed)
    at = speed[np.argmax(np.abs(misfit))]
    if at == speed.max():
        return "nonlinear_drag"
    return "stribeck_friction" if at < np.median(speed) else "coulomb_friction"


def _named_by_sweep(data: Data) -> str:
    """Return the table's entry for the sweeps, from the shape of the curve of torsion."""
    points = data.torsion[0]
    torque, path = points.torque, points.path
    share = torque / np.max(np.abs(torque))
    shapes = {
        "hysteresis": np.sign(path[points.intervals + 1] - path[points.intervals]),
        "backlash": np.sign(share),
        "soft_windup": np.tanh(4.0 * share),
        "hardening_stiffness": share**3,
    }

    def bent(curve: Values) -> Values:
        return curve - np.polyval(np.polyfit(torque, curve, 1), torque)

    alike = {name: abs(_correlation(bent(points.angle), bent(shapes[name]))) for name in shapes}
    return max(alike, key=lambda name: alike[name])


def _load(data: Data) -> Values:
    return data.features.conditions.output_torque


def _correlation(column: Values, other: Values) -> float:
    if np.ptp(column) == 0.0 or np.ptp(other) == 0.0:
        return 0.0
    return float(np.corrcoef(column, other)[0, 1])


def sparse_regression(analysis: DriveFinding) -> str:
    """Name the effect by sparse regression of the residual torques on candidate laws.

    Sequentially thresholded least squares (Brunton, Proctor, Kutz, PNAS 113, 2016; that of
    pysindy) on the library of `candidate_terms.terms`, of all records and sweeps together, after
    what the base parameters explain within their tolerances. The threshold is the one that
    predicts the held-out records best; a sweep, of which none is held out, counts among them.
    Among the effects that are left, the one that alone explains most is named. "adequate" if
    neither the sum of squares nor any single term is beyond chance, "unlisted" if what is left
    explains too little.

    Out of its reach: other errors of the encoder than those once or twice in a turn (taken for a
    kinematic error), where in its turn a clearance was locked, and rattle.

    Parameters
    ----------
    analysis : DriveFinding
        Of which the data, the held-out records and the base fit are used.

    Raises
    ------
    InvalidInput
        Without held-out records.
    """
    held_out = analysis.held_out
    if held_out is None:
        raise InvalidInput("held_out records", 0, "at least one, to choose the threshold by")
    data, values = analysis.data, _base_values(analysis)
    library = terms(data.campaign.believed, data.features.orders.tolist())
    train = _with_tolerances(regression(data, values, library), data.base, values)
    test = regression(replace(held_out, torsion=data.torsion), values, library)
    support = chosen_support(train, test)
    target, laws = free_of_base(train)
    degrees_of_freedom = len(train.target) - len(values)
    if not support.any():
        # Before the base parameters are let out of their bounds.
        clean = chi2.sf(train.target @ train.target, degrees_of_freedom) > FALSE_ALARMS
        return "adequate" if clean else "unlisted"
    excess = float(target @ target) - degrees_of_freedom
    positive = np.array([term.positive for term in library])
    if explained(laws[:, support], target, positive[support]) < LEAST_SHARE * excess:
        return "unlisted"
    shares: dict[str, float] = {}
    for name in dict.fromkeys(term.name for term in library):
        columns = support & np.array([term.name == name for term in library])
        shares[name] = explained(laws[:, columns], target, positive[columns])
    return max(shares, key=lambda name: shares[name])


def chosen_support(train: Regression, test: Regression) -> NDArray[np.bool_]:
    """Return which terms the threshold keeps that predicts the test records best; (q,)."""
    target, laws = free_of_base(train)
    norm = np.linalg.norm(laws, axis=0)
    known = norm > 1e-6 * np.linalg.norm(train.library, axis=0)
    laws = laws[:, known] / norm[known]
    least = np.sqrt(chi2.isf(FALSE_ALARMS / laws.shape[1], 1))
    largest = float(np.max(np.abs(laws.T @ target)))
    supports = [np.zeros(len(norm), dtype=bool)]
    if largest > least:
        for threshold in np.geomspace(least, largest, _THRESHOLDS):
            support = np.zeros(len(norm), dtype=bool)
            support[known] = stlsq_support(laws, target, float(threshold))
            supports.append(support)
    return min(supports, key=lambda one: held_out_misfit(train, test, one))


def stlsq_support(laws: Values, target: Values, threshold: float) -> NDArray[np.bool_]:
    """Return which columns of unit norm (n, q) keep a coefficient above the threshold."""
    with warnings.catch_warnings():
        # The warning of a threshold that no column passes; that is a valid answer here.
        warnings.filterwarnings("ignore", message="Sparsity parameter is too big")
        solution = STLSQ(threshold=threshold).fit(laws, target[:, None])
    return np.asarray(solution.coef_[0] != 0.0)


def held_out_misfit(train: Regression, test: Regression, support: NDArray[np.bool_]) -> float:
    """Return the mean logarithm of the reduced chi-square of the test records.

    The coefficients are those of the other records. The logarithm, as for records of unknown
    noise each, keeps one that rattles from outweighing all others.
    """
    columns = np.hstack([train.base, train.library[:, support]])
    norm = np.linalg.norm(columns, axis=0)
    scale = np.where(norm > 0.0, norm, 1.0)
    solution = np.linalg.lstsq(columns / scale, train.target, rcond=1e-10)[0] / scale
    residual = test.target - np.hstack([test.base, test.library[:, support]]) @ solution
    count = np.bincount(test.record)
    reduced = np.bincount(test.record, residual**2) / count
    return float(np.average(np.log(reduced), weights=count))


def _with_tolerances(
    measured: Regression, parameters: Sequence[Parameter], values: Values
) -> Regression:
    """Return the regression with a row for what is known of each base parameter beforehand.

    A tolerance is taken for a standard deviation; the static error and its offset are free.
    Damping and load inertia stay where the base fit left them, within their tolerance, because
    terms of the library are what lies beyond it.
    """
    free = np.array([parameter.name not in EFFECTS_IN_BASE for parameter in parameters])
    rows, target = [], []
    for place, (parameter, value) in enumerate(zip(parameters, values, strict=True)):
        known = parameter.name in (*MECHANICAL, "locked_stiffness")
        deviation = parameter.scale if known else parameter.prior
        rows.append(np.eye(len(values))[place] * parameter.scale / deviation)
        target.append((parameter.start - value) / deviation)
    beyond = np.full(len(rows), measured.record.max() + 1)
    return Regression(
        np.concatenate([measured.target, target]),
        np.vstack([measured.base, rows]) * free,
        np.vstack([measured.library, np.zeros((len(rows), measured.library.shape[1]))]),
        np.concatenate([measured.record, beyond]),
    )


def free_of_base(measured: Regression) -> tuple[Values, Values]:
    """Return target and library without what the base parameters could imitate."""
    norm = np.linalg.norm(measured.base, axis=0)
    basis = np.linalg.qr(measured.base[:, norm > 0.0] / norm[norm > 0.0])[0]
    target, library = measured.target, measured.library
    return target - basis @ (basis.T @ target), library - basis @ (basis.T @ library)


def explained(columns: Values, target: Values, positive: NDArray[np.bool_] | None = None) -> float:
    """Return the sum of squares that columns (n, k) take from the target.

    ``positive``, shape (k,), says whose coefficients cannot be negative.
    """
    if not columns.shape[1]:
        return 0.0
    # To the size of the coefficients' number, without which the bounded solver is slow.
    basis, triangle = np.linalg.qr(columns / np.linalg.norm(columns, axis=0))
    short = basis.T @ target
    if positive is None or not positive.any():
        return float(short @ short)
    solution = lsq_linear(triangle, short, (np.where(positive, 0.0, -np.inf), np.inf))
    return float(short @ short - 2.0 * solution.cost)


def _base_values(analysis: DriveFinding) -> Values:
    return analysis.verdict.base.values[: len(analysis.data.base)]
