"""The unexplained residual of a mechanism, relative to which effects are named.

No model of a real machine fits down to the noise of its sensors. The residual of the best model,
with at most as many effects as a verdict names, counts as noise.
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


def with_unexplained_residual(
    sensors: MeasuredData, base: Fit, candidates_for: Callable[[Fit], list[Candidate]]
) -> tuple[MeasuredData, list[Candidate], Hypothesis | None]:
    """Return the data with the residual of the best effects as the noise, and all candidates.

    The best effects depend on the noise; after a few rounds they no longer change. The hypothesis
    with them comes last, fitted to the data of the last round but one; it is None where the base is
    adequate.

    Parameters
    ----------
    sensors : MeasuredData
        Data with the noise of the sensors.
    base : Fit
        Fit of these data without effects.
    candidates_for : callable
        Returns the candidates for the residual of a fit. Orders beside a much larger load or
        friction only show in the residual of the best effects of the first round.
    """
    rules, degrees_of_freedom = sensors.rules, len(base.residuals) - len(base.values)
    candidates = candidates_for(base)
    if down_to_noise(base, degrees_of_freedom, rules):
        return sensors, candidates, None
    data, hypothesis = sensors.with_residual_as_noise(base.residuals), None
    for turn in range(rules.rest_rounds):
        hypothesis = _best_hypothesis(data, candidates)
        best = replace(
            hypothesis.fit, residuals=in_units_of(sensors, data, hypothesis.fit.residuals)
        )
        data = sensors.with_residual_as_noise(best.residuals)
        if turn == 0:
            labels = {candidate.label for candidate in candidates}
            candidates += [
                candidate for candidate in candidates_for(best) if candidate.label not in labels
            ]
    return data, candidates, hypothesis


def _best_hypothesis(data: MeasuredData, candidates: Sequence[Candidate]) -> Hypothesis:
    """Return the best model with up to as many effects as a verdict has, by BIC."""
    candidates = [candidate for candidate in candidates if not candidate.instead_of]
    base, rules = fit(data), data.rules
    excess = base.chi_square - (len(base.residuals) - len(base.values))
    shortlisted = varied(screen(data, base, candidates), rules.most_of_one_name)
    level = fit_all(data, base, shortlisted[: rules.most_fitted], excess)
    hypotheses = [hypothesis_of(base, excess), *level]
    n_extended = rules.rest_seconds
    for _ in range(1, rules.most_effects):
        extended = []
        for hypothesis in level[:n_extended]:
            compatible = [
                candidate
                for candidate in candidates
                if all(candidate.goes_with(member) for member in hypothesis.candidates)
            ]
            added = varied(screen(data, hypothesis.fit, compatible), 1)
            extended += fit_all(data, hypothesis.fit, added[: rules.rest_seconds], excess)
        level = sorted(extended, key=lambda hypothesis: hypothesis.bic)
        hypotheses += level
        # Of larger sets only the best is extended, since others mostly hold the same effects.
        n_extended = 1
    return min(hypotheses, key=lambda hypothesis: hypothesis.bic)


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
    """Return whitened residuals of the given data in units of the deviation of the wanted data."""
    ratio = [
        (numerator / denominator)[balance.kept]
        for numerator, denominator, balance in zip(
            given.deviation, wanted.deviation, wanted.spectra, strict=True
        )
    ]
    return residuals * np.concatenate(ratio)


def root_mean_square(data: MeasuredData, residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the root mean square of each balance, N or N.m, for whitened residuals (n,)."""
    samples = sum(balance.moving.count for balance in data.spectra)
    return np.sqrt(data.power(residuals) / samples)


def port_forces(data: MeasuredData, residuals: NDArray[np.float64]) -> dict[str, float]:
    """Return the size of the force that may be missing at each port, N or N.m.

    It is the largest with which one of the port's coordinates may leave whitened residuals (n,).
    """
    rms = dict(zip(data.names, root_mean_square(data, residuals).tolist(), strict=True))
    return {
        port.name: rms[port.name]
        if port.read
        else max(rms[name] / abs(share) for name, share in port.motion.items() if share)
        for port in data.mechanism.ports
    }


def fitted_values(mechanism: Mechanism, fitted: Fit) -> dict[str, float]:
    """Return the fitted quantities of the mechanism, SI, by name."""
    return {
        parameter.name: float(value)
        for parameter, value in zip(fitted.parameters, fitted.values, strict=True)
        if parameter.name in mechanism.quantities
    }
