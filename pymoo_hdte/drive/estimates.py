"""Rules that estimate what a catalogue page does not print, each with its tolerance and source.

A rule is data: to replace one, pass a mapping with another `Estimate` at its name. The size of a
drive is the pitch diameter of its teeth in tenths of an inch, as makers count it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pymoo_hdte.units import REVOLUTION_PER_MINUTE

Known = Mapping[str, float]

TENTH_OF_INCH = 2.54e-3
"""A unit of size, m."""

_STIFFNESS = (
    "geometric mean of the eight sizes from 14 to 58 of the CHA series, ratios above 50, Harmonic "
    "Drive SE, manual 1018854 of 12/2015, page 50"
)
_FRICTION = (
    "geometric mean of the four sizes from 14 to 25 of Schaeffler TPI 275, series RT1-H-CS, ratio "
    "100, at 20 C"
)
_PAPER = "from the HS-20-100, Machines 2026, 14(9), 1000, Table 4"


@dataclass(frozen=True)
class Estimate:
    """A rule for one figure of a page.

    Attributes
    ----------
    formula : callable
        Maps the figures that are known so far, in SI, to the estimate, in SI.
    needs : tuple of str
        Figures that the formula uses.
    tolerance : float
        Relative half-width: the true figure is expected within 1 +- tolerance times the estimate.
        Where a series is the source, the largest deviation of one size from the rule of the others.
    basis : str
        What the rule says and where it comes from.
    sizes, ratios : (float, float)
        Range within which the rule was checked, dimensionless; outside it the figure is asked for.

    Examples
    --------
    >>> print(f"{ESTIMATES['K2'].formula({'K3': 1e4}):.0f} N.m/rad")
    8800 N.m/rad
    """

    formula: Callable[[Known], float]
    needs: tuple[str, ...]
    tolerance: float
    basis: str
    sizes: tuple[float, float] = (0.0, 1000.0)
    ratios: tuple[float, float] = (0.0, 1000.0)

    def covers(self, known: Known) -> bool:
        """Return whether the rule was checked at the size and ratio among the known figures."""
        checked = (("size", self.sizes), ("ratio", self.ratios))
        return all(low <= known[name] <= high for name, (low, high) in checked)


def _share_of(name: str, share: float) -> Callable[[Known], float]:
    return lambda known: share * known[name]


def _power_of_size(coefficient: float, power: int) -> Callable[[Known], float]:
    return lambda known: coefficient * known["size"] ** power


def _running(known: Known) -> float:
    """Return the no-load torque at the rated speed, from that at 2000 r/min."""
    start, share = known["no_load_starting_torque"], known["rated_speed"] / _SPEED_OF_FRICTION
    return start + (1.21e-5 * known["size"] ** 3 - start) * share


_SPEED_OF_FRICTION = 2000.0 * REVOLUTION_PER_MINUTE

_SERIES = ((14.0, 58.0), (51.0, 160.0))
_RT1 = ((14.0, 25.0), (80.0, 120.0))
_K3, _SIZE = ("K3",), ("size",)

ESTIMATES: Mapping[str, Estimate] = {
    "K2": Estimate(_share_of("K3", 0.88), _K3, 0.06, f"0.88 K3: {_STIFFNESS}", *_SERIES),
    "K1": Estimate(_share_of("K3", 0.58), _K3, 0.17, f"0.58 K3: {_STIFFNESS}", *_SERIES),
    "T1": Estimate(
        _power_of_size(8.4e-4, 3), _SIZE, 0.16, f"8.4e-4 N.m size^3: {_STIFFNESS}", *_SERIES
    ),
    "T2": Estimate(
        _power_of_size(2.94e-3, 3), _SIZE, 0.2, f"2.94e-3 N.m size^3: {_STIFFNESS}", *_SERIES
    ),
    "hysteresis_loss": Estimate(
        lambda known: 2.9e-4,
        (),
        0.9,
        "1 arcmin, the limit that makers print for ratios above 30; most drives have less",
        ratios=(31.0, 160.0),
    ),
    "no_load_starting_torque": Estimate(
        _power_of_size(1.02e-4, 2), _SIZE, 0.13, f"1.02e-4 N.m size^2: {_FRICTION}", *_RT1
    ),
    "no_load_running_torque": Estimate(
        _running,
        ("size", "rated_speed", "no_load_starting_torque"),
        0.2,
        f"1.21e-5 N.m size^3 at 2000 r/min, from the starting torque in a line: {_FRICTION}",
        *_RT1,
    ),
    "load_friction": Estimate(
        lambda known: 0.108, (), 0.45, f"10.8 % of the load is lost besides: {_FRICTION}", *_RT1
    ),
    "driven_friction": Estimate(
        lambda known: 0.05,
        (),
        0.1,
        f"back-driving takes ratio and starting torque over 1 - 0.05: {_FRICTION}",
        *_RT1,
    ),
    "mesh_damping_share": Estimate(
        lambda known: 0.72,
        (),
        0.5,
        f"the torsion is damped by 0.72 of the no-load drag, times the ratio squared: {_PAPER}",
    ),
    "output_inertia": Estimate(
        _power_of_size(8.5e-4 / 20.0**5, 5), _SIZE, 0.5, f"fifth power of the size {_PAPER}"
    ),
    "output_damping": Estimate(
        _power_of_size(5.0e-4 / 20.0**3, 3), _SIZE, 0.5, f"third power of the size {_PAPER}"
    ),
}
"""The rules by the name of their figure, in the order in which they are used.

Examples
--------
>>> ESTIMATES["K2"].tolerance
0.06
"""
