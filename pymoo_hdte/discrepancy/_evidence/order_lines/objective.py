"""Whitened residuals of a model and their derivatives, as a fit needs them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS
from pymoo_hdte.discrepancy._evidence.order_lines.observations import Observations
from pymoo_hdte.discrepancy._evidence.order_lines.steady_states import SLOPES, Continuation
from pymoo_hdte.discrepancy._records.known_values import known_values
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Unknowns, Vector, built
from pymoo_hdte.drive import DriveEffect, SteadyMotion

_IN_SWEEPS = ("stiffness", "locked_stiffness", "output_torque_gain", "output_torque_zero")
"""Base parameters on which the torsion with the input locked depends."""
_READ_ONLY = ("offset", "input_torque_gain", "input_torque_zero", "locked_stiffness")
"""Base parameters on which the motion of a running record does not depend: readings at most."""
LOST = 1e3
"""Residual of a sweep's point at which the model cannot transmit the torque."""


class Objective(Unknowns):
    """Whitened residuals and their Jacobian for a set of candidates.

    Parameters
    ----------
    data : Observations
    candidates : sequence of Candidate
    slopes : ndarray, shape (n_base, r, f), optional
        Derivatives of the features by base parameters, which are not computed anew if given. Those
        of a model without an effect also serve for the uncertainty of one with it, but not for a
        search.
    """

    def __init__(
        self,
        data: Observations,
        candidates: Sequence[Candidate],
        slopes: NDArray[np.float64] | None = None,
    ) -> None:
        super().__init__(data.base, candidates)
        self.data = data
        self.slopes = slopes
        self._states = Continuation()

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n,), those of sweeps and priors last."""
        difference, others = self.differences(values)
        return np.nan_to_num(np.concatenate([self.data.whiten(difference), others]), nan=LOST)

    def differences(self, values: Vector) -> tuple[NDArray[np.float64], Vector]:
        """Return predicted minus measured features (r, f), and residuals of sweeps and priors."""
        difference = self._features(values) - self.data.features.values
        torsion = self._torsion(*self._base_and_effects(values))[0]
        return difference, np.concatenate([torsion, self.priors(values)])

    def jacobian(self, values: Vector) -> NDArray[np.float64]:
        """Return the derivatives of the residuals by parameters in units of their scale."""
        features, others = self.derivatives(values)
        return np.concatenate([self.data.whiten(features), others], axis=1).T

    def derivatives(self, values: Vector) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return derivatives by parameters in units of their scale.

        The first are those of the features, not whitened, (n, r, f); the second those of sweeps and
        priors, whitened, (n, n_others).
        """
        n_base, steps = len(self.data.base), self.steps(values)
        moved = values + np.diag(steps * self.scale)
        base, effects = self._base_and_effects(values)
        here = self._features_at_departure(values)
        slopes = self._slopes(values) if self.slopes is None else self.slopes
        in_sweeps = (*_IN_SWEEPS, *known_values(self.data.campaign.believed.effects))
        swept = [k for k, parameter in enumerate(self.data.base) if parameter.name in in_sweeps]
        torsion = self._torsion(np.vstack([base, moved[swept, :n_base]]), effects)
        by_base = np.zeros((n_base, torsion.shape[1]))
        by_base[swept] = (torsion[1:] - torsion[0]) / steps[swept, None]
        features, sweeps = list(slopes), list(by_base)
        for place in range(n_base, len(values)):
            base, effects = self._base_and_effects(moved[place])
            shifted, (states,) = self._near_last_values(base, effects)
            features.append((shifted[0] - here) / steps[place])
            self._states.follow(place, steps[place] * self.scale[place], states)
            sweeps.append((self._torsion(base, effects)[0] - torsion[0]) / steps[place])
        priors = np.diag(self.scale / self.prior)[:, self.bounded]
        return np.array(features), np.concatenate([np.array(sweeps), priors], axis=1)

    def _torsion(
        self, vectors: NDArray[np.float64], effects: tuple[DriveEffect, ...]
    ) -> NDArray[np.float64]:
        return np.nan_to_num(self.data.torsion_residuals(vectors, effects), nan=LOST)

    def slopes_at(self, values: Vector) -> NDArray[np.float64]:
        """Return derivatives of the features by base parameters in units of their scale."""
        self._features_at_departure(values)
        return self._slopes(values)

    def _slopes(self, values: Vector) -> NDArray[np.float64]:
        """Return `slopes_at` values whose steady states are known, and follow these."""
        base, effects = self._base_and_effects(values)
        n_base = base.shape[1]
        steps = self.steps(values)[:n_base]
        moving = [
            k for k, parameter in enumerate(self.data.base) if parameter.name not in _READ_ONLY
        ]
        moved = base + np.diag(steps * self.scale[:n_base])
        # Solved together, so that the remaining errors of Newton's method cancel in the quotients.
        stacked, (_, *moved_states) = self._near_last_values(
            np.vstack([base, moved[moving]]), effects
        )
        here = stacked[0]
        slopes = np.empty((n_base, *here.shape))
        slopes[moving] = (stacked[1:] - here) / steps[moving, None, None]
        for place, states in zip(moving, moved_states, strict=True):
            self._states.follow(place, steps[place] * self.scale[place], states)
        for place, parameter in enumerate(self.data.base):
            if parameter.name in _READ_ONLY:
                slopes[place] = self.scale[place] * self._slope_of_reading(
                    parameter.name, base[0], here
                )
        return slopes

    def _slope_of_reading(
        self, name: str, base: Vector, features: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the derivative of features (r, f) by a parameter of `_READ_ONLY`."""
        slope = np.zeros_like(features)
        if name == "offset":
            slope[:, MEANS.index(0)] = 1.0
        elif name == "input_torque_zero":
            slope[:, MEANS.index(1)] = 1.0
        elif name == "input_torque_gain":
            of_channel = np.append(self.data.features.places(1), MEANS.index(1))
            names = [parameter.name for parameter in self.data.base]
            gain, zero = (base[names.index(f"input_torque_{part}")] for part in ("gain", "zero"))
            slope[:, of_channel] = features[:, of_channel]
            slope[:, MEANS.index(1)] -= zero
            slope /= 1.0 + gain
        return slope

    def _base_and_effects(
        self, values: Vector
    ) -> tuple[NDArray[np.float64], tuple[DriveEffect, ...]]:
        """Return the base parameters as one row, and the effects."""
        n_base = len(self.data.base)
        parts = built(self.candidates, values[n_base:])
        return values[None, :n_base], tuple(effect for part in parts for effect in part)

    def _features(self, values: Vector) -> NDArray[np.float64]:
        """Return predicted features (r, f) at values; their steady states are kept as a start."""
        prediction = self.data.prediction(*self._base_and_effects(values), self._states.at(values))
        self._states.arrived(values, prediction.balance)
        return self.data.features.of_prediction(prediction)[0]

    def _features_at_departure(self, values: Vector) -> NDArray[np.float64]:
        """Return predicted features (r, f) at values from which slopes are to follow."""
        features = self._features(values)
        self._states.depart(len(values))
        return features

    def _near_last_values(
        self, vectors: NDArray[np.float64], effects: tuple[DriveEffect, ...]
    ) -> tuple[NDArray[np.float64], list[SteadyMotion]]:
        """Return features (v, r, f) and states near the values tried last, for slopes.

        Records without a steady state at those values have none here.
        """
        prediction = self.data.prediction(vectors, effects, self._states.motion, SLOPES)
        records = len(self.data.features.records)
        places = [slice(k * records, (k + 1) * records) for k in range(len(vectors))]
        states = [prediction.balance.rows(place) for place in places]
        return self.data.features.of_prediction(prediction), states
