"""Corrections of a law's form: small forces of the same argument at the same port.

No bearing has exactly the friction curve of a library. Whatever the curve, it is a function of the
speed at its port, that of a spring one of the deflection, and that of a ripple one of the angle.
The corrections of a law span smooth functions of its argument, or further harmonics. To first
order, a misfit that remains beside all of them cannot be an error of that law's form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.chebyshev import Chebyshev
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.corrections import (
    AnyForce,
    AnyForceOfLoad,
    Correction,
    DampingByRecord,
    Force,
    LoadRate,
)
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.drive import DriveEffect
from pymoo_hdte.drive._effects import (
    Eccentricity,
    KinematicErrorLine,
    PreslidingFriction,
    ThermalDrift,
)
from pymoo_hdte.effects.effect import AS_LISTED
from pymoo_hdte.effects.friction import smoothed_sign
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import OUTPUT_SHAFT, PortState, Response, Values
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.effects.stiffness import HardeningStiffness, PeriodicStiffness, SoftWindup

# Sizes are far below those that matter, because only directions count.
_SHARE = 1e-3
"""Size of what varies with an angle, as a share of the torque or stiffness of the drive."""
_LARGER_SHARE = 5e-3
"""Size of what changes means, as a share of the same."""
_ANGLE = 1e-7
"""Size of an error of the output angle, rad."""
_SHARPNESS = 3.0
"""Sharpness of the bends, as of a play with a soft skin."""
_BENDS = tuple(np.geomspace(0.01, 1.0, 8).tolist())
"""Torsions, as shares of the largest, at which a stiffness may bend and springs may slip."""
_PARTS = (0.0, np.pi / 2.0)
"""Phases of the two parts of a line."""
_RATES = (1, 2, 3, 4)
"""Derivatives of the load's acceleration: a line that a coupling delays by a third of a radian
needs no more for a hundredth of its torque."""
_DRIFTS = (0.1, 0.3, 1.0, 3.0)
"""Time constants of a drift, as shares of the session."""


@dataclass(frozen=True, eq=False)
class Ranges:
    """Ranges of speed, torque and time in the records of a drive, SI.

    Attributes
    ----------
    speed : ndarray, shape (r,)
        Speeds of the input.
    torque, travel : float
        Largest torque at the output, and the torsion that it causes.
    duration : float
        Duration of the session.
    ratio, stiffness, damping, inertia : float
        Values of the believed drive; the inertia is that of its load.
    lines : tuple of float
        Orders of the believed static error.
    shown : tuple of float
        Orders that are analysed.
    terms : int
        Curves of the speed, or harmonics of an angle, that another form may hold.
    """

    speed: NDArray[np.float64]
    torque: float
    travel: float
    duration: float
    ratio: float
    stiffness: float
    damping: float
    inertia: float
    lines: tuple[float, ...]
    shown: tuple[float, ...]
    terms: int

    def multiples(self, order: float) -> list[float]:
        """Return those of an order and its harmonics that are analysed."""
        multiples = [k * order for k in range(1, self.terms + 1)]
        return [
            multiple
            for multiple in multiples
            if np.min(np.abs(np.subtract(self.shown, multiple))) < 1e-6
        ]

    def slower(self, port: str) -> float:
        """Return turns of the input per turn of a port."""
        return self.ratio if port in OUTPUT_SHAFT else 1.0


def corrections(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    """Return the corrections of the form of a candidate's laws, none where no form is known.

    A base parameter out of its tolerance has those of the effect that covers it. An error that no
    verdict names has none.
    """
    effect = candidate.effect if candidate.listed else None
    return _FAMILIES[(effect and effect.forms) or AS_LISTED](candidate, ranges)


def _friction(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    """Return friction of any curve; at the output with bristles, which show in the sweep."""
    effects: list[DriveEffect] = [
        Correction(candidate.port, AnyForce(_of_speed(power, candidate.port, ranges)))
        for power in range(ranges.terms)
    ]
    return effects + (_contacts(ranges) if candidate.port == "output" else [])


def _contacts(ranges: Ranges) -> list[DriveEffect]:
    """Return contacts of the output that bend before they slip, as far as those of a bearing."""
    size, shares = _SHARE * ranges.torque, _BENDS[:4]
    laws = [PreslidingFriction(size, share * ranges.travel, 1e-3) for share in shares]
    return [Correction("output", law) for law in laws]


def _of_speed(
    power: int, port: str, ranges: Ranges, order: float = 0.0, phase: float = 0.0
) -> Force:
    """Return a friction by a polynomial of the speed's logarithm, perhaps times a cosine."""
    slower = ranges.slower(port)
    low, high = np.log([0.7 * ranges.speed.min() / slower, 1.1 * ranges.speed.max() / slower])
    curve = Chebyshev.basis(power)
    slope = curve.deriv()
    size = _LARGER_SHARE * ranges.torque / ranges.ratio * slower

    def force(state: PortState) -> Response:
        sign, steep = smoothed_sign(state.speed)
        speed = np.maximum(np.abs(state.speed), 1e-9)
        place = np.clip((2.0 * np.log(speed) - low - high) / (high - low), -1.5, 1.5)
        wave = size * np.cos(state.phase(order) + phase) if order else size
        value, growth = curve(place), slope(place) * 2.0 / ((high - low) * speed)
        return Response(wave * value * sign, damping=wave * (growth + value * steep))

    return force


def _varying_friction(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    port, slower = candidate.port, ranges.slower(candidate.port)
    effects = _friction(candidate, ranges)
    for order in (slower * multiple for multiple in ranges.multiples(candidate.order or 1.0)):
        for phase in _PARTS:
            for power in range(2):
                force = _of_speed(power, port, ranges, order, phase)
                effects.append(Correction(port, AnyForce(force, (order,))))
    return effects


def _friction_of_load(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    """Return friction of any power of the load, which may differ where the load drives."""
    scale = ranges.torque / ranges.ratio
    effects: list[DriveEffect] = [*_friction(candidate, ranges)[:2]]
    for power in (0.0, 0.5, 1.0, 2.0):
        for driven in (False, True):

            def force(state: PortState, power: float = power, driven: bool = driven) -> Response:
                load = np.asarray(state.load)
                sign, steep = smoothed_sign(state.speed)
                size = _LARGER_SHARE * scale * (np.abs(load) / scale) ** power
                if driven:
                    size = size * np.sign(load)
                    return Response(size * sign**2, damping=2.0 * size * sign * steep)
                return Response(size * sign, damping=size * steep)

            effects.append(Correction("input", AnyForceOfLoad(force)))
    return effects


def _stiffness(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    """Return stiffness that bends anywhere, and with the angle where a clearance varies."""
    bends = [SoftWindup(_LARGER_SHARE, share * ranges.travel, _SHARPNESS) for share in _BENDS]
    cubic = HardeningStiffness(_LARGER_SHARE * ranges.stiffness / ranges.travel**2)
    effects: list[DriveEffect] = [Correction("mesh", law) for law in bends]
    effects.append(Correction("mesh", cubic))
    for order in ranges.multiples(candidate.order) if candidate.order else ():
        for phase in _PARTS:
            waving = [_waving(law, order, phase) for law in bends[::2]]
            effects += [Correction("mesh", AnyForce(force, (order,))) for force in waving]
    return effects


def _waving(law: SoftWindup, order: float, phase: float) -> Force:
    """Return a bend that comes and goes with the angle."""

    def force(state: PortState) -> Response:
        bend, wave = law.respond(state), np.cos(state.phase(order) + phase)
        return Response(bend.torque * wave, bend.slope * wave)

    return force


def _springs(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    """Return springs at the mesh that slip at any torsion, all four of each at the same."""
    size = _SHARE * ranges.torque
    return [Correction("mesh", MaxwellSlip(size, share * ranges.travel, 1e-3)) for share in _BENDS]


def _stiffness_wave(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    orders = ranges.multiples(candidate.order or 2.0)
    laws = [PeriodicStiffness(order, phase, _SHARE) for order in orders for phase in _PARTS]
    return [Correction("mesh", law) for law in laws]


def _ripple(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    port, slower = candidate.port, ranges.slower(candidate.port)
    size, order = _SHARE * ranges.torque / ranges.ratio * slower, candidate.order or 1.0 / slower
    orders = ranges.multiples(order)
    # A ripple moves its own angle, so that each harmonic also shows at the next lower one.
    shown = {round(multiple / order) for multiple in orders}
    orders += [(k + 1) * order for k in shown if k < ranges.terms and k + 1 not in shown]
    return [
        Correction(port, PeriodicTorque(slower * order, phase, size))
        for order in orders
        for phase in _PARTS
    ]


def _error(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    orders = ranges.multiples(candidate.order or 1.0)
    return [KinematicErrorLine(order, _ANGLE, phase) for order in orders for phase in _PARTS]


def _scale_error(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    orders = ranges.multiples(candidate.order or 1.0)
    return [
        Eccentricity(_ANGLE, phase, order * ranges.ratio) for order in orders for phase in _PARTS
    ]


def _reaction(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    """Return torques by the load at the orders of the error, in any phase, as with a lag."""
    fastest, effects = ranges.speed.max(), []
    for order in ranges.lines:
        for phase in _PARTS:
            for power in (0, 1):

                def force(
                    state: PortState, order: float = order, phase: float = phase, power: int = power
                ) -> Response:
                    faster = (np.abs(state.speed) / fastest) ** power
                    wave: Values = np.cos(state.phase(order) + phase)
                    return Response(1e-2 * _SHARE * np.asarray(state.load) * wave * faster)

                effects.append(Correction("input", AnyForceOfLoad(force, (order,))))
    return list[DriveEffect](effects)


def _damping(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    """Return a damping that grows with the speed of the input, or with the torsion's rate."""
    share = ranges.speed / ranges.speed.max()
    rate = 100.0 * _ANGLE * ranges.speed.max()

    def force(state: PortState) -> Response:
        slope = _LARGER_SHARE * ranges.damping * np.abs(state.speed) / rate
        return Response(slope * state.speed, damping=2.0 * slope)

    effects: list[DriveEffect] = [DampingByRecord(0.05 * share**power) for power in (1, 2)]
    return [*effects, Correction("mesh", AnyForce(force))]


def _drift(candidate: Candidate, ranges: Ranges) -> list[DriveEffect]:
    times = [share * ranges.duration for share in _DRIFTS if ranges.duration > 0.0]
    return [ThermalDrift(_ANGLE / time, time) for time in times]


def load_series(ranges: Ranges) -> list[DriveEffect]:
    """Return torques of a load that hangs on a spring, a damper or both: a series in the rate."""
    fastest = ranges.speed.max()
    return [LoadRate(k, _SHARE * ranges.inertia / fastest**k) for k in _RATES]


_FAMILIES: dict[str, Callable[[Candidate, Ranges], list[DriveEffect]]] = {
    AS_LISTED: lambda candidate, ranges: [],
    "curve_of_speed": _friction,
    "curve_of_speed_and_angle": _varying_friction,
    "power_of_load": _friction_of_load,
    "curve_of_torsion": _stiffness,
    "slipping_springs": _springs,
    "harmonics_of_torque": _ripple,
    "harmonics_of_stiffness": _stiffness_wave,
    "harmonics_of_error": _error,
    "harmonics_of_scale": _scale_error,
    "lagging_reaction": _reaction,
    "growing_damping": _damping,
    "hanging_load": lambda candidate, ranges: load_series(ranges),
    "drift_in_time": _drift,
}
"""What the families of `effects.effect.FORMS` span."""
