"""What effects change in every possible test, and how far others can imitate it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.drive.candidates import drive_candidates
from pymoo_hdte.discrepancy.drive.evidence import Data, flanks_held
from pymoo_hdte.discrepancy.drive.features import MEANS
from pymoo_hdte.discrepancy.drive.objective import Objective
from pymoo_hdte.discrepancy.drive.plan.limits import PlanLimits
from pymoo_hdte.discrepancy.drive.separation import unimitated
from pymoo_hdte.discrepancy.drive.sizes import Scales, port_sizes
from pymoo_hdte.discrepancy.engine.candidate import Candidate, Layout
from pymoo_hdte.discrepancy.engine.fitting import Fit
from pymoo_hdte.drive import DriveEffect
from pymoo_hdte.effects.effect import effect_named, is_contained, place_of

Values = NDArray[np.float64]
Counts = NDArray[np.int_]
Change = Callable[[Sequence[DriveEffect]], Values]

_STEP = 1e-3
"""Step of difference quotients, in units of a parameter's scale."""
_RIDGE = 1e-10
"""Information on the directions of a rival, relative to what all tests together tell: it keeps
equations solvable where two directions are the same."""


@dataclass(frozen=True)
class Imitation:
    """One linearised form of a rival: columns of `Signatures.grams`.

    Attributes
    ----------
    columns : tuple of int
    one_sided : bool
        Whether the first of them, a strength, cannot be negative.
    """

    columns: tuple[int, ...]
    one_sided: bool = False


@dataclass(frozen=True, eq=False)
class Signatures:
    """Inner products of whitened changes, test by test.

    Columns are those of the effects to be found, then of the rivals' imitations, then of the base
    parameters in units of their scale.

    Attributes
    ----------
    effects : tuple of str
        Effects to be found, each with its port.
    rivals : tuple of str
        Effects that may imitate them, each with its port.
    imitations : tuple of tuple of Imitation
        For each of the rivals its forms.
    grams : ndarray, shape (n_tests, n, n)
    known : ndarray, shape (n,)
        Information on the columns before any test.
    held : ndarray of bool, shape (n_tests,), optional
        Tests whose load holds the tooth flanks together. In the others a drive with a clearance
        rattles, and what it does then is predicted for no model.
    rattling : frozenset of str
        Effects and rivals with a clearance, which only tests in ``held`` tell from others.
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
        told = np.einsum("tii->i", grams)[len(signatures) : len(columns)]
        known[len(signatures) : len(columns)] = np.where(told > 0.0, _RIDGE * told, 1.0)
        known[len(signatures) + moving :] = base_known
        names = tuple(name for name, _ in rivals)
        return cls(tuple(effects), names, tuple(imitations), grams, known)

    def noncentralities(self, counts: Counts) -> tuple[Values, Values]:
        """Return what a set of tests leaves of each effect, to no rival and to each of them.

        Parameters
        ----------
        counts : ndarray of int, shape (n_tests,)
            How often each test is made.

        Returns
        -------
        alone : ndarray, shape (n_effects,)
            Not imitated by the base parameters.
        beside : ndarray, shape (n_effects, n_rivals)
            Nor by a rival that is fitted with them: its best form.
        """
        alone, beside = self._of(counts)
        if self.held is not None and self.rattling and np.any(counts[~self.held]):
            effect, rival = (
                np.array([one in self.rattling for one in names])
                for names in (self.effects, self.rivals)
            )
            held_alone, held_beside = self._of(counts * self.held)
            alone = np.where(effect, held_alone, alone)
            beside = np.where(effect[:, None] | rival, held_beside, beside)
        return alone, beside

    def _of(self, counts: Counts) -> tuple[Values, Values]:
        """Return `noncentralities` of all effects by the same tests."""
        flat = counts @ self.grams.reshape(len(self.grams), -1)
        together = flat.reshape(self.grams.shape[1:]) + np.diag(self.known)
        count = len(self.effects)
        moving = sum(len(one.columns) for forms in self.imitations for one in forms)
        left = unimitated(together, count + moving)
        alone = np.maximum(np.diagonal(left)[:count], 0.0)
        beside = np.repeat(alone[:, None], len(self.rivals), axis=1)
        if self.imitations:
            by_form = np.maximum(self._beside_forms(left), 0.0)
            for rival in range(len(self.rivals)):
                forms = by_form[self._owners == rival]
                beside[:, rival] = np.minimum(alone, forms.min(axis=0))
        return alone, beside

    @cached_property
    def _forms(self) -> list[Imitation]:
        return [one for forms in self.imitations for one in forms]

    @cached_property
    def _owners(self) -> NDArray[np.int_]:
        sizes = [len(forms) for forms in self.imitations]
        return np.repeat(np.arange(len(sizes)), sizes)

    @cached_property
    def _places(self) -> tuple[NDArray[np.int_], NDArray[np.bool_]]:
        """Columns of each form, padded to the largest number, and which are no padding."""
        most = max(len(one.columns) for one in self._forms)
        places = np.zeros((len(self._forms), most), dtype=int)
        used = np.zeros(places.shape, dtype=bool)
        for row, one in enumerate(self._forms):
            places[row, : len(one.columns)] = one.columns
            used[row, : len(one.columns)] = True
        return places, used

    def _beside_forms(self, left: Values) -> Values:
        """Return what each form leaves of each effect, shape (n_forms, n_effects)."""
        places, used = self._places
        count = len(self.effects)
        whole = np.diagonal(left)[:count]
        rest, strength = _rest(left, whole, places, used)
        one_sided = np.array([one.one_sided for one in self._forms])
        weaker = used.copy()
        weaker[:, 0] = False
        without, _ = _rest(left, whole, places, weaker)
        # Least squares under one bound: where it is violated, the solution lies at the bound.
        return np.where(one_sided[:, None] & (strength < 0.0), without, rest)


def _rest(
    left: Values, whole: Values, places: NDArray[np.int_], used: NDArray[np.bool_]
) -> tuple[Values, Values]:
    """Return what forms leave of effects, and their strengths, both (n_forms, n_effects)."""
    both = used[:, :, None] & used[:, None, :]
    own = np.where(both, left[places[:, :, None], places[:, None, :]], np.eye(places.shape[1]))
    cross = np.where(used[:, :, None], left[places][:, :, : len(whole)], 0.0)
    strengths = np.linalg.solve(own, cross)
    return whole - np.sum(cross * strengths, axis=1), strengths[:, 0]


def signatures_of(data: Data, limits: PlanLimits, rated_torque: float) -> Signatures:
    """Return the signatures of effects for the tests behind data.

    Parameters
    ----------
    data : Data
        Of imagined records: running ones, then sweeps.
    limits : PlanLimits
    rated_torque : float
        Scale of torques where all loads are zero, N.m.
    """
    objective = Objective(data, ())
    residuals, jacobian = objective.residuals(objective.start), objective.jacobian(objective.start)
    fitted = Fit((), data.base, objective.start, residuals, jacobian)
    change = data.response(fitted)
    by_port: dict[str, list[Candidate]] = {}
    for one in _candidates(data, limits, rated_torque):
        if one.listed:
            by_port.setdefault(_label(one.name, one.port), []).append(one)
    wanted = _wanted(limits, by_port)
    rivals = [
        (
            label,
            [(_by_test(data, form), sided) for one in ones for form, sided in _forms(one, change)],
        )
        for label, ones in by_port.items()
    ]
    layout = Layout(data.base)
    widths = (layout.array("upper") - layout.array("lower")) / layout.array("scale")
    # What bounds tell counts as a uniform distribution between them, as in `Fit.covariance`.
    known = 12.0 / widths**2 + (layout.array("scale") / layout.array("prior")) ** 2
    found = Signatures.of(
        list(wanted),
        _by_test(data, [change(parts) for parts in wanted.values()]),
        rivals,
        np.array(_by_test(data, list(jacobian.T))),
        known,
    )
    held = flanks_held(data.features, data.campaign.torque_scale, data.rules)
    labels = {*wanted, *by_port}
    return replace(
        found,
        held=np.append(held, np.ones(len(data.torsion), dtype=bool)),
        rattling=frozenset(one for one in labels if effect_named(one.split(":")[0]).rattles),
    )


def is_rival(effect: str, rival: str) -> bool:
    """Tell whether a rival is another explanation than an effect, and no wider one that holds it.

    Both as labels ``name:port``. What contains the effect imitates it in every test; the special
    case is then named.
    """
    (one, port), (other, there) = effect.split(":"), rival.split(":")
    return effect != rival and not (port == there and is_contained(one, other))


def _label(name: str, port: str) -> str:
    return f"{name}:{port}"


def _candidates(data: Data, limits: PlanLimits, rated_torque: float) -> list[Candidate]:
    """Return candidates at the sizes that matter, lines at the orders of the stated effects."""
    believed, features = data.campaign.believed, data.features
    paths = [float(np.abs(one.path).max()) for one in data.torsion]
    torque = max([float(np.abs(features.conditions.output_torque).max()), *paths])
    torque = torque if limits.sweeps or any(limits.loads) else rated_torque
    motor = float(np.abs(features.values[:, MEANS.index(1)]).max())
    motor = max(motor, torque / believed.ratio)
    braking = features.conditions.output_torque * np.sign(features.conditions.input_speed)
    least = data.campaign.torque_scale * data.rules.least_held_load
    scales = Scales(
        speed=float(np.abs(features.conditions.input_speed).max()),
        torque=torque,
        motor_torque=motor,
        duration=limits.session,
        error=limits.share * torque / believed.stiffness,
        input_torque=limits.share * motor,
        output_torque=limits.share * torque,
        driven=bool(braking.max() > least and braking.min() < -least),
    )
    seen = stated_orders(limits.effects, believed.ratio)
    sizes = port_sizes(believed, features.orders.tolist(), seen, scales)
    return drive_candidates(sizes, believed.effects)


def stated_orders(effects: Sequence[DriveEffect], ratio: float) -> list[float]:
    """Return the orders of effects in cycles per input turn."""
    found = set()
    for effect in effects:
        _, port, order = place_of(effect)
        if order is not None:
            found.add(order / (ratio if port in ("output", "sensor") else 1.0))
    return sorted(found)


def _wanted(
    limits: PlanLimits, by_port: dict[str, list[Candidate]]
) -> dict[str, tuple[DriveEffect, ...]]:
    """Return the effects to be found by their label; stated ones of one label act together."""
    if not limits.effects:
        return {
            label: ones[0].build([one.start for one in ones[0].parameters])
            for label, ones in by_port.items()
        }
    found: dict[str, tuple[DriveEffect, ...]] = {}
    for effect in limits.effects:
        name, port, _ = place_of(effect)
        label = _label(name, port)
        found[label] = (*found.get(label, ()), effect)
    return found


def _forms(one: Candidate, change: Change) -> list[tuple[list[Values], bool]]:
    """Return the linearised forms of a candidate: changes, and whether the first is one-sided."""
    if one.linear:
        return [([change(one.build(start)) for start in one.starts], False)]
    one_sided = one.parameters[0].lower >= 0.0
    found = []
    for start in one.starts:
        here = change(one.build(start))
        changes = [here]
        for place, parameter in enumerate(one.parameters[1:], start=1):
            step = _STEP * parameter.scale
            step = -step if start[place] + step > parameter.upper else step
            moved = [value + step * (k == place) for k, value in enumerate(start)]
            changes.append((change(one.build(moved)) - here) / _STEP)
        found.append((changes, one_sided))
    return found


def _by_test(data: Data, rows: Sequence[Values]) -> list[Values]:
    """Return whitened changes as arrays of tests, (n_tests, f), padded with zeros."""
    records, size = data.features.values.shape
    widest = max([size, *(len(one.angle) - 1 for one in data.torsion)])
    found = []
    for row in rows:
        placed = np.zeros((records + len(data.torsion), widest))
        placed[:records, :size] = np.nan_to_num(row[: records * size]).reshape(records, size)
        start = records * size
        for k, points in enumerate(data.torsion):
            length = len(points.angle) - 1
            placed[records + k, :length] = np.nan_to_num(row[start : start + length])
            start += length
        found.append(placed)
    return found
