"""The unexplained residual (the rest) of a mechanism, relative to which effects are named.

No model of a real machine fits down to the noise of its sensors. What the best model leaves counts
as noise, with as many effects as a verdict names at most.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    down_to_noise,
    fit_all,
    hypothesis_of,
)
from pymoo_hdte.discrepancy._selection.screening import screen, varied
from pymoo_hdte.mechanism import Mechanism


def with_rest(
    sensors: MeasuredData, base: Fit, candidates_for: Callable[[Fit], list[Candidate]]
) -> tuple[MeasuredData, list[Candidate], Hypothesis | None]:
    """Return the data with the residual of the best effects as the noise, and all candidates.

    The best effects depend on the noise; after a few rounds they no longer change. They come last,
    fitted to the data of the last round but one; None where the base is adequate.

    Parameters
    ----------
    sensors : MeasuredData
        With the noise of the sensors.
    base : Fit
        Of them, without effects.
    candidates_for : callable
        From a fit to the candidates for what it leaves. Orders beside a much larger load or
        friction are seen in what the best effects of the first round leave only.
    """
    rules, degrees_of_freedom = sensors.rules, len(base.residuals) - len(base.values)
    candidates = candidates_for(base)
    if down_to_noise(base, degrees_of_freedom, rules):
        return sensors, candidates, None
    data, found = sensors.with_rest(base.residuals), None
    for turn in range(rules.rest_rounds):
        found = _best_few(data, candidates)
        best = replace(found.fit, residuals=in_units_of(sensors, data, found.fit.residuals))
        data = sensors.with_rest(best.residuals)
        if turn == 0:
            labels = {one.label for one in candidates}
            candidates += [one for one in candidates_for(best) if one.label not in labels]
    return data, candidates, found


def _best_few(data: MeasuredData, candidates: Sequence[Candidate]) -> Hypothesis:
    """Return the best model with up to as many effects as a verdict has, by BIC."""
    candidates = [one for one in candidates if not one.instead_of]
    base, rules = fit(data), data.rules
    excess = base.chi_square - (len(base.residuals) - len(base.values))
    promising = varied(screen(data, base, candidates), rules.most_of_one_name)
    level = fit_all(data, base, promising[: rules.most_fitted], excess)
    found = [hypothesis_of(base, excess), *level]
    firsts = rules.rest_seconds
    for _ in range(1, rules.most_effects):
        grown = []
        for one in level[:firsts]:
            others = [
                more for more in candidates if all(more.goes_with(each) for each in one.candidates)
            ]
            more = varied(screen(data, one.fit, others), 1)
            grown += fit_all(data, one.fit, more[: rules.rest_seconds], excess)
        level = sorted(grown, key=lambda one: one.bic)
        found += level
        # Of several effects the best set is extended alone: others mostly hold the same ones.
        firsts = 1
    return min(found, key=lambda one: one.bic)


def share_removed(sensors: MeasuredData, data: MeasuredData, base: Fit, fitted: Fit) -> float:
    """Return the share of the power beyond the sensors' noise that a fit removes, 0 to 1.

    Each balance is in units of its residual, so that N and N.m can be added.
    """
    noise = float(np.sum((in_units_of(data, sensors, np.ones_like(base.residuals))) ** 2))
    beyond = base.chi_square - noise
    gain = base.chi_square - max(fitted.chi_square, noise)
    return float(np.clip(gain / beyond, 0.0, 1.0)) if beyond > 0.0 else 0.0


def in_units_of(
    wanted: MeasuredData, given: MeasuredData, residuals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return whitened residuals, whitened by the deviation of other data instead."""
    ratio = [
        (one / other)[balance.kept]
        for one, other, balance in zip(
            given.deviation, wanted.deviation, wanted.spectra, strict=True
        )
    ]
    return residuals * np.concatenate(ratio)


def root_mean_square(data: MeasuredData, residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the root mean square of each balance, N or N.m, for whitened residuals (n,)."""
    samples = sum(balance.moving.count for balance in data.spectra)
    return np.sqrt(data.power(residuals) / samples)


def fitted_values(mechanism: Mechanism, fitted: Fit) -> dict[str, float]:
    """Return the fitted quantities of the mechanism, SI, by name."""
    return {
        parameter.name: float(value)
        for parameter, value in zip(fitted.parameters, fitted.values, strict=True)
        if parameter.name in mechanism.quantities
    }
