"""Fit of everything else to the force of an input, for its delay and its gain.

The force of an input is fitted by the inertias, dampers and springs of a mechanism, by its laws,
and by friction, gravity and a constant force at each port, so that what the base lacks does not
pass for a delay or a gain (as sensor delays in MuJoCo's ``sysid``). The gain is unknown: only the
signs of the quantities are held.

What such a fit leaves may be a disturbance to which the motion responds, in a control loop above
all. It then is no noise beside the columns, and no resampling shows by how much it moves a result.
By the inequality of Cauchy and Schwarz it is at most its norm over that of what is fitted to it;
only the sensors' noise is known to be independent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import lsq_linear
from scipy.stats import t

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.balances import ForceBalance, quantity_names

Values = NDArray[np.float64]
Rows = NDArray[np.int_]

_RANGES = 10
"""Ranges of frequency, each of which is left out once."""
_SAME = 1e-3
"""Share of a force by which it differs from a sum of others if it is another one. Laws are means
over a step of a fortieth of a period, which lowers a sine by (pi / 40)^2 / 6."""


@dataclass(frozen=True, eq=False)
class InputFit:
    """Columns that are fitted to the whitened force of an input, at its believed gain.

    Attributes
    ----------
    data : MeasuredData
    name : str
        Of the input.
    laws : tuple of LawAt
        Laws that were found, whose sizes are fitted.
    """

    data: MeasuredData
    name: str
    laws: tuple[LawAt, ...] = ()

    @cached_property
    def stated(self) -> dict[str, tuple[float, float]]:
        """Limits of quantities and of known laws that act, SI; theirs are the first columns."""
        limits = {}
        for quantity in quantity_names(self.data.mechanism):
            kind = quantity.partition(" of ")[0]
            if kind in ("inertia", "damping", "stiffness") and np.any(self._quantity(quantity)):
                believed = self.data.mechanism.quantities[quantity]
                if believed.value:
                    limits[quantity] = believed.limits
        return limits | {f"{law.name} at {law.port}": (1.0, 1.0) for law in self.data.known}

    @cached_property
    def columns(self) -> Values:
        """Whitened forces, (n, columns), each per unit of its quantity."""
        columns = [self._quantity(name) for name in self.stated if " of " in name]
        columns += [self._law(law) for law in self.data.known]
        for free in self._free():
            # Beside a known weight none is looked for.
            known, _ = np.linalg.qr(np.column_stack(columns)) if columns else (np.zeros((1, 1)), 0)
            rest = free - known @ (known.T @ free) if columns else free
            if np.linalg.norm(rest) > _SAME * np.linalg.norm(free):
                columns.append(free)
        return np.column_stack(columns)

    def force(self, delay: float = 0.0) -> Values:
        """Return the whitened force, (n,), that acts later than its record says, s."""
        return self._input(self.name, delay)

    def coefficients(self, force: Values, rows: Rows) -> Values:
        """Return the size of each column, (columns,), by some rows of a force, (n,)."""
        scale = np.linalg.norm(self.columns, axis=0)
        least = np.full(len(scale), -np.inf)
        least[: len(self.stated)] = 0.0
        matrix = self.columns[rows] / scale
        found = np.linalg.lstsq(matrix, force[rows], rcond=None)[0]
        if np.any(found < least):
            reduced, triangle = np.linalg.qr(matrix)
            found = lsq_linear(triangle, reduced.T @ force[rows], (least, np.inf), "bvls").x
        return np.asarray(found / scale)

    def possible(self, sizes: Values) -> bool:
        """Tell whether no inertia is zero: then it is another force that moves the mechanism."""
        inertias = (
            size for size, name in zip(sizes, self.stated, strict=False) if "inertia" in name
        )
        return all(size > 0.0 for size in inertias)

    def beyond(self, signal: Values, sizes: Values, rows: Rows) -> Values:
        """Return what columns with a size that is not at its bound leave of a signal's rows."""
        free = np.r_[sizes[: len(self.stated)] > 0.0, np.ones(len(sizes) - len(self.stated), bool)]
        basis, _ = np.linalg.qr(self.columns[rows][:, free])
        return np.asarray(signal[rows] - basis @ (basis.T @ signal[rows]))

    def without(self, place: int) -> float:
        """Return the norm of what all other columns leave of a column."""
        others = np.delete(self.columns, place, axis=1)
        basis, _ = np.linalg.qr(others)
        column = self.columns[:, place]
        return float(np.linalg.norm(column - basis @ (basis.T @ column)))

    def jackknifed(self, estimate: Callable[[Rows], ArrayLike]) -> tuple[Values, Values]:
        """Return an estimate, and half the width of its 95 % interval by chance.

        Without each range of frequency in turn (Tukey's jackknife), because the residual of a model
        is not white.

        Parameters
        ----------
        estimate : callable
            From the rows that it may use.
        """
        every = np.arange(len(self.data.frequency))
        ranges = np.array_split(np.argsort(self.data.frequency, kind="stable"), _RANGES)
        without = np.array([estimate(np.setdiff1d(every, one)) for one in ranges])
        variance = (_RANGES - 1.0) * np.var(without, axis=0)
        spread = t.ppf(0.975, _RANGES - 1) * variance**0.5
        return np.asarray(estimate(every)), np.asarray(spread)

    def disturbance(self, left: Values) -> float:
        """Return the norm of what is left of a force, (n,), beyond the noise of the sensors."""
        noise = in_units_of_noise(self.data, [one.noise for one in self.data.spectra])
        return max(float(left @ left - noise @ noise), 0.0) ** 0.5

    def _quantity(self, name: str) -> Values:
        row = quantity_names(self.data.mechanism).index(name)
        return in_units_of_noise(self.data, [-one.terms[:, row] for one in self.data.spectra])

    def _law(self, law: LawAt) -> Values:
        return in_units_of_noise(self.data, [one.forces([law]) for one in self.data.spectra])

    def _input(self, name: str, delay: float = 0.0) -> Values:
        (gain,) = (one.gain.value for one in self.data.mechanism.inputs if one.name == name)
        return in_units_of_noise(
            self.data, [gain * one.of_input(name, delay) for one in self.data.spectra]
        )

    def _free(self) -> Iterator[Values]:
        """Yield the forces whose size may have either sign."""
        yield from (self._law(law) for law in self.laws)
        for quantity in quantity_names(self.data.mechanism):
            # A damper that is not stated is fitted, as friction is.
            if quantity.startswith(("zero of ", "damping of ")) and quantity not in self.stated:
                yield self._quantity(quantity)
        shapes = [list(_shapes(one, self.data)) for one in self.data.spectra]
        yield from (in_units_of_noise(self.data, list(each)) for each in zip(*shapes, strict=True))
        for other in self.data.mechanism.inputs:
            if other.name != self.name:
                yield self._input(other.name)


def _shapes(balance: ForceBalance, data: MeasuredData) -> Iterator[Values]:
    """Yield dry friction, gravity and a constant force at each port that is not read."""
    for port in data.mechanism.ports:
        if not port.read:
            motion = balance.ports[port.name]
            yield balance.of_port(port.name, np.sign(motion.speed))
            yield balance.of_port(port.name, np.ones_like(motion.speed))
            if data.mechanism.turns(port):
                yield balance.of_port(port.name, np.sin(motion.position))
                yield balance.of_port(port.name, np.cos(motion.position))


def in_units_of_noise(data: MeasuredData, coefficients: Sequence[Values]) -> Values:
    """Return coefficients (n_balances, n_bins) of each record in units of its noise, (n,)."""
    return np.concatenate(
        [
            (one / deviation)[balance.kept]
            for one, balance, deviation in zip(
                coefficients, data.spectra, data.deviation, strict=True
            )
        ]
    )
