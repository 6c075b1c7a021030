"""Mean and deviation of a sparse polynomial at very many designs, as machine code.

The same steps as in `SparseMoments`, with the designs of a block innermost in every loop, where a
processor does several at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._compilation import compiled
from pymoo_hdte.surrogate._sparse.index_set import AxisMap
from pymoo_hdte.surrogate._sparse.measures import OrthonormalPolynomials

Array = NDArray[np.float64]
Numbers = NDArray[np.int_]

_BLOCK = 64
"""Designs that go through all steps together: their numbers fit a processor's near caches."""


class ManyDesigns:
    """The steps of an expansion, laid out for machine code.

    Parameters
    ----------
    coefficients : ndarray, shape (r, p)
        Coefficients before the first step.
    steps : list of AxisMap, length m
        Steps of the designed axes, in their order.
    families : list of OrthonormalPolynomials, length m
        Orthonormal polynomials under their scatter.
    """

    def __init__(
        self, coefficients: Array, steps: list[AxisMap], families: list[OrthonormalPolynomials]
    ) -> None:
        self._coefficients = np.ascontiguousarray(coefficients)
        self._columns = np.array([step.columns for step in steps])
        rows = np.array([family.size for family in families])
        self._rows = rows
        self._nodes = np.zeros((len(steps), rows.max()))
        self._rules = np.zeros((len(steps), rows.max(), rows.max()))
        for j, family in enumerate(families):
            self._nodes[j, : rows[j]] = family.nodes
            self._rules[j, : rows[j], : rows[j]] = family(family.nodes) * family.weights
        pairs = [step.pairs() for step in steps]
        self._pairs = np.concatenate(pairs, axis=0)
        self._ends = np.append(0, np.cumsum([len(step_pairs) for step_pairs in pairs]))
        self._sizes = np.array([coefficients.shape[1], *(len(step.result) for step in steps)])
        final_indices = steps[-1].result
        self._mean_place = int(np.flatnonzero((final_indices == 0).all(axis=1))[0])

    def __call__(self, offsets: Array, factors: Array) -> tuple[Array, Array]:
        """Return mean and deviation, shape (n, r) each, from A and B of every axis, (m, n)."""
        moments = np.empty((2, offsets.shape[1], len(self._coefficients)))
        # Room for a block, made here: what makes it in machine code takes a second to compile.
        columns, terms = self._columns.max(), self._sizes.max()
        work = (
            np.empty((len(self._rows), self._rows.max(), columns, _BLOCK)),
            np.empty((columns + 1, _BLOCK)),
            np.empty((terms, _BLOCK)),
            np.empty((terms, _BLOCK)),
        )
        _moments(
            (np.ascontiguousarray(offsets), np.ascontiguousarray(factors)),
            (self._nodes, self._rules, self._rows, self._columns),
            (self._pairs, self._ends, self._sizes, self._mean_place),
            self._coefficients,
            work,
            moments,
        )
        return moments[0], moments[1]


@compiled
def _matrices(places, families, start, count, matrix, basis):  # type: ignore[no-untyped-def]
    """Fill matrix[j, l, k, b] for a block of designs: what changes T_k(A + B s) into p_l(s)."""
    offsets, factors = places
    nodes, rules, rows, columns = families
    for j in range(len(rows)):
        for row in range(rows[j]):
            for k in range(columns[j]):
                for b in range(count):
                    matrix[j, row, k, b] = 0.0
        for q in range(rows[j]):
            for b in range(count):
                basis[0, b] = 1.0
                basis[1, b] = offsets[j, start + b] + factors[j, start + b] * nodes[j, q]
            for k in range(2, columns[j]):
                for b in range(count):
                    basis[k, b] = 2.0 * basis[1, b] * basis[k - 1, b] - basis[k - 2, b]
            for row in range(rows[j]):
                rule = rules[j, row, q]
                for k in range(row, columns[j]):
                    for b in range(count):
                        matrix[j, row, k, b] += rule * basis[k, b]


@compiled
def _moments(places, families, steps, coefficients, work, moments):  # type: ignore[no-untyped-def]
    pairs, ends, sizes, mean_place = steps
    matrix, basis, old, new = work
    n = places[0].shape[1]
    for start in range(0, n, _BLOCK):
        count = min(_BLOCK, n - start)
        _matrices(places, families, start, count, matrix, basis)
        for response in range(len(coefficients)):
            for p in range(sizes[0]):
                for b in range(count):
                    old[p, b] = coefficients[response, p]
            for j in range(len(matrix)):
                for p in range(sizes[j + 1]):
                    for b in range(count):
                        new[p, b] = 0.0
                for place in range(ends[j], ends[j + 1]):
                    target, source = pairs[place, 0], pairs[place, 1]
                    row, column = pairs[place, 2], pairs[place, 3]
                    for b in range(count):
                        new[target, b] += matrix[j, row, column, b] * old[source, b]
                old, new = new, old
            for b in range(count):
                moments[0, start + b, response] = old[mean_place, b]
                moments[1, start + b, response] = 0.0
            for p in range(sizes[-1]):
                if p != mean_place:
                    for b in range(count):
                        moments[1, start + b, response] += old[p, b] ** 2
            for b in range(count):
                moments[1, start + b, response] = np.sqrt(moments[1, start + b, response])
