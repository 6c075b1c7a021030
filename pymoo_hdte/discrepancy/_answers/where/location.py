"""Where the model is wrong, on the map channel x order x speed x load, and where it is right.

A cell's misfit is weighted by the marginal covariance of the cell, so that it does not spread to
others, and computed with base parameters that the misfit did not bias: those of the model with its
named effects, refitted to the cells that it explains. The believed model has these parameters, each
within its tolerance: where one was freed, it stands at the end of its tolerance. A cell is flagged
if the named effects, or the freed parameters, change it by more than the noise, or if the model
with them still misses it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from pymoo_hdte.discrepancy._answers.where.map import (
    Flags,
    Location,
    Values,
    WithinNoise,
    benjamini_hochberg,
)
from pymoo_hdte.discrepancy._answers.where.where import sentences
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS
from pymoo_hdte.discrepancy._evidence.order_lines.objective import LOST, Objective
from pymoo_hdte.discrepancy._evidence.order_lines.observations import (
    as_lines,
    cell_chi_square,
    cell_degrees_of_freedom,
    cell_noise,
)
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.hypothesis import adequate
from pymoo_hdte.discrepancy._selection.levenberg_marquardt import moved
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.drive import DriveEffect
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

__all__ = ["Location", "locate", "refit_clean"]

# Settings of the robust fit; finer ones give the same result. What is flagged is in `Rules`.
_LINEARISATIONS = 2
_ROUNDS = 15
"""Most rounds of reweighting for one linearisation."""
_EVALUATIONS = 10
"""Most evaluations of the residuals once the weights are fixed."""
_SETTLED = 0.05
"""Relative change of all weights that ends the rounds."""
_CAUCHY = 4.0
"""Square of the scale of Cauchy's weights, in variances."""
_LEFT_OUT = 1e8
"""Factor on the variance of a cell that is left out of a fit."""


def locate(finding: DriveFinding) -> Location:
    """Return the map of the misfit with its sentences.

    Parameters
    ----------
    finding : DriveFinding
        Of `analysis.examine_drive`.
    """
    data = finding.data
    clean = refit_clean(data, finding.verdict.accepted)
    complete = data.predict(clean.values[None, : len(data.base)], clean.effects)[0]
    believed = within_tolerance(data, clean.values)
    without = data.predict(believed[None], ())[0]
    degrees_of_freedom = cell_degrees_of_freedom(data)
    chi_square = cell_chi_square(data, data.features.values - without)
    moved = cell_chi_square(data, complete - without)
    residual = cell_chi_square(data, data.features.values - complete)
    sweep = _sweep_p_value(data, believed, ())
    conditions = data.features.conditions
    location = Location(
        records=tuple(record.name for record in data.features.records),
        speed_rpm=conditions.input_speed / REVOLUTION_PER_MINUTE,
        load_torque=conditions.output_torque,
        orders=np.concatenate([[0.0], data.features.orders]),
        misfit=as_lines(data, data.features.values - without),
        change=as_lines(data, complete - without),
        noise=cell_noise(data),
        chi_square=chi_square,
        p_value=chi2.sf(chi_square, degrees_of_freedom),
        moved=moved,
        flagged=(moved > degrees_of_freedom)
        | _significant(residual, degrees_of_freedom, data.rules),
        within_noise=groups_within_noise(data, data.features.values - without),
        sweep_p_value=sweep,
        sweep_flagged=_wrong(sweep, data.rules),
        named=bool(clean.candidates),
        rules=data.rules,
    )
    sentence, trusted = sentences(location, data, finding.unexpected)
    return replace(location, sentence=sentence, trusted=trusted)


def within_tolerance(data: Data, values: Values) -> Values:
    """Return the base parameters of a fit, shape (n_base,), each within its tolerance.

    A fit may have freed some of them, which are then no longer those of the believed model.
    """
    layout = Layout(data.base)
    return np.clip(values[: len(data.base)], layout.array("lower"), layout.array("upper"))


def groups_within_noise(data: Data, difference: Values) -> WithinNoise:
    """Return which channels, orders and records a model meets within the noise.

    By the criterion for an adequate model, and with the covariance of the cells of a group.

    Parameters
    ----------
    data : Data
    difference : ndarray, shape (r, f)
        Measured minus predicted features.
    """
    places = [data.features.places(channel) for channel in range(len(CHANNELS))]
    means = [[MEANS.index(channel)] if channel in MEANS else [] for channel in range(len(CHANNELS))]
    channels = [np.array([*mean, *pair.ravel()]) for mean, pair in zip(means, places, strict=True)]
    lines = np.concatenate(places, axis=1)
    orders = [np.array([place for mean in means for place in mean]), *lines]
    every = _group(data, difference, np.arange(difference.shape[1]))

    def meets(chi_square: float, degrees_of_freedom: int) -> bool:
        return chi_square <= adequate(degrees_of_freedom, data.rules) * degrees_of_freedom

    def together(groups: list[NDArray[np.int_]]) -> Flags:
        sums = [_group(data, difference, group).sum() for group in groups]
        return np.array(
            [meets(s, len(difference) * len(g)) for s, g in zip(sums, groups, strict=True)]
        )

    records = np.array([meets(chi_square, difference.shape[1]) for chi_square in every])
    return WithinNoise(together(channels), together(orders), records)


def _group(data: Data, difference: Values, places: NDArray[np.int_]) -> Values:
    """Return the chi-square of some features, with their covariance, in each record; (r,)."""
    part = difference[:, places, None]
    solved = np.linalg.solve(data.covariance[:, places[:, None], places], part)
    return np.asarray(np.sum(part * solved, axis=(1, 2)))


def refit_clean(data: Data, fitted: Fit) -> Fit:
    """Refit a model within its bounds to the cells that it does not contradict.

    First with the weights of Cauchy's distribution, because a fit spreads a misfit over all cells,
    so that clean ones look wrong; then without the cells that are still wrong. A torsion sweep that
    contradicts the running records is left out too. The robust fit begins at the fitted values and
    at sensors without error if it left one beyond its stated limit, since a fit takes a misfit for
    a zero or a gain where it can.

    Parameters
    ----------
    data : Data
    fitted : Fit
        Its effects are kept; returned unchanged if it contradicts no cell.
    """
    degrees_of_freedom, rules = cell_degrees_of_freedom(data), data.rules
    chi_square, sweep = _misfit(data, fitted)
    if not (_significant(chi_square, degrees_of_freedom, rules).any() or _wrong(sweep, rules)):
        return fitted
    stated, priors = _with_sensors_as_stated(data, fitted)
    begins = [fitted.values, *([stated] if np.abs(priors).max() > 1.0 else [])]
    fits = [_robust(data, replace(fitted, values=values)) for values in begins]
    fitted = min(fits, key=lambda candidate_fit: _robust_loss(data, candidate_fit))
    values = fitted.values
    chi_square, sweep = _misfit(data, fitted)
    factor = np.where(_significant(chi_square, degrees_of_freedom, rules), _LEFT_OUT, 1.0)
    weakened = _weakened(data, factor, _wrong(sweep, rules))
    return fit(weakened, fitted.candidates, values, _EVALUATIONS)


def _with_sensors_as_stated(data: Data, fitted: Fit) -> tuple[Values, Values]:
    """Return values with gains and zeros of the torque sensors where their prior has them.

    With them, how far the fit left these, in units of their stated limits.
    """
    layout = Layout(data.base)
    prior, start = layout.array("prior"), layout.array("start")
    bounded = np.flatnonzero(np.isfinite(prior))
    stated = fitted.values.copy()
    stated[bounded] = start[bounded]
    return stated, ((fitted.values[: len(prior)] - start) / prior)[bounded]


def _robust(data: Data, fitted: Fit) -> Fit:
    for _ in range(_LINEARISATIONS):
        fitted = replace(fitted, values=_robust_step(data, fitted))
    return fitted


def _robust_loss(data: Data, fitted: Fit) -> float:
    """Return Cauchy's loss of all cells, with the squares of the priors."""
    scale = _CAUCHY * cell_degrees_of_freedom(data)
    chi_square, _ = _misfit(data, fitted)
    priors = Objective(data, fitted.candidates).priors(fitted.values)
    return float(np.nansum(scale * np.log1p(chi_square / scale)) + priors @ priors)


def _robust_step(data: Data, fitted: Fit) -> Values:
    """Return the values that minimise Cauchy's loss of the linearised model.

    Weights are renewed after every solution of the bounded linear problem until they settle.
    """
    degrees_of_freedom = cell_degrees_of_freedom(data)
    _, sweep = _misfit(data, fitted)
    used = replace(data, torsion=()) if _wrong(sweep, data.rules) else data
    objective = Objective(used, fitted.candidates)
    difference, others = objective.differences(fitted.values)
    slopes, others_slopes = objective.derivatives(fitted.values)
    lower = (objective.lower - fitted.values) / objective.scale
    upper = (objective.upper - fitted.values) / objective.scale
    step, factor = (
        np.zeros(len(lower)),
        np.full((len(difference), *degrees_of_freedom.shape), np.inf),
    )
    for _ in range(_ROUNDS):
        missed = difference + np.tensordot(step, slopes, 1)
        before, factor = (
            factor,
            1.0 + cell_chi_square(data, missed) / (_CAUCHY * degrees_of_freedom),
        )
        if np.allclose(before, factor, rtol=_SETTLED, atol=0.0, equal_nan=True):
            break
        # What is not compared weakens nothing.
        weakened = _weakened(data, np.where(np.isfinite(factor), factor, 1.0), False)
        matrix = np.concatenate([weakened.whiten(slopes), others_slopes], axis=1).T
        right = -np.concatenate([weakened.whiten(difference), others])
        # Values at a bound may exceed it by rounding.
        step = lsq_linear(matrix, right, (np.minimum(lower, 0.0), np.maximum(upper, 0.0))).x
    return moved(objective, fitted.values, step)


def _misfit(data: Data, fitted: Fit) -> tuple[Values, float | None]:
    """Return the chi-square of all cells and the p-value of the sweep."""
    predicted = data.predict(fitted.values[None, : len(data.base)], fitted.effects)[0]
    chi_square = cell_chi_square(data, data.features.values - predicted)
    return chi_square, _sweep_p_value(data, fitted.values, fitted.effects)


def _significant(chi_square: Values, degrees_of_freedom: Values, rules: Rules) -> Flags:
    return benjamini_hochberg(chi2.sf(chi_square, degrees_of_freedom), rules.false_discovery_rate)


def _wrong(sweep: float | None, rules: Rules) -> bool:
    return sweep is not None and sweep < rules.false_discovery_rate


def _weakened(data: Data, factor: Values, without_sweep: bool) -> Data:
    """Return the data with the variances of cells (r, 4, 1 + m) multiplied by a factor."""
    features = data.features
    by_feature = np.ones_like(features.values)
    for channel in range(len(CHANNELS)):
        if channel in MEANS:
            by_feature[:, channel] = factor[:, channel, 0]
        for part in features.places(channel).T:
            by_feature[:, part] = factor[:, channel, 1:]
    covariance = features.covariance.copy()
    diagonal = np.arange(features.values.shape[1])
    # Added to the whole covariance, that of the repeatability included, not to the sensors' alone.
    variance = np.diagonal(data.covariance, axis1=1, axis2=2)
    covariance[:, diagonal, diagonal] += (by_feature - 1.0) * variance
    weakened = replace(features, covariance=covariance)
    return replace(data, features=weakened, torsion=() if without_sweep else data.torsion)


def _sweep_p_value(data: Data, values: Values, effects: tuple[DriveEffect, ...]) -> float | None:
    """Return the chance of a larger misfit of the torsion sweeps; None where there is none."""
    residuals = data.torsion_residuals(values[None, : len(data.base)], effects)[0]
    if not residuals.size:
        return None
    known = np.nan_to_num(residuals, nan=LOST)
    return float(chi2.sf(known @ known, known.size))
