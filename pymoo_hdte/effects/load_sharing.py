"""Uneven load sharing: one of two zones of engagement has play, and the other carries alone.

The teeth of a strain wave gear engage at both ends of the wave generator's long axis. Where one of
these two zones has play, by wear or because shafts are out of line, half of the stiffness is left
until the torsion has used up that play. That load sharing is poor at small torques and evens out as
parts bend is known of planetary gears (Molaie et al., Machines 10, 2022, article 634); the law is
that of two equal springs side by side, one of which has play.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Law, PortState, Response
from pymoo_hdte.effects.portable import Formula
from pymoo_hdte.effects.stiffness import DeadZone, PeriodicClearance, guess_of_clearance

SHARE = 0.5
"""Share of the stiffness of one of the two zones."""


def _halved(response: Response) -> Response:
    return Response(SHARE * response.torque, SHARE * response.slope)


def _formula_halved(formula: Formula) -> Formula:
    return Formula(f"{SHARE} * ({formula.force})")


class _OfOneZone(DeadZone):
    """A play of the same half-width at all angles, in one of the two zones."""

    rattles: ClassVar[bool] = False

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        return _halved(super().respond(state))

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return _formula_halved(super().formula)


@dataclass(frozen=True)
class UnevenSharing(PeriodicClearance):
    """T = K/2 (dz(d) - d): a play, as that of `PeriodicClearance`, in one of two equal zones.

    Attributes
    ----------
    half_width, variation : float
        The play is half_width + variation cos(order angle + phase), at least 0, to either side;
        rad.
    locked : float or None
        As of `PeriodicClearance`.
    """

    rattles: ClassVar[bool] = False

    def with_input_locked(self) -> Law | None:
        """Return the play where the input was locked, its mean where that is not known."""
        return _OfOneZone(self.at_rest)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        return _halved(super().respond(state))

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return _formula_halved(super().formula)


def _uneven(sizes: Sizes) -> list[Guess]:
    """Guess a play at odd orders: what is even is the same at both zones, half a turn apart."""
    odd = [order for order in sizes.expected if order % 2.0 == 1.0]
    return guess_of_clearance(sizes, odd, lambda numbers: UnevenSharing(*numbers))


register(
    Effect(
        "uneven_load_sharing",
        UnevenSharing,
        ("mesh",),
        {"order": "", "phase": "angle", "half_width": "angle", "variation": "angle"},
        "One of the two zones of engagement has play, order {order} of the shaft: below some "
        "{force} the other carries alone, with half of the stiffness.",
        _uneven,
        of_fit={"narrowest": "angle", "locked": "angle"},
        forms="curve_of_torsion",
        with_load=True,
    )
)
