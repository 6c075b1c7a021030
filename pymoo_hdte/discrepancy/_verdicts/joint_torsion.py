"""The verdict on the torsion of a gear: what its measured angles lack beside the motor's torque.

The balance of the input's torques has the motor's torque on one side and spring, laws of the
torsion and friction ahead of the gear on the other. Divided by the stiffness it is an angle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.ripple import (
    OF_TORSION,
    Ripple,
    Ripples,
    find_ripples,
)
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.ripple_size import Part
from pymoo_hdte.discrepancy._evidence.force_balances.candidates import port_sizes
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData, measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.joint_halves import Half, Joint
from pymoo_hdte.discrepancy._evidence.force_balances.orders import (
    periods_within,
    position_orders,
)
from pymoo_hdte.discrepancy._evidence.force_balances.preconditions import (
    check_sampling,
    check_scale,
    fine_enough,
)
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import (
    fitted_values,
    root_mean_square,
)
from pymoo_hdte.discrepancy._selection.candidate import Candidate, candidate_of
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._verdicts.mechanism import examined
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.drive._effects.static_error import KinematicErrorLine, KinematicTorsion
from pymoo_hdte.effects.effect import Effect, place_of
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.effects import law_effects
from pymoo_hdte.mechanism.port_motion import motion_at_port

KINEMATIC = KinematicErrorLine.name
ANGLE = "torsion"
"""Name of the measured torsion as a signal of its own."""


def examine_torsion(
    half: Half, joint: Joint, cutoff: float, rules: Rules = RULES
) -> MechanismFinding:
    """Return the verdict on the torsion of a joint.

    Parameters
    ----------
    half : Half
        From `torsion_half`.
    joint : Joint
    cutoff : float
        Hz, up to which the motion is known.
    rules : Rules

    Returns
    -------
    MechanismFinding
        In N.m of the output; its ripples, beyond the cutoff, are in rad of the torsion.

    Raises
    ------
    InvalidInput
        See `examine_mechanism`.
    """
    records = fine_enough(half.records, cutoff)
    check_sampling(half.mechanism, records, cutoff)
    train = [record for record in records if record.role == "train"]
    sensors = measured_data(half.mechanism, train, cutoff, half.known, rules)
    check_scale(sensors)
    # Noise of the encoders is a torque by the stiffness, of which only a rough value may be known.
    name = f"stiffness of {joint.gear.name}"
    fitted = fitted_values(half.mechanism, fit(sensors))
    stiff = half.mechanism.with_values({n: v for n, v in fitted.items() if n == name}, False)
    sensors = replace(
        measured_data(stiff, train, cutoff, half.known, rules), mechanism=half.mechanism
    )
    data, verdict = examined(sensors, _candidates)
    ripples = _lines_beyond(half, joint, cutoff, rules)
    lines = lines_of(ripples)
    if lines and verdict.status == "unlisted":
        # While the shafts turn slowly, they are within the band as well.
        again = examined(replace(sensors, known=(*half.known, *lines)), _candidates)
        data, verdict = (data, verdict) if again[1].status == "unlisted" else again
    verdict = replace(verdict, seen_beyond=tuple(dict.fromkeys(line.name for line in lines)))
    return MechanismFinding(half.mechanism, records, cutoff, data, verdict, ripples)


def errors_of(ripples: Ripples) -> list[tuple[Ripple, Part]]:
    """Return the lines beyond the band that are kinematic errors, with their size in rad.

    Their part that turns with the direction is friction, or the error of a fit.
    """
    return [
        (line, part)
        for line in ripples.lines
        for part in line.parts
        if isinstance(part.law.law, PeriodicTorque)
    ]


def lines_of(ripples: Ripples) -> tuple[LawAt, ...]:
    """Return the kinematic errors beyond the band as laws of the torsion."""
    return tuple(
        LawAt(KINEMATIC, line.port, KinematicTorsion(law.order, law.phase, law.amplitude))
        for line, part in errors_of(ripples)
        if isinstance(law := part.law.law, PeriodicTorque)
    )


def _candidates(
    data: MeasuredData, base: Fit, seen: Mapping[str, Sequence[float]], fitted: Fit
) -> list[Candidate]:
    """Return the candidates for what a base leaves of the torsion.

    Laws of a mesh at the gear, and laws of the motor's shaft ahead of it; orders that the travel
    resolves, ``seen`` by port or expected of a shaft; where none is seen in what the base leaves,
    those in what another fit leaves.
    """
    shaft, gear = data.mechanism.ports
    (unexplained,) = root_mean_square(data, base.residuals)
    orders = seen[gear.name]
    if fitted is not base and not orders:
        orders = position_orders(data, fitted)[gear.name]
    candidates = []
    for port in (gear, shaft):
        sizes = port_sizes(data, port, float(unexplained), orders if port is gear else ())
        if port is gear:
            sizes = replace(sizes, between=True, expected=_low_orders(data, gear, orders))
        for effect in law_effects():
            if _belongs(effect, port):
                candidates += [
                    candidate_of(effect, guess, port.name, "torque", LawAt)
                    for guess in effect.guesses(sizes)
                ]
    known = {place_of(law) for law in data.known}
    return [candidate for candidate in candidates if not candidate.places & known]


def _low_orders(data: MeasuredData, gear: Port, seen: Sequence[float]) -> tuple[float, ...]:
    """Return the lowest orders of the output that travel and band resolve, and that are not seen.

    A shaft errs at whole orders by its bearings, its encoder and its splines.
    """
    shafts = [balance.ports[gear.name].shaft for balance in data.spectra]
    turns, rules = max(map(np.ptp, shafts)) / (2.0 * np.pi), data.rules
    lowest, highest = rules.fewest_error_periods / turns, rules.fewest_periods / turns
    orders = np.arange(max(1.0, np.ceil(lowest)), np.ceil(highest))
    periods = [
        periods_within(balance.cutoff, shaft, float(balance.time[1] - balance.time[0]), orders)
        for balance, shaft in zip(data.spectra, shafts, strict=True)
    ]
    orders = orders[np.max(periods, axis=0) >= rules.fewest_error_periods]
    return tuple(order for order in orders.tolist() if order not in seen)


def _belongs(effect: Effect, port: Port) -> bool:
    """Tell whether an effect may be at a port: of the gear, or of the shaft ahead of it."""
    if port.followed:
        return "mesh" in effect.ports
    if effect.of_reading or effect.drives or effect.behind_gear:
        return False
    return "input" in effect.ports or not effect.ports


def _lines_beyond(half: Half, joint: Joint, cutoff: float, rules: Rules) -> Ripples:
    """Return orders of the torsion beyond the band of the motion, amplitudes in rad.

    They are sought in the measured angle itself, as ripple is in a measured torque; with the errors
    that are believed, what is left of it winds the spring.
    """
    name, gear = joint.motor, half.mechanism.port(joint.gear.name)
    port = Port(joint.gear.name, {name: 1.0}, gear=joint.kind)
    still = dict.fromkeys((name, joint.load), np.zeros(1))
    angle = Mechanism({name: BelievedValue(1.0)}, [port], [Input(ANGLE, {name: 1.0})])
    records = [
        Record(
            record.name,
            record.role,
            record.time,
            {
                name: record.channels[name],
                ANGLE: motion_at_port(gear, dict(record.channels), still).position,
            },
            context=record.context,
        )
        for record in half.records
    ]
    return find_ripples(angle, records, cutoff, (), rules, OF_TORSION)
