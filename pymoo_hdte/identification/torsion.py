"""Torsional stiffness from a torque/torsion loop (Section 3 and Fig. 9 of the paper).

The input is locked and the output torque runs 0 -> +T -> 0 -> -T -> 0. The four branches are
forward loading a1, forward unloading a2, reverse loading a3 and reverse unloading a4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.identification.linear_fit import LinearFit, fit_line
from pymoo_hdte.identification.noise import noise_of

TOLERANCE = 0.1
"""Share of the peak torque by which a torque may miss zero or run backwards on a branch."""

GIVEN_WORK = 0.01
"""Share of the ranges of torque times torsion that a loop may give as work, by noise and drift.

A loop of a strain wave gear takes 0.05 to 0.2 of it; noise of a hundredth of both ranges in 100
rows gives less than 0.002."""

FEWEST_SAMPLES = 3
"""Fewest samples on each branch."""

_NOISE_BAND = 3.0
"""Samples within this many standard deviations of an extreme torque may be the turning point."""


@dataclass(frozen=True)
class TorsionLoop:
    """One record of a torque/torsion loop (Section 3 and Fig. 9).

    Attributes
    ----------
    torque : ndarray, shape (n,)
        At the output, N.m, in the order of the record; any sampling.
    torsion : ndarray, shape (n,)
        Angle of the output, rad.

    Raises
    ------
    InvalidInput
        If the torque does not run 0 -> +T -> 0 -> -T -> 0 once, a positive torque turns the output
        backwards or not at all, or the loop gives work, which no drive does.

    Examples
    --------
    >>> torque = np.concatenate([np.linspace(a, b, 50) for a, b in ((0, 9), (9, -9), (-9, 0))])
    >>> TorsionLoop(torque, torque / 3e4).branches.keys()
    dict_keys(['a1', 'a2', 'a3', 'a4'])
    """

    torque: NDArray[np.float64]
    torsion: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "torque", finite_array("torque", self.torque, (None,)))
        shape = (len(self.torque),)
        object.__setattr__(self, "torsion", finite_array("torsion", self.torsion, shape))
        self._check_twist()
        loop_branches(self.torque)
        self._check_work()

    def _check_twist(self) -> None:
        """Refuse a torsion that does not follow the torque, or that runs against it."""
        torque, torsion = self.torque, self.torsion
        if np.ptp(torque) == 0.0:
            return  # No loop, as `loop_branches` says.
        compliance = float(
            (torque - torque.mean()) @ torsion / np.sum((torque - torque.mean()) ** 2)
        )
        if np.ptp(torsion) == 0.0:
            allowed = "some twist: the angle was not recorded, or in too coarse steps"
            raise InvalidInput("torsion", float(torsion[0]), allowed)
        if compliance < 0.0:
            allowed = (
                "above 0: a positive torque twists the output forwards. Likely torque and angle "
                "count in opposite senses; change the sign of one of the columns"
            )
            raise InvalidInput("slope of torsion over torque", float(f"{compliance:.3g}"), allowed)

    def _check_work(self) -> None:
        """Refuse a loop that is run around the wrong way, which would give work."""
        torque, torsion = self.torque, self.torsion
        given = -lost_energy(self) / (np.ptp(torque) * np.ptp(torsion))
        if given > GIVEN_WORK:
            allowed = (
                f"at least {-GIVEN_WORK:g}: unloading lies above loading in torsion, or the loop "
                "would give work. Likely the torque lags behind the angle, by a filter or another "
                "clock, or the rows stand in reverse"
            )
            field = "work of the loop, as a share of the ranges of torque times torsion"
            raise InvalidInput(field, float(f"{-given:.3g}"), allowed)

    @property
    def branches(self) -> dict[str, slice]:
        """Samples of the branches ``"a1"`` .. ``"a4"``, see `loop_branches`."""
        return loop_branches(self.torque)


def loop_branches(torque: NDArray[np.float64]) -> dict[str, slice]:
    """Find the four branches of a loop from its torque alone (Fig. 9).

    The ends of a1 and a3 are the middle of the samples that reach the extreme torque within noise,
    so that dwells are halved; a2 ends where as many samples as are positive have passed, so that
    noise at the zero crossing does not matter. The noise is judged from second differences.

    Parameters
    ----------
    torque : ndarray, shape (n,)
        N.m, in the order of the record.

    Returns
    -------
    dict of slice
        For ``"a1"``, ``"a2"``, ``"a3"``, ``"a4"``; together they are the whole record.

    Raises
    ------
    InvalidInput
        Naming the sample, for a torque that never unloads, starts in reverse, does not start and
        end near zero, runs backwards within a branch, or leaves a branch fewer than three samples.

    Examples
    --------
    >>> torque = np.concatenate([np.linspace(a, b, 50) for a, b in ((0, 9), (9, -9), (-9, 0))])
    >>> list(loop_branches(torque))
    ['a1', 'a2', 'a3', 'a4']
    """
    torque = finite_array("torque", torque, (None,))
    if len(torque) < 4 * FEWEST_SAMPLES:
        raise InvalidInput("number of samples", len(torque), f"at least {4 * FEWEST_SAMPLES}")
    peak = float(np.max(np.abs(torque)))
    slack = TOLERANCE * peak
    _check_ends(torque, peak, slack)
    top, bottom = _turning_point(torque), _turning_point(-torque)
    if bottom < top:
        allowed = (
            "after the highest torque: load forward first. Likely the rows stand in reverse, or "
            "torque and angle both count in the opposite sense"
        )
        raise InvalidInput("sample of the lowest torque", bottom, allowed)
    zero = top + int(np.count_nonzero(torque[top:bottom] > 0.0))
    cuts = (0, top + 1, zero, bottom + 1, len(torque))
    names = ("a1", "a2", "a3", "a4")
    branches = {name: slice(*ends) for name, *ends in zip(names, cuts[:-1], cuts[1:], strict=True)}
    for (name, samples), direction in zip(branches.items(), (1.0, -1.0, -1.0, 1.0), strict=True):
        _check_branch(name, direction * torque[samples], samples.start, slack)
    return branches


def stiffness(loop: TorsionLoop) -> LinearFit:
    """Return the stiffness K: the slope of torque over torsion on the forward loading branch a1.

    That is the paper's stiffness (Section 3). The interval holds for the straight line that fits
    the noise-free branch best. Friction bends the start of a1; this moves the slope itself, not its
    standard error. The error assumes normal noise of torque and torsion with a first-order
    autocorrelation, judged from the whole record (see `noise_of`). Noise s of the torsion lowers
    the slope by the share (s / S)^2, where S is the standard deviation of the torsion over the
    branch: 1e-4 for 1 arcsec in 0..320 arcsec.

    Parameters
    ----------
    loop : TorsionLoop
        In N.m and rad.

    Returns
    -------
    LinearFit
        Slope in N.m/rad, intercept in N.m.

    Examples
    --------
    >>> torque = np.concatenate([np.linspace(a, b, 50) for a, b in ((0, 9), (9, -9), (-9, 0))])
    >>> print(f"{stiffness(TorsionLoop(torque, torque / 3e4)).slope:.0f} N.m/rad")
    30000 N.m/rad
    """
    loading = loop.branches["a1"]
    torque, torsion = loop.torque[loading], loop.torsion[loading]
    slope = fit_line(torsion, torque).slope
    return fit_line(torsion, torque, noise_of(loop.torque - slope * loop.torsion))


def stiffness_between(loop: TorsionLoop, low: float, high: float) -> LinearFit:
    """Return the stiffness between two torques, of either sign: K1, K2 or K3 of a catalogue.

    One slope of torque over torsion through the samples whose torque is between the two in size,
    each branch about its own mean, so that the width of the loop does not count. From zero on, they
    are those of a2 to a4, since a1 begins without hysteresis; further up, those of the loading
    branches a1 and a3, since after a turning point the loop is as stiff as before slip.

    Parameters
    ----------
    loop : TorsionLoop
        In N.m and rad.
    low, high : float
        N.m, at least 0; 0 and T1 for K1.

    Returns
    -------
    LinearFit
        Slope in N.m/rad; the intercept is about 0.

    Raises
    ------
    InvalidInput
        If fewer than three samples lie there.

    Examples
    --------
    >>> torque = np.concatenate([np.linspace(a, b, 50) for a, b in ((0, 9), (9, -9), (-9, 0))])
    >>> print(f"{stiffness_between(TorsionLoop(torque, torque / 3e4), 2.0, 6.0).slope:.0f} N.m/rad")
    30000 N.m/rad
    """
    torques, torsions = [], []
    size = np.abs(loop.torque)
    for name in ("a1", "a3") if low > 0.0 else ("a2", "a3", "a4"):
        branch = np.zeros(len(size), dtype=bool)
        branch[loop.branches[name]] = True
        inside = branch & (size >= low) & (size <= high)
        if inside.any():
            torques.append(loop.torque[inside] - loop.torque[inside].mean())
            torsions.append(loop.torsion[inside] - loop.torsion[inside].mean())
    found = sum(len(part) for part in torques)
    if found < FEWEST_SAMPLES:
        allowed = f"at least {FEWEST_SAMPLES}"
        raise InvalidInput(f"samples between {low:g} and {high:g} N.m", found, allowed)
    return fit_line(np.concatenate(torsions), np.concatenate(torques))


def hysteresis_width(loop: TorsionLoop) -> float:
    """Return the torsion at zero torque after forward minus that after reverse loading, rad.

    Each is read off a straight line through the samples of the loop within 10 % of the peak torque.

    Examples
    --------
    >>> torque = np.concatenate([np.linspace(a, b, 50) for a, b in ((0, 9), (9, -9), (-9, 0))])
    >>> lag = 1e-5 * np.sign(np.gradient(torque))
    >>> print(f"{hysteresis_width(TorsionLoop(torque, torque / 3e4 - lag)):.1e} rad")
    2.0e-05 rad
    """
    branches = loop.branches
    falling = slice(branches["a2"].start, branches["a3"].stop)
    return _torsion_at_zero(loop, falling) - _torsion_at_zero(loop, branches["a4"])


def lost_energy(loop: TorsionLoop) -> float:
    """Return the work that one loop turns into heat, J: the integral of torque over torsion.

    Examples
    --------
    >>> torque = np.concatenate([np.linspace(a, b, 50) for a, b in ((0, 9), (9, -9), (-9, 0))])
    >>> lag = 1e-5 * np.sign(np.gradient(torque))
    >>> print(f"{lost_energy(TorsionLoop(torque, torque / 3e4 - lag)):.1e} J")
    3.6e-04 J
    """
    return float(np.trapezoid(loop.torque, loop.torsion))


def _check_ends(torque: NDArray[np.float64], peak: float, slack: float) -> None:
    if abs(torque[0]) > slack:
        raise InvalidInput("torque[0]", float(torque[0]), f"a start within {slack:g} N.m of zero")
    if min(torque.max(), -torque.min()) <= 0.5 * peak:
        reached = (float(torque.min()), float(torque.max()))
        allowed = "a loop 0 -> +T -> 0 -> -T -> 0 that loads and unloads in both directions"
        raise InvalidInput("range of torque", reached, allowed)
    if abs(torque[-1]) > slack:
        last = f"torque[{len(torque) - 1}]"
        raise InvalidInput(last, float(torque[-1]), f"unloaded to within {slack:g} N.m of zero")


def _turning_point(torque: NDArray[np.float64]) -> int:
    """Return the middle of the samples that cannot be told from the greatest one."""
    # A second difference of white noise has the variance 6; 0.6745 turns a median into a sigma.
    noise = float(np.median(np.abs(np.diff(torque, 2)))) / 0.6745 / 6.0**0.5
    near = np.flatnonzero(torque >= torque.max() - _NOISE_BAND * noise)
    return int(np.median(near))


def _check_branch(name: str, rising: NDArray[np.float64], first_sample: int, slack: float) -> None:
    if len(rising) < FEWEST_SAMPLES:
        allowed = f"at least {FEWEST_SAMPLES}"
        raise InvalidInput(f"number of samples on branch {name}", len(rising), allowed)
    setback = np.maximum.accumulate(rising) - rising
    worst = int(np.argmax(setback))
    if setback[worst] > slack:
        allowed = f"one loop: branch {name} runs backwards by no more than {slack:g} N.m"
        raise InvalidInput(f"setback at torque[{first_sample + worst}]", setback[worst], allowed)


def _torsion_at_zero(loop: TorsionLoop, samples: slice) -> float:
    torque, torsion = loop.torque[samples], loop.torsion[samples]
    near = np.count_nonzero(np.abs(torque) <= TOLERANCE * np.abs(loop.torque).max())
    nearest = np.argsort(np.abs(torque), kind="stable")[: max(near, FEWEST_SAMPLES)]
    return fit_line(torque[nearest], torsion[nearest]).intercept
