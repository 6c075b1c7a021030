"""From records of a mechanism to a verdict: missing effects, and the unexplained residual.

The rules are those of `_selection.verdict`. Because no model of a real machine fits down to the
noise of its sensors, they are applied relative to the unexplained residual: see
`_evidence.force_balances.unexplained`. A verdict therefore names effects that are significant
beyond this residual, and states it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.ripple import Ripples, find_ripples
from pymoo_hdte.discrepancy._evidence.force_balances.candidates import mechanism_candidates
from pymoo_hdte.discrepancy._evidence.force_balances.delay import Delay, delays
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData, measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.orders import position_orders
from pymoo_hdte.discrepancy._evidence.force_balances.preconditions import (
    check_sampling,
    check_scale,
    check_signals,
    fine_enough,
    usual_cutoff,
)
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import (
    fitted_values,
    port_forces,
    with_unexplained_residual,
)
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.mechanism_choice import judged
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import (
    Progress,
    held_out_balances,
    mechanism_after_held_out_test,
    simulate_held_out,
    without_mass,
)
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import grown, validate_mechanism
from pymoo_hdte.mechanism import LawAt, Mechanism, Record

CandidatesOf = Callable[[MeasuredData, Fit, Mapping[str, tuple[float, ...]], Fit], list[Candidate]]


def examine_mechanism(
    mechanism: Mechanism,
    records: Sequence[Record],
    cutoff: float | None = None,
    known: Sequence[LawAt] = (),
    rules: Rules = RULES,
    progress: Progress | None = None,
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
    progress : callable, optional
        Is told how many windows of held-out records have been simulated, and how many there are.

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
    mechanism, records = _in_time(mechanism, records, cutoff, known, rules)
    sampled, records = records, fine_enough(records, cutoff)
    check_sampling(mechanism, records, cutoff)
    train = [record for record in records if record.role == "train"]
    sensors = measured_data(mechanism, train, cutoff, known, rules)
    check_scale(sensors)
    data, verdict = examined(sensors)
    ripples = _beyond(sensors, sampled, cutoff, verdict)
    if ripples.lines and verdict.status == "unlisted":
        data, verdict, ripples = _beside(sensors, sampled, cutoff, data, verdict, ripples)
    verdict = replace(verdict, seen_beyond=ripples.names)
    # A ripple beyond the band moves nothing that could be measured, and takes a solver many steps.
    fits = verdict.base, verdict.accepted
    simulated = simulate_held_out(mechanism, records, data, fits, known, progress)
    light = without_mass(mechanism, data, verdict.accepted)
    judges = light if verdict.accepted is not verdict.base else ()
    balances = held_out_balances(mechanism, records, data, fits, judges)
    verdict = mechanism_after_held_out_test(verdict, simulated, balances)
    finding = MechanismFinding(mechanism, records, cutoff, data, verdict, ripples, simulated, light)
    if verdict.accepted is verdict.base:
        return finding
    return replace(
        finding, verdict=verdict.after_held_out_test(worse=grown(validate_mechanism(finding)))
    )


def _in_time(
    mechanism: Mechanism,
    records: Sequence[Record],
    cutoff: float,
    known: Sequence[LawAt],
    rules: Rules,
) -> tuple[Mechanism, Sequence[Record]]:
    """Return a mechanism without unknown delays, and records in which every input acts at once."""
    found: dict[str, Delay] = {}
    if any(actuator.delay is None for actuator in mechanism.inputs):
        fine = fine_enough(records, cutoff)
        check_sampling(mechanism, fine, cutoff)
        train = [record for record in fine if record.role == "train"]
        sensors = measured_data(mechanism, train, cutoff, known, rules)
        data = sensors.with_residual_as_noise(fit(sensors).residuals)
        found = {delay.input: delay for delay in delays(data)}
    taken = {
        actuator.name: (found[actuator.name].value if actuator.name in found else 0.0)
        if actuator.delay is None
        else actuator.delay
        for actuator in mechanism.inputs
    }
    if not found and not any(taken.values()):
        return mechanism, records
    inputs = [replace(actuator, delay=taken[actuator.name]) for actuator in mechanism.inputs]
    return replace(mechanism, inputs=inputs), [record.with_delays(taken) for record in records]


def _beyond(
    sensors: MeasuredData, sampled: Sequence[Record], cutoff: float, verdict: Verdict
) -> Ripples:
    """Return the ripple beyond the band, with the gains that are fitted, as its other forces."""
    mechanism = sensors.mechanism
    fitted = fitted_values(mechanism, verdict.accepted)
    gains = [f"gain of {actuator.name}" for actuator in mechanism.inputs]
    scaled = {name: fitted[name] for name in gains if name in fitted}
    as_fitted = mechanism.with_values(scaled, exactly=False)
    effects = (*sensors.known, *verdict.accepted.effects)
    return find_ripples(as_fitted, sampled, cutoff, effects, sensors.rules)


def _beside(
    sensors: MeasuredData,
    sampled: Sequence[Record],
    cutoff: float,
    data: MeasuredData,
    verdict: Verdict,
    ripples: Ripples,
) -> tuple[MeasuredData, Verdict, Ripples]:
    """Return data, verdict and ripple with the ripple in the band as well, where that explains all.

    While a port moves slowly, it is there. Twice, because the gains of the first verdict, in which
    the ripple is told, were fitted to forces that hold it.
    """
    taken = ripples
    for _ in range(2):
        again = examined(replace(sensors, known=(*sensors.known, *taken.laws)))
        if again[1].status == "unlisted":
            break
        (data, verdict), ripples = again, taken
        taken = _beyond(sensors, sampled, cutoff, verdict)
        if not taken.lines or taken.laws == ripples.laws:
            break
    return data, verdict, ripples


def examined(
    sensors: MeasuredData, candidates: CandidatesOf | None = None
) -> tuple[MeasuredData, Verdict]:
    """Return the verdict on force balances, and the data with the residual as their noise.

    Parameters
    ----------
    sensors : MeasuredData
        With the noise of the sensors.
    candidates : callable, optional
        From the data, the fit of their base, the orders seen in what it leaves, by port, and the
        fit of a base to the candidates; by default all that a mechanism may have.
    """
    base = fit(sensors)
    seen = position_orders(sensors, base)
    of_fit = partial(candidates or _candidates, sensors, base, seen)
    data, every, best = with_unexplained_residual(sensors, base, of_fit)
    return data, judged(sensors, data, every, best and best.fit)


def _candidates(
    data: MeasuredData, base: Fit, seen: Mapping[str, tuple[float, ...]], fitted: Fit
) -> list[Candidate]:
    """Return the candidates for the misfit of a base, with the orders ``seen`` in it by port.

    Where a port shows none there, with those that it shows in what another fit leaves.
    """
    if fitted is not base and not all(seen.values()):
        further = position_orders(data, fitted)
        seen = {port: orders or further[port] for port, orders in seen.items()}
    return mechanism_candidates(data, port_forces(data, base.residuals), seen)
