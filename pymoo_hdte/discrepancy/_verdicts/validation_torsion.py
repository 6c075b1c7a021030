"""The torsion of held-out records as models predict it from the measured torque."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData, measured_data
from pymoo_hdte.discrepancy._selection.excess import HeldOutTest
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import bounded_unknowns, label_of
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import laws_of
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import (
    MechanismPredictionError,
    chance_of,
    grown,
)
from pymoo_hdte.mechanism import Port
from pymoo_hdte.mechanism.port_motion import law_force, torsion_noise

Values = NDArray[np.float64]

KIND = "torsion"
_STEPS = 300
_SETTLED = 1e-9
"""rad, 2e-4 arcseconds."""


def torsion_errors(finding: MechanismFinding) -> tuple[MechanismPredictionError, ...]:
    """Return the errors of the predicted torsion on held-out records, rad.

    About their means: how the springs of a hysteresis are stretched at the first row is not known.

    Parameters
    ----------
    finding : MechanismFinding
        From `examine_torsion`.
    """
    (gear,) = (port for port in finding.mechanism.ports if port.followed)
    # As the errors are: with the fitted stiffness, of which the stated one may be a multiple.
    unexplained = float(finding.unexplained[0]) / stiffness_of(finding.accepted, gear)
    errors = []
    for record in finding.records:
        if record.role != "held_out":
            continue
        known = finding.data.known
        data = measured_data(finding.mechanism, [record], finding.cutoff, known, finding.data.rules)
        (balance,) = data.spectra
        # Where rows are left out, no model is asked what the torsion is.
        rows = balance.moving.whole
        measured = balance.ports[gear.name].position[rows]
        before, after = (
            _about(predicted_torsion(data, fitted)[rows], measured)
            for fitted in (finding.verdict.base, finding.accepted)
        )
        noise = torsion_noise(gear, record)
        expected = float(np.hypot(unexplained, noise))
        errors.append(
            MechanismPredictionError(
                record.name,
                gear.name,
                KIND,
                _size(measured - before),
                _size(measured - after),
                noise,
                "rad",
                balance.time[rows],
                measured,
                before,
                after,
                expected,
                chance_of(
                    expected, _size(after - before), _independent(finding, balance.time[rows])
                ),
                finding.data.rules,
            )
        )
    return tuple(errors)


def _independent(finding: MechanismFinding, time: Values) -> float:
    """Return how many independent values a band up to the cutoff has in some time."""
    return finding.cutoff * 2.0 * float(time[-1] - time[0])


def _about(predicted: Values, measured: Values) -> Values:
    return predicted + float(np.mean(measured - predicted))


def _size(difference: Values) -> float:
    return float(np.sqrt(np.mean(difference**2)))


def predicted_torsion(data: MeasuredData, fitted: Fit) -> Values:
    """Return the torsion at which a model's spring and laws hold the measured torque, rad.

    Parameters
    ----------
    data : MeasuredData
        Of one record, up to whose cutoff the torque is known.
    fitted : Fit

    Returns
    -------
    ndarray, shape (n,)
        At the rate of the balance.
    """
    (balance,) = data.spectra
    (gear,) = (port for port in data.mechanism.ports if port.followed)
    base = dict(
        zip(
            (parameter.name for parameter in data.base),
            fitted.values[: len(data.base)],
            strict=True,
        )
    )
    stiffness = stiffness_of(fitted, gear)
    zero = float(base[f"zero of {gear.name}"])
    effects = (*data.known, *laws_of(fitted.effects))
    laws = [effect.law for effect in effects if effect.port == gear.name]
    motion = balance.ports[gear.name]

    def force(torsion: Values) -> Values:
        moved = replace(motion, position=torsion + zero / stiffness)
        of_laws = (law_force(law, moved, stiffness) for law in laws)
        return np.asarray(stiffness * torsion + zero + sum(of_laws))

    whitened = data.residuals(fitted.values[: len(data.base)], laws_of(fitted.effects))
    unexplained = balance.in_time(data.coefficients(whitened)[0][0])
    wanted, torsion = force(motion.position) + unexplained, motion.position
    # The steepest slope anywhere, so that no step goes too far.
    steepest = max(stiffness, _steepest(force, motion.position))
    for _ in range(_STEPS):
        step = (wanted - force(torsion)) / steepest
        torsion = torsion + step
        if np.max(np.abs(step)) < _SETTLED:
            break
    return torsion


def stiffness_of(fitted: Fit, gear: Port) -> float:
    """Return the stiffness of a gear in a fit, N.m/rad; the believed one where it is not fitted."""
    values = dict(
        zip((parameter.name for parameter in fitted.parameters), fitted.values, strict=True)
    )
    return float(values.get(f"stiffness of {gear.name}", gear.stiffness.value))


def _steepest(force: Callable[[Values], Values], torsion: Values) -> float:
    """Return the largest slope of a force over a torsion of shape (n,).

    Along two courses that lie apart by ever more, so that springs that slip stick on the way.
    """
    apart = 1e-3 * float(np.ptp(torsion)) * np.linspace(0.0, 1.0, len(torsion))
    return float(np.max((force(torsion + apart) - force(torsion))[1:] / apart[1:]))


def torsion_after_held_out_test(
    finding: MechanismFinding, errors: Sequence[MechanismPredictionError]
) -> Verdict:
    """Return the verdict on a torsion, ``unlisted`` where held-out records contradict it.

    Parameters
    ----------
    finding : MechanismFinding
    errors : sequence of MechanismPredictionError
        From `torsion_errors`.
    """
    verdict = finding.verdict
    if verdict.accepted is verdict.base or not errors:
        return verdict
    sums = np.zeros(3)
    for error in errors:
        change = float(np.mean((error.predicted_after - error.predicted_before) ** 2))
        powers = np.array([error.before**2, error.after**2, change])
        sums += _independent(finding, error.time) * powers / error.expected**2
    return verdict.after_held_out_test(HeldOutTest(*sums.tolist()), grown(errors))


def without_unvalidated_lines(
    verdict: Verdict, fitted: Fit, errors: Sequence[MechanismPredictionError]
) -> Verdict:
    """Return a verdict on a torsion in which no set has an order that its fit or validation denies.

    A line whose amplitude ended at a bound, or one that leaves the held-out torsion as it was,
    stands for something else: its order would send a reader to a part that does not err.

    Parameters
    ----------
    verdict : Verdict
        After the test on its held-out records.
    fitted : Fit
        What was accepted before it.
    errors : sequence of MechanismPredictionError
        Of that fit, on these records.
    """
    shrinks = not errors or sum(error.after**2 - error.before**2 for error in errors) < 0.0
    denied = {
        candidate.label
        for candidate, bounded in bounded_unknowns(fitted)
        if candidate.order is not None and (bounded or not shrinks)
    }
    if not denied or verdict.chosen is None:
        return verdict
    sets = verdict.chosen, *verdict.alternatives
    others = [hypothesis for hypothesis in sets if not denied & label_of(hypothesis.candidates)]
    return replace(
        verdict,
        certain=False,
        chosen=others[0] if others else None,
        alternatives=tuple(others[1:]),
        equivalent=(),
        reasons=(),
        probability=None,
    )
