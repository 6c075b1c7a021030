"""From records of a mechanism to a verdict: missing effects, and the unexplained residual.

The rules are those of `discrepancy.engine.verdict`. Because no model of a real machine fits down to
the noise of its sensors, they are applied relative to the unexplained residual (the rest): the
residual of the model with the two best effects. A verdict therefore names effects that are
significant beyond this residual, and states it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Fit, fit
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
    contains,
    down_to_noise,
    fit_all,
    hypothesis_of,
    varied,
)
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules
from pymoo_hdte.discrepancy.engine.screening import screen
from pymoo_hdte.discrepancy.engine.verdict import Verdict, judge
from pymoo_hdte.discrepancy.mechanism.candidates import mechanism_candidates
from pymoo_hdte.discrepancy.mechanism.evidence import MeasuredData, measured_data
from pymoo_hdte.discrepancy.mechanism.orders import position_orders
from pymoo_hdte.discrepancy.mechanism.preconditions import (
    check_sampling,
    check_scale,
    check_signals,
    fine_enough,
    usual_cutoff,
)
from pymoo_hdte.discrepancy.mechanism.ripple import NO_RIPPLES, Ripples, find_ripples
from pymoo_hdte.mechanism import LawAt, Mechanism, Record


@dataclass(frozen=True, eq=False)
class MechanismFinding:
    """The result of the analysis of measured records.

    Attributes
    ----------
    mechanism : Mechanism
        Without the effects that were to be found.
    records : tuple of Record
        All that were given, training and held out; interpolated where they were sampled less than
        ten times in a period of the cutoff.
    cutoff : float
        Hz, up to which the motion is known.
    data : MeasuredData
        Training records; their noise is the unexplained residual.
    verdict : Verdict
        What is missing: its ``status`` is ``"adequate"``, ``"named"``, ``"class"``,
        ``"parameter"`` or ``"unlisted"``.
    ripples : Ripples
        What varies with the position beyond the cutoff. With one, a verdict is never
        ``"adequate"``, but ``"named"`` without a chosen hypothesis.
    """

    mechanism: Mechanism
    records: tuple[Record, ...]
    cutoff: float
    data: MeasuredData
    verdict: Verdict
    ripples: Ripples = NO_RIPPLES

    @property
    def accepted(self) -> Fit:
        """The fit with the effects that the verdict names, or that of the base."""
        return self.verdict.accepted

    @property
    def believed(self) -> tuple[LawAt, ...]:
        """Effects that the mechanism was known to have."""
        return tuple(one for one in self.data.known if one not in self.ripples.laws)

    @property
    def sensors(self) -> MeasuredData:
        """The data with the noise of their sensors only."""
        return replace(self.data, deviation=tuple(one.noise for one in self.data.spectra))

    @property
    def share_removed(self) -> float:
        """Share of the power of the misfit beyond the sensors' noise that the effects remove.

        Dimensionless, 0 to 1.
        """
        return share_removed(self.sensors, self.data, self.verdict.base, self.accepted)

    @property
    def sensor_noise(self) -> NDArray[np.float64]:
        """Root mean square of the sensors' noise in each balance, shape (n_balances,), N or N.m."""
        return root_mean_square(self.sensors, np.ones_like(self.verdict.base.residuals))

    @property
    def base_misfit(self) -> NDArray[np.float64]:
        """Root mean square of the residual of the base in each balance.

        Shape (n_balances,), N or N.m.
        """
        return root_mean_square(self.data, self.verdict.base.residuals)

    @property
    def remainder(self) -> NDArray[np.float64]:
        """Root mean square of the residual of the accepted model in each balance.

        Shape (n_balances,), N or N.m.
        """
        return root_mean_square(self.data, self.accepted.residuals)


def examine_mechanism(
    mechanism: Mechanism,
    records: Sequence[Record],
    cutoff: float | None = None,
    known: Sequence[LawAt] = (),
    rules: Rules = RULES,
) -> MechanismFinding:
    """Return the verdict on records of a mechanism.

    By inverse dynamics, for which every coordinate has to be measured (of robots: Janot,
    Vandanjon and Gautier, IEEE Trans. Control Systems Technology 22, 2014). Candidate effects are
    compared by the Bayesian information criterion (Schwarz, Annals of Statistics 6, 1978).

    Parameters
    ----------
    mechanism : Mechanism
        Without the effects that are to be found.
    records : sequence of Record
        At least one of them of role ``train``.
    cutoff : float, optional
        Hz, up to which the motion is known; by default where it falls below its noise. At most a
        third of the sampling rate.
    known : sequence of LawAt
        Effects that the mechanism is known to have.
    rules : Rules
        Thresholds of the verdict.

    Returns
    -------
    MechanismFinding

    Raises
    ------
    InvalidInput
        If no record is to be fitted, a record, of either role, lacks a channel, is too short, is
        sampled too slowly or has no motion, two have one name, the mechanism has no port, or no
        quantity sets the scale: none is known, or the input with the known gain is only noise.
    """
    train = [record for record in records if record.role == "train"]
    if not train:
        raise InvalidInput("number of train records", 0, "at least 1")
    check_signals(mechanism, records)
    cutoff = usual_cutoff(mechanism, train, rules) if cutoff is None else cutoff
    sampled, records = records, fine_enough(records, cutoff)
    check_sampling(mechanism, records, cutoff)
    train = [record for record in records if record.role == "train"]
    sensors = measured_data(mechanism, train, cutoff, known, rules)
    check_scale(sensors)
    data, verdict = _examined(sensors)
    ripples = find_ripples(mechanism, sampled, cutoff, (*known, *verdict.accepted.effects), rules)
    if ripples.found and verdict.status == "unlisted":
        # While the port moves slowly, a ripple is within the band as well.
        again = _examined(replace(sensors, known=(*known, *ripples.laws)))
        data, verdict = (data, verdict) if again[1].status == "unlisted" else again
    if ripples.found and verdict.status == "adequate":
        verdict = replace(verdict, status="named")
    return MechanismFinding(mechanism, records, cutoff, data, verdict, ripples)


def _examined(sensors: MeasuredData) -> tuple[MeasuredData, Verdict]:
    """Return the verdict on force balances, and the data with the residual as their noise."""
    base = fit(sensors)
    candidates = _candidates(sensors, base)
    data = _with_rest(sensors, base, candidates)
    return data, _judged(sensors, data, candidates)


def _candidates(data: MeasuredData, base: Fit) -> list[Candidate]:
    residual = dict(zip(data.names, root_mean_square(data, base.residuals), strict=True))
    forces = {
        port.name: residual[port.name]
        if port.read
        else max(residual[name] / abs(share) for name, share in port.motion.items() if share)
        for port in data.mechanism.ports
    }
    return mechanism_candidates(data, forces, position_orders(data, base))


def _with_rest(sensors: MeasuredData, base: Fit, candidates: Sequence[Candidate]) -> MeasuredData:
    """Return the data with the residual of the two best effects as the noise.

    The best effects depend on the noise; after a few rounds they no longer change.
    """
    rules, degrees_of_freedom = sensors.rules, len(base.residuals) - len(base.values)
    if down_to_noise(base, degrees_of_freedom, rules):
        return sensors
    data = sensors.with_rest(base.residuals)
    for _ in range(rules.rest_rounds):
        best = _best_two(data, candidates)
        data = sensors.with_rest(_in_units_of(sensors, data, best.fit.residuals))
    return data


def _best_two(data: MeasuredData, candidates: Sequence[Candidate]) -> Hypothesis:
    """Return the best model with up to two effects, by BIC."""
    base, rules = fit(data), data.rules
    excess = base.chi_square - (len(base.residuals) - len(base.values))
    promising = varied(screen(data, base, candidates), rules.most_of_one_name)
    singles = fit_all(data, base, promising[: rules.most_fitted], excess)
    found = [hypothesis_of(base, excess), *singles]
    for single in singles[: rules.rest_seconds]:
        (first,) = single.candidates
        others = [one for one in candidates if first.goes_with(one)]
        seconds = varied(screen(data, single.fit, others), 1)
        found += fit_all(data, single.fit, seconds[: rules.rest_seconds], excess)
    return min(found, key=lambda one: one.bic)


def _judged(sensors: MeasuredData, data: MeasuredData, candidates: Sequence[Candidate]) -> Verdict:
    """Return the verdict in units of the residual, if it also holds against the sensors' noise."""
    base, rules = fit(data), data.rules
    verdict = _with_true_rivals(data, _simplest(data, judge(data, base, candidates)))
    before, noise = data.power(base.residuals), sensors.power(np.ones_like(base.residuals))
    if verdict.chosen is None:
        quiet = np.all(before <= rules.noise_power_ratio * noise)
        return verdict if quiet else _as_unlisted(verdict, None)
    removed = share_removed(sensors, data, base, verdict.chosen.fit)
    freed = [one.frees for one in verdict.chosen.candidates]
    out = any(one in verdict.chosen.fit.at_bounds for one in freed if one)
    least = rules.explained_share if verdict.status == "parameter" else rules.main_share
    if removed < least or out:
        return _as_unlisted(verdict, verdict.chosen)
    return verdict


def share_removed(sensors: MeasuredData, data: MeasuredData, base: Fit, fitted: Fit) -> float:
    """Return the share of the power beyond the sensors' noise that a fit removes, 0 to 1.

    Each balance is in units of its residual, so that N and N.m can be added.
    """
    noise = float(np.sum((_in_units_of(data, sensors, np.ones_like(base.residuals))) ** 2))
    beyond = base.chi_square - noise
    gain = base.chi_square - max(fitted.chi_square, noise)
    return float(np.clip(gain / beyond, 0.0, 1.0)) if beyond > 0.0 else 0.0


def _simplest(data: MeasuredData, verdict: Verdict) -> Verdict:
    """Return the verdict with the model of fewest unknowns that fits nearly as well as the best.

    With many samples the evidence prefers a richer law, or a second effect, for a minimal reduction
    of a residual that is no noise.
    """
    chosen = verdict.chosen
    if chosen is None or verdict.status not in ("named", "class"):
        return verdict
    most = data.rules.parsimony_ratio * data.power(chosen.fit.residuals)
    near = [
        one
        for one in verdict.alternatives
        if all(candidate.frees is None for candidate in one.candidates)
        and _unknowns(one) < _unknowns(chosen)
        and np.all(data.power(one.fit.residuals) <= most)
    ]
    if not near:
        return verdict
    simplest = min(near, key=lambda one: (_unknowns(one), one.bic))
    others = tuple(one for one in (chosen, *verdict.alternatives) if one is not simplest)
    equivalent = (
        one
        for one in verdict.equivalent
        if one is not simplest and len(one.candidates) == len(simplest.candidates)
    )
    return _with_rivals(replace(verdict, chosen=simplest, alternatives=others), equivalent)


def _with_true_rivals(data: MeasuredData, verdict: Verdict) -> Verdict:
    """Return the verdict without hypotheses that fit a balance worse, or contain the chosen one.

    A law that contains the chosen one and fits no better is not a different explanation.
    """
    chosen = verdict.chosen
    if chosen is None or verdict.status != "class":
        return verdict
    most = data.rules.parsimony_ratio * data.power(chosen.fit.residuals)
    equivalent = (
        one
        for one in verdict.equivalent
        if np.all(data.power(one.fit.residuals) <= most) and not contains(one, chosen)
    )
    return _with_rivals(verdict, equivalent)


def _with_rivals(verdict: Verdict, equivalent: Iterable[Hypothesis]) -> Verdict:
    """Return the verdict with other hypotheses that explain as much, which make it a class."""
    rivals = tuple(equivalent)
    return replace(verdict, status="class" if rivals else "named", equivalent=rivals)


def _unknowns(one: Hypothesis) -> int:
    return sum(candidate.unknowns for candidate in one.candidates)


def _as_unlisted(verdict: Verdict, nearest: Hypothesis | None) -> Verdict:
    return replace(verdict, status="unlisted", chosen=nearest, equivalent=())


def _in_units_of(
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
    samples = sum(len(balance.time) for balance in data.spectra)
    return np.sqrt(data.power(residuals) / samples)
