"""The gear of a joint: what its kind and ratio say about the orders of a ripple."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from pymoo_hdte.checks import InvalidInput, one_of, real_number, whole_number

KINDS = ("harmonic drive", "other")
_PER_TURN = (2, 4, 6)
"""Cycles per turn of a wave generator, an ellipse with two ends, against either spline (Tuttle and
Seering, IEEE Trans. Robotics and Automation 12, 1996)."""
_PER_FIELD = (1, 2, 6)
"""Cycles per turn of a motor's field: at six, the currents of three phases commutate."""


@dataclass(frozen=True)
class Gear:
    """A gear in front of a port, whose motion is that of the gear's output or its torsion.

    Attributes
    ----------
    ratio : float
        Turns of the input per turn of the output, dimensionless; at least 1.
    kind : {"harmonic drive", "other"}
    pole_pairs : int
        Pole pairs of the motor at the input; 0 if unknown.

    Raises
    ------
    InvalidInput
        For a ratio below 1, another kind, or a negative number of pole pairs.

    Examples
    --------
    >>> Gear(101.0, "harmonic drive").expected[202.0]
    '2 per input turn'
    """

    ratio: float
    kind: str = "other"
    pole_pairs: int = 0

    def __post_init__(self) -> None:
        real_number("gear.ratio", self.ratio, at_least=1.0)
        one_of("gear.kind", self.kind, KINDS)
        whole_number("gear.pole_pairs", self.pole_pairs, at_least=0)

    @property
    def expected(self) -> dict[float, str]:
        """Orders at which a ripple is expected, cycles per turn of the output, each in words."""
        meanings = {}
        if self.kind == "harmonic drive":
            for count in _PER_TURN:
                meanings[count * self.ratio] = f"{count} per input turn"
                # The output turns as well, the same way or, of a flexible spline, the other way.
                for output in (-1.0, 1.0):
                    order = count * (self.ratio + output)
                    meanings[order] = f"{count} per input turn against the output"
        for count in _PER_FIELD if self.pole_pairs else ():
            words = f"{count * self.pole_pairs} per input turn, {count} per pole pair"
            meanings.setdefault(count * self.pole_pairs * self.ratio, words)
        meanings.setdefault(self.ratio, "1 per input turn")
        meanings.setdefault(1.0, "1 per turn of the output")
        return meanings

    def check_at(self, port: str, motion: Mapping[str, float], angles: Collection[str]) -> None:
        """Refuse a port that can be neither the output of a gear nor its torsion.

        Parameters
        ----------
        port : str
            Its name.
        motion : mapping of str to float
            Share of each coordinate in its motion, by name.
        angles : collection of str
            Coordinates that are, or may be, angles of a shaft.

        Raises
        ------
        InvalidInput
            If the motion is neither that of one coordinate nor a `torsion_of` two, or one of them
            is no angle.
        """
        moved = [name for name, share in motion.items() if share]
        fits = len(moved) == 1 or torsion_of(motion) is not None
        if not fits or any(name not in angles for name in moved):
            allowed = (
                "a port whose motion is the angle of the gear's output; or its torsion, 1 the "
                "input's angle, divided by the ratio already, and -1 the output's"
            )
            raise InvalidInput(f"gear of {port}", dict(motion), allowed)

    def meaning(self, order: float, within: float) -> str:
        """Return in words what an order of a ripple may be.

        Parameters
        ----------
        order : float
            Cycles per turn of the output.
        within : float
            Largest distance from an expected order, cycles per turn of the output.

        Returns
        -------
        str
            The expected orders within that distance, the nearest first; empty for none.
        """
        off = {expected_order: abs(expected_order - order) for expected_order in self.expected}
        candidates = sorted(
            (expected_order for expected_order in off if off[expected_order] <= within),
            key=off.__getitem__,
        )
        return "; ".join(
            f"{expected_order:.5g} is {self.expected[expected_order]}"
            for expected_order in candidates
        )


def torsion_of(motion: Mapping[str, float]) -> tuple[str, str] | None:
    """Return the angles of input and output whose difference a motion is, or None.

    Parameters
    ----------
    motion : mapping of str to float
        Share of each coordinate, by name: 1 of the input's angle, divided by the gear's ratio, and
        -1 of the output's.
    """
    shares = {share: name for name, share in motion.items() if share}
    if set(shares) != {1.0, -1.0} or sum(map(bool, motion.values())) != 2:
        return None
    return shares[1.0], shares[-1.0]
