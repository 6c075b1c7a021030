"""Mean and standard deviation of the DTE by quadrature of the drive model itself.

A Gauss rule for each input, all combined: no surrogate stands between design and moments. Every
design has the same nodes, relative to it, so that differences of designs are sharper than values.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.drive import PARAMETERS, DriveModel
from pymoo_hdte.problems.operating_conditions import (
    OperatingCondition,
    duty_cycle_dte_where_found,
)
from pymoo_hdte.surrogate import SobolIndices, TruncatedNormal, UniformBand
from pymoo_hdte.surrogate._sparse.measures import Distribution, Measure, OrthonormalPolynomials

Values = NDArray[np.float64]

FIRST_NODES: tuple[int, ...] = (8, 3, 3, 1, 2)
"""Nodes of theta_s, K, J_in, B_in, B_fc: right to 0.55 % of the width on the front of `calibrated`.

By ``experiments direct_front``. With 6 of theta_s it is 1.4 % there, and 4 % for a drive of size 32
with soft wind-up.
"""
MOST_NODES = 4096
_RUNS_AT_ONCE = 8192


class ModelMoments:
    """Mean and standard deviation of the DTE over the scatter around designs.

    Parameters
    ----------
    model : DriveModel
    conditions : sequence of OperatingCondition
        The DTE is their weighted mean.
    inputs : sequence of TruncatedNormal and UniformBand
        Scatter of `PARAMETERS`, of the design variables relative to the design.
    nodes : sequence of int
        Number of nodes for each of `PARAMETERS`; n integrate polynomials up to degree 2 n - 1.

    Attributes
    ----------
    nodes : tuple of int
    n_runs : int
        Runs of the drive model so far.

    Raises
    ------
    InvalidInput
        If the numbers of nodes are not five whole numbers from 1 on, of a product up to 4096.
    """

    def __init__(
        self,
        model: DriveModel,
        conditions: Sequence[OperatingCondition],
        inputs: Sequence[TruncatedNormal | UniformBand],
        nodes: Sequence[int] = FIRST_NODES,
    ) -> None:
        self.model, self.conditions, self.inputs = model, tuple(conditions), tuple(inputs)
        self.nodes = _checked_nodes(nodes)
        self.n_runs = 0
        rules = [_rule(*pair) for pair in zip(self.inputs, self.nodes, strict=True)]
        grids = np.meshgrid(*(values for values, _ in rules), indexing="ij")
        self._points = np.stack(grids, axis=-1).reshape(-1, len(PARAMETERS))
        self._rules = [weights for _, weights in rules]
        # Softest with heaviest and stiffest with lightest: the slowest and the fastest vibration.
        top = np.array(self.nodes) - 1
        extremes = np.array([[1, 0, 1, 0, 0], [1, 1, 0, 0, 0], [1, 0, 0, 0, 0], [1, 1, 1, 0, 0]])
        self._outermost = np.ravel_multi_index(tuple((extremes * top).T), self.nodes)
        self._weights = np.ones(1)
        for weights in self._rules:
            self._weights = np.multiply.outer(self._weights, weights).ravel()

    def __call__(self, designs: Values) -> Values:
        """Return mean and standard deviation of n designs, shape (n, 2), arcsec.

        Both are NaN for a design around which a node has no steady state.

        Parameters
        ----------
        designs : ndarray, shape (n, 4)
            K, J_in, B_in, B_fc, SI.
        """
        dte = self._at_nodes(designs)
        mean = dte @ self._weights
        variance = (dte - mean[:, None]) ** 2 @ self._weights
        return np.column_stack([mean, np.sqrt(variance)])

    def with_nodes(self, nodes: Sequence[int]) -> ModelMoments:
        """Return the moments by other numbers of nodes, which count the same runs."""
        moments = ModelMoments(self.model, self.conditions, self.inputs, nodes)
        moments.n_runs = self.n_runs
        return moments

    def at_least_two(self) -> ModelMoments:
        """Return moments of two nodes or more for each input, as far as `MOST_NODES` goes."""
        rule = self
        for axis, count in enumerate(self.nodes):
            nodes = _doubled(rule.nodes, axis)
            if count == 1 and np.prod(nodes) <= MOST_NODES:
                rule = rule.with_nodes(nodes)
        return rule

    def refined(self, designs: Values, wanted: Values) -> ModelMoments:
        """Return moments of so many nodes that doubling those of any input changes little.

        Parameters
        ----------
        designs : ndarray, shape (n, 4)
            Designs at which the change is measured; they have steady states.
        wanted : ndarray, shape (2,)
            Largest change of mean and standard deviation, summed over the inputs, arcsec.

        Notes
        -----
        The input with the largest change gets twice the nodes, up to `MOST_NODES` altogether.
        """
        rule = self
        while True:
            now = rule(designs)
            changes = []
            for axis in range(len(PARAMETERS)):
                finer = rule.with_nodes(_doubled(rule.nodes, axis))
                difference = np.abs(finer(designs) - now) / wanted
                changes.append(np.nanmax(difference, initial=0.0))
                rule.n_runs = finer.n_runs
            doubled = _doubled(rule.nodes, int(np.argmax(changes)))
            if sum(changes) <= 1.0 or np.prod(doubled) > MOST_NODES:
                return rule
            rule = rule.with_nodes(doubled)

    def sources(self, design: Values) -> SobolIndices:
        """Return the Sobol indices of the scatter around one design, shape (4,)."""
        dte = self._at_nodes(design[None]).reshape(self.nodes)
        mean, std = self._moments_over(dte, range(len(PARAMETERS)))
        variance = float(std) ** 2
        first_order, total = np.zeros((2, len(PARAMETERS)))
        for axis in range(len(PARAMETERS)) if variance > 0.0 else ():
            others = [index for index in range(len(PARAMETERS)) if index != axis]
            alone = self._moments_over(dte, others)[0]
            averaged = self._moments_over(dte, [axis])[0]
            first_order[axis] = self._rules[axis] @ (alone - mean) ** 2 / variance
            without = self._rules[:axis] + self._rules[axis + 1 :]
            total[axis] = 1.0 - _expectation((averaged - mean) ** 2, without) / variance
        return SobolIndices(PARAMETERS, float(mean), variance, first_order, total)

    def lost(self, design: Values) -> dict[str, float] | None:
        """Return `PARAMETERS` of the first node of a design without a steady state, or None."""
        gone = np.isnan(self._at_nodes(design[None])[0])
        if not gone.any():
            return None
        # Where an outermost one is lost, the others have not been tried.
        tried = self._outermost[gone[self._outermost]]
        node = tried[0] if tried.size else np.flatnonzero(gone)[0]
        return dict(zip(PARAMETERS, self._drives(design[None])[0, node].tolist(), strict=True))

    def _moments_over(self, dte: Values, axes: Sequence[int]) -> tuple[Values, Values]:
        """Return expectation and deviation over some axes of values on the grid."""
        mean, square = dte, dte**2
        for axis in sorted(axes, reverse=True):
            mean = np.tensordot(mean, self._rules[axis], (axis, 0))
            square = np.tensordot(square, self._rules[axis], (axis, 0))
        return np.asarray(mean), np.sqrt(np.maximum(square - mean**2, 0.0))

    def _at_nodes(self, designs: Values) -> Values:
        """Return the DTE at all nodes of all designs, shape (n, q), arcsec.

        Where an outermost node has no steady state, the others stay NaN: an iteration that fails
        takes longer than one that succeeds.
        """
        drives = self._drives(designs)
        dte = np.full((len(designs), len(self._points)), np.nan)
        outermost = np.isin(np.arange(len(self._points)), self._outermost)
        rows = np.arange(len(designs))
        for nodes in (np.flatnonzero(outermost), np.flatnonzero(~outermost)):
            place = np.ix_(rows, nodes)
            dte[place] = self._runs(drives[place].reshape(-1, len(PARAMETERS))).reshape(
                len(rows), len(nodes)
            )
            rows = np.flatnonzero(np.isfinite(dte[:, outermost]).all(axis=1))
        return dte

    def _runs(self, drives: Values) -> Values:
        self.n_runs += len(drives)
        parts = [
            duty_cycle_dte_where_found(self.model, self.conditions, drives[start:][:_RUNS_AT_ONCE])
            for start in range(0, len(drives), _RUNS_AT_ONCE)
        ]
        return np.concatenate([np.empty(0), *parts])

    def _drives(self, designs: Values) -> Values:
        values = finite_array("designs", designs, (None, len(PARAMETERS) - 1))
        drives = np.repeat(self._points[None], len(values), axis=0)
        drives[:, :, 1:] *= values[:, None, :]
        return drives


def _rule(entry: TruncatedNormal | UniformBand, nodes: int) -> tuple[Values, Values]:
    """Return values and weights of a Gauss rule of one input."""
    if isinstance(entry, UniformBand):
        return entry.quadrature(2 * nodes - 1)
    measure = Measure.of("theta_s", Distribution("theta_s", entry))
    rule = OrthonormalPolynomials(measure, nodes - 1)
    return rule.nodes, rule.weights


def _expectation(values: Values, rules: Sequence[Values]) -> float:
    for weights in rules:
        values = np.tensordot(weights, values, (0, 0))
    return float(values)


def _doubled(nodes: tuple[int, ...], axis: int) -> tuple[int, ...]:
    return tuple(2 * count if place == axis else count for place, count in enumerate(nodes))


def _checked_nodes(nodes: Sequence[int]) -> tuple[int, ...]:
    allowed = f"{len(PARAMETERS)} whole numbers from 1 on, of a product up to {MOST_NODES}"
    given = tuple(nodes)
    whole = all(isinstance(number, int | np.integer) and number >= 1 for number in given)
    if len(given) != len(PARAMETERS) or not whole or int(np.prod(given)) > MOST_NODES:
        raise InvalidInput("nodes", given, allowed)
    return tuple(int(number) for number in given)
