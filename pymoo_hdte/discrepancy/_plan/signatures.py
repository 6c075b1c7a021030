"""The changes that effects cause in every possible test, and how far others can imitate them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._answers.separation import unimitated
from pymoo_hdte.effects.effect import is_contained

Values = NDArray[np.float64]
Counts = NDArray[np.int_]

_RIDGE = 1e-10
"""Information on the directions of a rival, relative to that of all tests together. It keeps
equations solvable if two directions are the same."""


@dataclass(frozen=True)
class Imitation:
    """One linearised form of a rival: columns of `Signatures.grams`.

    Attributes
    ----------
    columns : tuple of int
    one_sided : bool
        Whether the first column, a strength, cannot be negative.
    """

    columns: tuple[int, ...]
    one_sided: bool = False


@dataclass(frozen=True, eq=False)
class Signatures:
    """Inner products of whitened changes, test by test.

    Columns are those of the effects to be found, of the rivals' imitations, and of the base
    parameters in units of their scale, in this order.

    Attributes
    ----------
    effects : tuple of str
        Labels of the effects to be found, with their ports.
    rivals : tuple of str
        Labels of the effects that may imitate them, with their ports.
    imitations : tuple of tuple of Imitation
        Forms of each rival.
    grams : ndarray, shape (n_tests, n, n)
    known : ndarray, shape (n,)
        Information on the columns before any test.
    held : ndarray of bool, shape (n_tests,), optional
        Tests whose load holds the tooth flanks together. In the others a drive with a clearance
        rattles, which no model predicts.
    rattling : frozenset of str
        Effects and rivals with a clearance, which only tests in ``held`` separate from others.
    """

    effects: tuple[str, ...]
    rivals: tuple[str, ...]
    imitations: tuple[tuple[Imitation, ...], ...]
    grams: Values
    known: Values
    held: NDArray[np.bool_] | None = None
    rattling: frozenset[str] = frozenset()

    @classmethod
    def of(
        cls,
        effects: Sequence[str],
        signatures: Sequence[Values],
        rivals: Sequence[tuple[str, Sequence[tuple[Sequence[Values], bool]]]],
        base: Values,
        base_known: Values,
    ) -> Signatures:
        """Return the inner products of signatures that are given by test.

        Parameters
        ----------
        effects : sequence of str
        signatures : sequence of ndarray, shape (n_tests, f)
            Whitened changes by the effects.
        rivals : sequence of (str, forms)
            Each form as its changes, (n_tests, f) each, and whether the first is one-sided.
        base : ndarray, shape (n_base, n_tests, f)
            Derivatives by the base parameters.
        base_known : ndarray, shape (n_base,)
            Information on them before any test.
        """
        columns, imitations = list(signatures), []
        for _, forms in rivals:
            of_rival = []
            for changes, one_sided in forms:
                places = tuple(range(len(columns), len(columns) + len(changes)))
                of_rival.append(Imitation(places, one_sided))
                columns += changes
            imitations.append(tuple(of_rival))
        moving = len(columns) - len(signatures)
        matrix = np.array([*columns, *base])
        by_test = np.moveaxis(matrix, 1, 0)
        grams = np.ascontiguousarray(by_test @ np.swapaxes(by_test, 1, 2))
        known = np.zeros(len(matrix))
        information = np.einsum("tii->i", grams)[len(signatures) : len(columns)]
        known[len(signatures) : len(columns)] = np.where(
            information > 0.0, _RIDGE * information, 1.0
        )
        known[len(signatures) + moving :] = base_known
        names = tuple(name for name, _ in rivals)
        return cls(tuple(effects), names, tuple(imitations), grams, known)

    def noncentralities(self, counts: Counts) -> tuple[Values, Values]:
        """Return what a set of tests leaves of each effect, alone and beside each rival.

        Parameters
        ----------
        counts : ndarray of int, shape (n_tests,)
            How often each test is made.

        Returns
        -------
        alone : ndarray, shape (n_effects,)
            Part that the base parameters cannot imitate.
        beside : ndarray, shape (n_effects, n_rivals)
            Part that the best form of a rival cannot imitate either, fitted with them.
        """
        alone, beside = self._of(counts)
        if self.held is not None and self.rattling and np.any(counts[~self.held]):
            effect, rival = (
                np.array([label in self.rattling for label in names])
                for names in (self.effects, self.rivals)
            )
            held_alone, held_beside = self._of(counts * self.held)
            alone = np.where(effect, held_alone, alone)
            beside = np.where(effect[:, None] | rival, held_beside, beside)
        return alone, beside

    def _of(self, counts: Counts) -> tuple[Values, Values]:
        """Return the `noncentralities` of all effects if every test counts for all of them."""
        flat = counts @ self.grams.reshape(len(self.grams), -1)
        together = flat.reshape(self.grams.shape[1:]) + np.diag(self.known)
        count = len(self.effects)
        moving = sum(len(form.columns) for forms in self.imitations for form in forms)
        unexplained = unimitated(together, count + moving)
        alone = np.maximum(np.diagonal(unexplained)[:count], 0.0)
        beside = np.repeat(alone[:, None], len(self.rivals), axis=1)
        if self.imitations:
            by_form = np.maximum(self._beside_forms(unexplained), 0.0)
            for rival in range(len(self.rivals)):
                forms = by_form[self._owners == rival]
                beside[:, rival] = np.minimum(alone, forms.min(axis=0))
        return alone, beside

    @cached_property
    def _forms(self) -> list[Imitation]:
        return [form for forms in self.imitations for form in forms]

    @cached_property
    def _owners(self) -> NDArray[np.int_]:
        sizes = [len(forms) for forms in self.imitations]
        return np.repeat(np.arange(len(sizes)), sizes)

    @cached_property
    def _places(self) -> tuple[NDArray[np.int_], NDArray[np.bool_]]:
        """Columns of each form, padded to the largest number, and a mask without the padding."""
        most = max(len(form.columns) for form in self._forms)
        places = np.zeros((len(self._forms), most), dtype=int)
        used = np.zeros(places.shape, dtype=bool)
        for row, form in enumerate(self._forms):
            places[row, : len(form.columns)] = form.columns
            used[row, : len(form.columns)] = True
        return places, used

    def _beside_forms(self, unexplained: Values) -> Values:
        """Return what each form leaves of each effect, shape (n_forms, n_effects)."""
        places, used = self._places
        count = len(self.effects)
        total = np.diagonal(unexplained)[:count]
        residual, strength = _unimitated_by_forms(unexplained, total, places, used)
        one_sided = np.array([form.one_sided for form in self._forms])
        weaker = used.copy()
        weaker[:, 0] = False
        without, _ = _unimitated_by_forms(unexplained, total, places, weaker)
        # Least squares under one bound: where it is violated, the solution lies at the bound.
        return np.where(one_sided[:, None] & (strength < 0.0), without, residual)


def _unimitated_by_forms(
    unexplained: Values, total: Values, places: NDArray[np.int_], used: NDArray[np.bool_]
) -> tuple[Values, Values]:
    """Return what forms leave of effects, and their strengths, both (n_forms, n_effects)."""
    used_pairs = used[:, :, None] & used[:, None, :]
    own = np.where(
        used_pairs, unexplained[places[:, :, None], places[:, None, :]], np.eye(places.shape[1])
    )
    cross = np.where(used[:, :, None], unexplained[places][:, :, : len(total)], 0.0)
    strengths = np.linalg.solve(own, cross)
    return total - np.sum(cross * strengths, axis=1), strengths[:, 0]


def is_rival(effect: str, rival: str) -> bool:
    """Tell whether a rival is another explanation than an effect, and does not contain it.

    Both are labels ``name:port``. A law that contains the effect imitates it in every test; the
    special case is then named.
    """
    (name, port), (rival_name, rival_port) = effect.split(":"), rival.split(":")
    return effect != rival and not (port == rival_port and is_contained(name, rival_name))
