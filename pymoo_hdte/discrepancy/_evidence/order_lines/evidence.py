"""The observations of a campaign as evidence for a fit, by record and part of the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.candidates import out_of_tolerance
from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS, Features, measure
from pymoo_hdte.discrepancy._evidence.order_lines.objective import Objective
from pymoo_hdte.discrepancy._evidence.order_lines.observations import (
    Observations,
    cell_chi_square,
    cell_degrees_of_freedom,
)
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_parameters
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import coefficients_of, with_readings
from pymoo_hdte.discrepancy._evidence.order_lines.steady_states import SCREENING
from pymoo_hdte.discrepancy._evidence.order_lines.torsion_curve import torsion_points
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.excess import Excess
from pymoo_hdte.discrepancy._selection.fitting import Fit, Response
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.drive import DriveEffect, SteadyMotion
from pymoo_hdte.drive._solve.free_angle import torus_of
from pymoo_hdte.drive._solve.torus import Torus
from pymoo_hdte.effects.unknowns import Parameter

Vector = NDArray[np.float64]

CHANGED_NOISE = 1.5
"""Ratio of variances from which on the noise of another model counts as another one.

Set by hand: chi-square of what changes most is then off by half.
"""
PARTS = (*CHANNELS, "torsion_sweep")
"""Parts of the data, as in `Excess`: channels of the running records, and the sweeps."""


@dataclass(frozen=True, eq=False)
class Data(Observations):
    """The observations of a campaign as the engine's `Evidence`.

    Attributes
    ----------
    rules : Rules
        Thresholds of the verdict.
    evident : frozenset of str
        Effects that show by themselves, as in `Evidence`.
    """

    rules: Rules = RULES
    evident: frozenset[str] = frozenset()

    def objective(self, candidates: Sequence[Candidate]) -> Objective:
        """Return whitened residuals of the drive with candidates."""
        return Objective(self, candidates)

    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""
        base = fitted.values[None, : len(self.base)]
        believed, values = self.campaign.believed, self._values_by_name(base)
        unchanged = self.prediction(base, fitted.effects)
        here, on_torus = unchanged.balance, dict[Torus, SteadyMotion]()
        input_gain = 1.0 + float(base[0, Layout(self.base).index("input_torque_gain")])
        before = self.features.of_prediction(unchanged)
        before_torsion = self.torsion_residuals(base, fitted.effects)
        priors = np.zeros(len(fitted.residuals) - before.size - before_torsion.size)

        def change(added: Sequence[DriveEffect]) -> Vector:
            effects = (*fitted.effects, *added)
            if all(effect.only_reads for effect in added):
                moved = with_readings(
                    unchanged, added, self.features.conditions,
                    self.features.orders.tolist(), believed.ratio, input_gain,
                )  # fmt: skip
            else:
                torus = torus_of(coefficients_of(believed, values, effects, 1))
                moved = self.prediction(base, effects, on_torus.get(torus, here), SCREENING)
                # Linear systems of many harmonics take longer than all else.
                if moved.balance.torus is not here.torus and moved.balance.converged.all():
                    on_torus.setdefault(torus, moved.balance)
            # A record without a steady state says nothing about the effect.
            steady = (moved.balance.converged & here.converged)[:, None]
            changed = self.features.of_prediction(moved) - before
            running = self.whiten(np.where(steady, changed, 0.0))[0]
            torsion = self.torsion_residuals(base, effects) - before_torsion
            return np.concatenate([running, np.nan_to_num(torsion[0]), priors])

        return change

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return the indices of the residuals of each channel, and of the sweeps."""
        n_records, n_features = self.features.values.shape
        starts = n_features * np.arange(n_records)[:, None]
        rows = []
        for channel in range(len(CHANNELS)):
            mean = [MEANS.index(channel)] if channel in MEANS else []
            places = np.append(mean, self.features.places(channel)).astype(int)
            rows.append((starts + places).ravel())
        return [*rows, n_records * n_features + np.arange(self.n_sweep_residuals)]

    def excess(self, fitted: Fit) -> Excess:
        """Return the excess chi-square of a fit by record and part of the data.

        Parts are the four channels of the running records, cell by cell as on the map of the
        misfit, and the torsion sweeps, which count as one more record: shape (r + 1, 5).
        """
        n_records, n_features = self.features.values.shape
        n_running = n_records * n_features
        n_sweeps = self.n_sweep_residuals
        whitened = fitted.residuals[:n_running].reshape(n_records, n_features)
        cells = cell_chi_square(self, np.einsum("rij,rj->ri", self.whiteners, whitened))
        known = np.isfinite(cells)
        chi_square, degrees_of_freedom = np.zeros((2, n_records + 1, cells.shape[1] + 1))
        degrees_of_freedom[:-1, :-1] = np.where(known, cell_degrees_of_freedom(self), 0.0).sum(
            axis=2
        )
        chi_square[:-1, :-1] = np.where(known, cells, 0.0).sum(axis=2)
        sweeps = fitted.residuals[n_running : n_running + n_sweeps]
        chi_square[-1, -1], degrees_of_freedom[-1, -1] = sweeps @ sweeps, n_sweeps
        return Excess(chi_square - degrees_of_freedom, degrees_of_freedom)

    def out_of_tolerance(self, at_bounds: Sequence[str], together: bool = False) -> list[Candidate]:
        """Return a candidate for each base parameter that a fit left at a bound."""
        believed = self.campaign.believed
        return out_of_tolerance(
            self.base, at_bounds, believed.error_orders, together, believed.effects
        )

    @cached_property
    def held_out(self) -> Data | None:
        """Features of the records kept out of the fit, or None without such records.

        If records with rattling were left out of the fit, they are left out here, too.
        """
        records = self.campaign.held_out
        if not records:
            return None
        features = self._measured(records)
        if len(self.features.records) < len(self.campaign.train):
            held = flanks_held(features, self.campaign.torque_scale, self.rules)
            features = features.rows(np.flatnonzero(held))
        return replace(self, features=features, torsion=()) if features.records else None

    @property
    def with_held_out(self) -> Data:
        """The data with the records that are kept out of fits."""
        if (held_out := self.held_out) is None:
            return self
        records = (*self.features.records, *held_out.features.records)
        return replace(self, features=self._measured(records))

    def _measured(self, records: Sequence[RunningRecord]) -> Features:
        """Return records as these features are."""
        features = self.features
        return measure(
            self.campaign, records, features.orders.tolist(), self.rules, features.only_exciting
        )

    def with_noise_of(self, fitted: Fit) -> Data | None:
        """Return the data with the noise of another model, or None where the noise hardly grows.

        The non-repeatable error is a motion, which reaches all channels through the response of
        the drive, its effects included.
        """
        base = fitted.values[: len(self.base)]
        renewed = replace(self, reference=base, reference_effects=fitted.effects)
        variances = (np.diagonal(data.covariance, axis1=1, axis2=2) for data in (renewed, self))
        return renewed if np.divide(*variances).max() > CHANGED_NOISE else None

    def rewhitened(self, changes: Vector, before: Data) -> Vector:
        """Return changes (k, n) of residuals that were whitened ``before``, with this noise."""
        if not changes.size:
            return changes
        shape = self.features.values.shape
        n_running = self.features.values.size
        running = changes[:, :n_running].reshape(-1, *shape)
        running = np.einsum("rij,krj->kri", before.whiteners, running)
        return np.hstack([self.whiten(running), changes[:, n_running:]])

    @property
    def loaded(self) -> Data:
        """The data without records whose load does not hold the tooth flanks together.

        With a clearance the drive rattles in them and has no steady state to fit.
        """
        held = flanks_held(self.features, self.campaign.torque_scale, self.rules)
        if np.all(held) or held.sum() < self.rules.fewest_records:
            return self
        return replace(self, features=self.features.rows(np.flatnonzero(held)))


def flanks_held(features: Features, torque_scale: float, rules: Rules) -> NDArray[np.bool_]:
    """Return which records have a load above the amplitude of their torque, shape (r,)."""
    m = len(features.orders)
    lines = features.values[:, features.places(2)].reshape(len(features.records), m, 2)
    swing = np.hypot(lines[..., 0], lines[..., 1]).sum(axis=1)
    load = np.abs(features.conditions.output_torque)
    return np.asarray(load > np.maximum(swing, torque_scale * rules.least_held_load))


def training_data(campaign: Campaign, features: Features, rules: Rules = RULES) -> Data:
    """Return features of training records with first guesses, and the sweeps."""
    points = tuple(torsion_points(record, campaign.rig) for record in campaign.torsion)
    return Data(
        campaign,
        features,
        start_parameters(campaign, features),
        points,
        rules=rules,
    )


def start_parameters(campaign: Campaign, features: Features) -> tuple[Parameter, ...]:
    """Return the base parameters, with first guesses from the slowest record."""
    believed = campaign.believed
    slowest = int(np.argmin(np.abs(features.conditions.input_speed)))
    values, places = features.values[slowest], features.places(0)
    phases = []
    for order in believed.error_orders:
        line = int(np.argmin(np.abs(features.orders - order)))
        real, imaginary = values[places[line]]
        # amplitude sin(x + phase) has the phasor -i amplitude exp(i phase).
        phases.append(float(np.angle(1j * (real + 1j * imaginary))))
    load = features.conditions.output_torque
    offset = float(np.median(features.values[:, 0] - load / believed.stiffness))
    return base_parameters(believed, campaign.rig, phases, offset)
