"""A model that describes the records of a mechanism as well as they allow, whatever the verdict.

A verdict names what is proved. This model takes every term that predicts the force balances better
where it was not fitted: by forward selection with cross-validation over blocks of time (Burman,
Chow and Nolan, Biometrika 81, 1994) and the rule of one standard error (Breiman et al.,
Classification and Regression Trees, 1984). It describes, and diagnoses nothing.

All terms are linear: of a law whose shape has unknowns, such as the speed at which a friction
fades, each start of the search is a term of its own. So that a fold is a few small matrices.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.force_balances.candidates import mechanism_candidates
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData, measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.intervals import Spread
from pymoo_hdte.discrepancy._evidence.force_balances.orders import position_orders
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import (
    fitted_values,
    port_forces,
    root_mean_square,
)
from pymoo_hdte.discrepancy._records.rig_model import MechanismModel
from pymoo_hdte.discrepancy._records.split import SPLIT
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import laws_of
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.linear import ConstantForce, LinearDamper
from pymoo_hdte.mechanism import LawAt, Mechanism
from pymoo_hdte.mechanism.balances import ForceBalance, quantity_names
from pymoo_hdte.mechanism.believed import SMALLEST_SHARE
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force
from pymoo_hdte.mechanism.quantity_units import base_unit, unit_of, unit_of_number

Values = NDArray[np.float64]

DESCRIPTIVE_FILE = "descriptive_model.toml"

_BLOCKS = 10
"""Blocks of time of the training records, at least."""
_LEFT_OUT = 1.0 - SPLIT
"""Share of the blocks, one after the other, that is predicted from the others: as much as is held
out of a record by default, so that a model is judged by how far it has to reach."""
_WHOLE_RECORDS = 5
"""Number of training records from which each is a block."""
_ROWS_PER_PERIOD = 5.0
"""Rows of a balance in a period of the cutoff: 2.5 times as many as determine it."""
_RIDGE = 1e-10
"""Keeps apart columns that are the same in some blocks, in units of their own power."""
_SUBSAMPLE = 1000
"""Rows of a motion on which it is seen whether a law is linear in an unknown."""
_SLOWER = (1.0, 0.1, 0.01)
"""Shares of the speeds of a record at which no effect may be larger than all of its forces."""
_SAME = 1e-6
"""Share up to which two forces count as equal."""
_SIMPLE = ("viscous_friction", "coulomb_friction", "force_offset", "gravity", "linear_stiffness")
"""Effects that least squares with six terms has, beside the quantities of the mechanism."""
_OF_BASE = ("inertia", "damping", "stiffness")
"""Kinds of quantities that may leave their limits; a gain is the scale of all forces."""


@dataclass(frozen=True)
class DescribedValue:
    """A number of the model; ``interval95`` is None for one that is held, or ends at its bound.

    Attributes
    ----------
    value : float
        SI.
    interval95 : (float, float) or None
        By the jackknife over the blocks of time; of a quantity that keeps the value of the
        accepted fit, that of the fit.
    unit : str
    """

    value: float
    interval95: tuple[float, float] | None
    unit: str

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        interval = None if self.interval95 is None else list(self.interval95)
        return {"value": self.value, "interval95": interval, "unit": self.unit}


@dataclass(frozen=True)
class BalanceErrors:
    """Root mean squares of what models leave of a force balance.

    Attributes
    ----------
    record : str
        A held-out record; empty for the training records, each block predicted from the others.
    quantity, unit : str
        Name of the balance, and its unit.
    base, accepted, descriptive, six_terms : float
        Of the fitted base, of what the verdict accepts, of this model, and of least squares with
        a, v, sign v, sin q, cos q and 1 at each port.
    """

    record: str
    quantity: str
    unit: str
    base: float
    accepted: float
    descriptive: float
    six_terms: float

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        return dict(vars(self))


@dataclass(frozen=True, eq=False)
class DescriptiveModel:
    """A model with all terms that predict better; it describes, and does not diagnose.

    Attributes
    ----------
    model : MechanismModel
        What `read_mechanism_model` reads from ``descriptive_model.toml``.
    values : dict of str to DescribedValue
        Inertias, springs and dampers.
    effects : tuple of (LawAt, dict of str to DescribedValue)
        The terms, each with its numbers.
    cross_validated : tuple of BalanceErrors
        Of the training records, each block predicted from the others.
    held_out : tuple of BalanceErrors
        Of the records that were not fitted.
    """

    model: MechanismModel
    values: Mapping[str, DescribedValue]
    effects: tuple[tuple[LawAt, dict[str, DescribedValue]], ...]
    cross_validated: tuple[BalanceErrors, ...]
    held_out: tuple[BalanceErrors, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values, without the model itself."""
        return {
            "values": {name: one.as_dict() for name, one in self.values.items()},
            "effects": [
                {
                    "name": effect.name,
                    "port": effect.port,
                    "parameters": {name: one.as_dict() for name, one in numbers.items()},
                }
                for effect, numbers in self.effects
            ],
            "cross_validated": [one.as_dict() for one in self.cross_validated],
            "held_out": [one.as_dict() for one in self.held_out],
        }


@dataclass(frozen=True, eq=False)
class _Term:
    """What is free together: a quantity of the mechanism, or an effect of held shape.

    Attributes
    ----------
    columns : tuple of int
        Places of its coefficients among all columns.
    lower, upper : ndarray, shape (len(columns),)
    fixed : int or None
        Column of the force that it has whatever its coefficients.
    quantity : str
        Of the mechanism; empty for an effect.
    candidate : Candidate or None
    shape : tuple of float
        All values of the candidate; those at ``free`` are the coefficients.
    free : tuple of int
    bends : bool
        Whether its force depends on the stiffness of its port.
    """

    columns: tuple[int, ...]
    lower: Values
    upper: Values
    fixed: int | None = None
    quantity: str = ""
    candidate: Candidate | None = None
    shape: tuple[float, ...] = ()
    free: tuple[int, ...] = ()
    bends: bool = False

    def laws(self, coefficients: Values) -> tuple[LawAt, ...]:
        """Return the laws for all coefficients of the design."""
        if self.candidate is None:
            return ()
        values = list(self.shape)
        for place, column in zip(self.free, self.columns, strict=True):
            values[place] = float(coefficients[column])
        return laws_of(self.candidate.build(values))

    def excludes(self, term: _Term) -> bool:
        """Tell whether a mechanism cannot have both."""
        if self.candidate is None or term.candidate is None:
            return any(
                one.quantity.startswith("stiffness") and two.bends and two.at(one.quantity)
                for one, two in ((self, term), (term, self))
            )
        return not self.candidate.goes_with(term.candidate)

    def at(self, quantity: str) -> bool:
        """Tell whether a quantity is that of its port."""
        return self.candidate is not None and quantity.endswith(f" of {self.candidate.port}")

    def holds(self, term: _Term) -> bool:
        """Tell whether another effect is a special case of this one, or the same effect."""
        if self.candidate is None or term.candidate is None:
            return self.quantity != "" and self.quantity == term.quantity
        ours, theirs = self.candidate, term.candidate
        same = ours.name == theirs.name and ours.order == theirs.order
        return ours.port == theirs.port and (same or ours.holds(theirs))


class _Design:
    """Columns of the force balances of the training records in blocks of time.

    A residual is ``columns @ coefficients``. The first column is what no coefficient changes.
    """

    def __init__(self, finding: MechanismFinding) -> None:
        self.finding, self.data = finding, finding.data
        self.mechanism = finding.mechanism
        self.quantities = quantity_names(self.mechanism)
        self.names = self.data.names
        accepted = finding.accepted
        self.nominal = {name: one.value for name, one in self.mechanism.quantities.items()}
        self.nominal |= fitted_values(self.mechanism, accepted)
        self.nominal |= {
            one.name: float(value)
            for one, value in zip(accepted.parameters, accepted.values, strict=True)
            if one.name in self.quantities
        }
        self._peaks: dict[str, float] = {}
        self._columns: list[list[Values]] = []
        """By column and record, shape (n_balances, n_bins)."""
        self.terms: list[_Term] = []
        """What may be added: candidates of held shapes."""
        self._add([b.constant - b.forces(self.data.known, *self._sprung) for b in self.spectra])
        self._add_base()
        self._add_six()
        self.accepted = [
            term
            for candidate, place in accepted.places
            if candidate.parameters
            for term in [self._effect(candidate, tuple(accepted.values[place].tolist()), True)]
            if term is not None
        ]

    @property
    def spectra(self) -> tuple[ForceBalance, ...]:
        """The force balances of the training records."""
        return self.data.spectra

    @property
    def _sprung(self) -> tuple[dict[str, float]]:
        """Stiffness of each port."""
        return (_stiffness(self.nominal),)

    def _add(self, column: list[Values]) -> int:
        self._columns.append(column)
        self.__dict__.pop("blocks", None)
        return len(self._columns) - 1

    def _force(self, effects: Sequence[LawAt]) -> list[Values]:
        return [-balance.forces(effects, *self._sprung) for balance in self.spectra]

    def _add_base(self) -> None:
        """Add the quantities; those that are not stated take the values of the accepted fit."""
        measured = bool(self.mechanism.inputs) or any(port.read for port in self.mechanism.ports)
        self.fixed = {0: 1.0}
        self.base: list[_Term] = []
        self.within: list[_Term] = []
        """The quantities released from their tolerances, and within them."""
        for row, name in enumerate(self.quantities):
            column = self._add([balance.terms[:, row] for balance in self.spectra])
            self.fixed[column] = self.nominal.get(name, 0.0)
            kind, believed = name.partition(" of ")[0], self.mechanism.quantities.get(name)
            # Without a measured force the quantities that are known exactly set the scale.
            known = believed is not None and believed.known and not measured
            if (kind in _OF_BASE and not known) or kind == "zero":
                # A mass cannot be negative. What a damper describes may fall with the speed.
                least = (
                    SMALLEST_SHARE * believed.value if believed and kind != "damping" else -np.inf
                )
                self.base.append(_quantity(column, name, least, np.inf))
                if believed is None or not believed.known:
                    limits = believed.fit_limits if believed else (-np.inf, np.inf)
                    self.within.append(_quantity(column, name, *limits))

    def _add_six(self) -> None:
        """Add the columns of least squares with six terms."""
        self.six = [
            term.columns[0] for term in self.base if not term.quantity.startswith("stiffness")
        ]
        for port in self.mechanism.ports:
            if port.read:
                continue
            laws: dict[str, list[Any]] = {
                "viscous_friction": [LinearDamper(1.0)] if not port.damping.value else [],
                "coulomb_friction": [CoulombFriction(1.0)],
                "gravity": [Gravity(1.0, 0.0), Gravity(1.0, np.pi / 2.0)],
                "force_offset": [ConstantForce(1.0)],
            }
            self.six += [
                self._add(self._force([LawAt(name, port.name, law)]))
                for name, of_name in laws.items()
                for law in of_name
            ]

    def offer(self, candidates: Sequence[Candidate]) -> None:
        """Add candidates as terms, one for each shape that their starts have."""
        for candidate in candidates:
            known: set[tuple[float, ...]] = set()
            for start in candidate.starts if candidate.parameters else ():
                term = None if candidate.remembers else self._effect(candidate, start, False, known)
                if term is not None:
                    self.terms.append(term)

    def _effect(
        self,
        candidate: Candidate,
        start: tuple[float, ...],
        accepted: bool,
        known: set[tuple[float, ...]] | None = None,
    ) -> _Term | None:
        """Return a candidate as a term; None where no unknown of it is linear.

        A start of a shape that is among the ``known`` ones is none, unless it is accepted.
        """
        try:
            free, bends = self._linear(candidate, start)
        except InvalidInput:
            # A law does not take the steps by which it is tried.
            return None
        shape = tuple(0.0 if place in free else value for place, value in enumerate(start))
        if not accepted and (not free or (known is not None and shape in known)):
            return None
        if known is not None:
            known.add(shape)
        constant = self._force(laws_of(candidate.build(shape)))
        moving = max(float(np.abs(one).max(initial=0.0)) for one in constant) > 0.0
        if moving and not accepted:
            return None
        columns = []
        for place in free:
            values = list(shape)
            values[place] = candidate.parameters[place].scale
            force = self._force(laws_of(candidate.build(values)))
            columns.append(
                self._add(
                    [
                        (one - none) / values[place]
                        for one, none in zip(force, constant, strict=True)
                    ]
                )
            )
        lower = np.array([candidate.parameters[place].lower for place in free])
        above = np.array([self._most(candidate, shape, place) for place in free])
        below = np.where(lower == 0.0, 0.0, -above)
        fixed = self._add(constant) if moving else None
        return _Term(tuple(columns), below, above, fixed, "", candidate, shape, tuple(free), bends)

    def _most(self, candidate: Candidate, shape: tuple[float, ...], place: int) -> float:
        """Return the size at which an effect alone is as large as all forces that were measured.

        At any speed up to those of the records: a friction that had faded wherever the port moved
        would otherwise take any size.
        """
        scale = candidate.parameters[place].scale
        values = [scale if i == place else value for i, value in enumerate(shape)]
        forces = [
            self._small_force(laws_of(candidate.build(one)), 1.0, slower)
            for slower in _SLOWER
            for one in (values, list(shape))
        ]
        unit = max(
            float(np.abs(with_it - without).max(initial=0.0))
            for with_it, without in zip(forces[::2], forces[1::2], strict=True)
        )
        return abs(scale) * self._peak(candidate.port) / unit if unit > 0.0 else np.inf

    def _peak(self, port: str) -> float:
        """Return the sum of the largest forces of all that acts at the coordinates of a port."""
        if port not in self._peaks:
            of_port = self.mechanism.port(port)
            shares = {port: 1.0} if of_port.read else of_port.motion
            largest = 0.0
            for balance in self.spectra:
                for name, share in shares.items():
                    row = self.names.index(name)
                    forces = [balance.constant[row]]
                    forces += [
                        self.nominal.get(quantity, 0.0) * balance.terms[row, place]
                        for place, quantity in enumerate(self.quantities)
                    ]
                    peaks = (np.abs(balance.in_time(force)).max() for force in forces)
                    largest = max(largest, sum(map(float, peaks)) / abs(share) if share else 0.0)
            self._peaks[port] = largest
        return self._peaks[port]

    def _linear(self, candidate: Candidate, start: tuple[float, ...]) -> tuple[list[int], bool]:
        """Return the unknowns in which a force is linear, and whether it depends on a stiffness."""
        scales = [parameter.scale for parameter in candidate.parameters]

        def force(steps: Mapping[int, float], stiffer: float = 1.0) -> Values:
            values = [v + steps.get(i, 0.0) * scales[i] for i, v in enumerate(start)]
            return self._small_force(laws_of(candidate.build(values)), stiffer)

        here = force({})
        size = float(np.abs(here).max(initial=0.0)) or 1.0
        free: list[int] = []
        together = here
        for place in range(len(scales)):
            once, twice = force({place: 0.5}), force({place: 1.0})
            unseen = np.abs(twice - here).max() <= _SAME * size
            if unseen or np.abs(twice - 2.0 * once + here).max() > _SAME * size:
                continue
            joint = force({**dict.fromkeys(free, 0.5), place: 0.5})
            if np.abs(joint - together - once + here).max() <= _SAME * size:
                free.append(place)
                together = joint
        return free, bool(np.abs(force({}, 1.1) - here).max() > _SAME * size)

    def _small_force(self, effects: Sequence[LawAt], stiffer: float, slower: float = 1.0) -> Values:
        """Return the forces of laws on some rows of the first record, at a share of its speed."""
        total: Values = np.zeros(_SUBSAMPLE)
        (stiffness,) = self._sprung
        for effect in effects:
            here = stiffness.get(effect.port, self.mechanism.port(effect.port).stiffness.value)
            motion = _thinned(self.spectra[0].ports[effect.port])
            motion = replace(motion, speed=slower * motion.speed)
            total = total + law_force(effect.law, motion, stiffer * here)
        return total

    @cached_property
    def blocks(self) -> Values:
        """Products of all columns, by block and balance; shape (n_blocks, n_balances, p, p)."""
        each = 1
        if len(self.spectra) < _WHOLE_RECORDS:
            each = -(-_BLOCKS // len(self.spectra))
        found = []
        for record, balance in enumerate(self.spectra):
            signals = np.array(
                [
                    [balance.in_time(row)[balance.moving.weight > 0.0] for row in column[record]]
                    for column in self._columns
                ]
            )
            step = float(balance.time[1] - balance.time[0])
            highest = float(balance.frequency[-1]) or balance.cutoff
            stride = max(int(1.0 / (_ROWS_PER_PERIOD * step * highest)), 1)
            rows = signals[:, :, ::stride]
            found += [
                stride * np.einsum("pbn,qbn->bpq", part, part, optimize=True)
                for part in np.array_split(rows, each, axis=2)
            ]
        self.samples = sum(balance.moving.count for balance in self.spectra)
        return np.array(found)

    def spectra_of(self, coefficients: Values) -> list[Values]:
        """Return the residual of each record, (n_balances, n_bins)."""
        return [
            np.einsum("p,pbk->bk", coefficients, np.array([one[record] for one in self._columns]))
            for record in range(len(self.spectra))
        ]

    def whitened(self, coefficients: Values) -> Values:
        """Return the residual in the form of the data's residuals, (n,)."""
        return np.concatenate(
            [
                (one / deviation)[balance.kept]
                for one, deviation, balance in zip(
                    self.spectra_of(coefficients), self.data.deviation, self.spectra, strict=True
                )
            ]
        )


class _Selection:
    """Cross-validated errors of sets of terms of a design."""

    def __init__(self, design: _Design) -> None:
        self.design = design
        # Each balance in units of what six terms leave of it, so that N and N.m can be added.
        total = design.blocks.sum(axis=0)
        left = self._six_coefficients(total.sum(axis=0))
        power = np.einsum("p,bpq,q->b", left, total, left)
        self.weight = 1.0 / np.maximum(power, 1e-300)
        self.blocks = np.einsum("b,kbpq->kpq", self.weight, design.blocks)
        whole = self.blocks.sum(axis=0)
        count = len(self.blocks)
        width = max(round(_LEFT_OUT * count), 1)
        self.windows = [slice(first, first + width) for first in range(count - width + 1)]
        without = [whole - self.blocks[window].sum(axis=0) for window in self.windows]
        self.parts = np.array([*without, whole])
        """What the windows are predicted from, and everything."""
        self.without_one = np.array([*(whole - self.blocks), whole])
        """Everything but a block, and everything."""

    def _six_coefficients(self, product: Values) -> Values:
        design = self.design
        full = np.zeros(len(product))
        full[0] = 1.0
        for column, value in design.fixed.items():
            if column not in design.six:
                full[column] = value
        columns = np.array(design.six, dtype=int)
        size = np.sqrt(np.maximum(np.diag(product)[columns], 1e-300))
        scaled = product[np.ix_(columns, columns)] / np.outer(size, size)
        pull = -product[columns] @ full + product[np.ix_(columns, columns)] @ full[columns]
        full[columns] = np.linalg.pinv(scaled, rcond=_RIDGE, hermitian=True) @ (pull / size) / size
        return full

    def six_terms(self) -> Values:
        """Return the coefficients of least squares with six terms, (n_windows + 1, p)."""
        return np.array([self._six_coefficients(product) for product in self.parts])

    def coefficients(self, terms: Sequence[_Term], parts: Values | None = None) -> Values:
        """Return the bounded least squares of terms by part, by default (n_windows + 1, p)."""
        parts = self.parts if parts is None else parts
        full = np.zeros(parts.shape[:2])
        for column, value in self.design.fixed.items():
            full[:, column] = value
        for term in terms:
            if term.fixed is not None:
                full[:, term.fixed] = 1.0
        columns = np.array([column for term in terms for column in term.columns], dtype=int)
        if not len(columns):
            return full
        lower = np.concatenate([term.lower for term in terms])
        upper = np.concatenate([term.upper for term in terms])
        full[:, columns] = 0.0
        pull = -np.einsum("kpq,kq->kp", parts[:, columns], full)
        size = np.sqrt(np.maximum(np.diag(parts[-1])[columns], 1e-300))
        inner = parts[:, columns[:, None], columns] / np.outer(size, size)
        inner += _RIDGE * np.eye(len(columns))
        found = np.linalg.solve(inner, (pull / size)[:, :, None])[:, :, 0] / size
        for part in np.flatnonzero(np.any((found < lower) | (found > upper), axis=1)):
            limits = lower * size, upper * size
            found[part] = _bounded(inner[part], pull[part] / size, *limits) / size
        full[:, columns] = found
        return full

    def errors(self, coefficients: Values) -> Values:
        """Return the errors of the blocks, each predicted from windows without it, (n_blocks,)."""
        return np.einsum("b,kb->k", self.weight, self.errors_by_balance(coefficients))

    def errors_by_balance(self, coefficients: Values) -> Values:
        """Return the sums of squares of the blocks, (n_blocks, n_balances)."""
        blocks = self.design.blocks
        total, counted = np.zeros(blocks.shape[:2]), np.zeros((len(blocks), 1))
        for values, window in zip(coefficients[:-1], self.windows, strict=True):
            total[window] += (blocks[window] @ values) @ values
            counted[window] += 1.0
        return total / counted

    def of(self, terms: Sequence[_Term]) -> Values:
        """Return the errors of the folds with terms."""
        return self.errors(self.coefficients(terms))

    def grown(self, terms: Sequence[_Term]) -> list[_Term]:
        """Return a set with every term that predicts better, and without those that do not."""
        chosen = list(terms)
        errors = self.of(chosen)
        while True:
            extended = [
                (float(trial.mean()), trial, one)
                for one in self._extensions(chosen)
                for trial in [self.of(one)]
            ]
            if not extended:
                break
            _, trial, best = min(extended, key=lambda each: each[0])
            if not _falls(errors, trial, len(extended)):
                break
            chosen, errors = best, trial
        return self._pruned(chosen)

    def _extensions(self, terms: Sequence[_Term]) -> Iterator[list[_Term]]:
        """Yield sets with one term more, which replaces what it holds."""
        for term in (*self.design.base, *self.design.terms):
            if any(term is one for one in terms):
                continue
            remaining = [one for one in terms if not term.holds(one)]
            held = any(one.holds(term) for one in remaining)
            if not held and not any(one.excludes(term) for one in remaining):
                yield [*remaining, term]

    def _pruned(self, terms: list[_Term]) -> list[_Term]:
        """Return a set without the terms without which it predicts better."""
        while terms:
            least = float(self.of(terms).mean())
            without = [[one for one in terms if one is not term] for term in terms]
            means = [float(self.of(one).mean()) for one in without]
            if min(means) > least:
                break
            terms = without[int(np.argmin(means))]
        return terms


def descriptive_model(title: str, finding: MechanismFinding) -> DescriptiveModel:
    """Return the model that predicts the force balances best, by the training records alone.

    Parameters
    ----------
    title : str
        Of the records.
    finding : MechanismFinding
        Of which nothing is changed.
    """
    design = _Design(finding)
    six = _Selection(design).six_terms()[-1]
    design.offer(_candidates(finding, design, six))
    selection = _Selection(design)
    simple = [*design.base, *_simple(design.terms)]
    within = [one for one in design.within if not any(one.excludes(law) for law in design.accepted)]
    accepted = [*within, *design.accepted]
    terms, further = (selection.grown(start) for start in (simple, accepted))
    if _falls(selection.of(terms), selection.of(further)):
        terms = further
    coefficients = selection.coefficients(terms, selection.without_one)
    laws = [law for term in terms for law in term.laws(coefficients[-1])]
    values = {name: float(coefficients[-1, 1 + row]) for row, name in enumerate(design.quantities)}
    model = MechanismModel(
        f"{title} (describes, does not diagnose)",
        *_mechanism(finding.mechanism, values, (*finding.believed, *laws, *finding.ripples.laws)),
        finding.cutoff,
    )
    base, six_terms = design.within, selection.six_terms()
    compared = [selection.coefficients(one) for one in (base, accepted, terms)]
    return DescriptiveModel(
        model,
        _values(design, terms, coefficients),
        _effects(finding, terms, coefficients),
        _cross_validated(selection, [*compared, six_terms]),
        _held_out(finding, values, laws, design, six_terms[-1]),
    )


def _mechanism(
    mechanism: Mechanism, values: Mapping[str, float], laws: Sequence[LawAt]
) -> tuple[Mechanism, tuple[LawAt, ...]]:
    """Return the mechanism with values and laws; a damper below zero is a law at its port."""
    stated = {name: value for name, value in values.items() if name in mechanism.quantities}
    falling = []
    for port in mechanism.ports:
        name = f"damping of {port.name}"
        if stated.get(name, 1.0) <= 0.0:
            least = SMALLEST_SHARE * port.damping.value
            damper = LinearDamper(stated[name] - least)
            falling.append(LawAt("viscous_friction", port.name, damper))
            stated[name] = least
    return mechanism.with_values(stated, exactly=False), (*laws, *falling)


def _candidates(finding: MechanismFinding, design: _Design, six: Values) -> list[Candidate]:
    """Return every effect that a port may have, with the orders that six terms leave."""
    data = design.data
    left = replace(finding.verdict.base, residuals=design.whitened(six))
    return mechanism_candidates(
        data, port_forces(data, left.residuals), position_orders(data, left)
    )


def _simple(terms: Sequence[_Term]) -> list[_Term]:
    """Return the terms of least squares with six terms: a spring where gravity cannot pull."""
    found: list[_Term] = []
    for name in _SIMPLE:
        for term in terms:
            candidate = term.candidate
            if candidate is None or candidate.name != name or candidate.form:
                continue
            weight = any(
                one.candidate
                and (one.candidate.name, one.candidate.port) == ("gravity", candidate.port)
                for one in found
            )
            if not (name == "linear_stiffness" and weight):
                found.append(term)
    return found


def _falls(before: Values, after: Values, tried: int = 1) -> bool:
    """Tell whether errors of blocks, (n_blocks,), fall by more than the standard error of that.

    Of several that were ``tried`` the best falls by chance by so many standard errors as is
    expected of the largest of as many normal numbers (Donoho and Johnstone, Biometrika 81, 1994).
    """
    change = before - after
    chance = max(1.0, (2.0 * np.log(tried)) ** 0.5)
    return bool(change.mean() > chance * change.std(ddof=1) / len(change) ** 0.5)


def _quantity(column: int, name: str, lower: float, upper: float) -> _Term:
    return _Term((column,), np.array([lower]), np.array([upper]), quantity=name)


def _bounded(inner: Values, pull: Values, lower: Values, upper: Values) -> Values:
    """Return the least squares within bounds: what goes beyond one stays at it."""
    found, free = np.zeros(len(pull)), np.ones(len(pull), dtype=bool)
    while free.any():
        held = np.where(free, 0.0, found)
        found[free] = np.linalg.solve(inner[np.ix_(free, free)], (pull - inner @ held)[free])
        beyond = free & ((found < lower) | (found > upper))
        found = np.clip(found, lower, upper)
        if not beyond.any():
            break
        free &= ~beyond
    return found


def _thinned(motion: PortMotion) -> PortMotion:
    rows = np.linspace(0, len(motion.position) - 1, _SUBSAMPLE).astype(int)

    def some(signal: Values | None) -> Values | None:
        return None if signal is None else signal[rows]

    return PortMotion(
        motion.position[rows], motion.speed[rows], some(motion.load), some(motion.angle)
    )


def _stiffness(values: Mapping[str, float]) -> dict[str, float]:
    return {
        name.removeprefix("stiffness of "): value
        for name, value in values.items()
        if name.startswith("stiffness of ")
    }


def _interval(values: Values) -> tuple[float, float]:
    """Return the interval of a value by the jackknife: the last of all, the others without one."""
    folds, value = values[:-1], float(values[-1])
    n = len(folds)
    deviation = ((n - 1.0) / n * float(np.sum((folds - folds.mean()) ** 2))) ** 0.5
    half = float(t.ppf(0.975, n - 1)) * deviation
    return value - half, value + half


def _values(
    design: _Design, terms: Sequence[_Term], coefficients: Values
) -> dict[str, DescribedValue]:
    limits = {
        term.quantity: (float(term.lower[0]), float(term.upper[0]))
        for term in terms
        if term.quantity
    }
    found, held = {}, _intervals_of_verdict(design.finding)
    for row, name in enumerate(design.quantities):
        column, interval = coefficients[:, 1 + row], held.get(name)
        value = float(column[-1])
        if name in limits:
            interval = None
        if name in limits and not np.isclose(value, limits[name], rtol=1e-9, atol=0.0).any():
            lower, upper = np.clip(_interval(column), *limits[name]).tolist()
            interval = lower, upper
        found[name] = DescribedValue(value, interval, base_unit(design.mechanism, name))
    return found


def _intervals_of_verdict(finding: MechanismFinding) -> dict[str, tuple[float, float]]:
    """Return the intervals of the accepted fit, at whose values a quantity is held."""
    fitted = finding.accepted
    spread, found = Spread(finding.data, fitted), {}
    for row, (parameter, value) in enumerate(zip(fitted.parameters, fitted.values, strict=True)):
        half = float(spread.reach[row] * max(spread.covariance[row, row], 0.0) ** 0.5)
        if fitted.bound_sides[row] == 0.0:
            ends = max(value - half, parameter.lower), min(value + half, parameter.upper)
            found[parameter.name] = float(ends[0]), float(ends[1])
    return found


def _effects(
    finding: MechanismFinding, terms: Sequence[_Term], coefficients: Values
) -> tuple[tuple[LawAt, dict[str, DescribedValue]], ...]:
    found = []
    for term in terms:
        by_part = [term.laws(one) for one in coefficients]
        for place, effect in enumerate(by_part[-1]):
            kind = effect_named(effect.name)
            numbers = [kind.numbers_of(laws[place].law) for laws in by_part]
            described = {}
            for name, value in numbers[-1].items():
                column = np.array([one[name] for one in numbers])
                if name == "phase":
                    # Between two parts a phase does not leap by a turn.
                    column = value + np.angle(np.exp(1j * (column - value)))
                interval = _interval(column) if np.ptp(column) > 0.0 else None
                unit = unit_of_number(finding.mechanism, effect.port, name, kind.unit(name))
                described[name] = DescribedValue(value, interval, unit)
            found.append((effect, described))
    return tuple(found)


def _cross_validated(
    selection: _Selection, compared: Sequence[Values]
) -> tuple[BalanceErrors, ...]:
    """Return the errors of the training records, each block predicted from the others."""
    design = selection.design
    rms = [
        np.sqrt(selection.errors_by_balance(one).sum(axis=0) / design.samples) for one in compared
    ]
    return tuple(
        BalanceErrors("", name, unit_of(design.mechanism, name), *map(float, errors))
        for name, *errors in zip(design.names, *rms, strict=True)
    )


def _held_out(
    finding: MechanismFinding,
    values: Mapping[str, float],
    laws: Sequence[LawAt],
    design: _Design,
    six: Values,
) -> tuple[BalanceErrors, ...]:
    """Return the errors of the records that were not fitted."""
    found = []
    of_six = _six_laws(design, six)
    six_values = {name: float(six[1 + row]) for row, name in enumerate(design.quantities)}
    for record in finding.records:
        if record.role != "held_out":
            continue
        data = measured_data(finding.mechanism, [record], finding.cutoff, finding.data.known)
        n_base = len(data.base)
        rms = [
            root_mean_square(data, data.residuals(one.values[:n_base], laws_of(one.effects)))
            for one in (finding.verdict.base, finding.accepted)
        ]
        rms += [
            _left(data, values, laws, design.nominal),
            _left(data, six_values, of_six, design.nominal),
        ]
        found += [
            BalanceErrors(record.name, name, unit_of(finding.mechanism, name), *map(float, errors))
            for name, *errors in zip(data.names, *rms, strict=True)
        ]
    return tuple(found)


def _left(
    data: MeasuredData,
    values: Mapping[str, float],
    laws: Sequence[LawAt],
    nominal: Mapping[str, float],
) -> Values:
    """Return the root mean square of what a model leaves of each balance of a record."""
    (balance,) = data.spectra
    quantities = np.array([values[name] for name in quantity_names(balance.mechanism)])
    left = balance.constant + np.einsum("bqk,q->bk", balance.terms, quantities)
    left = left - balance.forces((*data.known, *laws), _stiffness({**nominal, **values}))
    return np.sqrt(np.sum((left * balance.kept) ** 2, axis=1) / balance.moving.count)


def _six_laws(design: _Design, six: Values) -> list[LawAt]:
    """Return the laws of least squares with six terms."""
    columns = iter(design.six[sum(not t.quantity.startswith("stiffness") for t in design.base) :])
    found = []
    for port in design.mechanism.ports:
        if port.read:
            continue
        if not port.damping.value:
            found.append(LawAt("viscous_friction", port.name, LinearDamper(six[next(columns)])))
        found += [
            LawAt("coulomb_friction", port.name, CoulombFriction(six[next(columns)])),
            LawAt("gravity", port.name, Gravity(six[next(columns)], 0.0)),
            LawAt("gravity", port.name, Gravity(six[next(columns)], np.pi / 2.0)),
            LawAt("force_offset", port.name, ConstantForce(six[next(columns)])),
        ]
    return found
